from __future__ import annotations

import json
import statistics
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from analysis import binomial_test, rm_anova, rm_tukey_hsd, yes_no
from analysis.logs.reading import Logs, read_logs
from analysis.summary.results import StudyStatistics
from analysis.summary.summary import summarize
from tests.log_files import METHODS, rating_rows, ratings_path, trial_rows, trials_path, write_rows, write_study

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Logs:
    return read_logs([write_study(tmp_path_factory.mktemp("study"))])


@pytest.fixture(scope="module")
def summary(logs: Logs) -> StudyStatistics:
    return summarize(logs)


@pytest.fixture(scope="module")
def found(summary: StudyStatistics) -> dict[str, Any]:
    return summary.to_dict()


def _rate(code: str, seed: int, method: str, direction: str) -> float:
    rows = [r for r in trial_rows(code, seed) if r["method"] == method and r["direction"] == direction]
    return sum(int(r["correct"]) for r in rows) / len(rows)


def test_the_direction_measure_is_the_correct_rate_on_forward_trials(found: dict[str, Any]) -> None:
    found = found["direction"]
    assert found["n"] == 14
    assert found["methods"] == list(METHODS)
    for method in METHODS:
        rates = [_rate(f"P{i:02d}", 1000 + i, method, "forward") for i in range(1, 15)]
        assert [row[method] for row in found["participants"].values()] == pytest.approx(rates)
        assert found["means"][method] == pytest.approx(statistics.mean(rates))
        assert found["sds"][method] == pytest.approx(statistics.stdev(rates))


def test_tests_are_the_repeated_measures_ones_on_the_participants_scores(found: dict[str, Any]) -> None:
    for own in (found["direction"], found["preference"]):
        scores = [[row[m] for m in METHODS] for row in own["participants"].values()]
        anova = rm_anova(scores)
        assert own["anova"]["F"] == anova.F
        assert own["anova"]["df"] == [2, 26]
        assert own["anova"]["name"] == "one-way repeated-measures ANOVA"
        comparisons = rm_tukey_hsd(scores, METHODS)
        assert [(c["a"], c["b"], c["p"]) for c in own["tukey"]] == [(c.a, c.b, c.p) for c in comparisons]
        assert "repeated-measures" in own["tukey_error_term"]


def test_binomial_tests_pool_the_trials_of_all_participants(found: dict[str, Any]) -> None:
    found = found["direction"]
    for method in METHODS:
        for direction in ("forward", "backward"):
            entry = found["binomial"][method][direction]
            successes = round(sum(10 * _rate(f"P{i:02d}", 1000 + i, method, direction) for i in range(1, 15)))
            assert (entry["successes"], entry["trials"]) == (successes, 140)
            assert entry["p"] == binomial_test(successes, 140).p
    assert "come in people" in found["binomial_note"]


def test_sensitivity_takes_forward_said_on_backward_as_a_false_alarm(found: dict[str, Any]) -> None:
    found = found["direction"]["sensitivity"]["asymmetric-1"]
    values = [
        yes_no(
            round(10 * _rate(f"P{i:02d}", 1000 + i, "asymmetric-1", "forward")),
            10,
            10 - round(10 * _rate(f"P{i:02d}", 1000 + i, "asymmetric-1", "backward")),
            10,
        )
        for i in range(1, 15)
    ]
    assert found["d_prime"]["mean"] == pytest.approx(statistics.mean(v.d_prime for v in values))
    assert found["criterion"]["sd"] == pytest.approx(statistics.stdev(v.criterion for v in values))


def test_response_times_count_only_where_they_are_the_participants_own(tmp_path: Path) -> None:
    rows = trial_rows()
    for row in rows[1:20]:
        row["response_time_valid"] = "0"
    rows[0]["response_time_s"] = "1.25"
    write_rows(trials_path(tmp_path, "P01"), rows)
    assert summarize(read_logs([tmp_path])).to_dict()["direction"]["response_time"]["vibration"] == {
        "median": 1.25,
        "n": 1,
    }


def test_participants_who_miss_an_answer_or_a_method_are_left_out_and_listed(tmp_path: Path) -> None:
    write_study(tmp_path, participants=5)
    trials = trial_rows("P02", 2)
    trials[4].update(response="", correct="")
    write_rows(trials_path(tmp_path, "P02"), trials)
    write_rows(trials_path(tmp_path, "P03"), trial_rows("P03", methods=METHODS[:2]))
    ratings = rating_rows("P04")
    ratings[0]["rating"] = ""
    write_rows(ratings_path(tmp_path, "P04"), ratings)
    found = summarize(read_logs([tmp_path])).to_dict()
    assert (found["direction"]["n"], found["preference"]["n"]) == (3, 4)
    assert [tuple(one.values())[:4] for one in found["excluded"]] == [
        ("direction", "P02", "1 of 60 trials unanswered", "every trial is answered"),
        ("direction", "P03", "no forward trials with asymmetric-2", "everybody has every method"),
        ("preference", "P04", "1 of 3 ratings missing", "every method is rated"),
    ]
    assert all("drop_unanswered" in one["remedy"] for one in found["excluded"][::2])


