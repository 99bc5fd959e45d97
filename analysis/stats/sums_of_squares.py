"""Sums of squares that keep their digits, whatever the offset and the scale.

A number is cut into slices on fixed grids. For |x| <= 1 they are a multiple of 2**-26, a multiple of 2**-52 up to
2**-27, and the rest, up to 2**-53. Sums of the first two, and their multiples by whole numbers, are exact as long as
these come to 2**25 at most in all; those of the third round at 2**-106.
Sources: Zielke & Drygalla 2003, GAMM-Mitteilungen 26, 7; Rump 2009, SIAM J. Sci. Comput. 31, 3466.

Three measures: the data are scaled by a power of two, which is exact; totals and deviations are formed in slices and
times the number of values, so that no mean is divided and nothing rounded; and the error is the sum of squared
residuals, never a difference of sums, so it cannot be negative.

What is left is the rounding of the data themselves: tenths are no doubles. `noise` bounds what it can add to a sum of
squares. Below it an error is no error: it is set to 0 where the effect is of another order of magnitude (F = inf) and
where the effect is as small (0/0, undefined); in between, F is that of the doubles as they stand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import NDArray

from analysis.stats.arrays import FloatArray

_FIRST_GRID, _SECOND_GRID = 1.5 * 2.0**26, 1.5
"""Added and taken off again, they leave a number rounded to a multiple of 2**-26, of 2**-52."""


def exponent_of(largest: FloatArray) -> NDArray[np.int64]:
    """The power of two just above `largest`."""
    return np.frexp(largest)[1].astype(np.int64)


def scale(values: FloatArray, exponent: NDArray[np.int64]) -> None:
    """Divide `values` by 2**exponent in place: in two steps, because 2**1074, for the smallest, is no double."""
    half = -exponent // 2
    values *= np.ldexp(1.0, half)
    values *= np.ldexp(1.0, -exponent - half)


def unscaled(values: FloatArray, exponent: NDArray[np.int64]) -> FloatArray:
    """`values` * 2**exponent; what no double can hold becomes inf or 0, silently, as it must."""
    with np.errstate(over="ignore", under="ignore"):
        return np.ldexp(values, exponent)


def sliced(values: FloatArray) -> FloatArray:
    """The three slices (3, ...) of `values` (...) within -1..1; they add up to them exactly."""
    slices = np.empty((3, *values.shape))
    first, second, rest = slices[0], slices[1], slices[2]
    np.add(values, _FIRST_GRID, out=first)
    first -= _FIRST_GRID
    np.subtract(values, first, out=rest)
    np.add(rest, _SECOND_GRID, out=second)
    second -= _SECOND_GRID
    rest -= second
    return slices


def _joined(slices: FloatArray) -> FloatArray:
    """The number (...) that the slices (3, ...) stand for: where the first two cancel, their sum is exact."""
    total: FloatArray = slices[0] + slices[1]
    total += slices[2]
    return total


def pairwise(values: FloatArray) -> FloatArray:
    """Sum over the first axis, halves added to halves: the rounding grows with the logarithm of the count."""
    while len(values) > 1:
        half = len(values) // 2
        folded = values[:half] + values[half : 2 * half]
        if len(values) % 2:
            folded[0] += values[-1]
        values = folded
    total: FloatArray = values[0]
    return total


NOISE = 2.0 * float(np.finfo(np.float64).eps)
"""Relative error of a number that a few operations on decimals have made: four roundings of half an eps."""

_CERTAIN = 2.0**40
"""An effect so many times the noise leaves no doubt that F is beyond every bound, if the error is within the noise."""

_BLOCK = 16_128
"""Cells decomposed together: 384 data sets of 14 x 3, what stays in a processor's second cache."""

