from __future__ import annotations

import math

import numpy as np
import pytest

from analysis.stats.anova import one_way_anova, rm_anova
from analysis.stats.diagnostics import NO_ERROR_VARIANCE, TOO_LARGE, effect_size, partial_eta_squared_interval
from tests.made_scores import RIGHT


def test_both_eta_squared_equal_r() -> None:
    # R 4.2.2, afex 1.2.1: anova(a, es = "pes")$pes, anova(a, es = "ges")$ges
    found = effect_size(rm_anova(RIGHT))
    assert found.partial_eta_squared == pytest.approx(0.737484737484737, rel=1e-12)
    assert found.generalized_eta_squared == pytest.approx(0.639745796372302, rel=1e-12)


@pytest.mark.parametrize(
    ("F", "confidence", "low", "high"),
    [
        (36.5209302325581, 0.90, 0.543080524719177, 0.806322092558181),
        (36.5209302325581, 0.95, 0.501201286445648, 0.820017140883463),
        (28.45, 0.90, 0.465857827122395, 0.768545098631640),
        (1.5, 0.90, 0.0, 0.260201985927376),
        (0.01, 0.95, 0.0, 0.0),
    ],
)
def test_the_interval_equals_r(F: float, confidence: float, low: float, high: float) -> None:
    # R 4.2.2: l = uniroot(function(l) pf(F, 2, 26, ncp = l) - p, c(0, 1e4), tol = 1e-12)$root; l / (l + 29)
    assert partial_eta_squared_interval(F, 2, 26, confidence) == pytest.approx((low, high), abs=2e-7)


def test_the_90_percent_interval_leaves_out_zero_where_p_is_below_5_percent() -> None:
    at = 3.369016359495364  # R 4.2.2: qf(.95, 2, 26)
    assert partial_eta_squared_interval(at * 0.9999, 2, 26, 0.90)[0] == 0.0
    assert partial_eta_squared_interval(at * 1.0001, 2, 26, 0.90)[0] > 0.0


def test_thousands_of_participants_have_a_narrow_interval_around_the_estimate() -> None:
    low, high = partial_eta_squared_interval(5000.0, 2, 19_998, 0.95)
    estimate = 2 * 5000.0 / (2 * 5000.0 + 19_998)
    assert low < estimate < high
    assert high - low < 0.03


def test_a_gigantic_effect_has_no_interval_but_a_reason() -> None:
    found = effect_size(rm_anova(RIGHT * 1e-6 + [0.0, 1.0, 2.0]))
    assert (found.ci_90, found.ci_95, found.reason) == (None, None, TOO_LARGE)
    assert found.partial_eta_squared == pytest.approx(1.0)


@pytest.mark.parametrize("scores", [np.ones((4, 3)), [[1.0, 2.0, 3.0], [2.0, 3.0, 4.0]]])
def test_without_error_variance_there_is_no_interval_but_a_reason(scores: object) -> None:
    found = effect_size(rm_anova(scores))  # type: ignore[arg-type]
    assert (found.ci_90, found.ci_95, found.reason) == (None, None, NO_ERROR_VARIANCE)
    assert found.partial_eta_squared in (None, 1.0)


def test_two_conditions_give_the_eta_squared_of_t() -> None:
    difference = (RIGHT[:, 1] - RIGHT[:, 0]).astype(np.float64)
    t = difference.mean() / difference.std(ddof=1) * math.sqrt(14)
    assert effect_size(rm_anova(RIGHT[:, :2])).partial_eta_squared == pytest.approx(t**2 / (t**2 + 13))


@pytest.mark.parametrize("scale", [5e-324, 1e-300, 1e-160, 1e160, 1e300])
def test_effect_sizes_and_their_intervals_are_those_of_the_data_at_every_scale(scale: float) -> None:
    found, ours = effect_size(rm_anova(RIGHT * scale)), effect_size(rm_anova(RIGHT))
    assert found.reason is None
    assert found.partial_eta_squared == pytest.approx(ours.partial_eta_squared, rel=1e-13)
    assert found.generalized_eta_squared == pytest.approx(ours.generalized_eta_squared, rel=1e-13)
    assert found.ci_90 == pytest.approx(ours.ci_90, rel=1e-9)


def test_effect_sizes_keep_their_digits_far_from_zero() -> None:
    scores = 1e14 + 0.5 * RIGHT
    assert effect_size(rm_anova(scores)) == effect_size(rm_anova(0.5 * RIGHT))


def test_the_anovas_of_many_data_sets_have_an_effect_size_each() -> None:
    many = np.stack([RIGHT, RIGHT**2, np.ones_like(RIGHT)])
    found = rm_anova(many)
    assert found.partial_eta_squared[:2] == pytest.approx([0.737484737484737, rm_anova(RIGHT**2).partial_eta_squared])
    assert np.isnan(found.partial_eta_squared[2])
    with pytest.raises(ValueError, match=r"anova must be that of one data set, not of an array \(3,\)"):
        effect_size(found)


def test_eta_squared_between_groups_is_r2_of_the_group_means() -> None:
    # R 4.2.2: summary(lm(y ~ g))$r.squared of y = 1 2 3 2 3 4 6 7 8 is 0.875
    assert one_way_anova([[1, 2, 3], [2, 3, 4], [6, 7, 8]]).partial_eta_squared == pytest.approx(0.875)
