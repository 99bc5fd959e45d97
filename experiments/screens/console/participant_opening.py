"""What is looked at before the participant's screen is opened: their keys, their font, and where their window lies."""

from __future__ import annotations

from collections.abc import Sequence

from experiments.catalogues.catalogue import ENGLISH
from experiments.catalogues.fonts import font_for
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.shown_texts import letters_of
from experiments.run_request import RunRequest
from experiments.screens.console.keys import shared_keys
from experiments.screens.participant import messages
from experiments.study.folders import PlaceError
from experiments.tasks.questions import choices

_ARROWS = ("left", "right", "up", "down")
_OWN = (*_ARROWS, *"123456789")
"""Keys that the console leaves to the participant; where it has a field to type in, the arrows alone."""


def check_own_keys(setup: Setup[DesignConfig], *, rates: bool = False) -> None:
    """`PlaceError`: a key of the participant's own would be the experimenter's as well, or be typed at the console.

    `rates`: ratings and descriptions are given on the participant's screen.
    """
    questions = setup.config.questions
    on_page = ("rating", "ranking", "text") if rates else ()
    typed = [name for name, one in questions.items() if not one.named_answers and one.kind not in on_page]
    for name, question in questions.items():
        if shared := shared_keys(question, questions.values()):
            raise _no_key(setup, name, shared)
        if typed and (letters := [one.own_key for one in choices(question) if len(one.own_key) == 1]):
            raise _no_key(setup, name, letters, typed[0])


def _no_key(setup: Setup[DesignConfig], name: str, keys: Sequence[str], field: str = "") -> PlaceError:
    answers, free = setup.config.questions[name].named_answers, _ARROWS if field else _OWN
    beside = f" (questions.{field})" if field else ""
    such = ", ".join(f'{one} = "{key}"' for one, key in zip(answers, free, strict=False))
    return PlaceError(
        f"--participant-keys: {setup.source}: questions.{name}: {', '.join(keys)} would be "
        f"{'typed' if field else 'a key'} at the console as well{beside}, so nobody could tell who pressed it; free "
        f"are {', '.join(free)}, as in keys = {{ {such} }}"
    )


def check_font(request: RunRequest) -> None:
    """`ConfigError` if a letter of the participant's language is in none of its fonts: also the console shows texts."""
    if request.language is not ENGLISH:
        font_for(request.language, letters_of(request.language, request.setup))


_TITLE_BAR_PX = 40


def look_of(request: RunRequest, rooms_px: Sequence[tuple[int, int]]) -> messages.Look:
    """The screen that was chosen, else the last of several, all of it; of one screen a part, to leave the console.

    `rooms_px`: the width and height of each screen that a window may have. In a font that has all letters of the
    participant's language. `ConfigError`: there is none.
    """
    monitor, language = request.options.monitor, request.language
    font = font_for(language, letters_of(language, request.setup))
    screen = len(rooms_px) - 1 if monitor is None else monitor
    (width_px, height_px), usual = rooms_px[screen], messages.Look()
    return messages.Look(
        screen=screen,
        full_screen=len(rooms_px) > 1,
        width_px=min(width_px, usual.width_px),
        height_px=min(height_px - _TITLE_BAR_PX, usual.height_px),
        font=font.family,
        font_file=str(font.path or ""),
        right_to_left=language.right_to_left,
        messages=language.messages,
    )
