"""Contrasts, equivalence, mixed models, the ANOVA's Bayes factor and its power, against R. No R is needed; golden/r/.

The programs: t.test, emmeans, lme4 (glmer with 25 nodes, lmer by REML), BayesFactor, power.anova.test, power.t.test and
tables simulated there, p.adjust. A tolerance says where that program's digits end.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.stats.anova_bayes import one_way_bayes_factor, rm_anova_bayes_factor
from analysis.stats.anova_power import one_way_anova_power, rm_anova_power
from analysis.stats.contrasts import planned_contrasts
from analysis.stats.corrections import benjamini_hochberg, holm
from analysis.stats.equivalence import Equivalence, tost_one_sample, tost_paired, tost_two_samples
from analysis.stats.fixed_effects import Coefficient, indicators
from analysis.stats.mixed_model import linear_mixed_model
from analysis.stats.random_intercept import random_intercept_logit
from tests.golden.r import make_revision

GOLDEN = Path(__file__).parent / "golden" / "r"
TABLES = json.loads((GOLDEN / "datasets.json").read_text(encoding="utf-8"))
TRIALS = json.loads((GOLDEN / "revision.json").read_text(encoding="utf-8"))
R = json.loads((GOLDEN / "revision_expected.json").read_text(encoding="utf-8"))

Entry = dict[str, Any]


def _both(kind: str, part: str) -> pytest.MarkDecorator:
    """Every data set with R's `part`, where R has one."""
    pairs = [(data, found) for data, found in zip(TABLES[kind], R[kind], strict=True) if found.get(part)]
    return pytest.mark.parametrize(("data", "found"), [pytest.param(*pair, id=pair[0]["name"]) for pair in pairs])


EVERY_TRIAL_SET = pytest.mark.parametrize(
    ("data", "found"), [pytest.param(*pair, id=pair[0]["name"]) for pair in zip(TRIALS, R["trials"], strict=True)]
)


def _weights(k: int) -> dict[str, list[float]]:
    return {"trend": [j - (k - 1) / 2 for j in range(k)], "first": [-1.0, *[1 / (k - 1)] * (k - 1)]}


def test_the_trials_are_those_that_the_script_makes() -> None:
    assert (GOLDEN / "revision.json").read_text(encoding="utf-8") == make_revision.as_text()


# ---- contrasts and corrections ----


@_both("within", "contrasts")
def test_a_contrast_is_the_t_test_of_each_participants_own(data: Entry, found: Entry) -> None:
    largest = float(np.abs(data["scores"]).max())
    relative = 10 * data["relative_tolerance"]
    for ours in planned_contrasts(data["scores"], _weights(len(data["scores"][0]))):
        theirs = found["contrasts"][ours.name]
        assert ours.estimate == pytest.approx(theirs["estimate"], rel=relative, abs=1e-14 * largest)
        assert (ours.t, ours.p) == pytest.approx((theirs["t"], theirs["p"]), rel=relative, abs=1e-12)
        assert (ours.ci_low, ours.ci_high) == pytest.approx(
            (theirs["ci_low"], theirs["ci_high"]), rel=relative, abs=1e-13 * largest
        )
        assert ours.df == theirs["df"]


@_both("within", "emmeans")
def test_contrasts_and_their_holm_correction_are_those_of_emmeans_on_the_multivariate_model(
    data: Entry, found: Entry
) -> None:
    ours = planned_contrasts(data["scores"], _weights(len(data["scores"][0])), correction="holm")
    theirs, relative = found["emmeans"], 10 * data["relative_tolerance"]
    largest = float(np.abs(data["scores"]).max())
    assert [one.estimate for one in ours] == pytest.approx(theirs["estimate"], rel=relative, abs=1e-14 * largest)
    assert [one.se for one in ours] == pytest.approx(theirs["se"], rel=relative)
    assert [one.p_adjusted for one in ours] == pytest.approx(theirs["p_holm"], rel=relative, abs=1e-12)


@pytest.mark.parametrize("row", R["adjusted"], ids=lambda row: str(len(row["p"])))
def test_holm_and_benjamini_hochberg_are_those_of_p_adjust(row: Entry) -> None:
    assert holm(row["p"]).tolist() == pytest.approx(row["holm"], rel=1e-14)
    assert benjamini_hochberg(row["p"]).tolist() == pytest.approx(row["bh"], rel=1e-14)


# ---- equivalence ----


def _compare_tost(ours: Equivalence, theirs: Entry, relative: float) -> None:
    for name in ("t_low", "p_low", "t_high", "p_high", "df", "ci_low", "ci_high"):
        width = theirs["high"] - theirs["low"]
        assert getattr(ours, name) == pytest.approx(theirs[name], rel=10 * relative, abs=1e-13 * min(width, 1.0)), name


@_both("within", "tost_paired")
def test_two_one_sided_paired_tests_are_those_of_t_test(data: Entry, found: Entry) -> None:
    scores, theirs = np.array(data["scores"]), found["tost_paired"]
    ours = tost_paired(scores[:, 1], scores[:, 0], theirs["low"], theirs["high"])
    _compare_tost(ours, theirs, data["relative_tolerance"])


