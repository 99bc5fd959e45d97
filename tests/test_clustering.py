from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from analysis.stats.logit_model import ALL_ANSWERS_EQUAL, ONE_PERSON, ONE_TRIAL, clustering
from tests.made_scores import RIGHT


def test_equal_numbers_of_trials_equal_r() -> None:
    # R 4.2.2: m = anova(lm(y ~ id))$"Mean Sq" of the single answers; (m[1] - m[2]) / (m[1] + 9 * m[2])
    found = clustering(RIGHT[:, 0], np.full(14, 10))
    assert found.icc == pytest.approx(0.0444936086529012)
    assert found.design_effect == pytest.approx(1.40044247787611)
    assert found.p_adjusted == pytest.approx(0.221042497495031)


def test_unequal_numbers_of_trials_equal_r() -> None:
    found = clustering([8, 3, 9, 2, 5, 10], [10, 5, 12, 10, 7, 10])  # the same with m_0 = (M - sum m^2 / M) / 5
    assert found.icc == pytest.approx(0.267404735047389)
    assert found.design_effect == pytest.approx(3.29769994559238)
    assert found.p_adjusted == pytest.approx(0.194216634520462)


def test_the_design_effect_is_the_ratio_of_variances() -> None:
    """Rao & Scott 1992: D = variance of the pooled rate over people / binomial variance, the same for large n."""
    rng = np.random.default_rng(1)
    y = rng.binomial(10, rng.beta(2.0, 1.0, 20_000))
    p = y.mean() / 10
    ratio = (10 * np.square(y / 10 - p).sum() / 19_999) / (p * (1 - p))
    assert clustering(y, np.full(20_000, 10)).design_effect == pytest.approx(ratio, rel=1e-3)
    assert clustering(y, np.full(20_000, 10)).icc == pytest.approx(1 / 4, abs=0.01)  # beta(a, b): 1 / (a + b + 1)


def test_people_all_right_or_all_wrong_count_once_each() -> None:
    found = clustering([10] * 12 + [0] * 4, [10] * 16)
    assert found.icc == pytest.approx(1.0)
    assert found.design_effect == pytest.approx(10.0)
    z = 0.25 / np.sqrt(0.25 / 16)
    assert found.p_adjusted == pytest.approx(2 * stats.t.sf(z, 15))


def test_people_more_alike_than_chance_do_not_make_the_test_sharper_than_independence() -> None:
    found = clustering([6] * 14, [10] * 14)
    assert found.icc == pytest.approx(-1 / 9)  # the least that ten trials allow
    assert found.design_effect == pytest.approx(0.0, abs=1e-12)
    assert found.p_adjusted == pytest.approx(2 * stats.t.sf(0.1 / np.sqrt(0.25 / 140), 13))


@pytest.mark.parametrize(
    ("successes", "trials", "reason"),
    [
        ([], [], ONE_PERSON),
        ([5], [10], ONE_PERSON),
        ([5, 0], [10, 0], ONE_PERSON),
        ([1, 0], [1, 1], ONE_TRIAL),
        ([10, 10], [10, 10], ALL_ANSWERS_EQUAL),
        ([0, 0], [10, 10], ALL_ANSWERS_EQUAL),
    ],
)
def test_what_cannot_be_told_has_a_reason(successes: list[int], trials: list[int], reason: str) -> None:
    found = clustering(successes, trials)
    assert (found.icc, found.design_effect, found.p_adjusted, found.reason) == (None, None, None, reason)


@pytest.mark.parametrize(("successes", "trials"), [([11, 3], [10, 10]), ([-1, 3], [10, 10]), ([1, 2, 3], [10, 10])])
def test_impossible_counts_are_refused(successes: list[int], trials: list[int]) -> None:
    with pytest.raises(ValueError, match=r"successes must lie in 0\.\.trials"):
        clustering(successes, trials)
