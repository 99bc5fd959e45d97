"""What to look at before a test is believed: residuals, outliers, and scores at their ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from analysis.stats.anova import check_scores
from analysis.stats.arrays import FloatArray, numbers
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


SHAPIRO_UP_TO = 5000
NO_RESIDUALS = "There is no error variance, so there are no residuals to look at."
TOO_MANY = "Shapiro-Wilk's p-value is not known beyond 5000 residuals; read skewness and kurtosis."
NORMALITY_NOTE = (
    "Shapiro-Wilk test of the n × k residuals of the repeated-measures ANOVA. They are not independent (rows and "
    "columns sum to 0) and come in steps where rates do, so p is a guide, not a size."
)
OUTLIER_RULE = (
    "A score is an outlier if it lies more than 1.5 interquartile ranges of its method below the lower or above the "
    "upper quartile (Tukey 1977). Outliers are named, not removed."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Normality:
    """Shapiro-Wilk's W and p of `n` residuals, skewness and excess kurtosis; None where undefined, for `reason`."""

    W: float | None = None
    p: float | None = None
    n: int
    skewness: float | None = None
    excess_kurtosis: float | None = None
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlier:
    """A score beyond the fences of its condition: `row` of the participant, `column` of the condition."""

    row: int
    column: int
    score: float
    fence: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Ends:
    """How many participants score the least and the most that the scale allows, for each condition."""

    floor: tuple[int, ...]
    ceiling: tuple[int, ...]


def normality(scores: ArrayLike) -> Normality:
    """Are the residuals of the repeated-measures ANOVA normal? `scores`: (n participants, k conditions).

    `ValueError` as in `rm_anova`. Source: Shapiro & Wilk 1965, Biometrika 52, 591; p by Royston 1995, algorithm AS R94.
    """
    rest = residuals(scores).ravel()
    if not rest.any():
        return Normality(n=rest.size, reason=NO_RESIDUALS)
    rest = rest / np.abs(rest).max()
    skewness, kurtosis = float(stats.skew(rest)), float(stats.kurtosis(rest))
    if rest.size > SHAPIRO_UP_TO:
        return Normality(n=rest.size, skewness=skewness, excess_kurtosis=kurtosis, reason=TOO_MANY)
    W, p = stats.shapiro(rest)
    return Normality(W=float(W), p=float(p), n=rest.size, skewness=skewness, excess_kurtosis=kurtosis)


def outliers(scores: ArrayLike, reach: float = 1.5) -> tuple[Outlier, ...]:
    """The scores beyond `reach` interquartile ranges from the quartiles of their condition, conditions in order.

    `scores`: (n participants, k conditions). Quartiles interpolate linearly. A score within 1e-9 interquartile ranges
    of a fence is inside: tenths are no doubles. Source: Tukey 1977, Exploratory Data Analysis, 2D.
    """
    array = numbers(scores, "scores")
    lower, upper = np.quantile(array, [0.25, 0.75], axis=0)
    spread = upper - lower
    slack = 1e-9 * np.maximum(spread, np.abs(array).max(axis=0))
    low, high = lower - reach * spread, upper + reach * spread
    out = (array < low - slack) | (array > high + slack)
    return tuple(
        Outlier(
            row=int(i),
            column=int(j),
            score=float(array[i, j]),
            fence=float(low[j] if array[i, j] < low[j] else high[j]),
        )
        for j, i in np.argwhere(out.T)
    )


def ends(scores: ArrayLike, scale: Sequence[float]) -> Ends:
    """Counts of scores at the two ends of the `scale` (lowest, highest). `scores`: (n participants, k conditions)."""
    array, (lowest, highest) = numbers(scores, "scores"), scale
    return Ends(
        floor=tuple(int(count) for count in (array <= lowest).sum(axis=0)),
        ceiling=tuple(int(count) for count in (array >= highest).sum(axis=0)),
    )
