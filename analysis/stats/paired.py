"""All pairs of conditions on their own differences: paired t, Bayes factors, signed ranks; Friedman over all."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from analysis.stats.anova import check_scores, one_table, own_pairs, pairs_of, scores_and_names
from analysis.stats.arrays import FloatArray, by_row, numbers, pingouin, scale_number, share, single, whole
from analysis.stats.corrections import holm
from analysis.stats.frames import Label, Result, Results, ScoreTable

SCALE = math.sqrt(2.0) / 2.0
"""Scale r of the Cauchy prior on the standardised difference: "medium" in JASP and R's BayesFactor."""

LARGEST_T = 100.0
"""Up to here pingouin agrees with forty digits to 1e-6, for 2 to 50 differences."""


def jzs_paired(t: float, n: int, r: float = SCALE) -> float | None:
    """BF10 of a paired t-test of n differences: how much likelier t is under an effect than under none.

    Under H1 the standardised mean difference has a Cauchy(0, r) prior, and the variance Jeffreys's; under H0 it is 0.
    Two-sided; integrated numerically by pingouin. None where BF10 exceeds the largest double (n = 1000, t = 100), and
    for |t| above 100: from t = 1000 on pingouin's integral misses its peak in silence (n = 7: 2e8 for 3e12).
    `ValueError`: fewer than two differences, a t that is not finite, or an r outside 1e-6 to 1e6.
    Source: Rouder, Speckman, Sun, Morey & Iverson 2009, Psychon. Bull. Rev. 16, 225, equation 1.

    >>> round(jzs_paired(3.5, 20), 3)
    17.185
    """
    t, n, r = single(t, "t"), whole(n, "n", 2), scale_number(r, "r")
    if abs(t) > LARGEST_T:
        return None
    try:
        factor = float(pingouin("bayesfactor_ttest")(float(t), n, paired=True, r=r))
    except ZeroDivisionError:  # the likelihood under H0 is below the smallest double
        return None
    return factor if math.isfinite(factor) else None


EQUAL = "The two conditions are equal in every participant: there is nothing to test."
CONSTANT = "The difference is the same in every participant: without variance there is no test."


@dataclass(frozen=True, slots=True, kw_only=True)
class PairedT(Result):
    """One pair: `difference` = mean of `a` - mean of `b`, its own standard error, t on n - 1 degrees of freedom.

    `p_holm` is adjusted for all pairs; the interval is for this pair alone. `d_z` = t / sqrt(n), the mean difference
    over the SD of the differences. Without variance of the differences all but `difference` is None, for `reason`.
    """

    a: Label
    b: Label
    difference: float
    t: float | None = None
    df: int
    p: float | None = None
    p_holm: float | None = None
    ci_low: float | None = None
    ci_high: float | None = None
    d_z: float | None = None
    reason: str | None = None


def paired_t_tests(
    scores: ScoreTable, labels: Sequence[Label] | None = None, confidence: float = 0.95
) -> Results[PairedT]:
    """Paired t-tests of all pairs: t = mean d / (sd(d) / sqrt(n)), Holm's correction over the pairs that have a p.

    `scores`: (n participants, k conditions), or a DataFrame, whose columns name the pairs; `ValueError` as in
    `rm_anova`. Sources: Student 1908, Biometrika 6, 1; Holm 1979, Scand. J. Stat. 6, 65.

    >>> found = paired_t_tests({"A": [1.0, 2.0, 3.0, 4.0], "B": [2.0, 4.0, 4.0, 7.0]})
    >>> found[0].a, found[0].b, round(found[0].t, 3), round(found[0].p, 4)
    ('B', 'A', 3.656, 0.0354)
    """
    array, names = scores_and_names(scores, labels)
    n, k = one_table(array).shape
    pairs = own_pairs(array)
    t = np.sign(pairs.difference) * pairs.q / math.sqrt(2.0)
    p = 2.0 * scipy.special.stdtr(n - 1, -np.abs(t))
    there = np.isfinite(t)
    adjusted = np.full_like(p, np.nan)
    adjusted[there] = holm(p[there])
    tail = (1.0 - share(confidence, "confidence")) / 2.0
    half = -float(scipy.special.stdtrit(n - 1, tail)) * math.sqrt(2.0) * pairs.error  # the error is on the scale of q
    low, high = pairs.difference - half, pairs.difference + half
    rows = by_row(t=t, p=p, p_holm=adjusted, ci_low=low, ci_high=high, d_z=t / math.sqrt(n))
    tests = [row if tested else {} for row, tested in zip(rows, there, strict=True)]
    return Results(
        PairedT(
            a=names[a], b=names[b], difference=d, df=n - 1, reason=None if test else CONSTANT if d else EQUAL, **test
        )
        for (a, b), d, test in zip(pairs_of(k), pairs.difference.tolist(), tests, strict=True)
    )


EXACT_UP_TO = 50
TWO_CONDITIONS = "The Friedman test needs three conditions; with two, read the signed-rank test."
ALL_TIED = "Every participant scores all conditions alike: there are no ranks to compare."
NOTHING_TO_RANK = "The two conditions are equal in every participant: there is nothing to rank."


