"""Analysis of variance of one factor, between or within participants, and Tukey's test of its pairs; many at once.

Which error term is used decides the result. `tukey_hsd` is for different people in each group; `rm_tukey_hsd` pools the
repeated-measures error over all conditions (it needs sphericity); `rm_tukey_hsd_paired` gives each pair its own.

The tail of the studentized range has full accuracy however small it is: 1e-12 relative for k = 2..20, df >= 2, p down
to 1e-300, and its logarithm beyond (scipy's is 1 - cdf, with no digit left below 1e-12). k need not be a whole number.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from analysis.stats.arrays import FloatArray, Values, float_or_array, numbers, share
from analysis.stats.studentized_tail import log_tails
from analysis.stats.sums_of_squares import Sums, between_sums, repeated_sums, unscaled

NO_ERROR = "no error variance: the effect is the same in everyone, F is infinite"
F_UNDEFINED = "neither effect nor error beyond the rounding of the data: F is 0/0, undefined"


@dataclass(frozen=True, slots=True, kw_only=True)
class Anova:
    """One-way ANOVA between participants.

    An error no larger than what rounding decimals to doubles makes is none. No error but an effect: F = inf, p = 0.
    Neither (all values equal): 0/0, F and p are NaN. `reason` says which.
    `ss_effect, ss_error, ms_error` are in the squared unit of the data: of data beyond 1e154 they can be inf, of data
    below 1e-162 they can be 0, while F and p stand.
    """

    F: Values
    df_effect: int
    df_error: int
    p: Values
    ss_effect: Values
    ss_error: Values
    ms_error: Values

    @property
    def reason(self) -> str | NDArray[np.str_]:
        """Why F is infinite or undefined, empty if it is neither; an array of texts over the leading axes for many."""
        texts = np.select([np.isnan(self.F), np.isinf(self.F)], [F_UNDEFINED, NO_ERROR], default="")
        return str(texts) if texts.ndim == 0 else texts


@dataclass(frozen=True, slots=True, kw_only=True)
class RepeatedMeasuresAnova(Anova):
    """One-way ANOVA within participants; `ss_participants` is the spread of the participants' own means."""

    ss_participants: Values


def one_way_anova(groups: Sequence[ArrayLike]) -> Anova:
    """One-way ANOVA between participants.

    F = [sum n_i (m_i - m)^2 / (k - 1)] / [sum (x - m_i)^2 / (N - k)], p from the upper tail of F(k - 1, N - k).

    `groups`: k >= 2 arrays (..., n_i) whose leading axes broadcast; each result has shape (...).
    `ValueError`: fewer than two groups, an empty one, no group with two values, or values that are not finite numbers.
    Source: Fisher 1925, Statistical Methods for Research Workers.

    >>> result = one_way_anova([[1.0, 2.0, 3.0], [2.0, 3.0, 4.0], [6.0, 7.0, 8.0]])
    >>> result.F, result.df_effect, result.df_error
    (21.0, 2, 6)
    """
    return _anova(between_sums(check_groups(groups)))


def rm_anova(scores: ArrayLike) -> RepeatedMeasuresAnova:
    """One-way repeated-measures ANOVA, sphericity assumed (no correction of the degrees of freedom).

    F = [n sum (m_j - m)^2 / (k - 1)] / [sum (x_ij - m_i - m_j + m)^2 / ((n - 1)(k - 1))].

    `scores`: (..., n participants, k conditions); each result has shape (...).
    `ValueError`: fewer than two participants or conditions, or values that are not finite numbers (a missing score is
    not guessed: leave the participant out).
    Source: Winer 1971, Statistical Principles in Experimental Design, chapter 4.

    >>> result = rm_anova([[1.0, 2.0, 4.0], [2.0, 2.0, 6.0], [3.0, 5.0, 5.0]])
    >>> round(result.F, 9), result.df_effect, result.df_error
    (7.0, 2, 4)
    """
    sums = repeated_sums(check_scores(scores))
    found = _anova(sums)
    people = float_or_array(unscaled(sums.participants, 2 * sums.exponent))
    return RepeatedMeasuresAnova(**{name: getattr(found, name) for name in Anova.__slots__}, ss_participants=people)


