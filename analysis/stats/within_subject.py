"""Confidence intervals of a repeated measure's means, with the differences between people taken out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from analysis.stats.arrays import FloatArray, numbers, share


@dataclass(frozen=True, slots=True, kw_only=True)
class WithinSubject:
    """Means of the conditions and their intervals, arrays (conditions,)."""

    means: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray


def cousineau_morey(scores: ArrayLike, confidence: float = 0.95) -> WithinSubject:
    """Means with within-subject intervals, of `scores` (participants, conditions).

    y'_ij = y_ij - mean_i + mean; the interval of condition j is mean_j +- t(n - 1) s'_j / sqrt(n) sqrt(k / (k - 1)).
    `ValueError` for fewer than 2 participants or conditions.
    Sources: Cousineau 2005, Tutorials in Quantitative Methods for Psychology 1, 42; Morey 2008, same journal 4, 61.

    >>> cousineau_morey([[1, 2, 3], [5, 6, 7]]).ci_low.tolist()
    [3.0, 4.0, 5.0]
    """
    array = numbers(scores, "scores")
    if array.ndim != 2 or min(array.shape) < 2:
        raise ValueError(f"scores must be at least 2 participants by 2 conditions, not {array.shape}")
    n, k = array.shape
    within = array - array.mean(axis=1, keepdims=True) + array.mean()
    t = special.stdtrit(n - 1, 0.5 + share(confidence, "confidence") / 2.0)
    half = t * within.std(axis=0, ddof=1) / math.sqrt(n) * math.sqrt(k / (k - 1))
    means: FloatArray = np.asarray(array.mean(axis=0))
    return WithinSubject(means=means, ci_low=means - half, ci_high=means + half)
