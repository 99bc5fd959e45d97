"""Trials person by person at the speed of arrays: each one's rows in order of time, and means and quantiles of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.stats.arrays import FloatArray

Places = NDArray[np.intp]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ordered:
    """Rows of trials, person after person in the codes' sorted order, each one's by time; equal times as they stood."""

    rows: Places
    count: Places  # of each person's trials

    @property
    def people(self) -> int:
        """How many people there are."""
        return int(self.count.size)

    @property
    def person(self) -> Places:
        """The person of each row, from 0."""
        return np.repeat(np.arange(self.people), self.count)

    @property
    def rank(self) -> Places:
        """The place of each row among its person's, from 0."""
        first = np.cumsum(self.count) - self.count
        return np.asarray(np.arange(self.rows.size) - np.repeat(first, self.count))

    def means(self, values: FloatArray) -> FloatArray:
        """Each person's mean of `values`, one a trial in the order of the table."""
        return np.bincount(self.person, weights=values[self.rows], minlength=self.people) / self.count

    def only(self, chosen: NDArray[np.bool_]) -> Ordered:
        """Of these trials alone, one flag a trial in the order of the table; who has none of them is gone."""
        kept = chosen[self.rows]
        counts = np.bincount(self.person[kept], minlength=self.people)
        return Ordered(rows=self.rows[kept], count=counts[counts > 0])

    def of_at_least(self, fewest: int) -> Ordered:
        """Of the people who have so many trials."""
        return self.of(self.count >= fewest)

    def of(self, people: NDArray[np.bool_]) -> Ordered:
        """Of these people alone, one flag a person."""
        return Ordered(rows=self.rows[np.repeat(people, self.count)], count=self.count[people])


def ordered(people: ArrayLike, time_s: FloatArray) -> Ordered:
    """The rows of each person. `ValueError`: not one code a row."""
    codes = np.asarray(people)
    if codes.shape != time_s.shape:
        raise ValueError(f"people must be {time_s.size} codes, one a row, not {codes.shape}")
    rows = np.arange(codes.size) if _in_order(codes, time_s) else np.lexsort((time_s, codes))
    sorted_codes = codes[rows]
    begins = np.flatnonzero(np.append(True, sorted_codes[1:] != sorted_codes[:-1])[: codes.size])
    return Ordered(rows=rows, count=np.diff(np.append(begins, codes.size)))


def _in_order(codes: NDArray[Any], time_s: FloatArray) -> bool:
    later = codes[1:] > codes[:-1]
    return bool((later | ((codes[1:] == codes[:-1]) & (time_s[1:] >= time_s[:-1]))).all())


def quantiles(time_s: FloatArray, by: Ordered, shares: Sequence[float]) -> FloatArray:
    """Each person's quantiles (people, shares) of the times, interpolated linearly.

    >>> times = np.array([1.0, 2.0, 4.0, 7.0])
    >>> quantiles(times, ordered(["a", "a", "a", "b"], times), [0.5, 0.75]).tolist()
    [[2.0, 3.0], [7.0, 7.0]]
    """
    times = time_s[by.rows]
    first = (np.cumsum(by.count) - by.count)[:, None]
    wanted = (by.count - 1)[:, None] * np.asarray(shares, dtype=np.float64)
    below = np.floor(wanted).astype(np.intp)
    low, high = times[first + below], times[first + np.minimum(below + 1, by.count[:, None] - 1)]
    return np.asarray(low + (high - low) * (wanted - below))
