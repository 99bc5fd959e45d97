from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from analysis import rm_tukey_hsd_paired
from analysis.logs.reading import Logs, read_logs
from analysis.report.serial import undefined
from analysis.stats.paired import SCALE, jzs_paired
from analysis.summary.results import Supplement
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.supplement import supplement_sections
from analysis.summary.summary import summarize, within_supplement
from tests.log_files import METHODS, write_study
from tests.made_scores import CEILING, ONE_AT_CEILING, RIGHT, ratings_of, study_of
from tests.waiting import PATIENCE_S

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Logs:
    return read_logs([write_study(tmp_path_factory.mktemp("study"))])


@pytest.fixture(scope="module")
def found(logs: Logs) -> dict[str, Any]:
    return summarize(logs).to_dict()


@pytest.fixture(scope="module")
def published_like(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return study_of(tmp_path_factory.mktemp("right"), RIGHT, timed=False).to_dict()


@pytest.mark.parametrize("experiment", ["direction", "preference"])
def test_every_key_is_there_and_plain_json(experiment: str, found: dict[str, Any]) -> None:
    assert {field.name for field in fields(Supplement)} < set(found[experiment])
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert ("model" in found[experiment]) == (experiment == "direction")


def test_published_like_rates_give_the_numbers_of_r(published_like: dict[str, Any]) -> None:
    # R 4.2.2, afex 1.2.1 and emmeans 1.8.4: pairs(emmeans(a, "m", model = "multivariate")); see test_sphericity
    direction = published_like["direction"]
    assert direction["sphericity"]["W"] == pytest.approx(0.542433747971877)
    assert direction["effect_size"]["generalized_eta_squared"] == pytest.approx(0.639745796372302)
    assert direction["friedman"]["chi2"] == pytest.approx(25.5294117647059)
    own = [pair["p"] for pair in direction["tukey_paired"]]
    assert own == pytest.approx(
        [1.39928138233e-03, 1.28807696171e-05, 4.22318922663e-04], rel=1e-5
    )  # ptukey errs by 3e-6
    assert direction["diagnostics"]["normality"]["W"] == pytest.approx(0.949001646180764)
    assert direction["binomial"]["vibration"]["forward"]["clustering"]["icc"] == pytest.approx(0.0444936086529012)
    assert direction["model"]["conditions"][2]["log_odds"] == pytest.approx(3.29583686600253)


def test_bayes_factors_belong_to_the_paired_t_tests(found: dict[str, Any]) -> None:
    for experiment in ("direction", "preference"):
        factors = found[experiment]["bayes_factors"]
        assert factors["r"] == SCALE
        for factor, pair in zip(factors["pairs"], found[experiment]["paired_t"], strict=True):
            assert factor["bf10"] == jzs_paired(pair["t"], 14)


def test_outliers_are_named_by_participant_and_method(tmp_path: Path) -> None:
    table = [[2.0 + 0.1 * i, 5.0, 8.0 - 0.1 * (i % 3)] for i in range(9)] + [[9.5, 5.0, 7.9]]
    diagnostics = ratings_of(tmp_path, table).to_dict()["preference"]["diagnostics"]
    (outlier,) = diagnostics["outliers"]["found"]
    assert (outlier["participant"], outlier["method"], outlier["score"]) == ("P10", "vibration", 9.5)
    assert diagnostics["scale"] == [0.0, 10.0]


def test_low_epsilon_warns_against_the_pooled_tukey_once_at_the_top(published_like: dict[str, Any]) -> None:
    assert published_like["direction"]["sphericity"]["greenhouse_geisser"]["epsilon"] < 0.75
    assert [warning for warning in published_like["warnings"] if "tukey_paired" in warning] == [
        "direction: sphericity does not hold (Greenhouse-Geisser epsilon below 0.75): read the corrected F test and "
        "the Tukey test with each pair's own error (tukey_paired), not the pooled one"
    ]


def test_milder_departures_stay_beside_the_assumptions(published_like: dict[str, Any]) -> None:
    told = [entry["warning"] for entry in published_like["direction"]["assumptions"] if entry["warning"]]
    assert any("asymmetric-2 (ceiling 10 of 14)" in warning for warning in told)
    assert len(published_like["warnings"]) == 1


def test_clustering_that_turns_the_pooled_test_over_is_told_at_the_top(tmp_path: Path) -> None:
    counts = [[10, 8, 9], [10, 9, 8], [10, 8, 9], [9, 7, 8], [10, 8, 9], [1, 8, 9], [0, 8, 9], [2, 9, 8]]
    found = study_of(tmp_path, counts, timed=False).to_dict()
    test = found["direction"]["binomial"]["vibration"]["forward"]
    assert test["p"] < 0.05 < test["clustering"]["p_adjusted"]
    assert any("pooled binomial test is not to be read: vibration forward" in warning for warning in found["warnings"])


def test_people_are_not_said_to_differ_where_they_are_only_few(tmp_path: Path) -> None:
    found = study_of(tmp_path, [[9, 8, 9], [7, 9, 8]], timed=False).to_dict()
    test = found["direction"]["binomial"]["vibration"]["forward"]
    assert test["p"] < 0.05 < test["clustering"]["p_adjusted"]
    assert not any("differ so much" in warning for warning in found["warnings"])
    told = [entry["warning"] for entry in found["direction"]["assumptions"] if entry["warning"]]
    assert any(one.startswith("people are too few") and "vibration forward" in one for one in told)


ALIKE = np.column_stack([RIGHT[:, 0], RIGHT[:, 0], RIGHT[:, 1]])
ADDITIVE = np.add.outer([3, 5, 4, 6], [0, 1, 3])
DEGENERATE = {
    "all at ceiling": CEILING,
    "all at floor": 0 * CEILING,
    "all at chance": CEILING // 2,
    "identical columns": np.column_stack([RIGHT[:, 0]] * 3),
    "two identical columns": ALIKE,
    "people and methods only add up": ADDITIVE,
    "one method at ceiling": ONE_AT_CEILING,
    "two people": RIGHT[:2],
    "two people, alike": RIGHT[[0, 0]],
    "as many people as methods": RIGHT[:3],
}


def test_supplements_of_any_scores_are_finite_or_have_a_reason() -> None:
    """Nearly degenerate, huge, tiny and far from 0: a warning of a library would fail the test, too."""
    rng = np.random.default_rng(6)
    for _ in range(60):
        n, k = int(rng.integers(2, 16)), int(rng.integers(2, 6))
        size = rng.choice([1.0, 0.1, 1e-200, 1e200])
        scores = size * (np.add.outer(rng.integers(0, 11, n), rng.integers(0, 4, k)) + rng.choice([0.0, 1e9]))
        scores = scores + size * rng.choice([0.0, 1e-15, 1e-9, 1e-3, 1.0]) * rng.normal(size=(n, k))
        if rng.random() < 0.3:
            scores[:, 1] = scores[:, 0]
        found = within_supplement(pd.DataFrame(scores, index=range(n), columns=range(k)), (0.0, 10.0))
        assert not list(undefined(found))


def _numbers(value: Any) -> list[float]:
    if isinstance(value, dict):
        return [number for item in value.values() for number in _numbers(item)]
    if isinstance(value, list):
        return [number for item in value for number in _numbers(item)]
    return [value] if isinstance(value, float) else []


@pytest.mark.parametrize("name", DEGENERATE)
def test_degenerate_answers_never_crash_and_never_give_a_silent_number(name: str, tmp_path: Path) -> None:
    statistics = study_of(tmp_path, DEGENERATE[name], timed=False)
    found = statistics.to_dict()
    direction = found["direction"]
    assert np.isfinite(_numbers(found)).all()
    json.dumps(found, allow_nan=False)
    for entry in (*direction["paired_t"], *direction["tukey_paired"], *direction["bayes_factors"]["pairs"]):
        assert (entry.get("p", entry.get("bf10")) is None) == (entry["reason"] is not None)
    for entry in (direction["friedman"], direction["sphericity"], direction["diagnostics"]["normality"]):
        assert entry["p"] is not None or entry["reason"]
    assert direction["model"]["contrasts"] or direction["model"]["reason"]
    assert list(supplement_sections(ReportData(title="T", statistics=statistics)))


@pytest.mark.parametrize("name", DEGENERATE)
def test_degenerate_ratings_never_crash_either(name: str, tmp_path: Path) -> None:
    statistics = ratings_of(tmp_path, DEGENERATE[name])
    assert np.isfinite(_numbers(statistics.to_dict())).all()
    assert list(supplement_sections(ReportData(title="T", statistics=statistics)))


def test_all_at_ceiling_gives_reasons_everywhere(tmp_path: Path) -> None:
    direction = study_of(tmp_path, CEILING, timed=False).to_dict()["direction"]
    assert direction["effect_size"]["partial_eta_squared"] is None
    assert direction["friedman"]["reason"]
    assert [pair["p"] for pair in direction["paired_t"]] == [None] * 3
    assert [pair["q"] for pair in direction["tukey_paired"]] == [None] * 3
    assert "every answer right" in direction["model"]["reason"]
    assert direction["binomial"]["vibration"]["forward"]["clustering"]["p_adjusted"] is None
    assert direction["diagnostics"]["ceiling"] == dict.fromkeys(METHODS, 6)


def test_fewer_people_than_methods_have_no_mauchly_test_but_a_reason(tmp_path: Path) -> None:
    sphericity = study_of(tmp_path, RIGHT[:2], timed=False).to_dict()["direction"]["sphericity"]
    assert (sphericity["W"], sphericity["huynh_feldt"]) == (None, None)
    assert "fewer participants than conditions" in sphericity["reason"]


def test_two_methods_need_no_sphericity(tmp_path: Path) -> None:
    found = study_of(tmp_path, RIGHT[:, :2], ("ramp", "click"), timed=False).to_dict()["direction"]
    (pair,) = found["paired_t"]
    assert found["anova"]["F"] == pytest.approx(pair["t"] ** 2)
    assert found["anova"]["p"] == pytest.approx(pair["p"]) == pytest.approx(found["tukey_paired"][0]["p"])
    assert "trivially" in found["sphericity"]["reason"]
    assert "three conditions" in found["friedman"]["reason"]
    assert found["model"]["test"]["df"] == [1, 13]
    assert found["model"]["test"]["F"] == pytest.approx(found["model"]["contrasts"][0]["t"] ** 2)


@pytest.mark.parametrize("right", [RIGHT[:1], RIGHT[:, :1]])
def test_one_person_or_one_method_has_no_supplement(right: Any, tmp_path: Path) -> None:
    statistics = study_of(tmp_path, right, METHODS[: right.shape[1]], timed=False)
    found, direction = statistics.direction, statistics.to_dict()["direction"]
    assert found is not None
    assert found.supplement is None
    assert [direction[field.name] for field in fields(Supplement)] == [None] * len(fields(Supplement))
    assert found.assumptions == ()
    assert found.model.fit.reason
    assert not list(supplement_sections(ReportData(title="T", statistics=statistics)))


def test_the_paired_tukey_is_the_one_of_the_core(found: dict[str, Any]) -> None:
    scores = [[row[m] for m in METHODS] for row in found["preference"]["participants"].values()]
    own = rm_tukey_hsd_paired(scores, METHODS)
    assert [(c["a"], c["b"], c["q"], c["p"]) for c in found["preference"]["tukey_paired"]] == [
        (c.a, c.b, c.q, c.p) for c in own
    ]


def test_nothing_slow_is_imported_before_it_is_used() -> None:
    program = "import sys, analysis.summary.summary; print([m for m in {'pingouin', 'statsmodels'} & {*sys.modules}])"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=PATIENCE_S
    )
    assert done.stdout.strip() == "[]"