_Parts = tuple[NDArray[np.int64], FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sums:
    """Decomposed data sets, leading axes (...). The sums of squares are in units of 4**exponent.

    `totals` (3, ..., k) are the slices of the conditions' totals, in 2**exponent, `counts` (k,) the values of each.
    `participants` is 0 where everybody is in one condition. `noise` is the sum of squares that the rounding of the data
    could have made.
    """

    exponent: NDArray[np.int64]
    totals: FloatArray
    counts: FloatArray
    effect: FloatArray
    error: FloatArray
    noise: FloatArray
    df_effect: int
    df_error: int
    participants: FloatArray

    @property
    def ms_error(self) -> FloatArray:
        """Mean squared error, in 4**exponent."""
        return self.error / self.df_error

    def differences(self, a: NDArray[np.intp], b: NDArray[np.intp]) -> FloatArray:
        """Means of the conditions `a` less those of `b`, (..., pairs), in 2**exponent: total_a n_b - total_b n_a."""
        weighted = self.totals[..., a] * self.counts[b] - self.totals[..., b] * self.counts[a]
        difference: FloatArray = _joined(weighted) / (self.counts[a] * self.counts[b])
        return difference


def repeated_sums(scores: FloatArray) -> Sums:
    """Participants by conditions, (..., n, k): what conditions and participants explain, and the rest."""
    leading, (n, k) = scores.shape[:-2], scores.shape[-2:]
    sets = scores.reshape(prod(leading), n, k)
    step = max(1, _BLOCK // (n * k))
    blocks = [_decomposed(sets[first : first + step]) for first in range(0, max(len(sets), 1), step)]
    exponent, totals, effect, people, error, noise = (
        np.concatenate(parts, axis=-1) for parts in zip(*blocks, strict=True)
    )
    effect, error = without_noise(effect, error, noise)
    return Sums(
        exponent=exponent.reshape(leading),
        totals=np.moveaxis(totals, 1, -1).reshape(3, *leading, k),
        counts=np.full(k, float(n)),
        effect=effect.reshape(leading),
        error=error.reshape(leading),
        noise=noise.reshape(leading),
        df_effect=k - 1,
        df_error=(n - 1) * (k - 1),
        participants=people.reshape(leading),
    )


def _decomposed(sets: FloatArray) -> _Parts:
    """Exponents, totals (3, k, sets), effects, participants, errors and noise of data sets (sets, n, k).

    The data sets are laid along the last axis, so that every pass runs over many of them. With cells x, totals of
    rows R and of columns C and grand total T, n k times the residual is n k x - n R - (k C - T), slice by slice.
    """
    n, k = sets.shape[1:]
    cells = np.array(sets.transpose(1, 2, 0), order="C")
    flat = cells.reshape(n * k, len(sets))
    exponent = exponent_of(np.maximum(flat.max(axis=0), -flat.min(axis=0)))
    scale(cells, exponent)
    slices = sliced(cells)
    rows, columns = slices.sum(axis=2), slices.sum(axis=1)
    grand = columns.sum(axis=1)[:, None]
    rows *= n
    effects = k * columns - grand
    effect, people = (pairwise(np.square(_joined(parts))) for parts in (effects, rows - grand))
    slices *= n * k
    slices -= rows[:, :, None]
    slices -= effects[:, None]
    error = pairwise(np.square(_joined(slices)).reshape(flat.shape)) / float((n * k) ** 2)
    noise = NOISE**2 * pairwise(np.square(flat))
    return exponent, columns, effect / float(n * k**2), people / float(n**2 * k), error, noise


def between_sums(groups: Sequence[FloatArray]) -> Sums:
    """Groups of different people, each (..., n_i): effect of the group, and the spread within the groups.

    The first value is taken off all, slice by slice, which is exact and leaves room for large groups.
    """
    leading = np.broadcast_shapes(*(group.shape[:-1] for group in groups))
    scaled = [np.array(np.broadcast_to(group, leading + group.shape[-1:])) for group in groups]
    exponent = exponent_of(np.max([np.abs(group).max(axis=-1) for group in scaled], axis=0))
    for group in scaled:
        scale(group, exponent[..., None])
    slices = [sliced(group) for group in scaled]
    slices = [part - slices[0][..., :1] for part in slices]
    counts = np.array([group.shape[-1] for group in groups], dtype=np.float64)
    totals = np.stack([part.sum(axis=-1) for part in slices], axis=-1)
    noise = NOISE**2 * np.sum([np.square(group).sum(axis=-1) for group in scaled], axis=0)
    effect, error = without_noise(
        _between_effect(totals, counts), np.sum([_spread(part) for part in slices], axis=0), noise
    )
    return Sums(
        exponent=exponent,
        totals=totals,
        counts=counts,
        effect=effect,
        error=error,
        noise=noise,
        df_effect=len(groups) - 1,
        df_error=int(counts.sum()) - len(groups),
        participants=np.zeros_like(error),
    )


def _between_effect(totals: FloatArray, counts: FloatArray) -> FloatArray:
    """Sum of n_i (m_i - m)^2, where N n_i (m_i - m) = N total_i - n_i total."""
    everyone = counts.sum()
    deviations = _joined(everyone * totals - counts * totals.sum(axis=-1, keepdims=True))
    effect: FloatArray = (np.square(deviations) / (counts * everyone**2)).sum(axis=-1)
    return effect


def _spread(slices: FloatArray) -> FloatArray:
    """Sum of (x - m)^2 over the last axis of the slices (3, ..., n), where n (x - m) = n x - total."""
    n = slices.shape[-1]
    deviations = _joined(n * slices - slices.sum(axis=-1, keepdims=True))
    spread: FloatArray = np.square(deviations).sum(axis=-1) / float(n) ** 2
    return spread


def without_noise(effect: FloatArray, error: FloatArray, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Effect and error with what is no more than `noise` set to 0, as the head of this module says."""
    nothing = (error <= noise) & (effect <= noise)
    certain = (error <= noise) & (effect >= _CERTAIN * noise)
    return np.where(nothing, 0.0, effect), np.where(nothing | certain, 0.0, error)
