"""How large an effect within participants is, and intervals of means without what people differ by."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import special
from scipy.optimize import brentq

from analysis.stats.anova import RepeatedMeasuresAnova
from analysis.stats.arrays import FloatArray, numbers, share

NO_ERROR_VARIANCE = (
    "There is no error variance: the partial eta squared is 1 or undefined, and no interval can be given."
)
LARGEST_F = 1e8
TOO_LARGE = "F is above 1e8: the interval of the partial eta squared cannot be told from 1."
EFFECT_SIZE_NOTE = (
    "The intervals are those of the partial eta squared, from the noncentral F distribution (Steiger 2004); the 90 % "
    "interval leaves out 0 exactly if the F test has p < .05. The generalised eta squared has none: its denominator "
    "also holds the variance between participants, and the ratio follows no known noncentral distribution."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectSize:
    """Eta squared, partial (its intervals too) and generalised; None where undefined, and `reason` says why."""

    partial_eta_squared: float | None
    ci_90: tuple[float, float] | None
    ci_95: tuple[float, float] | None
    generalized_eta_squared: float | None
    reason: str | None = None


def effect_size(anova: RepeatedMeasuresAnova) -> EffectSize:
    """Effect sizes of one repeated-measures ANOVA.

    Partial: SS_effect / (SS_effect + SS_error). Generalised: SS_effect / (SS_effect + SS_participants + SS_error).
    Sources: Olejnik & Algina 2003, Psychol. Methods 8, 434; Bakeman 2005, Behav. Res. Methods 37, 379.
    """
    effect, error, people = (float(ss) for ss in (anova.ss_effect, anova.ss_error, anova.ss_participants))
    partial, generalized = _ratio(effect, error), _ratio(effect, people + error)
    F = float(anova.F)
    reason = TOO_LARGE if math.isfinite(F) and F > LARGEST_F else None if math.isfinite(F) else NO_ERROR_VARIANCE
    ci_90, ci_95 = (
        None if reason else partial_eta_squared_interval(F, anova.df_effect, anova.df_error, level)
        for level in (0.90, 0.95)
    )
    return EffectSize(
        partial_eta_squared=partial, ci_90=ci_90, ci_95=ci_95, generalized_eta_squared=generalized, reason=reason
    )


def partial_eta_squared_interval(F: float, df_effect: int, df_error: int, confidence: float) -> tuple[float, float]:
    """Interval of the partial eta squared: lambda / (lambda + df_effect + df_error + 1).

    The noncentralities lambda are those that put the observed F at the upper and at the lower tail; 0 where there is
    none. Scipy's noncentral F serves up to F = 1e8. Within participants the same conversion is customary, though exact
    only between participants.
    Source: Steiger 2004, Psychol. Methods 9, 164.
    """
    tail = (1.0 - share(confidence, "confidence")) / 2.0
    low, high = (_noncentrality(F, df_effect, df_error, p) for p in (1.0 - tail, tail))
    total = df_effect + df_error + 1
    return low / (low + total), high / (high + total)


def _noncentrality(F: float, df_effect: int, df_error: int, p: float) -> float:
    """The lambda at which P(F' <= F) = p; 0 where even the central F lies below p."""

    def excess(noncentrality: float) -> float:
        return float(special.ncfdtr(df_effect, df_error, noncentrality, F)) - p

    return float(brentq(excess, 0.0, _above(excess, F * df_effect), xtol=1e-10)) if excess(0.0) > 0.0 else 0.0


def _above(excess: Callable[[float], float], start: float) -> float:
    """A noncentrality that is surely too large."""
    high = start + 10.0
    while excess(high) > 0.0:
        high *= 2.0
    return high


def _ratio(effect: float, rest: float) -> float | None:
    return effect / (effect + rest) if effect + rest > 0.0 else None


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
