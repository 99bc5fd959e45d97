"""A file of requests: each is answered from the scores of the report, in report and statistics.json, or refused."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from analysis.logs.design_logs import DesignLogs
from analysis.logs.reading import Logs, read_logs
from analysis.stats.anova import rm_anova
from analysis.stats.anova_bayes import rm_anova_bayes_factor
from analysis.stats.contrasts import planned_contrasts
from analysis.stats.equivalence import tost_one_sample, tost_paired
from analysis.summary.analyze import Request, analyze
from analysis.summary.request_data import answers_to, planned_names, request_data
from analysis.summary.requests import BayesFactorRequest, Requested, Requests, check_names
from analysis.summary.results import StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.requested import requested_sections
from analysis.summary.summary import summarize
from experiments.config.door import ConfigError, load
from tests.conftest import Recoil
from tests.designs import design
from tests.log_files import rating_rows, ratings_path, trial_rows, trials_path, write_rows, write_study
from tests.tables_of_designs import loaded, simulated

EXAMPLE = Path(__file__).parent.parent / "configs" / "examples" / "requests.toml"
PEOPLE = 9


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    study = tmp_path_factory.mktemp("study")
    write_study(study, participants=PEOPLE)
    return study


@pytest.fixture(scope="module")
def logs(folder: Path) -> Logs:
    return read_logs([folder])


@pytest.fixture(scope="module")
def answers(logs: Logs) -> dict[str, Requested]:
    """The example's requests, each kind once."""
    return {one.kind: one for one in answers_to(load(Requests, EXAMPLE), EXAMPLE, logs)}


def of_designs(*names: str) -> Logs:
    """The logs of designs as their synthetic participants fill them."""
    empty = pd.DataFrame()
    designs = []
    for name in names:
        config, laws = loaded(name)
        designs.append(DesignLogs(design=config, table=simulated(config, laws, 8), gun_labels={}))
    return Logs(trials=empty, ratings=empty, paths=(), problems=(), designs=tuple(designs))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["grip", "hurry", "magnitude", "preference", "realism", "stronger", "voltages"])
def test_what_a_request_may_name_is_known_before_there_are_data(name: str) -> None:
    design, _ = loaded(name)
    question = next(name for name, one in design.questions.items() if one.kind != "text")
    asked = BayesFactorRequest(kind="bayes-factor", of=design.design, question=question)
    there = request_data(of_designs(name), asked).names
    planned = planned_names(design.model_copy(update={"design": "own"}), question)
    assert (set(planned.conditions), planned.factors, planned.grouped) == (
        set(there.conditions),
        there.factors,
        there.grouped,
    )


TWO_GRIPS: dict[str, object] = {"levels": ["one", "two"], "between": True}
RATED = {"q": {"kind": "rating", "text": "How?", "minimum": 1.0, "maximum": 7.0, "grain": 1.0}}


@pytest.mark.parametrize(
    ("factors", "said"),
    [
        (
            {
                "grip": TWO_GRIPS,
                "pulse_s": {"within": "grip", "levels": {"one": [0.004, 0.006], "two": [0.006, 0.008]}},
            },
            "each group of people has levels of pulse_s of its own, so nobody has all conditions",
        ),
        ({"grip": TWO_GRIPS}, "needs two conditions within people, and there is one"),
        (
            {
                "damper": {"levels": ["off", "on"]},
                "pulse_s": {"within": "damper", "levels": {"off": [0.004, 0.006], "on": [0.006, 0.008]}},
            },
            "there is no condition '0.004'; there are off/0.004, off/0.006, on/0.006, on/0.008",
        ),
    ],
)
def test_a_test_of_conditions_that_nobody_has_is_refused_before_there_are_data(
    factors: dict[str, object], said: str
) -> None:
    config = design(factors={"method": {"levels": ["a"]}, **factors}, questions=RATED)
    equal = {"kind": "equivalence", "of": "test", "question": "q", "a": "0.004", "b": "0.006", "low": -1.0, "high": 1.0}
    weighed = {"kind": "contrasts", "of": "test", "question": "q", "weights": {"x": {"0.004": -1.0, "0.006": 1.0}}}
    for request in Requests.model_validate_json(json.dumps({"requests": [equal, weighed]})).requests:
        with pytest.raises(ValueError, match=re.escape(said)):
            check_names(request, planned_names(config, "q"))