def check_scores(scores: ArrayLike) -> FloatArray:
    """`scores` as float64 (..., participants, conditions), at least two of each; else `ValueError` with the reason."""
    array = numbers(scores, "scores")
    if array.ndim < 2:
        raise ValueError(f"scores must have two axes (participants, conditions), not {array.ndim}")
    n, k = array.shape[-2:]
    if n < 2 or k < 2:
        raise ValueError(f"at least 2 participants and 2 conditions are needed, not {n} and {k}")
    return array


def check_groups(groups: Sequence[ArrayLike]) -> list[FloatArray]:
    """`groups` as float64 arrays, at least two and none empty; else `ValueError` with the reason."""
    arrays = [numbers(group, f"group {i}") for i, group in enumerate(groups)]
    if len(arrays) < 2:
        raise ValueError(f"at least 2 groups are needed, not {len(arrays)}")
    for i, array in enumerate(arrays):
        if array.ndim < 1 or array.shape[-1] < 1:
            raise ValueError(f"group {i} must hold at least one value along its last axis")
    if all(array.shape[-1] == 1 for array in arrays):
        raise ValueError("no group has two values: there is no variance within groups to test against")
    return arrays


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
        p=float_or_array(special.fdtrc(sums.df_effect, sums.df_error, F)),
        ss_effect=effect,
        ss_error=error,
        ms_error=ms_error,
    )


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


LOWEST_X = -45.0
"""exp(-45) is a range that is smaller with a probability below 1e-19, for every k and df."""
STEPS = 120
"""Halving alone would end in so many steps; six to fifteen are usual."""


def studentized_range_sf(q: ArrayLike, k: ArrayLike, df: ArrayLike) -> Values:
    """P(Q > q) for k means (k >= 2) and df > 0 error degrees of freedom, df = inf included; the arguments broadcast.

    E R(q sqrt(chi2_df / df)), R(w) = k ∫ φ(z) [Φ(z)^(k-1) - (Φ(z) - Φ(z-w))^(k-1)] dz.
    1 for q <= 0, 0 for q = inf, NaN for q = NaN. `ValueError` for k or df out of range.
    Source: Lund & Lund 1983, AS 190, for the distribution; `analysis.stats.studentized_tail` for the way.

    >>> round(studentized_range_sf(3.514, 3, 26), 3)
    0.05
    """
    return float_or_array(np.exp(_logsf(*_checked(q, k, df))))


def studentized_range_logsf(q: ArrayLike, k: ArrayLike, df: ArrayLike) -> Values:
    """Natural logarithm of P(Q > q), also where that is no double any more; -inf for q = inf.

    >>> round(studentized_range_logsf(1e9, 3, 26), 3)
    -488.21
    """
    return float_or_array(_logsf(*_checked(q, k, df)))


def studentized_range_isf(p: ArrayLike, k: ArrayLike, df: ArrayLike) -> Values:
    """The q with P(Q > q) = p, the critical value of Tukey's test at level p; the arguments broadcast.

    inf for p = 0, 0 for p = 1. `ValueError` for p outside 0..1, or k or df out of range.

    >>> round(studentized_range_isf(0.05, 3, 26), 3)
    3.514
    """
    p, k, df = _checked(p, k, df)
    if ((p < 0.0) | (p > 1.0)).any():
        raise ValueError(f"p must lie in 0..1, not {p[(p < 0.0) | (p > 1.0)][0]}")
    q = np.select([p == 0.0, p == 1.0], [np.inf, 0.0], default=np.nan)
    inside = (p > 0.0) & (p < 1.0)
    q[inside] = _quantile(p[inside], k[inside], df[inside])
    return float_or_array(q)


