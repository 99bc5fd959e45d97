"""The pages of the participant's window that want a look or a key, and what pages share that are confirmed."""

from __future__ import annotations

import math
from typing import Any

from experiments.screens.participant.stage import Box, Stage
from experiments.screens.participant.toolkit import Keys
from experiments.screens.participant.words import (
    AskDescription,
    AskDirection,
    AskRating,
    DirectionGiven,
    FromParticipant,
)

STILL_S = 0.1
"""How often a page is drawn on which nothing moves."""

Drafts = dict[int, float | str]
"""What was set or written on a page that was taken off before it was given, by the question's `draft`."""


class QuietPage:
    """A page that hears nothing; the others hear what concerns them."""

    redraw_s = STILL_S
    pointer = False
    typed = False

    def pressed(self, x: float, y: float) -> None:
        """Nothing."""

    def dragged(self, x: float) -> None:
        """Nothing."""

    def released(self) -> None:
        """Nothing."""

    def key(self, name: str, ctrl: bool) -> bool:
        """Nothing, and nothing for PsychoPy."""
        del name, ctrl
        return True

    def motion(self, name: str) -> None:
        """Nothing."""

    def outcome(self) -> FromParticipant | None:
        """Nothing."""
        return None

    def leave(self) -> None:
        """Nothing."""


class MessagePage(QuietPage):
    """A plain message in the middle."""

    def __init__(self, stage: Stage, text: str) -> None:
        box = Box(y=0, width=2 * stage.half_width, height=0.9, anchor="center")
        self._text = stage.text(text, box, 0.06, stage.palette.ink)

    def draw(self) -> None:
        """The message."""
        self._text.draw()


class DirectionPage(QuietPage):
    """Two answers, each with its key. Keys count from the onset on, even those that went down before the page stood.

    After a pause, or where a key was refused, only those that go down once it stands there again.
    """

    def __init__(self, stage: Stage, asked: AskDirection, keys: Keys) -> None:
        self._asked, self._keys, self._now = asked, keys, stage.toolkit.now
        self._since_s = math.inf if asked.once_seen else asked.onset_s
        width, ink = stage.half_width, stage.palette.ink
        question = Box(y=0.4, width=2 * width, height=0.25)
        self._drawn = [stage.text(asked.question, question, 0.06, ink)]
        for x, key, answer in (
            (-width / 2, asked.forward_key, asked.forward),
            (width / 2, asked.backward_key, asked.backward),
        ):
            self._drawn.append(stage.panel(Box(x=x, y=-0.12, width=0.9 * width, height=0.4), stage.palette.panel))
            letter = Box(x=x, y=-0.06, width=0.8 * width, height=0.16, anchor="center")
            self._drawn.append(stage.text(_key_text(key), letter, 0.12, stage.palette.accent))
            words = Box(x=x, y=-0.22, width=0.8 * width, height=0.12, anchor="center")
            self._drawn.append(stage.text(answer, words, 0.055, ink))

    def draw(self) -> None:
        """The question and both answers."""
        for stimulus in self._drawn:
            stimulus.draw()
        if math.isinf(self._since_s):
            self._since_s = max(self._now(), self._asked.onset_s)

    def outcome(self) -> DirectionGiven | None:
        """The first of the two keys since the onset."""
        for press in self._keys.since(self._since_s):
            if press.name == self._asked.forward_key:
                return DirectionGiven(response="forward", pressed_s=press.pressed_s, ask=self._asked.ask)
            if press.name == self._asked.backward_key:
                return DirectionGiven(response="backward", pressed_s=press.pressed_s, ask=self._asked.ask)
        return None


def _key_text(key: str) -> str:
    """A key as it is printed on the keyboard.

    >>> _key_text("f"), _key_text("left"), _key_text("num_1")
    ('F', 'LEFT', '1')
    """
    return key.removeprefix("num_").upper()


ENTER = ("RETURN", "ENTER", "NUM_ENTER")
"""Keys that confirm, as pyglet names them."""


class Button:
    """A button that can be pressed once there is something to confirm."""

    def __init__(self, stage: Stage, text: str) -> None:
        self._box = Box(y=-0.34, width=0.36, height=0.1, anchor="center")
        inner = Box(y=self._box.y, width=0.32, height=0.08, anchor="center")
        colors = stage.palette
        self._off = [stage.panel(self._box, colors.panel), stage.text(text, inner, 0.045, colors.muted)]
        self._on = [stage.panel(self._box, colors.accent), stage.text(text, inner, 0.045, colors.on_accent)]

    def draw(self, enabled: bool) -> None:
        """Lit or not."""
        for stimulus in self._on if enabled else self._off:
            stimulus.draw()

    def holds(self, x: float, y: float) -> bool:
        """Whether a place is on it."""
        return abs(x - self._box.x) <= self._box.width / 2 and abs(y - self._box.y) <= self._box.height / 2


def heading(stage: Stage, asked: AskRating | AskDescription) -> list[Any]:
    """Which stimulus is meant, by its order of presentation, and the question."""
    width = 2 * stage.half_width
    which = f"Feedback {asked.number} of {asked.of}"
    return [
        stage.text(which, Box(y=0.46, width=width, height=0.07), 0.05, stage.palette.accent),
        stage.text(asked.question, Box(y=0.37, width=width, height=0.3), 0.045, stage.palette.ink),
    ]


def hint(stage: Stage, text: str) -> Any:
    """How to answer, small, at the foot."""
    return stage.text(text, Box(y=-0.425, width=2 * stage.half_width, height=0.05), 0.034, stage.palette.muted)