def asked(tmp_path: Path, text: str, logs: Logs) -> tuple[Requested, ...]:
    path = tmp_path / "requests.toml"
    path.write_text(text, encoding="utf-8")
    return answers_to(load(Requests, path), path, logs)


def test_the_example_asks_for_every_kind(answers: dict[str, Requested]) -> None:
    assert set(answers) == {"contrasts", "equivalence", "bayes-factor", "logistic", "mixed-model"}


def test_contrasts_and_bayes_factor_are_of_the_scores_of_the_anova(logs: Logs, answers: dict[str, Requested]) -> None:
    direction = summarize(logs).direction
    assert direction is not None
    assert direction.anova is not None
    scores, names = direction.participants.array, direction.methods
    assert float(rm_anova(scores).F) == direction.anova.F
    weights = {"vibration": -1.0, "asymmetric-1": 0.5, "asymmetric-2": 0.5}
    expected = planned_contrasts(scores, {"x": [weights[name] for name in names]})[0]
    first: Any = answers["contrasts"].result
    assert (first[0].name, first[0].estimate, first[0].t) == ("force against vibration", expected.estimate, expected.t)
    bayes: Any = answers["bayes-factor"].result
    assert bayes.bf10 == rm_anova_bayes_factor(scores).bf10


def test_equivalence_is_of_the_two_conditions_in_their_order(logs: Logs, answers: dict[str, Requested]) -> None:
    preference = summarize(logs).preference
    assert preference is not None
    column = dict(zip(preference.methods, preference.participants.array.T, strict=True))
    expected = tost_paired(column["asymmetric-2"], column["asymmetric-1"], -1.0, 1.0)
    assert answers["equivalence"].result == expected


def test_models_are_of_single_trials(answers: dict[str, Requested]) -> None:
    logistic: Any = answers["logistic"].result
    linear: Any = answers["mixed-model"].result
    assert (logistic.people, linear.people) == (PEOPLE, PEOPLE)
    assert linear.trials == 3 * PEOPLE
    assert [one.name for one in linear.coefficients] == ["intercept", "asymmetric-1", "asymmetric-2"]


def test_every_answer_has_its_section_with_its_numbers(answers: dict[str, Requested]) -> None:
    statistics = StudyStatistics(requested=tuple(answers.values()))
    found = {one.title: one for one in requested_sections(ReportData(title="x", statistics=statistics))}
    assert list(found) == [
        "Requested: planned contrasts, direction",
        "Requested: equivalence, preference",
        "Requested: Bayes factor, direction",
        "Requested: logistic mixed model, direction",
        "Requested: linear mixed model, preference",
    ]
    contrasts: Any = answers["contrasts"].result
    row = found["Requested: planned contrasts, direction"].tables[0].rows[0]
    assert row[3] == f"{contrasts[0].t:.2f}".replace("-", "−")
    logistic: Any = answers["logistic"].result
    row = found["Requested: logistic mixed model, direction"].tables[0].rows[1]
    assert row[-1] == f"{math.exp(logistic.coefficients[1].estimate):.2f}"
    assert "BF10" in found["Requested: Bayes factor, direction"].paragraphs[0]


