"""What is left of scores within participants when the participants' and the conditions' own means are taken off."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from analysis.stats.anova import check_scores
from analysis.stats.arrays import FloatArray
from analysis.stats.sums_of_squares import repeated_sums


def unit_scaled(scores: FloatArray) -> FloatArray:
    """`scores` over a power of two, which is exact: the largest lies in 0.5..1, so no square over- or underflows."""
    scaled: FloatArray = np.ldexp(scores, -np.frexp(np.abs(scores).max())[1])
    return scaled


def residuals(scores: ArrayLike) -> FloatArray:
    """e_ij = x_ij - m_i - m_j + m in a power of two of the data's unit, so that the largest score lies in 0.5..1.

    `scores`: (n participants, k conditions), the result too. All zeros where `rm_anova` finds no error variance, so
    that nobody takes rounding for spread. `ValueError` as in `rm_anova`.

    >>> residuals([[1.0, 2.0], [2.0, 5.0]]).tolist()
    [[0.0625, -0.0625], [-0.0625, 0.0625]]
    """
    array = check_scores(scores)
    sums = repeated_sums(array)
    if not sums.error.any():
        return np.zeros_like(array)
    scaled = unit_scaled(array)
    rest: FloatArray = scaled - scaled[:, :1]
    rest = rest - rest[:1]
    for _ in range(2):  # the second pass takes off what the rounding of the first means left
        rest = rest - rest.mean(axis=1, keepdims=True)
        rest = rest - rest.mean(axis=0, keepdims=True)
    return rest
