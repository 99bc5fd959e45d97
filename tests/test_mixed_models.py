"""Models of single trials beyond what R is asked: the likelihood by another way, separation, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate, special, stats
from statsmodels.discrete.discrete_model import Logit
from statsmodels.tools import add_constant

from analysis.stats.anova import pooled_pairs, rm_anova
from analysis.stats.fixed_effects import indicators
from analysis.stats.logit_model import ONE_PERSON, ONE_TRIAL
from analysis.stats.mixed_model import NO_SPREAD_LEFT, linear_mixed_model
from analysis.stats.random_intercept import ALL_ALIKE, NOT_FOUND, RUNS_AWAY, random_intercept_logit

DRAW = np.random.default_rng(8)
PEOPLE, EACH = 12, 8
WHO = np.repeat(np.arange(PEOPLE), EACH)
FORCE = np.tile([0.0, 1.0], PEOPLE * EACH // 2)


def drawn(person_sd, effect=1.0):
    eta = person_sd * DRAW.normal(size=PEOPLE)[WHO] + effect * FORCE
    return (DRAW.random(WHO.size) < special.expit(eta)).astype(int)


@pytest.mark.slow
def test_the_likelihood_is_its_integral_by_quadpack():
    right = drawn(1.0)
    found = random_intercept_logit(right, WHO, {"force": FORCE})
    intercept, effect = (one.estimate for one in found.coefficients)

    def person(code):
        own, signs = FORCE[code == WHO], 2 * right[code == WHO] - 1

        def height(u):
            return np.prod(special.expit(signs * (intercept + effect * own + found.person_sd * u))) * stats.norm.pdf(u)

        return np.log(integrate.quad(height, -10, 10, epsabs=1e-14)[0])

    assert found.log_likelihood == pytest.approx(sum(person(code) for code in range(PEOPLE)), rel=1e-9)


def test_no_other_coefficients_are_likelier():
    right = drawn(0.8)
    best = random_intercept_logit(right, WHO, {"force": FORCE}, nodes=25)
    fewer = random_intercept_logit(right, WHO, {"force": FORCE}, nodes=15)
    assert fewer.person_sd == pytest.approx(best.person_sd, rel=1e-4)
    assert fewer.log_likelihood == pytest.approx(best.log_likelihood, rel=1e-7)


def test_people_who_do_not_differ_leave_the_plain_logistic_regression():
    right = np.array([1, 0, 1, 1, 0, 0, 1, 0] * PEOPLE)
    found = random_intercept_logit(right, WHO, {"force": FORCE})
    plain = Logit(right, add_constant(FORCE)).fit(disp=False)
    assert found.person_sd == 0.0
    assert [one.estimate for one in found.coefficients] == pytest.approx(plain.params.tolist(), abs=1e-7)
    assert [one.se for one in found.coefficients] == pytest.approx(plain.bse.tolist(), rel=1e-6)


def test_a_predictor_in_another_unit_has_its_coefficient_in_that_unit():
    right, pulse = drawn(1.0), FORCE * 0.001 + 0.012
    plain = random_intercept_logit(right, WHO, {"force": FORCE}).coefficients[1]
    milli = random_intercept_logit(right, WHO, {"pulse_s": pulse}).coefficients[1]
    assert (milli.estimate / 1000, milli.z) == pytest.approx((plain.estimate, plain.z), rel=1e-7)


def test_separation_is_said_with_the_predictors_it_is_in():
    right = drawn(1.0)
    right[FORCE == 1.0] = 1
    found = random_intercept_logit(right, WHO, {"force": FORCE, "trial": np.tile(np.arange(8.0), PEOPLE)})
    assert found.coefficients == ()
    assert "(force) tell right from wrong without exception" in found.reason
    beyond = np.tile(np.arange(8.0), PEOPLE)
    assert "separation" in random_intercept_logit((beyond > 4).astype(int), WHO, {"trial": beyond}).reason


def test_people_with_one_kind_of_answer_each_have_no_finite_spread():
    assert random_intercept_logit((WHO % 2).tolist(), WHO, {"force": FORCE}).reason == RUNS_AWAY


@pytest.mark.slow
def test_every_small_table_has_an_estimate_or_a_reason():
    draw = np.random.default_rng(12)
    reasons = set()
    for _ in range(40):
        people, each, sd = int(draw.integers(2, 9)), int(draw.integers(2, 8)), draw.choice([0.0, 0.5, 2.0, 8.0, 30.0])
        who = np.repeat(np.arange(people), each)
        force, own = np.arange(who.size) % 2.0, sd * draw.normal(size=people)
        answers = (own[who] + force + draw.normal(size=who.size) > 0).astype(int)
        found = random_intercept_logit(answers, who, {"force": force})
        reasons.add(found.reason)
        assert found.reason or all(0 < one.se < 100 for one in found.coefficients)
    assert {None, RUNS_AWAY} <= reasons
    assert NOT_FOUND not in reasons


@pytest.mark.parametrize(
    ("right", "people", "reason"),
    [
        ([1, 0, 1, 1], ["a"] * 4, ONE_PERSON),
        ([1, 1, 1, 1], ["a", "a", "b", "b"], ALL_ALIKE),
        ([1, 0, 1, 1], ["a", "b", "c", "d"], ONE_TRIAL),
    ],
)
def test_what_cannot_be_fitted_says_why(right, people, reason):
    assert random_intercept_logit(right, people, {}).reason == reason


@pytest.mark.parametrize(
    ("right", "people", "predictors", "said"),
    [
        ([1, 0, 2], "aab", {}, "1 for right and 0 for wrong"),
        ([1, 0], "aab", {}, "there are 3 for 2 rows"),
        ([1, 0, 1], ["a", None, "b"], {}, "the one at index 1 is None"),
        ([1, 0, 1], "aab", {"x": [1, 2]}, r"predictors\['x'\] must have one number for each of the 3 rows"),
        ([1, 0, 1], "aab", {"x": [2, 2, 2]}, r"predictors\['x'\] is 2 in every row"),
        ([1, 0, 1], "aab", {"x": [1, 2, 3], "y": [2, 4, 6]}, "x, y overlap"),
    ],
)
def test_what_is_no_table_of_trials_is_refused(right, people, predictors, said):
    with pytest.raises(ValueError, match=said):
        random_intercept_logit(right, list(people), predictors)


def test_a_reference_that_does_not_occur_is_refused():
    with pytest.raises(ValueError, match=r"reference must be one of a, b, not 'c'"):
        indicators(["a", "b"], "c")


# ---- linear ----


def test_of_a_full_table_the_linear_model_has_the_error_of_the_anova():
    scores = DRAW.normal(size=(10, 3)) + DRAW.normal(size=(10, 1)) * 2.0 + np.arange(3)
    found = linear_mixed_model(scores.ravel(), np.repeat(range(10), 3), indicators(list("abc") * 10))
    anova, pairs = rm_anova(scores), pooled_pairs(scores)
    assert found.residual_sd == pytest.approx(np.sqrt(anova.ms_error), rel=1e-6)
    assert found.person_sd == pytest.approx(np.sqrt((anova.ss_participants / 9 - anova.ms_error) / 3), rel=1e-6)
    assert [one.estimate for one in found.coefficients[1:]] == pytest.approx(pairs.difference[:2].tolist(), rel=1e-9)
    assert [one.se for one in found.coefficients[1:]] == pytest.approx(
        (pairs.error[:2] * np.sqrt(2)).tolist(), rel=1e-6
    )


@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e200])
def test_the_linear_model_does_not_depend_on_the_unit(scale):
    values = np.random.default_rng(1).normal(size=WHO.size) + WHO % 5
    here = linear_mixed_model(values, WHO, {"force": FORCE})
    there = linear_mixed_model(values * scale, WHO, {"force": FORCE})
    assert [one.z for one in there.coefficients] == pytest.approx([one.z for one in here.coefficients], rel=1e-5)
    assert there.person_sd == pytest.approx(here.person_sd * scale, rel=1e-5)


def test_people_who_are_more_alike_than_chance_have_no_spread():
    values = np.random.default_rng(2).normal(size=(10, 4))
    values -= values.mean(axis=1, keepdims=True)
    found = linear_mixed_model(values.ravel(), np.repeat(range(10), 4), {"x": [0, 1, 0, 1] * 10})
    assert found.person_sd == 0.0
    assert found.reason is None


@pytest.mark.parametrize("values", [[1.0] * 8, [1.0, 2.0] * 4, [3.0, 4.0, 5.0, 6.0, 1.0, 2.0, 0.0, 1.0]])
def test_nothing_left_to_explain_is_said(values):
    found = linear_mixed_model(values, list("aabbccdd"), {"x": [0, 1] * 4})
    assert found.reason == NO_SPREAD_LEFT
