"""The door of everything that reads response times as decisions: they must come from the participant's own hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from analysis.stats.arrays import FloatArray, numbers

OWN = ("participant", "synthetic")
"""The values of `response_source` whose times are the answerer's own."""
REASON = (
    "such a time holds the spoken answer and the experimenter's reaction to it as well, so it says nothing of the "
    "participant's speed: leave these rows out, or let the participant answer by hand"
)


def own_times(time_s: ArrayLike, sources: Sequence[str] | ArrayLike) -> FloatArray:
    """The response times in s, if each is above 0 and its `response_source` the participant or a synthetic one.

    `ValueError` naming the first row that is not so, with the reason; rows count from 0.
    """
    times, names = numbers(time_s, "response_time_s"), np.asarray(sources, dtype=np.str_)
    if times.ndim != 1 or names.shape != times.shape:
        raise ValueError(
            f"response_time_s and response_source must be columns of one length, not {times.shape} and {names.shape}"
        )
    foreign = np.flatnonzero(~np.isin(names, OWN))
    if foreign.size:
        raise ValueError(
            f"{foreign.size} of {times.size} response times are not the participant's own; the first, row "
            f"{foreign[0]}, has response_source {str(names[foreign[0]])!r}: {REASON}"
        )
    if not (times > 0.0).all():
        row = int(np.argmax(~(times > 0.0)))
        raise ValueError(f"response_time_s must be above 0, but row {row} has {times[row]:g}")
    return times


def answers(values: ArrayLike, name: str, count: int) -> FloatArray:
    """`values` as zeros and ones, one of each of `count` rows; else `ValueError`."""
    found = numbers(values, name)
    if found.shape != (count,) or not np.isin(found, (0.0, 1.0)).all():
        raise ValueError(f"{name} must be {count} values of 0 or 1")
    return found
