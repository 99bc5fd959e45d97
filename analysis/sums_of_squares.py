"""Sums of squares that keep their digits, whatever the offset and the scale of the data.

Three measures, in this order: the data are scaled by a power of two, which is exact; a datum is subtracted before any
mean is taken, because the rounding of a mean at 1e12 costs more digits than everything after it; and the error is
the sum of squared residuals, never a difference of sums, so it cannot be negative.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import FloatArray

_NOISE = 4.0 * float(np.finfo(np.float64).eps)
"""Relative size of a residual that rounding alone can make: half an eps from storing the number, the rest from ours."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sums:
    """Decomposed data sets. Leading axes (...); `means` is (..., k).

    `means` (of the conditions, less the grand mean) is in units of 2**exponent, the sums of squares in 4**exponent.
    `noise` is the sum of squares that rounding could have made: an error at or below it has been set to 0.
    """

    exponent: NDArray[np.int64]
    means: FloatArray
    effect: FloatArray
    error: FloatArray
    noise: FloatArray
    df_effect: int
    df_error: int
    participants: FloatArray | None = None

    @property
    def ms_error(self) -> FloatArray:
        """Mean squared error, in 4**exponent."""
        return self.error / self.df_error


def unscaled(values: FloatArray, exponent: NDArray[np.int64]) -> FloatArray:
    """`values` * 2**exponent; what no double can hold becomes inf or 0, silently, as it must."""
    with np.errstate(over="ignore", under="ignore"):
        return np.ldexp(values, exponent)


def exponent_of(largest: FloatArray) -> NDArray[np.int64]:
    """The power of two just above `largest`."""
    return np.frexp(largest)[1].astype(np.int64)


def repeated_sums(scores: FloatArray) -> Sums:
    """Participants by conditions, (..., n, k): what conditions and participants explain, and the rest."""
    n, k = scores.shape[-2:]
    exponent = exponent_of(np.abs(scores).max(axis=(-2, -1)))
    scaled = np.ldexp(scores, -exponent[..., None, None])
    high, low = _exact_difference(scaled, scaled[..., :1])
    first_high, first_low = high[..., :1, :], low[..., :1, :]
    rest = (high - first_high) + (low - first_low)
    columns, residuals = _double_centred(rest)
    means = _centred(first_high + first_low + columns)[..., 0, :]
    people = _centred((scaled[..., 0] - scaled[..., :1, 0]) + (high + low).mean(axis=-1))
    noise = _NOISE**2 * np.square(scaled).sum(axis=(-2, -1))
    effect = n * np.square(means).sum(axis=-1)
    effect, error = _without_noise(effect, np.square(residuals).sum(axis=(-2, -1)), noise)
    return Sums(
        exponent=exponent,
        means=means,
        effect=effect,
        error=error,
        noise=noise,
        df_effect=k - 1,
        df_error=(n - 1) * (k - 1),
        participants=k * np.square(people).sum(axis=-1),
    )


def between_sums(groups: Sequence[FloatArray]) -> Sums:
    """Groups of different people, each (..., n_i): effect of the group, and the spread within the groups."""
    leading = np.broadcast_shapes(*(group.shape[:-1] for group in groups))
    full = [np.broadcast_to(group, leading + group.shape[-1:]) for group in groups]
    exponent = exponent_of(np.max([np.abs(group).max(axis=-1) for group in full], axis=0))
    scaled = [np.ldexp(group, -exponent[..., None]) for group in full]
    pivot = scaled[0][..., :1]
    centres, spreads = zip(*(_mean_and_squares(group - pivot) for group in scaled), strict=True)
    counts = np.array([group.shape[-1] for group in groups], dtype=np.float64)
    means = np.stack(centres, axis=-1)
    means = means - (means * counts).sum(axis=-1, keepdims=True) / counts.sum()
    noise = _NOISE**2 * np.sum([np.square(group).sum(axis=-1) for group in scaled], axis=0)
    effect, error = _without_noise((counts * np.square(means)).sum(axis=-1), np.sum(spreads, axis=0), noise)
    return Sums(
        exponent=exponent,
        means=means,
        effect=effect,
        error=error,
        noise=noise,
        df_effect=len(groups) - 1,
        df_error=int(counts.sum()) - len(groups),
    )


def _exact_difference(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Difference a - b and its rounding error (Knuth's two-sum): nothing is lost where the effect is huge."""
    high = a - b
    b_virtual = a - high
    a_virtual = high + b_virtual
    return high, (a - a_virtual) + (b_virtual - b)


def _centred(values: FloatArray) -> FloatArray:
    """Last axis less its mean, twice: the second pass takes off what the first mean's rounding left."""
    once: FloatArray = values - values.mean(axis=-1, keepdims=True)
    twice: FloatArray = once - once.mean(axis=-1, keepdims=True)
    return twice


def _double_centred(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Column means (..., 1, k) of the row-centred values, and the residuals (..., n, k)."""
    within = _centred(values)
    columns = within.mean(axis=-2, keepdims=True)
    residuals = _centred(within - columns)
    correction = residuals.mean(axis=-2, keepdims=True)
    return columns + correction, residuals - correction


def _mean_and_squares(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    mean = values.mean(axis=-1, keepdims=True)
    rest = values - mean
    correction = rest.mean(axis=-1, keepdims=True)
    return (mean + correction)[..., 0], np.square(rest - correction).sum(axis=-1)


def _without_noise(effect: FloatArray, error: FloatArray, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    error = np.where(error <= noise, 0.0, error)
    effect = np.where((error == 0.0) & (effect <= noise), 0.0, effect)
    return effect, error