@pytest.mark.parametrize("participants", [0, 1])
def test_fewer_than_two_complete_participants_give_no_test_but_a_reason(participants: int, tmp_path: Path) -> None:
    write_study(tmp_path, participants=1)
    if participants == 0:
        rows = trial_rows()
        rows[0].update(response="", correct="")
        write_rows(trials_path(tmp_path, "P01"), rows)
    found = summarize(read_logs([tmp_path])).to_dict()
    assert found["direction"]["n"] == participants
    assert found["direction"]["anova"] is None
    assert found["direction"]["tukey"] is None
    assert f"complete participants: {participants}, methods: 3" in " ".join(found["warnings"])


def test_what_is_not_finite_is_null_and_named(tmp_path: Path) -> None:
    for code in ("P01", "P02"):
        rows = rating_rows(code)
        for row, rating in zip(rows, ("1", "2", "3"), strict=True):
            row["rating"] = rating
        write_rows(ratings_path(tmp_path, code), rows)
    found = summarize(read_logs([tmp_path])).to_dict()
    assert found["preference"]["anova"]["F"] is None
    assert found["preference"]["anova"]["p"] == 0.0
    assert any("preference.anova.F is infinite" in warning for warning in found["warnings"])
    assert "direction" not in found


def test_in_a_notebook_the_statistics_are_a_table_with_the_tests(summary: StudyStatistics) -> None:
    assert summary.direction is not None
    frame = summary.to_frame()
    assert list(frame["method"]) == [*METHODS, *METHODS]
    row = frame[(frame["experiment"] == "direction") & (frame["method"] == "vibration")].iloc[0]
    assert (row["n"], row["mean"]) == (14, summary.direction.means["vibration"])
    assert row["ci_low"] < row["mean"] < row["ci_high"]
    assert "F(2, 26) = " in summary._repr_html_()


def test_the_summary_is_plain_json(found: dict[str, Any]) -> None:
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert set(found["versions"]) == {"python", "numpy", "scipy", "pandas", "pingouin", "recoil"}


def test_unknown_methods_are_sorted_by_name(tmp_path: Path) -> None:
    for code in ("P01", "P02"):
        write_rows(ratings_path(tmp_path, code), rating_rows(code, methods=("ramp", "click")))
    assert summarize(read_logs([tmp_path])).to_dict()["preference"]["methods"] == ["click", "ramp"]


def test_order_of_files_changes_nothing(logs: Logs, found: dict[str, Any]) -> None:
    again = read_logs(reversed(logs.files))
    assert summarize(again).to_dict() == found


def _crowd(participants: int) -> Logs:
    """Logs of so many people, 60 trials and 3 ratings each, as the reader leaves them."""
    rng = np.random.default_rng(1)
    codes = [f"P{i:05d}" for i in range(participants)]
    trials = pd.DataFrame(
        {
            "participant_id": pd.Categorical(np.repeat(codes, 60)),
            "method": pd.Categorical(np.tile(np.repeat(METHODS, 20), participants)),
            "direction": pd.Categorical(np.tile(["forward", "backward"], 30 * participants)),
            "correct": pd.array((rng.random(60 * participants) < 0.8).astype(int), dtype="Int64"),
            "response_time_s": rng.random(60 * participants),
            "response_time_valid": pd.array(np.ones(60 * participants, dtype=int), dtype="Int64"),
            "response_source": pd.Categorical(["synthetic"] * (60 * participants)),
            "gun": pd.Categorical(["simulated"] * (60 * participants)),
        }
    )
    ratings = pd.DataFrame(
        {
            "participant_id": pd.Categorical(np.repeat(codes, 3)),
            "method": pd.Categorical(np.tile(METHODS, participants)),
            "rating": rng.uniform(0.0, 10.0, 3 * participants),
            "rating_by": pd.Categorical(["synthetic"] * (3 * participants)),
            "gun": pd.Categorical(["simulated"] * (3 * participants)),
        }
    )
    return Logs(trials=trials, ratings=ratings, problems=(), paths=())


def test_a_thousand_participants_are_counted() -> None:
    found = summarize(_crowd(1_000)).to_dict()
    assert (found["direction"]["n"], found["preference"]["n"]) == (1_000, 1_000)
