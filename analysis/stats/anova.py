"""Analysis of variance of one factor, between or within participants, and Tukey's test of its pairs; many at once.

Which error term is used decides the result. `tukey_hsd` is for different people in each group; `rm_tukey_hsd` pools the
repeated-measures error over all conditions (it needs sphericity); `rm_tukey_hsd_paired` gives each pair its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import cast

import numpy as np
import scipy
from numpy.typing import NDArray

from analysis.stats.arrays import FloatArray, Values, float_or_array, in_brief, row_labels, share
from analysis.stats.frames import GroupTable, Label, Result, Results, ScoreTable, named_groups, named_scores
from analysis.stats.studentized_range import studentized_range_isf, studentized_range_sf
from analysis.stats.sums_of_squares import Sums, between_sums, repeated_sums, unscaled

NO_ERROR = "no error variance: the effect is the same in everyone, F is infinite"
F_UNDEFINED = "neither effect nor error beyond the rounding of the data: F is 0/0, undefined"


@dataclass(frozen=True, slots=True, kw_only=True)
class Anova(Result):
    """One-way ANOVA between participants.

    >>> one_way_anova({"old": [1.0, 2.0, 3.0], "young": [6.0, 7.0, 8.0]}).to_frame().columns.tolist()
    ['F', 'df_effect', 'df_error', 'p', 'ss_effect', 'ss_error', 'ms_error', 'partial_eta_squared']

    An error no larger than what rounding decimals to doubles makes is none. No error but an effect: F = inf, p = 0.
    Neither (all values equal): 0/0, F and p are NaN. `reason` says which.
    `ss_effect, ss_error, ms_error` are in the squared unit of the data: of data beyond 1e154 they can be inf, of data
    below 1e-162 they can be 0, while F, p and `partial_eta_squared` = SS_effect / (SS_effect + SS_error) stand.
    """

    F: Values
    df_effect: int
    df_error: int
    p: Values
    ss_effect: Values
    ss_error: Values
    ms_error: Values
    partial_eta_squared: Values

    @property
    def reason(self) -> str | NDArray[np.str_]:
        """Why F is infinite or undefined, empty if it is neither; an array of texts over the leading axes for many."""
        texts = np.select([np.isnan(self.F), np.isinf(self.F)], [F_UNDEFINED, NO_ERROR], default="")
        return str(texts) if texts.ndim == 0 else texts


@dataclass(frozen=True, slots=True, kw_only=True)
class RepeatedMeasuresAnova(Anova):
    """One-way ANOVA within participants; `ss_participants` is the spread of the participants' own means.

    `generalized_eta_squared` = SS_effect / (SS_effect + SS_participants + SS_error).

    >>> found = rm_anova([[1.0, 2.0, 4.0], [2.0, 2.0, 6.0], [3.0, 5.0, 5.0]])
    >>> round(found.partial_eta_squared, 3), round(found.generalized_eta_squared, 3)
    (0.778, 0.583)
    """

    ss_participants: Values
    generalized_eta_squared: Values


def one_way_anova(groups: GroupTable) -> Anova:
    """One-way ANOVA between participants.

    F = [sum n_i (m_i - m)^2 / (k - 1)] / [sum (x - m_i)^2 / (N - k)], p from the upper tail of F(k - 1, N - k).

    `groups`: k >= 2 arrays (..., n_i) whose leading axes broadcast, or a mapping of them; each result has shape (...).
    `ValueError`: fewer than two groups, an empty one, no group with two values, or values that are not finite numbers.
    Source: Fisher 1925, Statistical Methods for Research Workers.

    >>> result = one_way_anova([[1.0, 2.0, 3.0], [2.0, 3.0, 4.0], [6.0, 7.0, 8.0]])
    >>> result.F, result.df_effect, result.df_error
    (21.0, 2, 6)
    """
    return _anova(between_sums(check_groups(groups)))


def rm_anova(scores: ScoreTable) -> RepeatedMeasuresAnova:
    """One-way repeated-measures ANOVA, sphericity assumed (no correction of the degrees of freedom).

    F = [n sum (m_j - m)^2 / (k - 1)] / [sum (x_ij - m_i - m_j + m)^2 / ((n - 1)(k - 1))].

    `scores`: (..., n participants, k conditions), or a DataFrame of so many rows and columns; each result has shape
    (...). `ValueError`: fewer than two participants or conditions, or values that are not finite numbers (a missing
    score is not guessed: leave the participant out).
    Source: Winer 1971, Statistical Principles in Experimental Design, chapter 4.

    >>> result = rm_anova([[1.0, 2.0, 4.0], [2.0, 2.0, 6.0], [3.0, 5.0, 5.0]])
    >>> round(result.F, 9), result.df_effect, result.df_error
    (7.0, 2, 4)
    """
    sums = repeated_sums(check_scores(scores))
    found = _anova(sums)
    return RepeatedMeasuresAnova(
        **{name: getattr(found, name) for name in Anova.__slots__},
        ss_participants=float_or_array(unscaled(sums.participants, 2 * sums.exponent)),
        generalized_eta_squared=_part(sums.effect, sums.participants + sums.error),
    )


def check_scores(scores: ScoreTable) -> FloatArray:
    """`scores` as float64 (..., participants, conditions), at least two of each; else `ValueError` with the reason."""
    return scores_and_names(scores)[0]


def scores_and_names(scores: ScoreTable, labels: Sequence[Label] | None = None) -> tuple[FloatArray, Sequence[Label]]:
    """`scores` as `check_scores` gives them, with the labels of their conditions, or else their names or numbers."""
    array, names = named_scores(scores, "scores")
    if array.ndim < 2:
        raise ValueError(f"scores must have two axes (participants, conditions), not {array.ndim}")
    n, k = array.shape[-2:]
    if n < 2 or k < 2:
        raise ValueError(f"scores must be of at least 2 participants and 2 conditions, not {n} and {k}")
    return array, condition_names(names if labels is None else labels, k)


def one_table(scores: FloatArray) -> FloatArray:
    """Checked scores of one data set; `ValueError` for many of them, which not every statistic takes."""
    if scores.ndim != 2:
        raise ValueError(f"scores must have two axes (participants, conditions), not {scores.ndim}")
    return scores


def check_groups(groups: GroupTable) -> list[FloatArray]:
    """`groups` as float64 arrays, at least two and none empty; else `ValueError` with the reason."""
    return groups_and_names(groups)[0]


def groups_and_names(
    groups: GroupTable, labels: Sequence[Label] | None = None
) -> tuple[list[FloatArray], Sequence[Label]]:
    """`groups` as `check_groups` gives them, with their labels, or else their names or numbers."""
    arrays, own = named_groups(groups, "groups")
    if len(arrays) < 2:
        raise ValueError(f"groups must be at least 2, not {len(arrays)}")
    names = condition_names(own if labels is None else labels, len(arrays))
    for name, array in zip(names, arrays, strict=True):
        if array.ndim < 1 or array.shape[-1] < 1:
            raise ValueError(f"groups[{name!r}] must hold at least one value along its last axis")
    if all(array.shape[-1] == 1 for array in arrays):
        raise ValueError("groups: none has two values, so there is no variance within them to test against")
    return arrays, names


def condition_names(labels: Sequence[Label] | None, k: int) -> Sequence[Label]:
    """The labels of k conditions, numbers without them; `ValueError` unless there are k different ones."""
    if labels is None:
        return range(k)
    names = row_labels(labels, "labels")
    if len(names) != k or len(set(names)) != k:
        raise ValueError(f"labels: {k} different labels are needed, not {in_brief(labels)}")
    return cast("Sequence[Label]", names)


def _anova(sums: Sums) -> Anova:
    """The F test of decomposed data, its sums of squares in the data's own units."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        F = (sums.effect / sums.df_effect) / sums.ms_error
    squares = (unscaled(value, 2 * sums.exponent) for value in (sums.effect, sums.error, sums.ms_error))
    effect, error, ms_error = map(float_or_array, squares)
    return Anova(
        F=float_or_array(F),
        df_effect=sums.df_effect,
        df_error=sums.df_error,
        p=float_or_array(scipy.special.fdtrc(sums.df_effect, sums.df_error, F)),
        ss_effect=effect,
        ss_error=error,
        ms_error=ms_error,
        partial_eta_squared=_part(sums.effect, sums.error),
    )