@dataclass(frozen=True, slots=True, kw_only=True)
class Friedman(Result):
    """Friedman's test with the correction for ties; `kendall_w` is the agreement of the participants, 0 to 1."""

    chi2: float | None = None
    df: int | None = None
    p: float | None = None
    kendall_w: float | None = None
    mean_ranks: tuple[float, ...]
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SignedRanks(Result):
    """One pair: `W` is the smaller sum of ranks over the `n` participants with a difference, `r` the rank-biserial.

    `r` = (sum of ranks in favour of `a` - in favour of `b`) / sum of ranks. `exact`: p from all 2^n signs, not from
    the normal approximation. `p_holm` is adjusted for all pairs.
    """

    a: Label
    b: Label
    n: int
    W: float | None = None
    p: float | None = None
    p_holm: float | None = None
    r: float | None = None
    exact: bool = True
    reason: str | None = None


def friedman(scores: ScoreTable) -> Friedman:
    """Friedman's test: chi2 of the rank sums over participants, corrected for ties, on k - 1 degrees of freedom.

    `scores`: (n participants, k conditions); `ValueError` as in `rm_anova`. Kendall's W = chi2 / (n (k - 1)).
    Source: Friedman 1937, J. Am. Stat. Assoc. 32, 675; Conover 1999, Practical Nonparametric Statistics, 5.8.

    >>> found = friedman([[1, 2, 3], [2, 3, 5], [1, 3, 2], [4, 6, 7]])
    >>> found.chi2, found.df, round(found.p, 4), found.mean_ranks
    (6.5, 2, 0.0388, (1.0, 2.25, 2.75))
    """
    array = one_table(check_scores(scores))
    n, k = array.shape
    ranks = scipy.stats.rankdata(array, axis=1)
    mean_ranks = tuple(float(rank) for rank in ranks.mean(axis=0))
    if k < 3:
        return Friedman(mean_ranks=mean_ranks, reason=TWO_CONDITIONS)
    if (ranks == ranks[:1, :1]).all():
        return Friedman(mean_ranks=mean_ranks, reason=ALL_TIED)
    chi2, p = scipy.stats.friedmanchisquare(*array.T)
    agreement = float(chi2) / (n * (k - 1))
    return Friedman(chi2=float(chi2), df=k - 1, p=float(p), kendall_w=agreement, mean_ranks=mean_ranks)


def signed_rank_tests(scores: ScoreTable, labels: Sequence[Label] | None = None) -> Results[SignedRanks]:
    """Wilcoxon's signed-rank test of all pairs, Holm's correction over the pairs that have a p.

    Differences of 0 are left out, ties get mean ranks. Up to 50 differences p is exact, ties included.
    `scores`: (n participants, k conditions); `ValueError` as in `rm_anova`.
    Source: Wilcoxon 1945, Biometrics Bulletin 1, 80; Holm 1979.

    >>> found = signed_rank_tests({"A": [1, 2, 3, 4, 9], "B": [2, 4, 6, 8, 7]})
    >>> found[0].W, found[0].p, found[0].exact
    (2.5, 0.25, True)
    """
    array, names = scores_and_names(scores, labels)
    one_table(array)
    tests = [_signed_ranks(array[:, a], array[:, b], names[a], names[b]) for a, b in pairs_of(array.shape[1])]
    adjusted = iter(holm([test.p for test in tests if test.p is not None]).tolist())
    return Results(test if test.p is None else replace(test, p_holm=next(adjusted)) for test in tests)


def exact_signed_rank_p(ranks: ArrayLike, statistic: float) -> float:
    """Two-sided p of the smaller rank sum: 2 P(sum of the ranks with a heads <= statistic), every sign a fair coin.

    `ranks`: whole or half (mean ranks of ties). The 2^n sums are counted by convolution, one rank after the other.

    >>> exact_signed_rank_p([1.0, 2.0, 3.0], 0.0)
    0.25
    """
    doubled = np.rint(2.0 * numbers(ranks, "ranks")).astype(np.int64)
    ways = np.zeros(int(doubled.sum()) + 1)
    ways[0] = 1.0
    for rank in doubled:
        ways[rank:] = (ways[rank:] + ways[: ways.size - rank]) / 2.0
        ways[:rank] /= 2.0
    return min(1.0, 2.0 * float(ways[: int(np.rint(2.0 * statistic)) + 1].sum()))


def _signed_ranks(first: FloatArray, second: FloatArray, a: Label, b: Label) -> SignedRanks:
    difference = _tidy(first - second, float(np.abs([first, second]).max()))
    difference = difference[difference != 0.0]
    if not difference.size:
        return SignedRanks(a=a, b=b, n=0, reason=NOTHING_TO_RANK)
    ranks = scipy.stats.rankdata(np.abs(difference))
    favour, total = float(ranks[difference > 0.0].sum()), float(ranks.sum())
    smaller = min(favour, total - favour)
    exact = difference.size <= EXACT_UP_TO
    p = exact_signed_rank_p(ranks, smaller) if exact else _normal_p(difference)
    return SignedRanks(
        a=a, b=b, n=difference.size, W=smaller, p=float(p), r=(2.0 * favour - total) / total, exact=exact
    )


def _normal_p(difference: FloatArray) -> float:
    wilcoxon: Any = scipy.stats.wilcoxon  # its stubs do not know the method's name
    return float(wilcoxon(difference, method="asymptotic").pvalue)


def _tidy(difference: FloatArray, largest: float) -> FloatArray:
    """Differences that are equal but for rounding made equal (0.9 - 0.8 and 0.8 - 0.7), else ties would be broken."""
    return np.round(difference / largest, 12) if largest > 0.0 else difference
