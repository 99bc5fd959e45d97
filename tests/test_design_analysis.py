"""Logs of designs from a results folder to statistics, figures and report: what is read, left out, and found."""

from __future__ import annotations

import csv
import io
import json
import math
import statistics

import pytest

from analysis.archive.bids import data_set, runs_of
from analysis.logs.reading import read_logs
from analysis.report.figures import style
from analysis.summary.analyze import Request, analyze
from analysis.summary.figures.designs import figure_design
from analysis.summary.summary import summarize
from analysis.summary.tables_out import result_tables
from experiments.clock import VirtualClock
from experiments.load import load_setup, shipped_folder
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from tests.bids_validator import validated
from tests.designs import ADAPTIVE, OF_THE_PAPER, SHIPPED, path_of

pytestmark = pytest.mark.slow

NAMES = [name for name in SHIPPED if name not in (*OF_THE_PAPER, *ADAPTIVE)]
PEOPLE = 4


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A results folder with four people's logs of each design that has no table of its own."""
    folder = tmp_path_factory.mktemp("results")
    for name in NAMES:
        setup = load_setup(str(path_of(name)))
        for number in range(1, PEOPLE + 1):
            request = RunRequest(setup=setup, participant_id=f"P0{number}", results=folder, seed=number)
            run(request, synthetic_screen, VirtualClock())
    return folder


@pytest.fixture(scope="module")
def found(results):
    return summarize(read_logs([results])).designs


def log(results, name, code="P01"):
    return next((results / f"sub-{code}").glob(f"*_task-{name}_*.csv"))


def test_every_design_is_read_by_its_journal_and_has_its_statistics(results, found):
    logs = read_logs([results])
    assert logs.problems == ()
    assert len(logs.files) == len(NAMES) * PEOPLE
    assert sorted(found) == sorted(NAMES)
    assert {one.n for one in found.values()} == {PEOPLE}


def long_table(results, name):
    logs = read_logs([results])
    data = result_tables(logs, {})[f"{name}_long.csv"]
    assert b"\r\n" in data
    return list(csv.DictReader(io.StringIO(data.decode(), newline="")))


def test_the_long_table_of_a_design_has_each_persons_scores_of_each_condition(results, found):
    rows = long_table(results, "realism")
    assert [*rows[0]] == [
        "study", "participant_id", "damper", "voltage_V", "trials", "realism_answers", "realism_mean",
        "comfort_answers", "comfort_mean",
    ]  # fmt: skip
    assert len(rows) == PEOPLE * 6
    for cell in found["realism"].questions["realism"].cells:
        some = [row for row in rows if (row["damper"], float(row["voltage_V"])) == tuple(cell.levels.values())]
        assert statistics.fmean(float(row["realism_mean"]) for row in some) == pytest.approx(cell.mean)
        assert sum(int(row["trials"]) for row in some) == cell.trials


def test_the_long_table_counts_right_answers_by_group_and_catch_trials_without_a_level(results, found):
    rows = long_table(results, "detection")
    caught = [row for row in rows if row["pulse_s"] == ""]
    assert len(caught) == PEOPLE
    for cell in found["detection"].questions["felt"].cells:
        level = str(cell.levels.get("pulse_s", ""))
        assert sum(int(row["felt_right"]) for row in rows if row["pulse_s"] == level) == cell.right
    assert {row["grip"] for row in long_table(results, "grip")} == {"one hand", "two hands"}
    strengths = [float(row["strength_log_mean"]) for row in long_table(results, "magnitude")]
    assert all(math.isfinite(one) for one in strengths)
    chosen = long_table(results, "pairs")
    assert sum(int(row["rather_first"]) + int(row["rather_second"]) for row in chosen) == PEOPLE * 20
    assert [*chosen[0]][2:4] == ["method_1", "method_2"]


@pytest.mark.parametrize(
    ("name", "question", "tests"),
    [
        ("voltages", "response", [("anova", "voltage_V"), ("anova", "direction"), ("anova", "voltage_V × direction")]),
        (
            "detection",
            "felt",
            [
                ("anova", "pulse_s"),
                ("tukey", "0.004 – 0.003"),
                ("tukey", "0.005 – 0.003"),
                ("tukey", "0.005 – 0.004"),
                ("d_prime", "stimulus"),
                ("criterion", "stimulus"),
                ("d_prime", "pulse_s 0.003"),
            ],
        ),
        ("magnitude", "strength", [("exponent", "pulse_s"), ("anova", "pulse_s")]),
        ("realism", "comfort", [("anova", "damper"), ("anova", "voltage_V"), ("anova", "damper × voltage_V")]),
        ("grip", "realism", [("anova", "grip"), ("anova", "method"), ("anova", "grip × method")]),
        ("pairs", "rather", []),
    ],
)
def test_which_test_there_is_follows_from_the_factors(found, name, question, tests):
    said = [(test.name, test.effect) for test in found[name].questions[question].tests]
    assert said[: len(tests)] == tests


def test_conditions_stand_in_the_order_of_the_design(found):
    cells = found["voltages"].questions["response"].cells
    levels = found["voltages"].factors
    assert [tuple(cell.levels.values()) for cell in cells] == [
        (volts, way) for volts in levels["voltage_V"] for way in levels["direction"]
    ]


