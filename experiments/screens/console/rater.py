"""A synthetic participant on the participant's own screen: its ratings are clicked, its descriptions left empty."""

from __future__ import annotations

import time
from typing import Protocol

from experiments.screens.participant.rating_page import spot_px
from experiments.screens.participant.stage import TITLE
from experiments.session.scale import on_scale
from experiments.session.steps import Rate

AGAIN_S = 0.2
"""How long hands wait before they try again: what is done before the page stands is lost, as a person's would be."""


class Hands(Protocol):
    """What is needed of hands."""

    def focus_on(self, title: str) -> tuple[int, int, int, int] | None:
        """Raise a window and give it the keys; its place and size."""

    def click(self, x_px: int, y_px: int) -> None:
        """Click at a place of the display."""

    def press(self, name: str, *held: str) -> float:
        """Press a key, with others held."""


class Rater:
    """Rates on the participant's screen. Whatever it does may be done again, on whichever page stands, to no harm."""

    def __init__(self, hands: Hands) -> None:
        self._hands = hands
        self._at_s = 0.0

    def rate(self, step: Rate, rating: float) -> None:
        """Click the rating and confirm it. A page that asks for a description takes the same for an empty one."""
        place = self._place()
        if place is not None:
            x_px, y_px = _spot(step, rating, width_px=place[2], height_px=place[3])
            self._hands.click(place[0] + x_px, place[1] + y_px)
            self._confirm()

    def describe(self) -> None:
        """Confirm an empty description. A page that asks for a rating takes none by that, as none is clicked on it."""
        if self._place() is not None:
            self._confirm()

    def _place(self) -> tuple[int, int, int, int] | None:
        """Where the participant's window lies, now that it has the keys; `None` if there is none, or it is too soon."""
        if time.monotonic() - self._at_s < AGAIN_S:
            return None
        self._at_s = time.monotonic()
        return self._hands.focus_on(TITLE)

    def _confirm(self) -> None:
        """With Ctrl, as Enter alone begins a new line of a description."""
        self._hands.press("Return", "Control_L")


def _spot(step: Rate, rating: float, *, width_px: int, height_px: int) -> tuple[int, int]:
    """Where the rating's grain lies on the window."""
    kept = on_scale(rating, step)
    return spot_px((kept - step.minimum) / (step.maximum - step.minimum), width_px, height_px)
