"""Power by the noncentral F: Poisson-weighted in many digits, G*Power's sizes, identities, what is refused."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from scipy import special

from analysis.stats.anova_power import cohens_f, one_way_anova_power, rm_anova_power


@pytest.mark.parametrize(("k", "n", "f"), [(3, 2, 0.4), (2, 2, 0.4), (5, 20, 0.1), (3, 45, 0.25)])
def test_power_is_the_sum_of_central_tails_weighted_by_poisson(k, n, f):
    df1, df2 = k - 1, k * n - k
    critical = float(special.fdtri(df1, df2, 0.95))
    x, half = mpmath.mpf(df1 * critical) / (df1 * critical + df2), mpmath.mpf(f**2 * k * n) / 2
    total = sum(
        mpmath.exp(-half)
        * half**j
        / mpmath.factorial(j)
        * (1 - mpmath.betainc(df1 / 2 + j, df2 / 2, 0, x, regularized=True))
        for j in range(60)
    )
    assert one_way_anova_power(f, [n] * k) == pytest.approx(float(total), rel=1e-10)


@pytest.mark.parametrize(("k", "expected"), [(2, 34), (3, 28), (4, 24)])
def test_the_sizes_are_those_of_gpower(k, expected):
    # G*Power 3.1, repeated measures, within factors: f = 0.25, power .80, correlation .5, one group
    n = np.arange(2, 60)
    assert n[(rm_anova_power(0.25, n, k) >= 0.8).argmax()] == expected


def test_a_partial_eta_squared_has_the_people_taken_out_already():
    f, rho = 0.3, 0.6
    partial = f**2 / (f**2 + 1.0 - rho)
    assert rm_anova_power(cohens_f(partial), 14, 3, correlation=0.0) == pytest.approx(
        rm_anova_power(f, 14, 3, correlation=rho), rel=1e-12
    )


def test_no_effect_has_the_power_of_the_level():
    assert one_way_anova_power(0.0, [5, 9], 0.01) == 0.01
    assert rm_anova_power(0.0, 14, 3) == 0.05


def test_numbers_broadcast_and_power_grows_with_each():
    power = rm_anova_power([[0.1], [0.2], [0.4]], [8, 14, 30], 3)
    assert power.shape == (3, 3)
    assert (np.diff(power, axis=0) > 0).all()
    assert (np.diff(power, axis=1) > 0).all()
    assert isinstance(rm_anova_power(0.2, 14, 3), float)
    assert rm_anova_power(0.3, 14, 3, epsilon=0.6) < rm_anova_power(0.3, 14, 3)


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: cohens_f(1.0), "eta_squared must lie in 0 to 1"),
        (lambda: cohens_f(math.nan), "eta_squared must be finite"),
        (lambda: one_way_anova_power(-0.1, [5, 5]), "f must be at least 0"),
        (lambda: one_way_anova_power(0.1, [5]), "at least two groups"),
        (lambda: one_way_anova_power(0.1, [1, 1]), "one of them at least 2"),
        (lambda: one_way_anova_power(0.1, [5, 5], 0.0), "alpha must lie between 0 and 1"),
        (lambda: rm_anova_power(0.1, 1, 3), "participants must be at least 2"),
        (lambda: rm_anova_power(0.1, 9, 1), "conditions must be at least 2"),
        (lambda: rm_anova_power(0.1, 9, 3, correlation=1.0), "correlation must lie between"),
        (lambda: rm_anova_power(0.1, 9, 3, epsilon=0.4), "epsilon must lie in"),
    ],
)
def test_what_is_no_study_is_refused(ask, said):
    with pytest.raises(ValueError, match=said):
        ask()
