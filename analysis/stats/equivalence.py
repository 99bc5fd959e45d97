"""Equivalence by two one-sided t-tests: is a mean, or a difference of means, within bounds that were set beforehand?"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import ArrayLike

from analysis.stats.anova import own_pairs
from analysis.stats.arrays import FloatArray, in_brief, numbers, single
from analysis.stats.frames import Result

NO_VARIANCE = "There is no variance, so there is no test: the mean itself says on which side of the bounds it lies."


@dataclass(frozen=True, slots=True, kw_only=True)
class Equivalence(Result):
    """Two one-sided tests of `difference` against `low` and `high`; equivalent at `alpha` if `p` is below it.

    `p_low`: of a difference at or below `low`; `p_high`: at or above `high`; `p` is the larger. The interval has
    confidence 1 - 2 alpha, and lies within the bounds exactly where p < alpha. None without variance, for `reason`.
    """

    difference: float
    low: float
    high: float
    alpha: float
    se: float | None = None
    df: float | None = None
    t_low: float | None = None
    p_low: float | None = None
    t_high: float | None = None
    p_high: float | None = None
    p: float | None = None
    ci_low: float | None = None
    ci_high: float | None = None
    reason: str | None = None


def tost_one_sample(values: ArrayLike, low: float, high: float, alpha: float = 0.05) -> Equivalence:
    """Is the mean of `values` (n,) between `low` and `high`, both in the unit of the values?

    t_low = (mean - low) / se tests mean <= low, t_high = (mean - high) / se tests mean >= high, se = sd / sqrt(n), on
    n - 1 degrees of freedom. Equivalent where both are rejected: p = max(p_low, p_high).
    `ValueError`: fewer than two values, `low` not below `high`, `alpha` outside 0 to .5, or no finite numbers.
    Sources: Schuirmann 1987, J. Pharmacokinet. Biopharm. 15, 657; Lakens 2017, Soc. Psychol. Personal. Sci. 8, 355.

    >>> found = tost_one_sample([0.1, -0.2, 0.3, 0.0, -0.1, 0.2], -0.5, 0.5)
    >>> round(found.t_low, 3), round(found.t_high, 3), round(found.p, 4)
    (7.201, -5.892, 0.001)
    """
    sample = _sample(values, "values")
    mean, se = _mean_and_se(sample)
    return _tests((mean, se, sample.size - 1.0), (low, high), alpha)


def tost_paired(a: ArrayLike, b: ArrayLike, low: float, high: float, alpha: float = 0.05) -> Equivalence:
    """Is the mean difference `a` - `b` of the same people between `low` and `high`? As `tost_one_sample` of a - b.

    `a, b`: (n,) in the same order of people. `ValueError`: as there, or of different lengths.

    >>> round(tost_paired([5.0, 6.0, 7.0, 5.5], [5.1, 5.8, 7.2, 5.4], -1.0, 1.0).p, 4)
    0.0008
    """
    first, second = _sample(a, "a"), _sample(b, "b")
    if first.size != second.size:
        raise ValueError(f"a and b must be of the same people, not {first.size} and {second.size} values")
    pair = own_pairs(np.stack([second, first], axis=-1))
    return _tests((float(pair.difference[0]), _se(pair.error[0]), first.size - 1.0), (low, high), alpha)


def tost_two_samples(
    a: ArrayLike, b: ArrayLike, low: float, high: float, alpha: float = 0.05, *, equal_variances: bool = False
) -> Equivalence:
    """Is the difference of the means of different people, `a` - `b`, between `low` and `high`?

    Welch: se^2 = s_a^2 / n_a + s_b^2 / n_b, on (s_a^2 / n_a + s_b^2 / n_b)^2 / sum (s_i^2 / n_i)^2 / (n_i - 1) degrees
    of freedom; with `equal_variances` the pooled variance on n_a + n_b - 2.
    `a`: (n_a,), `b`: (n_b,). `ValueError` as in `tost_one_sample`. Source: Welch 1947, Biometrika 34, 28.

    >>> found = tost_two_samples([5.0, 6.0, 7.0, 5.5], [5.6, 6.2, 6.1, 5.4, 6.3], -2.0, 2.0)
    >>> round(found.df, 3), round(found.p, 4)
    (4.033, 0.0066)
    """
    first, second = _sample(a, "a"), _sample(b, "b")
    if not isinstance(equal_variances, bool | np.bool_):
        raise ValueError(f"equal_variances must be True or False, not {in_brief(equal_variances)}")
    (mean_a, se_a), (mean_b, se_b) = _mean_and_se(first), _mean_and_se(second)
    degrees = first.size - 1.0, second.size - 1.0
    if equal_variances:
        ratio = math.sqrt((first.size + second.size) / (sum(degrees) * first.size * second.size))
        se = ratio * math.hypot(math.sqrt(degrees[0] * first.size) * se_a, math.sqrt(degrees[1] * second.size) * se_b)
        return _tests((mean_a - mean_b, se, sum(degrees)), (low, high), alpha)
    se = math.hypot(se_a, se_b)
    shares = ((se_a / se) ** 2, (se_b / se) ** 2) if se else (1.0, 0.0)
    df = 1.0 / sum(part**2 / freedom for part, freedom in zip(shares, degrees, strict=True))
    return _tests((mean_a - mean_b, se, df), (low, high), alpha)


def _sample(values: ArrayLike, name: str) -> FloatArray:
    array = numbers(values, name)
    if array.ndim != 1 or array.size < 2:
        raise ValueError(f"{name} must be at least two numbers in a row, not of shape {array.shape}")
    return array


def _mean_and_se(sample: FloatArray) -> tuple[float, float]:
    """Mean and standard error as those of the pair of `sample` and 0: with its rules for scale, offset and rounding."""
    pair = own_pairs(np.stack([np.zeros_like(sample), sample], axis=-1))
    return float(pair.difference[0]), _se(pair.error[0])


def _se(error: float) -> float:
    """The standard error of a difference from that on the scale of q."""
    return float(error) * math.sqrt(2.0)


def _tests(mean_se_df: tuple[float, float, float], bounds: tuple[float, float], alpha: float) -> Equivalence:
    difference, se, df = mean_se_df
    low, high, alpha = single(bounds[0], "low"), single(bounds[1], "high"), single(alpha, "alpha")
    if low >= high:
        raise ValueError(f"low must be below high, not {low} and {high}")
    if not 0.0 < alpha < 0.5:
        raise ValueError(f"alpha must lie between 0 and 0.5, not {alpha}")
    found = Equivalence(difference=difference, low=low, high=high, alpha=alpha)
    if se == 0.0:
        return replace(found, reason=NO_VARIANCE)
    t_low, t_high = (difference - low) / se, (difference - high) / se
    p_low, p_high = float(scipy.special.stdtr(df, -t_low)), float(scipy.special.stdtr(df, t_high))
    half = -float(scipy.special.stdtrit(df, alpha)) * se
    return replace(
        found,
        se=se,
        df=df,
        t_low=t_low,
        p_low=p_low,
        t_high=t_high,
        p_high=p_high,
        p=max(p_low, p_high),
        ci_low=difference - half,
        ci_high=difference + half,
    )
