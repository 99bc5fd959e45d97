"""A continuous rating scale is kept in grains: the nearest value that can be written down."""

from __future__ import annotations

import math


def on_scale(value: float, minimum: float, maximum: float, grain: float) -> float:
    """The nearest value of the scale, in whole grains from its minimum.

    A grain such as 0.1 has no exact binary form; rounding to its decimals gives the number a person would write.

    >>> on_scale(7.349, 0, 10, 0.1), on_scale(-3, 0, 10, 0.1), on_scale(7.3, 0, 10, 0.5)
    (7.3, 0.0, 7.5)
    """
    steps = round((min(max(value, minimum), maximum) - minimum) / grain)
    decimals = max(0, -math.floor(math.log10(grain))) + 2
    return round(float(minimum + steps * grain), decimals)
