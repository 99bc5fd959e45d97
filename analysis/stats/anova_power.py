"""Power of an analysis of variance from an assumed effect size, by the noncentral F distribution.

`recoil power` simulates instead: it knows floors, ceilings and people who differ. This is the textbook's number, for
means that are normal, and what reviewers compare with. Arguments broadcast, so that the smallest study is the first
whose power is enough.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike

from analysis.stats.arrays import FloatArray, Values, float_or_array, in_brief, numbers

LARGEST_EFFECT, MOST_PARTICIPANTS, MOST_CONDITIONS = 1e6, 1e9, 1e6
MOST_NONCENTRALITY = 1e15
"""Beyond it power is 1 in all digits that the noncentral F has, and beyond 1e20 scipy has none."""


def cohens_f(eta_squared: ArrayLike) -> Values:
    """Cohen's f = sqrt(eta^2 / (1 - eta^2)), of the eta squared of the population. `ValueError` outside 0 <= eta^2 < 1.

    Between people f is the SD of the groups' means over the SD within groups. A partial eta squared within people has
    the differences between people taken out already: use its f with `correlation` 0 in `rm_anova_power`.
    Source: Cohen 1988, Statistical Power Analysis for the Behavioral Sciences, 8.2.

    >>> round(cohens_f(0.14), 4)
    0.4035
    """
    array = numbers(eta_squared, "eta_squared")
    if ((array < 0.0) | (array >= 1.0)).any():
        raise ValueError(f"eta_squared must lie in 0 to 1, which it does not reach, not {in_brief(eta_squared)}")
    return float_or_array(np.sqrt(array / (1.0 - array)))


def one_way_anova_power(f: ArrayLike, sizes: ArrayLike, alpha: ArrayLike = 0.05) -> Values:
    """Power of `one_way_anova` with groups of `sizes`: P(F' > F_alpha), noncentrality f^2 N, on k - 1 and N - k df.

    `sizes`: (..., k groups), each at least 1; `f` and `alpha` broadcast with (...). f weighs the groups by their sizes.
    `ValueError`: f below 0, fewer than two groups, no group of two, or `alpha` outside 0 to 1.
    Source: Cohen 1988, chapter 8.

    >>> round(one_way_anova_power(0.25, [45, 45, 45]), 3)  # Cohen's medium effect
    0.732
    """
    groups = _within(sizes, "sizes", 0.0, MOST_PARTICIPANTS)
    if groups.ndim < 1 or groups.shape[-1] < 2 or (groups < 1.0).any() or (groups.max(axis=-1) < 2.0).any():
        raise ValueError("sizes must be of at least two groups, each at least 1 and one of them at least 2")
    total, k = groups.sum(axis=-1), groups.shape[-1]
    return _power(_within(f, "f", 0.0, LARGEST_EFFECT) ** 2 * total, np.asarray(k - 1.0), total - k, alpha)


def rm_anova_power(
    f: ArrayLike,
    participants: ArrayLike,
    conditions: ArrayLike,
    *,
    correlation: ArrayLike = 0.5,
    epsilon: ArrayLike = 1.0,
    alpha: ArrayLike = 0.05,
) -> Values:
    """Power of `rm_anova`: noncentrality f^2 n k e / (1 - rho), on (k - 1) e and (n - 1)(k - 1) e degrees of freedom.

    `f`: SD of the conditions' means over the SD between people in one condition; `correlation` rho: of the scores of
    two conditions; `epsilon` e: departure from sphericity, 1 / (k - 1) to 1, under which power is an approximation
    (`box_epsilon` of an assumed covariance). All broadcast.
    `ValueError`: f below 0, fewer than two people or conditions, rho outside -1 / (k - 1) to 1, e or alpha out of
    range.
    Sources: Muller & Barton 1989, J. Am. Stat. Assoc. 84, 549; Faul, Erdfelder, Lang & Buchner 2007, Behav. Res.
    Methods 39, 175, whose G*Power has this as "ANOVA: repeated measures, within factors".

    >>> n = np.arange(2, 100)
    >>> int(n[(rm_anova_power(0.25, n, 3) >= 0.8).argmax()])  # as G*Power
    28
    """
    n, k = (
        _within(participants, "participants", 2.0, MOST_PARTICIPANTS),
        _within(conditions, "conditions", 2.0, MOST_CONDITIONS),
    )
    rho, e = numbers(correlation, "correlation"), numbers(epsilon, "epsilon")
    if ((rho <= -1.0 / (k - 1.0)) | (rho >= 1.0)).any():
        raise ValueError("correlation must lie between -1 / (conditions - 1) and 1")
    if ((e < (1.0 - 1e-12) / (k - 1.0)) | (e > 1.0)).any():
        raise ValueError("epsilon must lie in 1 / (conditions - 1) to 1")
    noncentrality = _within(f, "f", 0.0, LARGEST_EFFECT) ** 2 * n * k * e / (1.0 - rho)
    return _power(noncentrality, (k - 1.0) * e, (n - 1.0) * (k - 1.0) * e, alpha)


def _within(values: ArrayLike, name: str, low: float, high: float) -> FloatArray:
    array = numbers(values, name)
    if ((array < low) | (array > high)).any():
        raise ValueError(f"{name} must be at least {low:g} and at most {high:,.0f}, not {in_brief(values)}")
    return array


def _power(noncentrality: FloatArray, df_effect: FloatArray, df_error: FloatArray, alpha: ArrayLike) -> Values:
    """P(F' > F_alpha); without an effect the level itself."""
    level = numbers(alpha, "alpha")
    if ((level <= 0.0) | (level >= 1.0)).any():
        raise ValueError(f"alpha must lie between 0 and 1, not {in_brief(alpha)}")
    critical = scipy.special.fdtri(df_effect, df_error, 1.0 - level)
    power = 1.0 - scipy.special.ncfdtr(df_effect, df_error, np.minimum(noncentrality, MOST_NONCENTRALITY), critical)
    return float_or_array(np.where(noncentrality > 0.0, power, level))