def test_of_pairs_each_level_has_how_often_it_was_chosen(found):
    question = found["pairs"].questions["rather"]
    assert question.preferred is not None
    assert [cell.levels["method"] for cell in question.preferred] == list(found["pairs"].factors["method"])
    assert sum(cell.mean for cell in question.preferred) == pytest.approx(len(question.preferred) / 2)


def test_bars_of_several_series_over_numbers_stand_side_by_side(found, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(style, "save", lambda figure, _: drawn.append(figure))
    figure_design(found["voltages"], tmp_path / "figure")
    (axes,) = drawn[0].axes
    forward, backward = ([float(x) for x in series.lines[0].get_xdata()] for series in axes.containers)
    assert all(x < other for x, other in zip(forward, backward, strict=True))
    assert [(x + other) / 2 for x, other in zip(forward, backward, strict=True)] == pytest.approx(axes.get_xticks())


def test_the_file_has_each_design_beside_the_two_experiments_and_the_report_its_figure(results, tmp_path):
    out = tmp_path / "analysis"
    analyze(Request(paths=[results], out=out))
    written = json.loads((out / "statistics.json").read_text())
    assert set(NAMES) <= set(written)
    assert set(written["voltages"]) >= {"n", "factors", "questions"}
    assert set(written["voltages"]["questions"]["response"]) >= {"kind", "cells", "tests"}
    page = (out / "report.html").read_text()
    for name in NAMES:
        assert written[name]["title"] in page
        assert (out / "figures" / f"figure-{name}.png").is_file()


def test_a_log_without_its_journal_is_left_out_and_the_reason_is_told(results, tmp_path):
    alone = tmp_path / "sub-P01" / log(results, "grip").name
    alone.parent.mkdir()
    alone.write_bytes(log(results, "grip").read_bytes())
    logs = read_logs([tmp_path])
    assert logs.files == ()
    assert "which says what the columns mean" in logs.problems[0].message


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (b"P01,grip,1,one hand", b"P01,grip,1,no hand", "not allowed"),
        (b"P01,grip,1,one hand", b"P01,grip,1,two hands", "not what was planned"),
        (b"P01,grip,1,one hand", b"P02,grip,1,one hand", "participant"),
        (b"participant_id,", b"who,", "missing are participant_id"),
    ],
)
def test_an_edited_log_is_left_out_with_its_reason(results, tmp_path, old, new, said):
    there = log(results, "grip")
    copy = tmp_path / "sub-P01" / there.name
    copy.parent.mkdir()
    content = there.read_bytes()
    assert old in content
    copy.write_bytes(content.replace(old, new, 1) if old != b"participant_id," else content.replace(old, new))
    beside = there.name.replace("_trials.csv", "_journal.jsonl")
    whole = (there.parent / beside).read_bytes().splitlines(keepends=True)
    (copy.parent / beside).write_bytes(b"".join(whole[:-1]))  # of an unfinished run the table's hash is not known
    problems = read_logs([tmp_path]).problems
    assert len(problems) == 1
    assert said in problems[0].message


def test_logs_of_another_design_under_the_same_name_are_left_out(results, tmp_path):
    text = path_of("grip").read_text().replace("maximum = 7.0", "maximum = 9.0")
    for name in ("gun.toml", "synthetic"):
        (tmp_path / name).symlink_to(shipped_folder() / name)
    (tmp_path / "grip.toml").write_text(text)
    setup = load_setup(str(tmp_path / "grip.toml"))
    run(RunRequest(setup=setup, participant_id="X1", results=tmp_path / "r", seed=1), synthetic_screen, VirtualClock())
    logs = read_logs([results, tmp_path / "r"])
    assert len(logs.files) == len(NAMES) * PEOPLE
    assert "another design" in logs.problems[0].message


def test_designs_are_exported_as_tasks_of_a_bids_data_set(results, tmp_path):
    logs = read_logs([results])
    files = data_set(runs_of(logs), {}, "designs", "0")
    for name in NAMES:
        told = json.loads(files[f"task-{name}_beh.json"])
        assert told["TaskName"] == name
        lines = files[f"sub-P01/beh/sub-P01_task-{name}_beh.tsv"].decode().splitlines()
        header = lines[0].split("\t")
        assert set(header) <= set(told)
        assert "note" not in header
    felt = files["sub-P01/beh/sub-P01_task-detection_beh.tsv"].decode().splitlines()
    correct = felt[0].split("\t").index("correct")
    assert {line.split("\t")[correct] for line in felt[1:]} == {"0", "1"}
    people = files["participants.tsv"].decode().splitlines()
    assert [line.split("\t")[-2:] for line in people] == [
        ["synthetic", "group"], ["true", "one hand"], ["true", "two hands"], ["true", "one hand"], ["true", "two hands"]
    ]  # fmt: skip
    assert "group" in json.loads(files["participants.json"])


def test_bids_takes_an_exported_design(results, tmp_path):
    out = tmp_path / "bids"
    for path, content in data_set(runs_of(read_logs([results])), {}, "designs", "0").items():
        (out / path).parent.mkdir(parents=True, exist_ok=True)
        (out / path).write_bytes(content)
    assert [one for one in validated(out) if one["severity"] == "error"] == []
