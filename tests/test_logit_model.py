from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from statsmodels.genmod.cov_struct import Independence
from statsmodels.genmod.families import Binomial
from statsmodels.genmod.generalized_estimating_equations import GEE

from analysis.stats.logit_model import NO_SPREAD, TOO_FEW_WAYS, logit_model
from analysis.stats.paired import holm
from tests.made_scores import RIGHT

TEN = np.full_like(RIGHT, 10)
LABELS = ("v", "a", "b")


def _statsmodels(successes: Any, trials: Any) -> Any:
    """The GEE on the single answers, by statsmodels 0.15."""
    answers = [
        (person, condition, int(trial < successes[person, condition]))
        for person, condition in np.ndindex(*successes.shape)
        for trial in range(trials[person, condition])
    ]
    person, condition, right = np.array(answers).T
    design = np.column_stack([np.ones(len(right)), condition == 1, condition == 2]).astype(float)
    model = GEE(right, design, groups=person, family=Binomial(), cov_struct=Independence())
    return model.fit(cov_type="bias_reduced")


@pytest.mark.parametrize("unequal", [False, True])
def test_contrasts_equal_the_gee_of_statsmodels(unequal: bool) -> None:
    trials = TEN + np.arange(14)[:, None] % 3 * [1, 0, 2] if unequal else TEN
    fit, found = _statsmodels(RIGHT, trials), logit_model(RIGHT, trials, LABELS)
    for i, contrast in enumerate(found.contrasts[:2], start=1):
        assert (contrast.log_odds_difference, contrast.se) == pytest.approx((fit.params[i], fit.bse[i]), rel=1e-8)
    assert found.conditions[0].se == pytest.approx(fit.bse[0], rel=1e-8)


def test_the_overall_test_is_hotellings_form_of_the_wald_test() -> None:
    fit, found = _statsmodels(RIGHT, TEN), logit_model(RIGHT, TEN, LABELS)
    wald = float(np.squeeze(fit.wald_test(np.eye(3)[1:], scalar=True).statistic))
    assert found.test is not None
    assert found.test.df == (2, 12)
    assert pytest.approx(wald * 12 / (13 * 2), rel=1e-7) == found.test.F
    assert found.test.p == pytest.approx(stats.f.sf(found.test.F, 2, 12))


def test_log_odds_are_those_of_a_logistic_regression_in_r() -> None:
    # R 4.2.2: coef(glm(cbind(y, 10 - y) ~ 0 + method, family = binomial))
    found = logit_model(RIGHT, TEN, LABELS)
    expected = (0.25857398829371, 1.52605630349505, 3.29583686600253)
    assert [one.log_odds for one in found.conditions] == pytest.approx(expected, rel=1e-10)
    assert [one.rate for one in found.conditions] == pytest.approx((RIGHT.mean(axis=0) / 10).tolist())


def test_a_contrast_is_a_t_test_on_n_minus_1_with_holm_and_an_odds_ratio() -> None:
    found = logit_model(RIGHT, TEN, LABELS)
    first = found.contrasts[0]
    assert (first.a, first.b, first.df) == ("a", "v", 13)
    assert first.p == pytest.approx(2 * stats.t.sf(abs(first.log_odds_difference / first.se), 13))
    assert [c.p_holm for c in found.contrasts] == pytest.approx(holm([c.p for c in found.contrasts]).tolist())
    half = stats.t.isf(0.025, 13) * first.se
    assert math.log(first.odds_ratio) == pytest.approx(first.log_odds_difference)
    assert math.log(first.ci_high) == pytest.approx(first.log_odds_difference + half)


@pytest.mark.slow
def test_its_size_holds_for_fourteen_people_who_differ() -> None:
    """No effect, people spread by 0.7 logits: t rejects in 5 % of the studies (3 s.e. of 1000 above: 7.1 %)."""
    rng, rejected = np.random.default_rng(5), 0
    for _ in range(1000):
        logits = 1.0 + rng.normal(0.0, 0.7, (14, 1)) + rng.normal(0.0, 0.3, (14, 2))
        y = rng.binomial(10, 1.0 / (1.0 + np.exp(-logits)))
        rejected += logit_model(y, np.full_like(y, 10), ("a", "b")).contrasts[0].p < 0.05
    assert 0.02 < rejected / 1000 < 0.071


@pytest.mark.parametrize(("value", "word"), [(10, "right"), (0, "wrong")])
def test_separation_gives_no_number_but_a_reason(value: int, word: str) -> None:
    successes = RIGHT.copy()
    successes[:, 2] = value
    found = logit_model(successes, TEN, LABELS)
    assert (found.conditions, found.contrasts, found.test) == ((), (), None)
    assert f"b (every answer {word})" in str(found.reason)


def test_conditions_near_the_ceiling_are_named() -> None:
    successes = RIGHT.copy()
    successes[:, 2] = [9] + [10] * 13
    assert logit_model(successes, TEN, LABELS).few == ("b",)
    assert logit_model(RIGHT, TEN, LABELS).few == ()  # exactly five wrong in the last


def test_people_without_spread_give_a_reason() -> None:
    assert logit_model(np.tile([5, 7, 9], (6, 1)), np.full((6, 3), 10), LABELS).reason == NO_SPREAD
    assert "fewer than two participants" in str(logit_model(RIGHT[:1], TEN[:1], LABELS).reason)


@pytest.mark.parametrize("people", [4, 6, 13])
@pytest.mark.parametrize("others", [[10, 10, 10], [9, 9, 9]])
def test_one_person_alone_is_no_spread_to_test_against(others: list[int], people: int) -> None:
    found = logit_model([[6, 5, 3], *[others] * (people - 1)], np.full((people, 3), 10), LABELS)
    assert (found.reason, len(found.contrasts), found.test) == (TOO_FEW_WAYS, 0, None)


@given(st.integers(0, 2**32 - 1))
def test_a_joint_test_is_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    people, off = int(rng.integers(3, 15)), int(rng.integers(1, 4))
    right = np.full((people, int(rng.integers(2, 5))), 10)
    right[:off] = rng.integers(2, 10, right[:off].shape)
    test = logit_model(right, np.full_like(right, 10)).test
    assert test is None or (0 <= test.F < 1e6 and 0 <= test.p <= 1)


def test_two_people_have_contrasts_but_no_overall_test_of_three() -> None:
    found = logit_model([[5, 7, 8], [6, 9, 7]], np.full((2, 3), 10), LABELS)
    assert found.test is None
    assert [contrast.df for contrast in found.contrasts] == [1, 1, 1]


@pytest.mark.parametrize(
    ("successes", "trials", "match"),
    [
        ([[11, 2]], [[10, 10]], "every cell"),
        ([[1, 2]], [[10, 0]], "every cell"),
        ([[1], [2]], [[3], [3]], "at least 2 conditions"),
    ],
)
def test_impossible_counts_are_refused(successes: Any, trials: Any, match: str) -> None:
    with pytest.raises(ValueError, match=match):
        logit_model(successes, trials, LABELS[: np.shape(successes)[1]])