def _part(effect: FloatArray, rest: FloatArray) -> Values:
    """The effect's part of the whole; NaN where both are 0."""
    with np.errstate(invalid="ignore"):
        return float_or_array(effect / (effect + rest))


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison(Result):
    """One pair: `difference` = mean of `a` - mean of `b`, where `a` is the later condition.

    `q` is |difference| over its standard error on the studentized range's scale, `p` the familywise p-value,
    `ci_low, ci_high` the simultaneous interval of the difference. No error variance: q = inf, p = 0; or NaN if the
    difference is 0 too.

    >>> tukey_hsd({"old": [1.0, 2.0, 3.0], "young": [6.0, 7.0, 8.0]})[0].difference
    5.0
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
    groups: GroupTable, labels: Sequence[Label] | None = None, confidence: float = 0.95
) -> Results[Comparison]:
    """Tukey-Kramer test of groups of different people: q = |m_a - m_b| / sqrt(MS_error / 2 (1/n_a + 1/n_b)), df N - k.

    `groups`: k >= 2 arrays (..., n_i), or a mapping of them, whose keys name the comparisons; `ValueError` as in
    `one_way_anova`. Source: Kramer 1956, Biometrics 12, 307.

    >>> found = tukey_hsd({"old": [1.0, 2.0, 3.0], "young": [6.0, 7.0, 8.0]})
    >>> found[0].a, found[0].b, found[0].difference, round(found[0].p, 4)
    ('young', 'old', 5.0, 0.0036)
    """
    checked, names = groups_and_names(groups, labels)
    return _comparisons(group_pairs(checked), names, confidence)


def rm_tukey_hsd(
    scores: ScoreTable, labels: Sequence[Label] | None = None, confidence: float = 0.95
) -> Results[Comparison]:
    """Tukey test within participants on the pooled error of `rm_anova`: q = |m_a - m_b| / sqrt(MS_error / n).

    `scores`: (..., n participants, k conditions), df (n - 1)(k - 1); the columns of a DataFrame name the comparisons.
    `ValueError` as in `rm_anova`. Assumes sphericity: with very unequal variances of the differences use
    `rm_tukey_hsd_paired`. Source: Winer 1971, chapter 4.

    >>> import pandas as pd
    >>> ratings = pd.DataFrame({"vibration": [1, 2, 3], "asymmetric-1": [2, 2, 5], "asymmetric-2": [4, 6, 5]})
    >>> rm_tukey_hsd(ratings).to_frame()[["a", "b", "difference"]].to_dict("split")["data"]
    [['asymmetric-1', 'vibration', 1.0], ['asymmetric-2', 'vibration', 3.0], ['asymmetric-2', 'asymmetric-1', 2.0]]
    """
    checked, names = scores_and_names(scores, labels)
    return _comparisons(pooled_pairs(checked), names, confidence)


def rm_tukey_hsd_paired(
    scores: ScoreTable, labels: Sequence[Label] | None = None, confidence: float = 0.95
) -> Results[Comparison]:
    """Tukey test within participants, each pair on its own error: q = sqrt(2) |mean d| / (sd(d) / sqrt(n)), df n - 1.

    `d` is a participant's difference between the two conditions. `scores`: as in `rm_tukey_hsd`; `ValueError` as in
    `rm_anova`. Needs no sphericity. Source: Maxwell & Delaney 2004, chapter 11.

    >>> found = rm_tukey_hsd_paired([[1.0, 2.0, 4.0], [2.0, 2.0, 6.0], [3.0, 5.0, 5.0]], labels=["A", "B", "C"])
    >>> [(pair.a, pair.b, round(pair.q, 3)) for pair in found]
    [('B', 'A', 2.449), ('C', 'A', 7.348), ('C', 'B', 2.449)]
    """
    checked, names = scores_and_names(scores, labels)
    return _comparisons(own_pairs(checked), names, confidence)


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


def _comparisons(pairs: PairStatistics, names: Sequence[Label], confidence: float) -> Results[Comparison]:
    critical = float(studentized_range_isf(1.0 - share(confidence, "confidence"), pairs.k, pairs.df))
    p = np.asarray(studentized_range_sf(pairs.q, pairs.k, pairs.df))
    low, high = pairs.difference - critical * pairs.error, pairs.difference + critical * pairs.error
    return Results(
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
