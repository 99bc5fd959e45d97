"""P-values adjusted for their number: Holm's bounds the chance of a false one, Benjamini and Hochberg's their share."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
import scipy
from numpy.typing import ArrayLike

from analysis.stats.arrays import FloatArray, numbers, one_of

Correction = Literal["none", "holm", "benjamini-hochberg"]

SIGNIFICANT = 0.05
"""A p-value below it is called significant."""


def holm(p: ArrayLike) -> FloatArray:
    """P-values adjusted for their number m: the running maximum of (m - i) p_(i), i = 0.. in rising order, at most 1.

    Rejecting where the result is below .05 keeps the chance of any false rejection below .05. `ValueError`: a p outside
    0..1. Source: Holm 1979, Scand. J. Stat. 6, 65.

    >>> holm([0.01, 0.04, 0.03]).tolist()
    [0.03, 0.06, 0.06]
    """
    array = _p_values(p)
    order = np.argsort(array, kind="stable")
    steps = np.maximum.accumulate((array.size - np.arange(array.size)) * array[order])
    adjusted = np.empty_like(array)
    adjusted[order] = np.minimum(steps, 1.0)
    return adjusted


def benjamini_hochberg(p: ArrayLike) -> FloatArray:
    """P-values adjusted for their number m: the running minimum of m p_(i) / i, i = m..1 in falling order, at most 1.

    Rejecting where the result is below .05 keeps the expected share of false ones among the rejections below .05, for
    tests that are independent or positively dependent. `ValueError`: a p outside 0..1. Computed by scipy.
    Source: Benjamini & Hochberg 1995, J. R. Stat. Soc. B 57, 289.

    >>> benjamini_hochberg([0.01, 0.04, 0.03]).round(12).tolist()
    [0.03, 0.04, 0.04]
    """
    array = _p_values(p)
    return np.asarray(scipy.stats.false_discovery_control(array, method="bh")) if array.size else array


def corrected(p: ArrayLike, correction: Correction) -> FloatArray:
    """P-values adjusted by the correction of that name; as they are for "none".

    >>> corrected([0.01, 0.04], "holm").tolist(), corrected([0.01, 0.04], "none").tolist()
    ([0.02, 0.04], [0.01, 0.04])
    """
    if one_of(correction, "correction", get_args(Correction)) == "none":
        return _p_values(p)
    return holm(p) if correction == "holm" else benjamini_hochberg(p)


def _p_values(p: ArrayLike) -> FloatArray:
    array = numbers(p, "p").ravel()
    strange = (array < 0.0) | (array > 1.0)
    if strange.any():
        raise ValueError(f"p must lie between 0 and 1, but one is {array[strange][0]}")
    return array