def test_what_is_said_of_right_answers_is_in_percentage_points_as_in_the_other_tables(
    tmp_path: Path, logs: Logs, answers: dict[str, Requested]
) -> None:
    text = """
[[requests]]
kind = "equivalence"
of = "direction"
a = "asymmetric-2"
b = "vibration"
low = -0.055
high = 0.1
[[requests]]
kind = "mixed-model"
of = "direction"
"""
    given = (answers["contrasts"], *asked(tmp_path, text, logs), answers["equivalence"])
    said = [*requested_sections(ReportData(title="x", statistics=StudyStatistics(requested=given)))]
    contrasts, equivalence, mixed = (one.tables[0] for one in said[:3])
    assert all("of direction in percentage points" in one.caption for one in (contrasts, equivalence))
    result: Any = given[0].result
    assert contrasts.rows[0][1] == f"{100 * result[0].estimate:.1f}"
    assert equivalence.rows[0][1] == "[−5.5, 10.0]"
    assert "lies between −5.5 and 10 percentage points, by" in said[1].paragraphs[0]
    model: Any = given[2].result
    assert mixed.rows[0][3] == f"{100 * model.coefficients[0].se:.1f}"
    assert f"of single trials {100 * model.residual_sd:.1f} in percentage points" in said[2].paragraphs[0]
    assert "percentage points" not in str(said[3])


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ([0.1, -0.2, 0.3, 0.0, -0.1, 0.2], "which lies within the bounds: equivalence was shown, p = .001."),
        ([0.4, 0.6, 0.5, 0.3, 0.7, 0.45], "equivalence was not shown, p = .446, which is no proof"),
        ([1.4, 1.6, 1.5, 1.3, 1.7, 1.45], "which lies wholly above the bounds: equivalence was not shown, p > .999"),
        ([-1.4, -1.6, -1.5, -1.3, -1.7, -1.45], "which lies wholly below the bounds: equivalence was not shown,"),
    ],
)
def test_an_equivalence_is_told_in_words(values: list[float], said: str, answers: dict[str, Requested]) -> None:
    asked = replace(answers["equivalence"], result=tost_one_sample(values, -0.5, 0.5))
    (section,) = requested_sections(ReportData(title="x", statistics=StudyStatistics(requested=(asked,))))
    assert said in section.paragraphs[0]
    no_proof = "not shown" in said and "wholly" not in said
    assert section.paragraphs[0].endswith("no proof of a difference.") is no_proof


def test_a_linear_model_of_right_and_wrong_says_that_another_is_meant_for_them(logs: Logs, tmp_path: Path) -> None:
    (tmp_path / "requests.toml").write_text('[[requests]]\nkind = "mixed-model"\nof = "direction"\n')
    (one,) = answers_to(load(Requests, tmp_path / "requests.toml"), tmp_path / "requests.toml", logs)
    assert "Caution: the answers are 0 or 1" in one.note
    assert '`kind = "logistic"`' in one.note


@pytest.mark.slow
def test_what_data_that_are_kept_apart_have_not_is_a_warning_and_the_rest_is_answered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("analysis.summary.sections.sections.write_report", lambda *_, **__: None)  # it takes longest
    hands = {"A": ("participant", "RG-2:0007"), "S": ("synthetic", "simulated")}
    for letter, (hand, gun) in hands.items():
        for seed in (1, 2, 3):
            code = f"{letter}{seed}"
            ratings = [row | {"rating_by": hand, "gun": gun} for row in rating_rows(code, seed)]
            write_rows(ratings_path(tmp_path / "results", code), ratings)
            if letter == "A":
                trials = [row | {"response_source": hand, "gun": gun} for row in trial_rows(code, seed)]
                write_rows(trials_path(tmp_path / "results", code), trials)
    text = '[[requests]]\nkind = "bayes-factor"\nof = "{}"\n'
    for of, said in (("preference", False), ("direction", True)):
        (tmp_path / "requests.toml").write_text(text.format(of))
        paths = {"paths": [tmp_path / "results"], "out": tmp_path / of, "requests": tmp_path / "requests.toml"}
        apart = analyze(Request(**paths, include_synthetic=True))[0].kept_apart or {}  # type: ignore[arg-type]
        assert (apart["synthetic"].requested is None) is said
        assert any("not answered here: " in warning for warning in apart["synthetic"].warnings) is said


@pytest.mark.slow
def test_a_report_without_requests_has_none(logs: Logs) -> None:
    assert summarize(logs).requested is None
    assert [*requested_sections(ReportData(title="x", statistics=summarize(logs)))] == []


