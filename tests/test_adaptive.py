"""Levels that are chosen by the answers so far: with corrections, repeats, ends, cuts and resumption."""

from __future__ import annotations

import csv
import random
from dataclasses import replace
from pathlib import Path

import pytest

from analysis.logs.reading import read_logs
from experiments.clock import VirtualClock
from experiments.design.planning import plan_of
from experiments.record.design_table import design_rows
from experiments.record.journal import Contents, Record, read_journal
from experiments.record.rebuild import table
from experiments.record.replay import history as told_by
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.session.steps import step_record
from tests.adaptive_kills import killed_until_done, unbroken
from tests.adaptive_runs import (
    KINDS,
    adaptive,
    check_ends,
    check_levels,
    check_rows,
    cut_and_resumed,
    step_after_cut,
    step_after_that,
    undone_run,
)

SETUPS = {kind: adaptive(kind) for kind in KINDS}


@pytest.fixture(scope="module")
def undone(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Contents]]:
    """Runs with corrections and repeats at about every other trial, some of each kind."""
    folder = tmp_path_factory.mktemp("undone")
    return {
        kind: [
            undone_run(setup, plan_of(setup.config, "P01", seed), folder / kind, seed, share=0.4) for seed in range(2)
        ]
        for kind, setup in SETUPS.items()
    }


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_after_corrections_and_repeats_the_next_level_is_as_if_the_answers_had_been_given_at_once(
    kind: str, undone: dict[str, list[Contents]]
) -> None:
    assert sum(check_levels(SETUPS[kind], contents) for contents in undone[kind]) > 20


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_no_row_has_an_answer_to_another_stimulus_than_its_own_whenever_a_run_stops(
    kind: str, undone: dict[str, list[Contents]]
) -> None:
    assert sum(check_rows(SETUPS[kind], contents) for contents in undone[kind]) > 200


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_run_ends_when_every_track_is_over_by_the_answers_as_they_count_in_the_end(
    kind: str, undone: dict[str, list[Contents]]
) -> None:
    for contents in undone[kind]:
        check_ends(SETUPS[kind], contents)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_run_that_is_cut_off_anywhere_stands_where_the_unbroken_one_stood(
    kind: str, undone: dict[str, list[Contents]]
) -> None:
    contents = undone[kind][0]
    data, draw = contents.path.read_bytes(), random.Random(1)
    for at in (draw.randrange(data.index(b"\n") + 1, len(data)) for _ in range(10)):
        wanted = step_after_that(contents, data[:at].count(b"\n"))
        step = step_after_cut(SETUPS[kind], contents, data[:at])
        if wanted is not None:
            assert step is not None
            assert step_record(step) == step_record(wanted)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_run_that_was_cut_off_and_goes_on_chooses_by_the_answers_that_count(
    kind: str, undone: dict[str, list[Contents]], tmp_path: Path
) -> None:
    contents = undone[kind][1]
    size = contents.path.stat().st_size
    at = random.Random(KINDS.index(kind)).randrange(contents.path.read_bytes().index(b"\n") + 1, size)
    whole = cut_and_resumed(SETUPS[kind], contents, at, tmp_path)
    assert check_levels(SETUPS[kind], whole) > 10
    check_ends(SETUPS[kind], whole)


def test_a_trial_that_breaks_off_after_its_answer_is_felt_again_at_the_same_level(
    undone: dict[str, list[Contents]], tmp_path: Path
) -> None:
    contents = undone["up-down"][0]
    rated = next(at for at, line in enumerate(contents.records) if _is_step(line, "rate"))
    lines = contents.path.read_bytes().splitlines(keepends=True)
    whole = cut_and_resumed(SETUPS["up-down"], contents, sum(map(len, lines[: rated + 1])), tmp_path)
    before, again = _levels(replace(whole, records=whole.records[:rated])), _levels(whole)
    assert again[len(before)] == before[-1]
    assert check_levels(SETUPS["up-down"], whole) > 10


@pytest.mark.slow
def test_a_run_that_is_killed_and_resumed_feels_what_the_unbroken_one_felt(tmp_path: Path) -> None:
    whole = unbroken("pairs", tmp_path / "unbroken")
    for attempt in range(20):  # on a busy machine a run may be done before it is killed
        kills, rows = killed_until_done("pairs", tmp_path / f"killed{attempt}", random.Random(attempt), 3)
        assert rows == whole
        if kills:
            return
    pytest.fail("no run was killed before it was done")


@pytest.mark.slow
def test_logs_of_another_procedure_are_left_out_as_their_levels_rest_on_other_priors(tmp_path: Path) -> None:
    for place, kind in enumerate(("posterior", "posterior", "posterior-ends"), start=1):
        request = replace(_request(SETUPS[kind], tmp_path), participant_id=f"P0{place}")
        run(request, synthetic_screen, VirtualClock())
    (problem,) = read_logs([tmp_path]).problems
    assert problem.participant == "P03"
    assert "was made with another design 'threshold'" in problem.message


def test_rows_that_a_track_did_not_need_are_marked(tmp_path: Path) -> None:
    setup = SETUPS["up-down"]
    done = run(_request(setup, tmp_path), synthetic_screen, VirtualClock())
    contents = read_journal(done.place.journal)
    whole = design_rows(contents.plan, told_by(contents), setup.config)
    kept = {bool(row["attempts"]): row["flags"] for row in whole}
    assert kept == {True: kept[True], False: "track-over"}
    cut = design_rows(contents.plan, told_by(replace(contents, records=contents.records[:30])), setup.config)
    assert not any(row["flags"] for row in cut if row["attempts"] is None)


def test_a_run_without_corrections_asks_no_more_trials_than_its_tracks_need(tmp_path: Path) -> None:
    setup = SETUPS["up-down"]
    done = run(_request(setup, tmp_path), synthetic_screen, VirtualClock())
    with done.place.table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 24
    for number in ("1", "2"):
        track = [row for row in rows if row["track"] == number]
        felt = [row for row in track if row["response"]]
        assert track[: len(felt)] == felt
        assert all(row["voltage_V"] and row["attempts"] == "1" for row in felt)
        assert not any(row["voltage_V"] or row["onset_utc"] for row in track[len(felt) :])
    assert any(not row["response"] for row in rows)


def test_the_same_seed_makes_the_same_levels_and_the_table_is_made_again_byte_for_byte(
    undone: dict[str, list[Contents]], tmp_path: Path
) -> None:
    setup, contents = SETUPS["posterior"], undone["posterior"][1]
    again = undone_run(setup, contents.plan, tmp_path, 1, share=0.4)
    assert _levels(again) == _levels(contents)
    assert table(contents) == table(contents)


def _request(setup, results: Path) -> RunRequest:
    return RunRequest(setup=setup, participant_id="P01", results=results, seed=4)


def _levels(contents: Contents) -> list[object]:
    return [line.body["chosen"] for line in contents.records if _is_step(line, "fire")]


def _is_step(line: Record, kind: str) -> bool:
    return line.kind == "step" and isinstance(line.body, dict) and line.body["kind"] == kind
