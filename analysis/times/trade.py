"""Speed against accuracy without a fit: accuracy over time, scores that join the two, and EZ-diffusion.

All times must be the participant's own: `ValueError` with the reason if one came by the experimenter's hand.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.stats.arrays import FloatArray, numbers
from analysis.times.first_passage import mean_form, variance_form
from analysis.times.own_trials import Ordered, answers, ordered, own_times
from analysis.times.own_trials import quantiles as own_quantiles

QUANTILES = (0.1, 0.3, 0.5, 0.7, 0.9)
"""The five of Ratcliff & Tuerlinckx 2002."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConditionalAccuracy:
    """One condition's accuracy over time, a value each bin, averaged over the `people` that have enough trials.

    `trials`: behind the value that rests on the fewest, those of all these people together.
    """

    mean_time_s: FloatArray
    accuracy: FloatArray
    people: int
    trials: int
    left_out: int  # people with fewer trials than bins


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class QuantileProbability:
    """One condition's points: each answer's probability and its time quantiles, averaged over people.

    Quantiles are NaN where nobody has enough answers of the kind; `people` says how many had, `answers` how many such
    answers they gave.
    """

    probability: FloatArray  # (2,): errors, correct answers
    quantiles_s: FloatArray  # (2, quantiles)
    people: NDArray[np.intp]  # (2,)
    answers: NDArray[np.intp]  # (2,)


def conditional_accuracy(
    correct: ArrayLike, time_s: ArrayLike, sources: Sequence[str] | ArrayLike, people: ArrayLike, bins: int = 5
) -> ConditionalAccuracy:
    """Conditional accuracy function: each person's trials in order of time, cut into `bins` as even as can be.

    Bin means of time and accuracy are then averaged over people with equal weight (Vincentised), so that fast people
    do not fill the fast bins. Equal times keep their order in the table. A person with fewer trials than bins is left
    out and counted. Caveat: a bin of a rare condition holds one or two trials; only the average over people means much.
    Source: Thomas 1974, Mem. Cognit. 2, 628; Heitz 2014, Front. Neurosci. 8, 150.
    """
    if bins < 1:
        raise ValueError(f"bins is {bins}; it must be at least 1")
    times = own_times(time_s, sources)
    right = answers(correct, "correct", times.size)
    everybody = ordered(people, times)
    enough = everybody.of_at_least(bins)
    cell = enough.person * bins + _bins(enough, bins)
    shape = enough.people, bins
    trials = np.bincount(cell, minlength=enough.people * bins).reshape(shape)
    sums = [np.bincount(cell, weights=v[enough.rows], minlength=trials.size).reshape(shape) for v in (times, right)]
    mean_time_s, accuracy = ((s / trials).mean(axis=0) if enough.people else np.full(bins, np.nan) for s in sums)
    return ConditionalAccuracy(
        mean_time_s=mean_time_s,
        accuracy=accuracy,
        people=enough.people,
        trials=int(trials.sum(axis=0).min()),
        left_out=everybody.people - enough.people,
    )


