"""A continuous rating scale is kept in grains: the nearest value that can be written down. Pure."""

from __future__ import annotations

import math
from typing import Protocol


class Scale(Protocol):
    """The ends of a scale, and how fine a rating is kept."""

    @property
    def minimum(self) -> float:
        """The lower end."""

    @property
    def maximum(self) -> float:
        """The upper end."""

    @property
    def grain(self) -> float:
        """The distance of two ratings, a part of the scale."""


def on_scale(value: float, scale: Scale) -> float:
    """The nearest value of the scale, in whole grains from its minimum.

    A grain such as 0.1 has no exact binary form; rounding to its decimals gives the number a person would write.
    """
    steps = round((min(max(value, scale.minimum), scale.maximum) - scale.minimum) / scale.grain)
    decimals = max(0, -math.floor(math.log10(scale.grain))) + 2
    return round(float(scale.minimum + steps * scale.grain), decimals)
