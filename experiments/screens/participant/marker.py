"""The marker of a rating scale, which stands nowhere until the participant puts it somewhere.

Pure: a place is a part of the scale's length from its left end; ratings are kept to the grain.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from experiments.screens.participant.words import AskRating
from experiments.session.scale import on_scale

Move = Literal["left", "right", "far left", "far right", "first", "last"]

GRAINS_FAR = 10
"""Grains of a far move: a tenth of a scale of 0 to 10 in grains of 0.1."""

_MOVES: dict[Move, Callable[[AskRating, float], float]] = {
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
    return _kept(scale, _MOVES[step](scale, middle if rating is None else rating))
