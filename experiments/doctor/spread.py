"""A sample of times in a few numbers: its middle and its tail."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Median, 95th and 99th percentile and the largest of `n` values, in the unit of the values."""

    n: int
    median: float
    p95: float
    p99: float
    worst: float


def percentile(values: Sequence[float], percent: float) -> float:
    """The smallest value that at least `percent` of 100 of the values do not exceed. `ValueError` if there is none.

    The inverse of the empirical distribution function, so always a value that was measured: definition 1 of Hyndman
    and Fan (1996), The American Statistician 50, 361-365.

    >>> percentile([3.0, 1.0, 2.0], 50)
    2.0
    """
    if not values or not 0 < percent <= 100:
        raise ValueError(f"percentile {percent} of {len(values)} values: needs a value, and 0 < percentile <= 100")
    return sorted(values)[math.ceil(len(values) * percent / 100) - 1]


def spread(values: Sequence[float]) -> Spread:
    """Middle and tail of some values. `ValueError` if there are none."""
    return Spread(
        n=len(values),
        median=percentile(values, 50),
        p95=percentile(values, 95),
        p99=percentile(values, 99),
        worst=max(values),
    )