def _bins(by: Ordered, bins: int) -> NDArray[np.intp]:
    """The bin of each row: of n trials the first n mod bins hold one more."""
    size, more = np.repeat(by.count // bins, by.count), np.repeat(by.count % bins, by.count)
    larger = more * (size + 1)
    return np.asarray(np.where(by.rank < larger, by.rank // (size + 1), more + (by.rank - larger) // size))


def quantile_probability(
    correct: ArrayLike,
    time_s: ArrayLike,
    sources: Sequence[str] | ArrayLike,
    people: ArrayLike,
    *,
    quantiles: Sequence[float] = QUANTILES,
    fewest: int = 5,
) -> QuantileProbability:
    """The points of a quantile-probability plot for one condition, Vincentised over people.

    Each person's time quantiles (linear interpolation) of errors and of correct answers are averaged over those with
    at least `fewest` (assumed: 5, one a quantile) answers of that kind; probabilities over all. Caveat: with few errors
    their points rest on the few people who made them; `people` shows on how many.
    Sources: Ratcliff 1979, Psychol. Bull. 86, 446 (Vincent averages); Ratcliff & McKoon 2008, Neural Comput. 20, 873.
    """
    times = own_times(time_s, sources)
    right = answers(correct, "correct", times.size)
    everybody = ordered(people, times)
    share = float(everybody.means(right).mean()) if everybody.people else np.nan
    points, counts, given = [], [], []
    for kind in (0.0, 1.0):
        enough = everybody.only(right == kind).of_at_least(max(fewest, 1))
        nobody = np.full(len(quantiles), np.nan)
        points.append(own_quantiles(times, enough, quantiles).mean(axis=0) if enough.people else nobody)
        counts.append(enough.people)
        given.append(enough.rows.size)
    return QuantileProbability(
        probability=np.array([1.0 - share, share]),
        quantiles_s=np.array(points),
        people=np.array(counts, dtype=np.intp),
        answers=np.array(given, dtype=np.intp),
    )


def balanced_integration(correct_rate: ArrayLike, mean_correct_s: ArrayLike) -> FloatArray:
    """Balanced integration score BIS = z(correct rate) - z(mean time of correct answers), people by conditions.

    z over all cells together, with the population SD (divided by n). Caveats: it says how a cell stands to the other
    cells of *this* table, so it has mean 0 and cannot be compared between studies; it weighs speed and accuracy alike
    by decree; it cancels a trade-off only about linearly. A column without spread gives z = 0 there.
    `ValueError`: shapes differ, a rate outside 0..1, or a time not above 0.
    Source: Liesefeld & Janczyk 2019, Behav. Res. Methods 51, 40.

    >>> balanced_integration([0.9, 0.7], [0.5, 0.7]).round(6).tolist()
    [2.0, -2.0]
    """
    rates, times = _rates_and_times(correct_rate, mean_correct_s)
    return _standardised(rates) - _standardised(times)


def inverse_efficiency(correct_rate: ArrayLike, mean_correct_s: ArrayLike) -> FloatArray:
    """Inverse efficiency score IES = mean time of correct answers / correct rate, in s; inf at a rate of 0.

    Caveats: not above about 10 % errors (Bruyer & Brysbaert 2011), which the vibration's rate near 50 % breaks by
    design; it grows noise as accuracy falls and does not cancel a trade-off. Report it beside rate and time, never
    alone. `ValueError`: as `balanced_integration`.
    Sources: Townsend & Ashby 1978, in Cognitive Theory 3; Bruyer & Brysbaert 2011, Psychol. Belg. 51, 5.

    >>> inverse_efficiency([0.5, 1.0], [0.6, 0.6]).tolist()
    [1.2, 0.6]
    """
    rates, times = _rates_and_times(correct_rate, mean_correct_s)
    with np.errstate(divide="ignore"):
        return np.asarray(times / rates)


def _rates_and_times(correct_rate: ArrayLike, mean_correct_s: ArrayLike) -> tuple[FloatArray, FloatArray]:
    rates, times = numbers(correct_rate, "correct_rate"), numbers(mean_correct_s, "mean_correct_s")
    if rates.shape != times.shape:
        raise ValueError(f"correct_rate and mean_correct_s must have one shape, not {rates.shape} and {times.shape}")
    if ((rates < 0.0) | (rates > 1.0)).any() or (times <= 0.0).any():
        raise ValueError("correct_rate must be 0 to 1 and mean_correct_s above 0")
    return rates, times


def _standardised(values: FloatArray) -> FloatArray:
    spread = values.std()
    return (values - values.mean()) / spread if spread > 1e-12 * np.abs(values).max() else np.zeros_like(values)


FEWEST = 10
"""Fewer correct answers than this give no variance worth the name (assumed)."""
ROUNDING = 1e-12
"""An SD below this share of the mean is what rounding leaves of equal times."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EZ:
    """The estimates; units 1/sqrt(s), sqrt(s) and s. NaN where there are none, and `reason` says why.

    `corrected`: no error or nothing but errors, so the accuracy was moved by half an answer.
    """

    drift: float = math.nan
    boundary: float = math.nan
    non_decision_s: float = math.nan
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
        reason = f"{int(right.sum())} correct answers; at least {FEWEST} are needed for a variance"
        return EZ(accuracy=float(right.mean()) if right.size else math.nan, reason=reason)
    mean_s, spread = float(times[right].mean()), float(np.var(times[right], ddof=1))
    some = spread > (ROUNDING * mean_s) ** 2
    return ez_from_summary(float(right.mean()), mean_s, spread if some else 0.0, times.size)


def ez_from_summary(accuracy: float, mean_s: float, variance_s2: float, trials: int) -> EZ:
    """EZ-diffusion from the accuracy, and mean and variance of the correct answers' times.

    For an unbiased start V(T) = a^4 (h(L) - h(L/2)/16) and E(T) = a^2 (c(L) - c(L/2)/4) with L = logit(accuracy) = v a
    and c and h of `first_passage`. That is the published v = +-(L (L P^2 - L P + P - 1/2) / V)^(1/4), a = L / v, so
    written that an accuracy of 1/2 (v = 0, a^4 = 24 V) is no special case and needs no edge correction. For 0 and 1 the
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
    if not (variance_s2 > 0.0 and math.isfinite(variance_s2) and math.isfinite(mean_s)):
        reason = f"the correct answers' times have a variance of {variance_s2:g} s2"
        return EZ(accuracy=accuracy, reason=reason)
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
    L = 2.0 * np.arctanh(2.0 * p - 1.0)  # the log odds of p, good near 1/2 too
    boundary = (variance_s2 / (variance_form(L) - variance_form(L / 2.0) / 16.0)) ** 0.25
    non_decision_s = mean_s - boundary**2 * (mean_form(L) - mean_form(L / 2.0) / 4.0)
    return np.array([L / boundary, boundary, non_decision_s, p])
