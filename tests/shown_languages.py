"""The participant's real window in a language, page by page: what `make pictures` and the tests look at."""

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from Xlib import X
from Xlib import display as xlib

from experiments.catalogues.catalogue import language
from experiments.catalogues.fonts import font_for
from experiments.design.shown_texts import letters_of, setup_in
from experiments.load import load_setup
from experiments.screens.participant.link import ParticipantLink
from experiments.screens.participant.messages import (
    AskChoice,
    AskDescription,
    AskRating,
    KeyedAnswer,
    Look,
    arguments,
)
from tests.waiting import PATIENCE_S, wait_for
from tests.warm_start import warm

WIDTH, HEIGHT = 1280, 800


class Pages:
    """The pages of the paper's two designs in a language, each asked as a console asks it."""

    def __init__(self, link: ParticipantLink, display: str, spoken: Any, console: ThreadPoolExecutor) -> None:
        self.link, self.spoken, self._console = link, spoken, console
        self._display = xlib.Display(display)
        self._rated, self._judged = (
            setup_in(spoken, load_setup(name))[0].config.questions for name in ("preference", "direction")
        )

    def picture(self) -> Image.Image:
        """What the display shows, once that stands still."""
        raw = None
        while raw != (raw := self._seen()):
            time.sleep(0.15)
        return Image.frombytes("RGB", (WIDTH, HEIGHT), raw, "raw", "BGRX")

    def _seen(self) -> bytes:
        root = self._display.screen().root
        return bytes(root.get_image(0, 0, WIDTH, HEIGHT, X.ZPixmap, 0xFFFFFFFF).data)

    def asked(self, question: AskRating | AskDescription | AskChoice) -> Any:
        """Ask, and come back when the question stands there; what it will come to."""
        ask = {AskRating: "ask_rating", AskDescription: "ask_description", AskChoice: "ask_choice"}[type(question)]
        self._changing(lambda: self.link.show("…"))
        return self._changing(lambda: self._console.submit(getattr(self.link, ask), question))

    def _changing(self, act: Callable[[], Any]) -> Any:
        """Do what changes the display, and come back when it has; what that gives back."""
        before = self._seen()
        done = act()
        wait_for(lambda: self._seen() != before, "the display does not change")
        self.picture()
        return done

    @property
    def questions(self) -> dict[str, AskRating | AskDescription | AskChoice]:
        """A question of each kind."""
        scale, words, which = self._rated["rating"], self._rated["comment"], self._judged["response"]
        return {
            "rating": AskRating(
                number=2,
                of=3,
                question=scale.text,
                minimum=0.0,
                maximum=10.0,
                minimum_text=scale.minimum_text or "",
                maximum_text=scale.maximum_text or "",
                grain=0.1,
            ),
            "description": AskDescription(number=2, of=3, question=words.text),
            "choice": AskChoice(
                question=which.text,
                answers=tuple(
                    KeyedAnswer(answer=answer, label=which.label(answer), key=key)
                    for answer, key in zip(which.named_answers, ("left", "right"), strict=True)
                ),
                onset_s=time.monotonic(),
            ),
        }

    def pictures(self) -> Iterator[tuple[str, Image.Image]]:
        """Each page by its name."""
        for name, question in self.questions.items():
            self.asked(question)
            yield name, self.picture()

    def close(self) -> None:
        self._display.close()


@contextmanager
def opened_in(code: str, folder: Path, display: str) -> Iterator[Pages]:
    """The window in a language, with the font that a run would use."""
    spoken = language(code, folder)
    font = font_for(spoken, letters_of(spoken, load_setup("preference")))
    look = Look(
        full_screen=False,
        width_px=WIDTH,
        height_px=HEIGHT,
        font=font.family,
        font_file=str(font.path or ""),
        right_to_left=spoken.right_to_left,
        messages=spoken.messages,
    )
    with pytest.MonkeyPatch.context() as environment, ThreadPoolExecutor(1) as console:
        environment.setenv("DISPLAY", display)
        program = warm("-m", "experiments.screens.participant", *arguments(look))
        with ParticipantLink.start(look, command=program) as link:
            link.wait_ready(PATIENCE_S)
            pages = Pages(link, display, spoken, console)
            yield pages
            pages.close()
            link.cancel()
