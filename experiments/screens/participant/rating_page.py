"""The page of a rating: a continuous scale, answered by mouse or by keys, and confirmed.

Pure: a place is a part of the scale's length from its left end; ratings are kept to the grain.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal

from experiments.screens.participant.pages import ENTER, Button, Drafts, QuietPage, heading, hint
from experiments.screens.participant.stage import Box, Stage, half_width
from experiments.screens.participant.words import AskDescription, AskRating, DescriptionGiven, RatingGiven
from experiments.session.steps import on_scale

Move = Literal["left", "right", "far left", "far right", "first", "last"]

GRAINS_FAR = 10
"""Grains of a far move: a tenth of a scale of 0 to 10 in grains of 0.1."""

_STEPS: dict[Move, Callable[[AskRating, float], float]] = {
    "left": lambda scale, rating: rating - scale.grain,
    "right": lambda scale, rating: rating + scale.grain,
    "far left": lambda scale, rating: rating - GRAINS_FAR * scale.grain,
    "far right": lambda scale, rating: rating + GRAINS_FAR * scale.grain,
    "first": lambda scale, _: scale.minimum,
    "last": lambda scale, _: scale.maximum,
}


def _kept(scale: AskRating, rating: float) -> float:
    return on_scale(rating, scale)


def put(scale: AskRating, part: float) -> float:
    """The rating where the marker is put by hand; beyond an end it is that end."""
    return _kept(scale, scale.minimum + part * (scale.maximum - scale.minimum))


def move(scale: AskRating, rating: float | None, step: Move) -> float:
    """The rating after a key; from nowhere the first key puts the marker in the middle, or at the end it names."""
    middle = _kept(scale, (scale.minimum + scale.maximum) / 2)
    if rating is None and step not in ("first", "last"):
        return middle
    return _kept(scale, _STEPS[step](scale, middle if rating is None else rating))


_HINT = "Click on the line or use the arrow keys, then Confirm or Enter"
_SCALE_Y = -0.06
_LENGTH = 0.76
"""The scale's, as a part of the page's width."""
_REACH = 0.06
"""How far above and below the line a press still takes the marker."""

_MOVES: dict[str, Move] = {
    "MOTION_LEFT": "left",
    "MOTION_DOWN": "left",
    "MOTION_RIGHT": "right",
    "MOTION_UP": "right",
    "MOTION_PREVIOUS_PAGE": "far left",
    "MOTION_NEXT_PAGE": "far right",
    "MOTION_BEGINNING_OF_LINE": "first",
    "MOTION_END_OF_LINE": "last",
}


def spot_px(part: float, width_px: int, height_px: int) -> tuple[int, int]:
    """Where a part of the scale's length lies on the window, in pixels from its upper left.

    >>> spot_px(0.0, 1280, 800), spot_px(0.5, 1280, 800)
    ((183, 448), (640, 448))
    """
    half = _LENGTH * half_width(width_px, height_px)
    return round(width_px / 2 + (2 * part - 1) * half * height_px), round((0.5 - _SCALE_Y) * height_px)


class RatingPage(QuietPage):
    """The scale. No marker stands on it until the participant puts one there, and nothing is confirmed before.

    `drafts` holds where it stood when the page was taken off: it stands there again.
    """

    redraw_s = 1 / 60
    pointer = True
    typed = True

    def __init__(self, stage: Stage, asked: AskRating, drafts: Drafts) -> None:
        self._stage, self._asked, self._drafts = stage, asked, drafts
        self._rating = None if asked.draft not in drafts else float(drafts[asked.draft])
        self._dragging = self._done = False
        self._half = _LENGTH * stage.half_width
        self._slider = self._scale()
        self._button = Button(stage, "Confirm")
        self._drawn = [*heading(stage, asked), *self._ends(), hint(stage, _HINT)]

    def draw(self) -> None:
        """The question, the scale with its marker if there is one, the button."""
        self._slider.markerPos = self._rating
        for stimulus in (*self._drawn, self._slider):
            stimulus.draw()
        self._button.draw(enabled=self._rating is not None)

    def pressed(self, x: float, y: float) -> None:
        """On the scale: put the marker there. On the button: confirm."""
        if abs(y - _SCALE_Y) <= _REACH and abs(x) <= self._half + _REACH:
            self._dragging = True
            self.dragged(x)
        elif self._button.holds(x, y):
            self._confirm()

    def dragged(self, x: float) -> None:
        """Take the marker along."""
        if self._dragging:
            self._rating = put(self._asked, (x / self._half + 1) / 2)

    def released(self) -> None:
        """Let the marker stand."""
        self._dragging = False

    def key(self, name: str, ctrl: bool) -> bool:
        """Enter confirms."""
        del ctrl
        if name in ENTER:
            self._confirm()
        return True

    def motion(self, name: str) -> None:
        """Arrows move the marker by grains, page keys by ten, Home and End to the ends."""
        if name in _MOVES:
            self._rating = move(self._asked, self._rating, _MOVES[name])

    def outcome(self) -> RatingGiven | None:
        """The rating, once it is confirmed. 0 is a rating."""
        if not self._done or self._rating is None:
            return None
        return RatingGiven(rating=self._rating, ask=self._asked.ask)

    def leave(self) -> None:
        """Where the marker stands is kept."""
        if self._rating is not None:
            self._drafts[self._asked.draft] = self._rating

    def _confirm(self) -> None:
        self._done = self._rating is not None

    def _scale(self) -> Any:
        """PsychoPy's slider draws; the mouse is heard here, as a click between two frames would be lost on it."""
        colors = self._stage.palette
        return self._stage.toolkit.visual.Slider(
            self._stage.window,
            ticks=(self._asked.minimum, self._asked.maximum),
            pos=(0, _SCALE_Y),
            size=(2 * self._half, 0.05),
            units="height",
            style="rating",
            granularity=0,
            readOnly=True,
            font=self._stage.look.font,
            lineColor=colors.ink,
            markerColor=colors.accent,
            labelColor=colors.ink,
        )

    def _ends(self) -> list[Any]:
        """Number and words under each end, the words no wider than twice the way to the window's edge."""
        width = 2 * (self._stage.half_width - self._half)
        ends = (
            (-self._half, self._asked.minimum, self._asked.minimum_text),
            (self._half, self._asked.maximum, self._asked.maximum_text),
        )
        drawn = []
        for x, number, words in ends:
            drawn.append(
                self._stage.text(
                    f"{number:g}", Box(x=x, y=-0.105, width=width, height=0.06), 0.04, self._stage.palette.ink
                )
            )
            drawn.append(
                self._stage.text(words, Box(x=x, y=-0.155, width=width, height=0.12), 0.04, self._stage.palette.ink)
            )
        return drawn


MOST_CHARACTERS = 1_000
"""What a description may hold: PsychoPy lays the text out anew at every key, and beyond this typing would lag."""

STOOD_S = 0.5
"""Done is taken from so long after the page was drawn: it lies where Confirm was, and people click twice."""

_PADDING = 0.02
_BELOW = 0.3  # of a letter: what a line may have below its base
_SIZES = (0.04, 0.034, 0.029, 0.025, 0.021)
_HOW = "Enter begins a new line. When you are done: the button, or Ctrl and Enter"
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
        self._hints = {False: hint(stage, _HOW), True: hint(stage, _FULL)}

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