def _checked(x: ArrayLike, k: ArrayLike, df: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    first, means, freedom = (np.asarray(value, dtype=np.float64) for value in (x, k, df))
    if not ((means >= 2.0) & (means < np.inf)).all():
        wrong = means[~((means >= 2.0) & (means < np.inf))][0]
        raise ValueError(f"k, the number of means, must be at least 2 and finite, not {wrong}")
    if not (freedom > 0.0).all():
        raise ValueError(f"df must be above 0, not {freedom[~(freedom > 0.0)][0]}")
    first, means, freedom = np.broadcast_arrays(first, means, freedom)
    return first, means, freedom


def _logsf(q: FloatArray, k: FloatArray, df: FloatArray) -> FloatArray:
    result = np.select([q <= 0.0, q == np.inf], [0.0, -np.inf], default=np.nan)
    inside = (q > 0.0) & (q < np.inf)
    result[inside] = log_tails(q[inside], k[inside], df[inside])[0]
    return result


def _quantile(p: FloatArray, k: FloatArray, df: FloatArray) -> FloatArray:
    """The q (n,) of p (n,): the root of log odds, over x with (1 + q²/2df)^(-df/2) = exp(-v²) and v(x) below.

    By v the tail is all but a normal one, whatever df. It is at most k(k-1)/2 exp(-v²) (a bound over all pairs), which
    ends the search on the right. Below df = 1 the q of a tiny p may be no double: inf.
    """
    wanted = np.log(p) - np.log1p(-p)

    def surplus(x: FloatArray) -> FloatArray:
        upper, lower = log_tails(np.minimum(_q_of(x, df), np.finfo(np.float64).max), k, df)
        difference: FloatArray = upper - lower - wanted
        return difference

    highest = np.sqrt(np.log(k * (k - 1.0) / 2.0) - np.log(p))
    return _q_of(_root(surplus, np.full(p.shape, LOWEST_X), highest), df)


def _q_of(x: FloatArray, df: FloatArray) -> FloatArray:
    """The q at x, with v = exp(x) for x < 0, 1 + x above: small q by their logarithm, large ones to the last digit."""
    v: FloatArray = np.where(x < 0.0, np.exp(np.minimum(x, 0.0)), 1.0 + x)
    with np.errstate(over="ignore", invalid="ignore"):
        squared = 2.0 * df * np.expm1(2.0 * np.square(v) / df)
    q: FloatArray = np.where(np.isinf(df), 2.0 * v, np.sqrt(squared))
    return q


def _root(function: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray) -> FloatArray:
    """The zeros (n,) of a falling function between `low` and `high`, to the last digit; `high` where it stays above 0.

    Inverse quadratic interpolation where three points allow it, else halving. Source: Chandrupatla 1997, Advances in
    Engineering Software 28, 145.
    """
    a, b, share = high, low, np.full(low.shape, 0.5)
    f_a, f_b = function(a), function(b)
    outside = f_a > 0.0
    for _ in range(STEPS):
        new = a + share * (b - a)
        f_new = function(new)
        same = np.sign(f_new) == np.sign(f_a)
        c, f_c = np.where(same, a, b), np.where(same, f_a, f_b)
        b, f_b = np.where(same, b, a), np.where(same, f_b, f_a)
        a, f_a = new, f_new
        best = np.where(np.abs(f_a) < np.abs(f_b), a, b)
        least = 2.0 * np.spacing(np.abs(best)) / np.maximum(np.abs(b - a), np.finfo(np.float64).tiny)
        done = (least > 0.5) | (f_a == 0.0)
        if done.all():
            break
        share = np.where(done, 0.0, np.clip(_interpolated((a, b, c), (f_a, f_b, f_c)), least, 1.0 - least))
    return np.where(outside, high, best)


Three = tuple[FloatArray, FloatArray, FloatArray]


def _interpolated(places: Three, heights: Three) -> FloatArray:
    """Where from the first place (0) to the second (1) to look: by the inverse parabola if it is monotone, else 0.5."""
    (a, b, c), (f_a, f_b, f_c) = places, heights
    with np.errstate(divide="ignore", invalid="ignore"):
        place, height = (a - b) / (c - b), (f_a - f_b) / (f_c - f_b)
        trusted = (np.square(height) < place) & (np.square(1.0 - height) < 1.0 - place)
        first = f_a / (f_b - f_a) * f_c / (f_b - f_c)
        second = (c - a) / (b - a) * f_a / (f_c - f_a) * f_b / (f_c - f_b)
    return np.where(trusted, first + second, 0.5)
