"""Speed against accuracy without a model: how accuracy changes with time, and scores that join the two.

All times must be the participant's own: `ValueError` with the reason if one came by the experimenter's hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.stats.arrays import FloatArray, numbers
from analysis.times.own_trials import Ordered, answers, ordered, own_times
from analysis.times.own_trials import quantiles as own_quantiles

QUANTILES = (0.1, 0.3, 0.5, 0.7, 0.9)
"""The five of Ratcliff & Tuerlinckx 2002."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConditionalAccuracy:
    """One condition's accuracy over time, a value each bin, averaged over the `people` that have enough trials."""

    mean_time_s: FloatArray
    accuracy: FloatArray
    people: int
    left_out: int  # people with fewer trials than bins


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class QuantileProbability:
    """One condition's points: each answer's probability and its time quantiles, averaged over people.

    Quantiles are NaN where nobody has enough answers of the kind; `people` says how many had.
    """

    probability: FloatArray  # (2,): errors, correct answers
    quantiles_s: FloatArray  # (2, quantiles)
    people: NDArray[np.intp]  # (2,)


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
    points, counts = [], []
    for kind in (0.0, 1.0):
        enough = everybody.only(right == kind).of_at_least(max(fewest, 1))
        nobody = np.full(len(quantiles), np.nan)
        points.append(own_quantiles(times, enough, quantiles).mean(axis=0) if enough.people else nobody)
        counts.append(enough.people)
    return QuantileProbability(
        probability=np.array([1.0 - share, share]), quantiles_s=np.array(points), people=np.array(counts, dtype=np.intp)
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
