"""EZ-diffusion: drift, boundary and non-decision time from three numbers, in closed form."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from analysis.stats.arrays import FloatArray
from analysis.times.first_passage import mean_form, variance_form
from analysis.times.own_trials import answers, ordered, own_times

FEWEST = 10
"""Fewer correct answers than this give no variance worth the name (assumed)."""
ROUNDING = 1e-12
"""An SD below this share of the mean is what rounding leaves of equal times."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EZ:
    """The estimates; units 1/sqrt(s), sqrt(s) and s. NaN where there are none, and `reason` says why.

    `corrected`: no error or nothing but errors, so the accuracy was moved by half an answer.
    """

    drift: float
    boundary: float
    non_decision_s: float
    accuracy: float
    corrected: bool = False
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EZPeople:
    """Estimates of many people, one axis, in the codes' sorted order; NaN where there are none or they are refused.

    Why: `few` correct answers, `flat` times without a variance, `impossible` a non-decision time below 0.
    """

    drift: FloatArray
    boundary: FloatArray
    non_decision_s: FloatArray
    corrected: NDArray[np.bool_]
    few: NDArray[np.bool_]
    flat: NDArray[np.bool_]
    impossible: NDArray[np.bool_]


def ez(correct: ArrayLike, time_s: ArrayLike, sources: Sequence[str] | ArrayLike) -> EZ:
    """EZ-diffusion of one person and condition, from single trials: 0 or 1, response time, `response_source`.

    Mean and variance are those of the correct answers' times, as the source has it. `ValueError`: times that are not
    the participant's own, or not above 0.
    """
    times = own_times(time_s, sources)
    right = answers(correct, "correct", times.size) == 1.0
    if right.sum() < FEWEST:
        nan = math.nan
        reason = f"{int(right.sum())} correct answers; at least {FEWEST} are needed for a variance"
        accuracy = float(right.mean()) if right.size else nan
        return EZ(drift=nan, boundary=nan, non_decision_s=nan, accuracy=accuracy, reason=reason)
    mean_s, spread = float(times[right].mean()), float(np.var(times[right], ddof=1))
    some = spread > (ROUNDING * mean_s) ** 2
    return ez_from_summary(float(right.mean()), mean_s, spread if some else 0.0, times.size)


def ez_from_summary(accuracy: float, mean_s: float, variance_s2: float, trials: int) -> EZ:
    """EZ-diffusion from the accuracy, and mean and variance of the correct answers' times.

    For an unbiased start V(T) = a^4 (h(L) - h(L/2)/16) and E(T) = a^2 (c(L) - c(L/2)/4) with L = logit(accuracy) = v a
    and the forms of `moments`. That is the published v = +-(L (L P^2 - L P + P - 1/2) / V)^(1/4), a = L / v, so written
    that an accuracy of 1/2 (v = 0, a^4 = 24 V) is no special case and needs no edge correction. For 0 and 1 the
    published one is used: half an answer, 1/(2 n).

    Caveats: no starting bias (for 2AFC that means: forward and backward shots together, never apart), no lapses, no
    variability between trials. Refused (`reason`): a variance that is not above 0; a non-decision time below 0, which
    says that the model does not hold. `ValueError`: an accuracy outside 0..1 or no trials.
    Source: Wagenmakers, van der Maas & Grasman 2007, Psychon. Bull. Rev. 14, 3.

    >>> found = ez_from_summary(0.802, 0.723, 0.112, 1000)
    >>> round(found.drift * 0.1, 4), round(found.boundary * 0.1, 4), round(found.non_decision_s, 3)
    (0.0999, 0.14, 0.3)
    """
    if not 0.0 <= accuracy <= 1.0 or trials < 1:
        raise ValueError(f"accuracy must be 0 to 1 and trials at least 1, not {accuracy} and {trials}")
    nan = math.nan
    if not (variance_s2 > 0.0 and math.isfinite(variance_s2) and math.isfinite(mean_s)):
        reason = f"the correct answers' times have a variance of {variance_s2:g} s2"
        return EZ(drift=nan, boundary=nan, non_decision_s=nan, accuracy=accuracy, reason=reason)
    given = np.array([[accuracy], [mean_s], [variance_s2], [trials]], dtype=np.float64)
    drift, boundary, non_decision_s, p = _solved(*given)[:, 0].tolist()
    return EZ(
        drift=drift,
        boundary=boundary,
        non_decision_s=non_decision_s,
        accuracy=p,
        corrected=accuracy in (0.0, 1.0),
        reason=None if non_decision_s >= 0.0 else "the non-decision time is below 0: the model does not hold here",
    )


def ez_people(
    correct: ArrayLike, time_s: ArrayLike, sources: Sequence[str] | ArrayLike, people: ArrayLike, fewest: int = FEWEST
) -> EZPeople:
    """EZ-diffusion of each person in one condition, as `ez`, at once; who has not `fewest` correct answers has none.

    Where people answer near chance a high `fewest` keeps those who guessed luckily, and so lifts the mean drift.
    `ValueError`: as `ez`, not one code a row, or `fewest` below 2.
    """
    if fewest < 2:
        raise ValueError(f"fewest is {fewest}; a variance needs at least 2")
    times = own_times(time_s, sources)
    right = answers(correct, "correct", times.size)
    everybody = ordered(people, times)
    accuracy = everybody.means(right)
    few = np.rint(accuracy * everybody.count) < fewest
    mine = everybody.of(~few).only(right == 1.0)
    mean_s, variance_s2 = np.full((2, everybody.people), np.nan)
    mean_s[~few] = mine.means(times)
    deviation = np.zeros_like(times)
    deviation[mine.rows] = times[mine.rows] - mean_s[~few][mine.person]
    variance_s2[~few] = mine.means(deviation**2) * mine.count / (mine.count - 1)
    flat = ~few & ~(variance_s2 > (ROUNDING * mean_s) ** 2)
    solved = np.full((4, everybody.people), np.nan)
    some = ~few & ~flat
    solved[:, some] = _solved(accuracy[some], mean_s[some], variance_s2[some], everybody.count[some].astype(np.float64))
    impossible = solved[2] < 0.0
    solved[:, impossible] = np.nan
    return EZPeople(
        drift=solved[0],
        boundary=solved[1],
        non_decision_s=solved[2],
        corrected=some & ~impossible & ((accuracy == 0.0) | (accuracy == 1.0)),
        few=few,
        flat=flat,
        impossible=impossible,
    )


def _solved(accuracy: FloatArray, mean_s: FloatArray, variance_s2: FloatArray, trials: FloatArray) -> FloatArray:
    """Drift, boundary, non-decision time and the accuracy used (4, cells), of variances above 0."""
    p = np.where((accuracy == 0.0) | (accuracy == 1.0), np.abs(accuracy - 0.5 / trials), accuracy)
    L = special.logit(p)
    boundary = (variance_s2 / (variance_form(L) - variance_form(L / 2.0) / 16.0)) ** 0.25
    non_decision_s = mean_s - boundary**2 * (mean_form(L) - mean_form(L / 2.0) / 4.0)
    return np.array([L / boundary, boundary, non_decision_s, p])
