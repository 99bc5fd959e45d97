"""The Bayes factor of the ANOVA, by another way: the marginal likelihood of the whole design matrix, by quadpack."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import integrate, stats

from analysis.stats.anova import F_UNDEFINED, NO_ERROR
from analysis.stats.anova_bayes import one_way_bayes_factor, rm_anova_bayes_factor

SCORES = np.random.default_rng(6).normal(size=(6, 3)) + np.arange(3) * 0.7 + np.arange(6)[:, None] / 3


def log_marginal(y, columns, variances):
    """Log p(y | g) of Rouder et al. (2012), less what all models share: X centred, G the priors' variances."""
    centred, x = y - y.mean(), columns - columns.mean(axis=0)
    inverse = x.T @ x + np.diag(1.0 / variances)
    left = centred @ centred - centred @ x @ np.linalg.solve(inverse, x.T @ centred)
    return -0.5 * (np.log(variances).sum() + np.linalg.slogdet(inverse)[1]) - (y.size - 1) / 2 * math.log(left)


def sum_to_zero(levels):
    return np.linalg.svd(np.eye(levels) - 1.0 / levels)[0][:, :-1]


def prior(log_g, scale):
    return stats.invgamma.pdf(math.exp(log_g), 0.5, scale=scale**2 / 2) * math.exp(log_g)


@pytest.mark.slow
def test_within_people_it_is_the_integral_of_the_whole_model():
    n, k = SCORES.shape
    who, what = (part.ravel() for part in np.indices((n, k)))
    y, people, conditions = SCORES.ravel(), np.eye(n)[who], sum_to_zero(k)[what]
    both, base = np.hstack([conditions, people]), log_marginal(SCORES.ravel(), people, np.ones(n))

    def full(c, s):
        g = np.exp([c] * (k - 1) + [s] * n)
        return math.exp(log_marginal(y, both, g) - base) * prior(c, 0.5) * prior(s, 1.0)

    def none(s):
        return math.exp(log_marginal(y, people, np.full(n, math.exp(s))) - base) * prior(s, 1.0)

    points = np.linspace(-7.0, 11.0, 37)  # smooth, and nothing at the ends: the trapezoids converge fast
    numerator = sum(full(c, s) for c in points for s in points) * (points[1] - points[0])
    expected = numerator / sum(none(s) for s in points)
    assert rm_anova_bayes_factor(SCORES).bf10 == pytest.approx(expected, rel=1e-3)


def test_of_groups_of_any_size_it_is_the_integral_of_the_whole_model():
    groups = [SCORES[:, 0], SCORES[:4, 1], SCORES[1:, 2] + 1.0]
    y = np.concatenate(groups)
    columns = sum_to_zero(3)[np.repeat(range(3), [len(one) for one in groups])]
    base = -(y.size - 1) / 2 * math.log(((y - y.mean()) ** 2).sum())

    def height(log_g):
        return math.exp(log_marginal(y, columns, np.full(2, math.exp(log_g))) - base) * prior(log_g, 0.5)

    expected = integrate.quad(height, -15, 40, limit=500, epsabs=1e-12)[0]
    assert one_way_bayes_factor(groups).bf10 == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize(("scale", "offset"), [(1e-300, 0.0), (1e300, 0.0), (1.0, 1e6)])
def test_it_does_not_depend_on_unit_or_origin(scale, offset):
    found = rm_anova_bayes_factor(SCORES * scale + offset)
    assert found.log_bf10 == pytest.approx(rm_anova_bayes_factor(SCORES).log_bf10, rel=1e-6)
    groups = [*(SCORES.T * scale + offset)]
    assert one_way_bayes_factor(groups).log_bf10 == pytest.approx(one_way_bayes_factor([*SCORES.T]).log_bf10, rel=1e-6)


def test_overwhelming_evidence_has_a_logarithm_where_it_has_no_number():
    scores = np.random.default_rng(7).normal(size=(400, 3)) + np.array([0.0, 20.0, 40.0])
    found = rm_anova_bayes_factor(scores)
    assert found.bf10 == math.inf
    assert 1000 < found.log_bf10 < 5000


def test_many_people_without_an_effect_speak_for_none():
    factors = [rm_anova_bayes_factor(np.random.default_rng(9).normal(size=(n, 3))).bf10 for n in (10, 100, 3000)]
    assert factors == sorted(factors, reverse=True)
    assert factors[-1] < 0.01


def test_without_an_error_there_is_none():
    assert rm_anova_bayes_factor([[1, 2, 3], [2, 3, 4]]).reason == NO_ERROR
    assert rm_anova_bayes_factor([[1, 1, 1], [2, 2, 2]]).reason == F_UNDEFINED
    assert one_way_bayes_factor([[1, 1], [2, 2]]).reason == NO_ERROR


@pytest.mark.parametrize("scale", [0.0, -1.0, math.inf, math.nan])
def test_a_scale_that_is_none_is_refused(scale):
    with pytest.raises(ValueError, match="fixed_scale must be"):
        rm_anova_bayes_factor(SCORES, scale)
