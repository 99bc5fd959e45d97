"""The page of a rating: a continuous scale, answered by mouse or by keys, and confirmed."""

from __future__ import annotations

from typing import Any

from experiments.screens.participant.confirming import ENTER, Button, heading, hint
from experiments.screens.participant.marker import Move, move, put
from experiments.screens.participant.pages import Drafts, QuietPage
from experiments.screens.participant.stage import Box, Stage, half_width
from experiments.screens.participant.words import AskRating, RatingGiven

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
