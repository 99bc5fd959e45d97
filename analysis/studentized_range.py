"""The studentized range distribution: range of k standard normals over an independent sqrt(chi2_df / df).

Accuracy is that of `scipy.stats.studentized_range`: 2e-7 relative or better for p above 1e-6 at df <= 1000, and
no correct digit below about 1e-12, because its tail is 1 - cdf. At df >= 1e5 it takes df = inf (1e-3 relative).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from analysis.arrays import FloatArray, Values, plain


def studentized_range_sf(q: ArrayLike, k: ArrayLike, df: ArrayLike) -> Values:
    """P(Q > q) for k means (k >= 2) and df > 0 error degrees of freedom; the arguments broadcast.

    1 for q <= 0, 0 for q = inf, NaN for q = NaN. `ValueError` for k or df out of range.
    No digit is correct where the true value is below about 1e-12. Source: Lund & Lund 1983, AS 190.

    >>> round(studentized_range_sf(3.514, 3, 26), 3)
    0.05
    """
    q, k, df = _checked(q, k, df)
    with np.errstate(all="ignore"):
        p = np.clip(stats.studentized_range.sf(np.maximum(q, 0.0), k, df), 0.0, 1.0)
    p = np.where(q <= 0.0, 1.0, np.where(q == np.inf, 0.0, p))
    return plain(np.where(np.isnan(q), np.nan, p))


def studentized_range_logsf(q: ArrayLike, k: ArrayLike, df: ArrayLike) -> Values:
    """Natural logarithm of P(Q > q), as accurate as `studentized_range_sf`; -inf where that is 0."""
    with np.errstate(divide="ignore"):
        return plain(np.log(studentized_range_sf(q, k, df)))


def studentized_range_isf(p: ArrayLike, k: ArrayLike, df: ArrayLike) -> Values:
    """The q with P(Q > q) = p, the critical value of Tukey's test at level p; the arguments broadcast.

    inf for p = 0, 0 for p = 1. `ValueError` for p outside 0..1, or k or df out of range.
    Near 14 digits at p >= 0.001 (k = 3, df = 26), 5e-8 at 1e-9, 5e-5 at 1e-12; below that none.

    >>> round(studentized_range_isf(0.05, 3, 26), 3)
    3.514
    """
    p, k, df = _checked(p, k, df)
    if ((p < 0.0) | (p > 1.0)).any():
        raise ValueError(f"p must lie in 0..1, not {p[(p < 0.0) | (p > 1.0)][0]}")
    inside = np.where((p > 0.0) & (p < 1.0), p, 0.5)  # the ends are known, and slow to search for
    with np.errstate(all="ignore"):
        q = stats.studentized_range.isf(inside, k, df)
    return plain(np.select([np.isnan(p), p == 0.0, p == 1.0], [np.nan, np.inf, 0.0], default=q))


def _checked(x: ArrayLike, k: ArrayLike, df: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    first, means, freedom = (np.asarray(value, dtype=np.float64) for value in (x, k, df))
    if not (means >= 2.0).all():
        raise ValueError(f"k, the number of means, must be at least 2, not {means[~(means >= 2.0)][0]}")
    if not (freedom > 0.0).all():
        raise ValueError(f"df must be above 0, not {freedom[~(freedom > 0.0)][0]}")
    first, means, freedom = np.broadcast_arrays(first, means, freedom)
    return first, means, freedom
