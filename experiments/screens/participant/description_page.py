"""The page of the free description: the participant's own words."""

from __future__ import annotations

import math
from typing import Any

from experiments.screens.participant.confirming import ENTER, Button, heading, hint
from experiments.screens.participant.pages import Drafts, QuietPage
from experiments.screens.participant.stage import Box, Stage
from experiments.screens.participant.words import AskDescription, DescriptionGiven

MOST_CHARACTERS = 1_000
"""What a description may hold: PsychoPy lays the text out anew at every key, and beyond this typing would lag."""

STOOD_S = 0.5
"""Done is taken from so long after the page was drawn: it lies where Confirm was, and people click twice."""

_PADDING = 0.02
_BELOW = 0.3  # of a letter: what a line may have below its base
_SIZES = (0.04, 0.034, 0.029, 0.025, 0.021)
_HINT = "Enter begins a new line. When you are done: the button, or Ctrl and Enter"
_FULL = "There is no more room. When you are done: the button, or Ctrl and Enter"


class DescriptionPage(QuietPage):
    """A box to type in. Letters get smaller as it fills; a key that finds no room is not taken, and that is said.

    `drafts` holds what was written so far: it stands there at first, and is kept at last.
    """

    redraw_s = 1 / 30
    pointer = True
    typed = True

    def __init__(self, stage: Stage, asked: AskDescription, drafts: Drafts) -> None:
        self._asked, self._drafts = asked, drafts
        self._now, self._drawn_s = stage.toolkit.now, math.inf
        self._done = self._full = False
        place = Box(y=-0.03, width=2 * stage.half_width, height=0.44)
        self._size = 0
        self._height_px = stage.height_px
        self._room_px = (place.height - 2 * _PADDING) * stage.height_px
        self._box = _text_box(stage, place, str(drafts.get(asked.draft, "")))
        self._button = Button(stage, "Done")
        self._drawn = [*heading(stage, asked), self._box]
        self._hints = {False: hint(stage, _HINT), True: hint(stage, _FULL)}

    def draw(self) -> None:
        """The question, what was typed, the button."""
        for stimulus in (*self._drawn, self._hints[self._full]):
            stimulus.draw()
        self._button.draw(enabled=True)
        self._drawn_s = min(self._drawn_s, self._now())
        self._fit()

    def pressed(self, x: float, y: float) -> None:
        """On the button: done, once the page has stood there."""
        stood = self._now() - self._drawn_s >= STOOD_S
        self._done = self._done or (stood and self._button.holds(x, y))

    def key(self, name: str, ctrl: bool) -> bool:
        """Enter with Ctrl: done. Tab does nothing; all else is PsychoPy's."""
        self._done = self._done or (ctrl and name in ENTER)
        return self._done or name == "TAB"

    def outcome(self) -> DescriptionGiven | None:
        """The description, once it is done."""
        return DescriptionGiven(comment=self._box.text.strip(), ask=self._asked.ask) if self._done else None

    def leave(self) -> None:
        """No more typing; what was written is kept."""
        self._box.editable = False
        self._drafts[self._asked.draft] = self._box.text

    def _fit(self) -> None:
        """Smaller letters if the text is too high; where there are none, the last letter goes again."""
        too_high = self._too_high()
        if too_high and self._size + 1 < len(_SIZES):
            self._size += 1
            self._write_in(_SIZES[self._size])
        elif too_high or len(self._box.text) > MOST_CHARACTERS:
            self._full = True
            self._box.deleteCaretLeft()

    def _too_high(self) -> bool:
        """Whether the text as it was last drawn, measured in pixels, is higher than the box within its padding."""
        return bool(self._box.boundingBox.size[1] > self._room_px - _BELOW * _SIZES[self._size] * self._height_px)

    def _write_in(self, size: float) -> None:
        """PsychoPy fetches letters of a new size only with the font, and lays out only with the text."""
        self._box.letterHeight = size
        self._box.font = self._box.font
        self._box.text = self._box.text


def _text_box(stage: Stage, place: Box, text: str) -> Any:
    return stage.toolkit.visual.TextBox2(
        stage.window,
        text=text,
        font=stage.look.font,
        pos=(place.x, place.y),
        size=(place.width, place.height),
        units="height",
        letterHeight=_SIZES[0],
        padding=_PADDING,
        alignment="top left",
        color=stage.palette.ink,
        fillColor=stage.palette.panel,
        borderColor=stage.palette.muted,
        placeholder="",
        formattingSyntax="none",  # the participant's asterisks are their own
        editable=True,
    )
