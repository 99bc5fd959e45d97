"""Confidence intervals of a proportion: Clopper and Pearson's, never too short, and Wilson's, right on average."""

from __future__ import annotations

import numpy as np
from scipy import special

from analysis.stats.arrays import FloatArray
from analysis.stats.binomial_tails import LongArray, log_pmf, log_tail

_CLOSE = 1e-9
"""A step of Newton's so small leaves an error of its square."""


def clopper_pearson(k: FloatArray, n: FloatArray, tail: float) -> tuple[FloatArray, FloatArray]:
    """Limits with P(X >= k | low) = P(X <= k | high) = tail, for k of n, one axis; 0 for k = 0, 1 for k = n.

    Found by Newton's method, because scipy's beta quantiles can be wrong in the first digit (1000 of 1e9, scipy 1.17).
    Source: Clopper & Pearson 1934, Biometrika 26, 404.
    """
    successes, trials = k.astype(np.longdouble), n.astype(np.longdouble)
    low, high = np.zeros_like(k), np.ones_like(k)
    some, not_all = k > 0.0, k < n
    low[some] = _limit(successes[some], trials[some], tail, 1)
    high[not_all] = _limit(successes[not_all], trials[not_all], tail, -1)
    return low, high


def _limit(k: LongArray, n: LongArray, tail: float, step: int) -> FloatArray:
    """The p at which P(X >= k) (step 1) or P(X <= k) (step -1) is `tail`.

    The logarithm of either is concave in t = log(p / (1 - p)), so Newton's steps converge from where it is a half. Its
    slope in t is k (1 - p) P(k) / P(X >= k), or -(n - k) p P(k) / P(X <= k).
    """
    odds = (k + 0.5) / (n - k + 0.5)
    change = np.ones_like(odds)
    while (np.abs(change) > _CLOSE).any():
        p = odds / (1 + odds)
        log_now = log_tail(k, step, n, p)
        falling = np.exp(log_pmf(k, n, p) - log_now)
        slope = k * (1 - p) * falling if step > 0 else -(n - k) * p * falling
        change = (np.log(np.longdouble(tail)) - log_now) / slope
        odds = odds * np.exp(change)
    limit: LongArray = odds / (1 + odds)
    return limit.astype(np.float64)


def wilson(k: FloatArray, n: FloatArray, tail: float) -> tuple[FloatArray, FloatArray]:
    """The p with |k / n - p| = z sqrt(p (1 - p) / n), z the normal quantile of `tail`.

    These are the roots of (n + z^2) p^2 - (2 k + z^2) p + k^2 / n = 0; the lower is taken from the product of the two,
    where nothing cancels. Source: Wilson 1927, J. Am. Stat. Assoc. 22, 209.
    """
    z = -float(special.ndtri(tail))
    upper = k + z * z / 2.0 + z * np.sqrt(k * (n - k) / n + z * z / 4.0)
    return k * (k / n) / upper, np.where(k == n, 1.0, upper / (n + z * z))