@_both("within", "tost_one_sample")
def test_two_one_sided_tests_of_one_sample_are_those_of_t_test(data: Entry, found: Entry) -> None:
    scores, theirs = np.array(data["scores"]), found["tost_one_sample"]
    ours = tost_one_sample(scores[:, 0], theirs["low"], theirs["high"])
    _compare_tost(ours, theirs, data["relative_tolerance"])


@pytest.mark.parametrize("part", ["welch", "pooled"])
@_both("between", "welch")
def test_two_one_sided_tests_of_two_samples_are_those_of_t_test(data: Entry, found: Entry, part: str) -> None:
    first, second = data["groups"][:2]
    theirs = found[part]
    ours = tost_two_samples(first, second, theirs["low"], theirs["high"], equal_variances=part == "pooled")
    _compare_tost(ours, theirs, data["relative_tolerance"])


# ---- Bayes factors ----


def _within_its_error(bf10: float | None, theirs: Entry) -> None:
    """R's factor comes from draws: its own relative error, four times; and six digits where it integrates."""
    assert bf10 is not None
    assert abs(bf10 / theirs["bf10"] - 1.0) < 4.0 * theirs["error"] + 1e-6


@pytest.mark.slow
@_both("within", "bayes")
def test_the_bayes_factor_within_people_is_that_of_anovaBF(data: Entry, found: Entry) -> None:
    _within_its_error(rm_anova_bayes_factor(data["scores"]).bf10, found["bayes"])


@_both("between", "bayes")
def test_the_bayes_factor_of_groups_is_that_of_anovaBF(data: Entry, found: Entry) -> None:
    _within_its_error(one_way_bayes_factor(data["groups"]).bf10, found["bayes"])


# ---- models of single trials ----

CLOSE = 1e-4
"""In the unit of the log odds or values; lme4's search ends there or a little later."""


def _model(data: Entry) -> tuple[list[float], list[float], list[float], dict[str, Any]]:
    """People, answers, values and predictors, as the formulas in R have them."""
    who, condition, x, answers, values = (list(column) for column in zip(*data["rows"], strict=True))
    names = [f"c{level:g}" for level in condition]
    return who, answers, values, indicators(names, "c0") | ({"x": x} if data["name"] == "a number" else {})


def _compare_coefficients(ours: tuple[Coefficient, ...], theirs: Entry) -> None:
    assert ["(Intercept)" if one.name == "intercept" else one.name for one in ours] == theirs["names"]
    assert [one.estimate for one in ours] == pytest.approx(theirs["estimate"], abs=CLOSE)
    assert [one.se for one in ours] == pytest.approx(theirs["se"], abs=CLOSE)


@pytest.mark.slow
@EVERY_TRIAL_SET
def test_the_random_intercept_logit_is_glmer_with_25_nodes(data: Entry, found: Entry) -> None:
    who, answers, _, predictors = _model(data)
    ours = random_intercept_logit(answers, who, predictors)
    _compare_coefficients(ours.coefficients, found["logit"])
    assert ours.person_sd == pytest.approx(found["logit"]["person_sd"], abs=CLOSE)


@pytest.mark.slow
@EVERY_TRIAL_SET
def test_the_linear_mixed_model_is_lmer_by_reml(data: Entry, found: Entry) -> None:
    who, _, values, predictors = _model(data)
    ours = linear_mixed_model(values, who, predictors)
    _compare_coefficients(ours.coefficients, found["linear"])
    assert ours.residual_sd == pytest.approx(found["linear"]["residual_sd"], abs=CLOSE)
    assert ours.person_sd == pytest.approx(found["linear"]["person_sd"], abs=CLOSE)


# ---- power ----


def test_the_power_of_groups_is_that_of_power_anova_test() -> None:
    for k, n, f, alpha, power in R["one_way_power"]:
        found = one_way_anova_power(f, [n] * int(k), alpha)
        assert found == pytest.approx(power, rel=0.0, abs=1e-9)  # where R's noncentral distribution ends


def test_the_power_of_two_conditions_is_that_of_the_paired_t_test() -> None:
    n, f, rho, power = np.array(R["paired_power"]).T
    assert rm_anova_power(f, n, 2, correlation=rho) == pytest.approx(power, rel=1e-6)


@pytest.mark.parametrize("row", R["simulated_power"], ids=lambda row: f"epsilon {row[4]:.2f}")
def test_the_power_within_people_is_that_of_simulated_tables(row: list[float]) -> None:
    n, k, f, correlation, epsilon, power, tables = row
    ours = rm_anova_power(f, n, k, correlation=correlation, epsilon=epsilon)
    by_chance = 4.0 * math.sqrt(power * (1.0 - power) / tables)
    assert ours == pytest.approx(power, abs=by_chance + (0.0 if epsilon > 0.999 else 0.02))  # approximate below 1
