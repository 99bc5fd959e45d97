"""Evidence for and against a difference within participants: Bayes factors of the paired t-test."""

from __future__ import annotations

import math

from analysis.stats.libraries import pingouin

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
