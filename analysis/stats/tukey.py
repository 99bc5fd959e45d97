"""Tukey's honestly significant difference: all pairs of means, one familywise error rate.

Which error term is used decides the result. `tukey_hsd` is for different people in each group; `rm_tukey_hsd` pools the
repeated-measures error over all conditions (it needs sphericity); `rm_tukey_hsd_paired` gives each pair its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from analysis.stats.anova import check_groups, check_scores
from analysis.stats.arrays import FloatArray, Values, float_or_array, share
from analysis.stats.studentized_range import studentized_range_isf, studentized_range_sf
from analysis.stats.sums_of_squares import Sums, between_sums, repeated_sums, unscaled

Label = str | int


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """One pair: `difference` = mean of `a` - mean of `b`, where `a` is the later condition.

    `q` is |difference| over its standard error on the studentized range's scale, `p` the familywise p-value,
    `ci_low, ci_high` the simultaneous interval of the difference. No error variance: q = inf, p = 0; or NaN if the
    difference is 0 too.
    """

    a: Label
    b: Label
    difference: Values
    q: Values
    p: Values
    ci_low: Values
    ci_high: Values


@dataclass(frozen=True, slots=True, kw_only=True)
class PairStatistics:
    """All pairs before any p-value: `difference, error, q` are (..., pairs), in the order of `pairs_of(k)`."""

    difference: FloatArray
    error: FloatArray
    q: FloatArray
    k: int
    df: int


def pairs_of(k: int) -> list[tuple[int, int]]:
    """The pairs (a, b) of k conditions, a the later one.

    >>> pairs_of(3)
    [(1, 0), (2, 0), (2, 1)]
    """
    return sorted((a, b) for b, a in combinations(range(k), 2))


def tukey_hsd(
    groups: Sequence[ArrayLike], labels: Sequence[Label] | None = None, confidence: float = 0.95
) -> tuple[Comparison, ...]:
    """Tukey-Kramer test of groups of different people: q = |m_a - m_b| / sqrt(MS_error / 2 (1/n_a + 1/n_b)), df N - k.

    `groups`: k >= 2 arrays (..., n_i); `ValueError` as in `one_way_anova`. Source: Kramer 1956, Biometrics 12, 307.
    """
    return _comparisons(group_pairs(check_groups(groups)), labels, confidence)


def rm_tukey_hsd(
    scores: ArrayLike, labels: Sequence[Label] | None = None, confidence: float = 0.95
) -> tuple[Comparison, ...]:
    """Tukey test within participants on the pooled error of `rm_anova`: q = |m_a - m_b| / sqrt(MS_error / n).

    `scores`: (..., n participants, k conditions), df (n - 1)(k - 1); `ValueError` as in `rm_anova`.
    Assumes sphericity: with very unequal variances of the differences use `rm_tukey_hsd_paired`.
    Source: Winer 1971, chapter 4.
    """
    return _comparisons(pooled_pairs(check_scores(scores)), labels, confidence)


def rm_tukey_hsd_paired(
    scores: ArrayLike, labels: Sequence[Label] | None = None, confidence: float = 0.95
) -> tuple[Comparison, ...]:
    """Tukey test within participants, each pair on its own error: q = sqrt(2) |mean d| / (sd(d) / sqrt(n)), df n - 1.

    `d` is a participant's difference between the two conditions. `scores`: (..., n participants, k conditions);
    `ValueError` as in `rm_anova`. Needs no sphericity. Source: Maxwell & Delaney 2004, chapter 11.
    """
    return _comparisons(own_pairs(check_scores(scores)), labels, confidence)


def group_pairs(groups: list[FloatArray]) -> PairStatistics:
    """Differences and q of `tukey_hsd` for checked groups, without p-values."""
    return _statistics(between_sums(groups))


def pooled_pairs(scores: FloatArray) -> PairStatistics:
    """Differences and q of `rm_tukey_hsd` for checked scores, without p-values: what a simulation needs."""
    return _statistics(repeated_sums(scores))


def own_pairs(scores: FloatArray) -> PairStatistics:
    """Differences and q of `rm_tukey_hsd_paired` for checked scores, without p-values."""
    n, k = scores.shape[-2:]
    pairs = [pooled_pairs(scores[..., [b, a]]) for a, b in pairs_of(k)]
    difference, error, q = (
        np.concatenate([getattr(pair, name) for pair in pairs], axis=-1) for name in ("difference", "error", "q")
    )
    return PairStatistics(difference=difference, error=error, q=q, k=k, df=n - 1)


def _statistics(sums: Sums) -> PairStatistics:
    """All pairs on the pooled error; q is taken before the scale is put back: at 1e-200 the squares would be gone."""
    k = len(sums.counts)
    a, b = np.array(pairs_of(k), dtype=np.intp).T
    difference = sums.differences(a, b)
    error = np.sqrt(sums.ms_error[..., None] * (1.0 / sums.counts[a] + 1.0 / sums.counts[b]) / 2.0)
    no_difference = (error == 0.0) & (np.square(difference) <= sums.noise[..., None])
    difference = np.where(no_difference, 0.0, difference)
    with np.errstate(divide="ignore", invalid="ignore"):
        q = np.abs(difference) / error
    scale = sums.exponent[..., None]
    return PairStatistics(
        difference=unscaled(difference, scale), error=unscaled(error, scale), q=q, k=k, df=sums.df_error
    )


def _comparisons(pairs: PairStatistics, labels: Sequence[Label] | None, confidence: float) -> tuple[Comparison, ...]:
    names = _names(labels, pairs.k)
    critical = float(studentized_range_isf(1.0 - share(confidence, "confidence"), pairs.k, pairs.df))
    p = np.asarray(studentized_range_sf(pairs.q, pairs.k, pairs.df))
    low, high = pairs.difference - critical * pairs.error, pairs.difference + critical * pairs.error
    return tuple(
        Comparison(
            a=names[a],
            b=names[b],
            difference=float_or_array(pairs.difference[..., i]),
            q=float_or_array(pairs.q[..., i]),
            p=float_or_array(p[..., i]),
            ci_low=float_or_array(low[..., i]),
            ci_high=float_or_array(high[..., i]),
        )
        for i, (a, b) in enumerate(pairs_of(pairs.k))
    )


def _names(labels: Sequence[Label] | None, k: int) -> Sequence[Label]:
    if labels is None:
        return range(k)
    if len(labels) != k or len(set(labels)) != k:
        raise ValueError(f"{k} different labels are needed, not {list(labels)}")
    return labels
