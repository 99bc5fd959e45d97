"""Sums without rounding: a number is cut into slices on fixed grids, and the sums of one slice are exact.

For |x| <= 1 the slices are a multiple of 2**-26, a multiple of 2**-52 up to 2**-27, and the rest, up to 2**-53. Sums of
the first two, and their multiples by whole numbers, are exact as long as these come to 2**25 at most in all; those of
the third round at 2**-106.
Sources: Zielke & Drygalla 2003, GAMM-Mitteilungen 26, 7; Rump 2009, SIAM J. Sci. Comput. 31, 3466.
"""

from __future__ import annotations

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


def joined(slices: FloatArray) -> FloatArray:
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
