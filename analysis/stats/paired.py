"""All pairs of conditions, each on its own differences: the paired t-tests, and Bayes factors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from analysis.stats.anova import check_scores
from analysis.stats.arrays import FloatArray, numbers, pingouin, share
from analysis.stats.tukey import Label, own_pairs, pairs_of

SCALE = math.sqrt(2.0) / 2.0
"""Scale r of the Cauchy prior on the standardised difference: "medium" in JASP and R's BayesFactor."""

LARGEST_T = 100.0
"""Up to here pingouin agrees with forty digits to 1e-6, for 2 to 50 differences."""


def jzs_paired(t: float, n: int, r: float = SCALE) -> float | None:
    """BF10 of a paired t-test of n differences: how much likelier t is under an effect than under none.

    Under H1 the standardised mean difference has a Cauchy(0, r) prior, and the variance Jeffreys's; under H0 it is 0.
    Two-sided; integrated numerically by pingouin. None where BF10 exceeds the largest double (n = 1000, t = 100), and
    for |t| above 100: from t = 1000 on pingouin's integral misses its peak in silence (n = 7: 2e8 for 3e12).
    `ValueError`: fewer than two differences, or a t that is not finite.
    Source: Rouder, Speckman, Sun, Morey & Iverson 2009, Psychon. Bull. Rev. 16, 225, equation 1.

    >>> round(jzs_paired(3.5, 20), 3)
    17.185
    """
    if n < 2 or not math.isfinite(t):
        raise ValueError(f"at least 2 differences and a finite t are needed, not {n} and {t}")
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
class PairedT:
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
    scores: ArrayLike, labels: Sequence[Label] | None = None, confidence: float = 0.95
) -> tuple[PairedT, ...]:
    """Paired t-tests of all pairs: t = mean d / (sd(d) / sqrt(n)), Holm's correction over the pairs that have a p.

    `scores`: (n participants, k conditions); `ValueError` as in `rm_anova`.
    Sources: Student 1908, Biometrika 6, 1; Holm 1979, Scand. J. Stat. 6, 65.
    """
    array = check_scores(scores)
    n, k = array.shape
    pairs = own_pairs(array)
    names = range(k) if labels is None else labels
    t = np.sign(pairs.difference) * pairs.q / math.sqrt(2.0)
    p = 2.0 * special.stdtr(n - 1, -np.abs(t))
    there = np.isfinite(t)
    adjusted = np.full_like(p, np.nan)
    adjusted[there] = holm(p[there])
    tail = (1.0 - share(confidence, "confidence")) / 2.0
    half = -float(special.stdtrit(n - 1, tail)) * math.sqrt(2.0) * pairs.error  # the error is on the scale of q
    return tuple(
        PairedT(
            a=names[a],
            b=names[b],
            difference=float(pairs.difference[i]),
            t=float(t[i]),
            df=n - 1,
            p=float(p[i]),
            p_holm=float(adjusted[i]),
            ci_low=float(pairs.difference[i] - half[i]),
            ci_high=float(pairs.difference[i] + half[i]),
            d_z=float(t[i]) / math.sqrt(n),
        )
        if there[i]
        else _untested(names[a], names[b], float(pairs.difference[i]), n - 1)
        for i, (a, b) in enumerate(pairs_of(k))
    )


def holm(p: ArrayLike) -> FloatArray:
    """P-values adjusted for their number m: the running maximum of (m - i) p_(i), i = 0.. in rising order, at most 1.

    Source: Holm 1979, Scand. J. Stat. 6, 65.

    >>> holm([0.01, 0.04, 0.03]).tolist()
    [0.03, 0.06, 0.06]
    """
    array = numbers(p, "p").ravel()
    order = np.argsort(array, kind="stable")
    steps = np.maximum.accumulate((array.size - np.arange(array.size)) * array[order])
    adjusted = np.empty_like(array)
    adjusted[order] = np.minimum(steps, 1.0)
    return adjusted


def _untested(a: Label, b: Label, difference: float, df: int) -> PairedT:
    return PairedT(a=a, b=b, difference=difference, df=df, reason=CONSTANT if difference else EQUAL)
