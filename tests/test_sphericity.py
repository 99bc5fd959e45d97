from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from analysis.stats.anova import rm_anova
from analysis.stats.diagnostics import NO_COVARIANCES, SINGULAR, TOO_FEW, TRIVIAL, Corrected, residuals, sphericity
from tests.made_scores import RIGHT


def _corrected(found: Corrected | None) -> Corrected:
    assert found is not None
    return found


def test_everything_equals_r() -> None:
    # R 4.2.2, afex 1.2.1: summary(aov_ez("id", "y", d, within = "m")) gives sphericity.tests and pval.adjustments
    found = sphericity(RIGHT)
    assert pytest.approx(0.542433747971877, rel=1e-12) == found.W
    assert found.p == pytest.approx(0.025473006720305, rel=1e-10)
    gg, hf = _corrected(found.greenhouse_geisser), _corrected(found.huynh_feldt)
    assert (gg.epsilon, gg.p) == pytest.approx((0.686075160294467, 2.70347375228747e-06), rel=1e-10)
    assert (hf.epsilon, hf.p) == pytest.approx((0.740038139584754, 1.22959104433388e-06), rel=1e-10)
    assert gg.df == pytest.approx((2 * gg.epsilon, 26 * gg.epsilon))
    assert found.reason is None


@pytest.mark.parametrize("offset", [1e3, 1e6, 1e9])
def test_an_offset_changes_nothing(offset: float) -> None:
    found = sphericity(RIGHT + offset)
    assert pytest.approx(0.542433747971877, rel=1e-10) == found.W
    assert _corrected(found.greenhouse_geisser).epsilon == pytest.approx(0.686075160294467, rel=1e-10)


@pytest.mark.parametrize("power", [-900, -500, 500, 900])
def test_a_scale_changes_nothing(power: int) -> None:
    found = sphericity(np.ldexp(RIGHT.astype(np.float64), power))
    assert pytest.approx(0.542433747971877, rel=1e-10) == found.W


@pytest.mark.slow
def test_epsilon_keeps_its_bounds() -> None:
    rng = np.random.default_rng(1)
    for n, k in ((4, 3), (6, 4), (14, 5), (5, 5)):
        for _ in range(20):
            found = sphericity(rng.normal(size=(n, k)) * rng.uniform(0.01, 10.0, k))
            gg, hf = _corrected(found.greenhouse_geisser).epsilon, _corrected(found.huynh_feldt).epsilon
            assert 1.0 / (k - 1) <= gg <= hf <= 1.0


def test_two_conditions_are_spherical_and_uncorrected() -> None:
    found = sphericity(RIGHT[:, :2])
    anova = rm_anova(RIGHT[:, :2])
    assert found.W is None
    assert found.reason == TRIVIAL
    assert _corrected(found.greenhouse_geisser) == Corrected(epsilon=1.0, df=(1.0, 13.0), p=float(anova.p))


def test_fewer_participants_than_conditions_have_a_reason_for_what_is_missing() -> None:
    found = sphericity(RIGHT[:2])
    assert (found.W, found.chi2, found.p, found.huynh_feldt) == (None, None, None, None)
    assert found.reason == TOO_FEW
    assert _corrected(found.greenhouse_geisser).epsilon == pytest.approx(0.5)  # one residual direction: the bound


def test_a_contrast_without_variance_has_no_chi_square() -> None:
    scores = RIGHT.copy()
    scores[:, 2] = scores[:, 1] + 1
    found = sphericity(scores)
    assert (found.W, found.chi2, found.p, found.reason) == (0.0, None, None, SINGULAR)
    assert _corrected(found.greenhouse_geisser).epsilon == pytest.approx(0.5)


@pytest.mark.parametrize(
    "scores", [np.ones((5, 3)), np.full((5, 3), 0.1), np.add.outer([0.1, 0.7, 0.3], [0.1, 0.2, 0.3])]
)
def test_no_variance_is_no_result_but_a_reason(scores: Any) -> None:
    found = sphericity(scores)
    assert (found.W, found.greenhouse_geisser, found.huynh_feldt, found.reason) == (None, None, None, NO_COVARIANCES)


def test_residuals_sum_to_zero_both_ways() -> None:
    rest = residuals(RIGHT)
    assert np.abs(rest.sum(axis=0)).max() < 1e-15
    assert np.abs(rest.sum(axis=1)).max() < 1e-15
    assert np.square(rest * 16.0).sum() == pytest.approx(rm_anova(RIGHT).ss_error)  # 10 lies below 2**4