@pytest.mark.slow
def test_a_design_is_asked_by_question_cells_and_terms(tmp_path: Path) -> None:
    text = """
[[requests]]
kind = "contrasts"
of = "realism"
question = "comfort"
weights."damper at 20 V" = { "off/20" = -1.0, "on/20" = 1.0 }
[[requests]]
kind = "mixed-model"
of = "realism"
question = "realism"
terms = ["damper", "voltage_V", "damper:voltage_V"]
[[requests]]
kind = "logistic"
of = "voltages"
[[requests]]
kind = "contrasts"
of = "grip"
weights.x = { vibration = -1.0, asymmetric-1 = 1.0 }
"""
    logs = of_designs("realism", "voltages", "grip")
    contrast, mixed, logistic, grip = asked(tmp_path, text, logs)
    rows = logs.designs[0].table
    rows = rows[rows["voltage_V"] == 20.0].pivot_table(index="participant_id", columns="damper", values="comfort")
    result: Any = contrast.result
    assert result[0].estimate == pytest.approx((rows["on"] - rows["off"]).mean())
    model: Any = mixed.result
    assert [one.name for one in model.coefficients] == ["intercept", "on", "voltage_V", "on:voltage_V"]
    assert "what stands of a factor alone is its effect at the first level of the other" in mixed.note
    assert "at 0, which may lie far from all levels" not in logistic.note  # no interaction
    model = logistic.result
    assert [one.name for one in model.coefficients] == ["intercept", "voltage_V", "backward"]
    assert grip.note.endswith("Scores: participants' means of ratings, people of all groups together.")


def test_numbers_are_asked_as_their_logarithms() -> None:
    found = request_data(of_designs("magnitude"), BayesFactorRequest(kind="bayes-factor", of="magnitude"))
    assert found.unit == "natural logarithms of the numbers"
    assert np.exp(found.trials["score"]).round(6).tolist() == found.trials["strength"].round(6).tolist()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('kind = "bayes-factor"\nof = "nothing"', "there are no logs of it; there are some of realism, magnitude"),
        ('kind = "bayes-factor"\nof = "realism"', "question: say which one; realism has realism, comfort"),
        ('kind = "bayes-factor"\nof = "realism"\nquestion = "pain"', "realism has realism, comfort"),
        ('kind = "bayes-factor"\nof = "realism"\nquestion = "comfort"', "of one factor within people"),
        ('kind = "logistic"\nof = "realism"\nquestion = "comfort"', "right or wrong, or one of two; take mixed-model"),
        ('kind = "mixed-model"\nof = "magnitude"\nterms = ["hand"]', "there is no factor 'hand' that varies"),
        ('kind = "contrasts"\nof = "magnitude"\nweights.x = { "1" = 1, "2" = -1 }', "there is no condition '1'"),
        ('kind = "contrasts"\nof = "magnitude"\nweights.x = { "0.004" = 1, "0.006" = -0.9 }', "must add up to 0"),
        ('kind = "equivalence"\nof = "magnitude"\na = "0.004"\nlow = 2.0\nhigh = 1.0', "low must be below high"),
    ],
)
def test_what_the_data_have_not_is_said_with_the_line_and_what_they_have(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=rf"requests.toml:2: requests.0: .*{said}"):
        asked(tmp_path, f"# one request\n[[requests]]\n{text}\n", of_designs("realism", "magnitude"))


def test_an_experiment_has_one_measure(tmp_path: Path, logs: Logs) -> None:
    with pytest.raises(ConfigError, match="direction has one measure; leave the key out"):
        asked(tmp_path, '[[requests]]\nkind = "logistic"\nof = "direction"\nquestion = "response"\n', logs)


@pytest.mark.slow
def test_the_command_answers_in_report_and_statistics_and_writes_nothing_of_what_it_refuses(
    recoil: Recoil, folder: Path, tmp_path: Path
) -> None:
    done = recoil("analyze", folder, "--out", tmp_path / "out", "--requests", EXAMPLE)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "out" / "statistics.json").read_text(encoding="utf-8"))["requested"]
    assert [one["kind"] for one in found] == [one.kind for one in load(Requests, EXAMPLE).requests]
    assert set(found[0]) == {"kind", "of", "question", "people", "shares", "note", "result"}
    assert "Requested: planned contrasts, direction" in (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    (tmp_path / "bad.toml").write_text('[[requests]]\nkind = "anova"\nof = "direction"\n', encoding="utf-8")
    bad = recoil("analyze", folder, "--out", tmp_path / "none", "--requests", tmp_path / "bad.toml")
    assert bad.returncode == 2
    assert "kind = 'anova' is none of contrasts, equivalence" in bad.stderr
    assert not (tmp_path / "none").exists()
