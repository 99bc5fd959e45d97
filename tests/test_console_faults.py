"""What a console's window does while gun or disk do not: it stays awake, says so, and records nothing that was not.

Each case is a program of its own (`tests.faulty_console`) in which the simulated gun or the disk is given a fault.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from experiments import run as runs
from experiments.record.journal import Contents, read_journal
from experiments.record.replay import history
from experiments.run_request import RunRequest
from experiments.session.steps import Answered, Ask, Failed, Fired, FireShot
from experiments.study.folders import place
from tests.faulty_console import PATIENCE_S, SETUP, SLOW_SYNC_S, TRIALS, child

pytest.importorskip("PyQt6")
pytestmark = pytest.mark.slow


Case = Callable[[str], tuple[dict[str, Any], Contents, list[dict[str, str]]]]


@pytest.fixture
def case(tmp_path: Path) -> Case:
    """Runs a case: what its window saw, its journal and its table."""

    def carry_out(name: str) -> tuple[dict[str, Any], Contents, list[dict[str, str]]]:
        seen = child(name, tmp_path)
        where = place(tmp_path, "P01", "direction")
        with where.table.open(newline="", encoding="utf-8") as file:
            return seen, read_journal(where.journal), list(csv.DictReader(file))

    return carry_out


def check_awake(seen: dict[str, Any]) -> None:
    """The window's thread was at work while the gun hung."""
    assert seen["ticks_in_fault"] > 0


def check_answers(contents: Contents) -> None:
    """Every answer belongs to a shot that was fired just before it, and none to one that failed."""
    told_so_far = history(contents)
    for place_, (step, word) in enumerate(told_so_far):
        if isinstance(step, Ask) and isinstance(word, Answered):
            before, shot = told_so_far[place_ - 1]
            assert isinstance(before, FireShot)
            assert isinstance(shot, Fired)
            assert before.trial == step.trial


@pytest.mark.parametrize(("fault", "cause"), [("hangs", "no answer within 1 s"), ("link", "the line is dead")])
def test_a_shot_that_fails_is_marked_said_and_presented_again_while_the_window_stays_awake(
    case: Case, fault: str, cause: str
) -> None:
    seen, contents, rows = case(fault)
    if fault == "hangs":
        check_awake(seen)
    check_answers(contents)
    failed = [(step, word) for step, word in history(contents) if isinstance(word, Failed)]
    assert [(step.trial.trial, word.cause) for step, word in failed] == [(2, cause)]
    assert [(row["attempts"], row["flags"]) for row in rows] == [
        ("1", ""),
        ("2", "device-error"),
        *[("1", "")] * (TRIALS - 2),
    ]
    assert all(row["response"] for row in rows)
    assert any(cause in line for line in seen["lines"])
    assert seen["asking"]
    assert not any(cause in line for line in seen["asking"])  # it is fired anew: the gun answers again
    assert contents.finished


def test_a_gun_that_answers_late_changes_nothing_but_the_time(case: Case) -> None:
    seen, contents, rows = case("late")
    check_awake(seen)
    check_answers(contents)
    assert [(row["attempts"], row["flags"]) for row in rows] == [("1", "")] * TRIALS
    assert "Firing" in seen["titles"]


def test_a_gun_that_vanishes_stops_the_run_with_nothing_answered_for_it(case: Case) -> None:
    seen, contents, rows = case("vanishes")
    check_answers(contents)
    assert "switch off its power" in seen["stopped"]
    assert contents.records[-1].kind == "stopped"
    assert [bool(row["response"]) for row in rows] == [True] + [False] * (TRIALS - 1)
    assert "Stopped" in seen["titles"]


def test_what_was_fired_when_the_gun_vanished_is_marked_and_presented_again_on_resumption(
    case: Case, tmp_path: Path
) -> None:
    from experiments.clock import VirtualClock
    from experiments.screens.synthetic import synthetic_screen

    case("vanishes")
    request = RunRequest(setup=SETUP, participant_id="P01", results=tmp_path, again="resume")
    done = runs.run(request, synthetic_screen, VirtualClock())
    with done.place.table.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert (rows[1]["attempts"], rows[1]["flags"]) == ("2", "interrupted")
    assert all(row["response"] for row in rows)


def test_the_emergency_stop_disarms_at_once_while_a_shot_hangs_and_stops_the_run(case: Case) -> None:
    seen, contents, rows = case("hangs-emergency")
    check_awake(seen)
    check_answers(contents)
    first_s = next(at_s for at_s in seen["disarmed_s"] if at_s >= seen["pressed_s"])
    assert first_s <= seen["hung_until_s"] < seen["pressed_s"] + PATIENCE_S  # it hangs until it is disarmed
    assert seen["shots"] == 2
    assert seen["stopped"] == "emergency stop"
    assert [bool(row["response"]) for row in rows] == [True] + [False] * (TRIALS - 1)
    assert contents.records[-1].reason == "emergency stop"


def test_a_disk_whose_sync_takes_200_ms_keeps_no_window_waiting(case: Case) -> None:
    seen, contents, rows = case("slow-disk")
    check_awake(seen)
    check_answers(contents)
    times = [record.monotonic_s for record in contents.records]
    assert times[-1] - times[0] > SLOW_SYNC_S * (len(times) - 1)
    assert [(row["attempts"], row["flags"]) for row in rows] == [("1", "")] * TRIALS


def test_bad_news_have_their_colour_and_nothing_good_stays_below_a_run_whose_disk_failed() -> None:
    seen = child("window-alone")
    assert seen["bad"] == seen["wanted"]
    assert seen["below"] == ["Saved. Note.", ""]


def test_a_signal_that_comes_before_the_run_has_begun_ends_it_with_nothing_fired(case: Case) -> None:
    seen, contents, rows = case("signalled")
    assert (seen["stopped"], seen["shots"]) == ("SIGTERM", 0)
    assert contents.records[-1].kind == "stopped"
    assert not any(row["response"] for row in rows)


def test_a_window_that_can_no_longer_be_drawn_stops_the_run_instead_of_standing_still(case: Case) -> None:
    seen, contents, _ = case("undrawable")
    assert seen["stopped"].startswith(
        "the console failed: ZeroDivisionError: division by zero (faulty_console.py, line"
    )
    assert contents.records[-1].kind == "stopped"
    check_answers(contents)
