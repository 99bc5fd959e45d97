"""What the start window says of participants, and dates as people read them."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from zoneinfo import ZoneInfo

import pytest

from experiments.clock import date_text, time_text
from experiments.screens.console.people import cell_text, coming_text, note_text, remark, stopped_text
from experiments.screens.texts import doubt_text
from experiments.study.enrolment import code_doubt
from experiments.study.folders import Overview
from experiments.study.preregistration import Chain, FreezeStatus
from experiments.study.study import NextParticipant, Participant, RunProgress, RunState
from tests.people import ORDER, someone

STOPPED = RunProgress(
    experiment="direction", state="in progress", answered=12, planned=60, last_utc="2026-11-22T01:09:58.895306Z"
)

# dates


@pytest.mark.parametrize(
    ("utc", "zone", "shown"),
    [  # by the calendar: 22 November 2026 is a Sunday; Berlin is one hour ahead of UTC in winter and two in summer
        ("2026-11-22T01:09:58.895306Z", UTC, "Sun 22 Nov 2026, 01:09"),
        ("2026-11-22T01:09:58.895306Z", ZoneInfo("Europe/Berlin"), "Sun 22 Nov 2026, 02:09"),
        ("2026-07-01T22:30:00Z", ZoneInfo("Europe/Berlin"), "Thu 2 Jul 2026, 00:30"),
        ("2026-12-31T23:59:59+00:00", timezone(timedelta(hours=-8)), "Thu 31 Dec 2026, 15:59"),
        ("", UTC, ""),
        ("yesterday", UTC, "yesterday"),
        ("0001-01-01T00:00:00Z", timezone(timedelta(hours=-8)), "0001-01-01T00:00:00Z"),
    ],
)
def test_a_date_is_local_and_in_one_format(utc: str, zone: timezone, shown: str) -> None:
    assert date_text(utc, zone) == shown


def test_without_a_zone_a_date_is_in_that_of_this_machine() -> None:
    utc = "2026-11-22T01:09:58Z"
    assert date_text(utc) == date_text(utc, datetime.fromisoformat(utc).astimezone().tzinfo)


def test_a_time_of_day_has_hours_and_minutes() -> None:
    assert time_text(datetime(2026, 11, 22, 14, 5, 59, tzinfo=UTC)) == "14:05"


# the table


@pytest.mark.parametrize(
    ("run", "shown"),
    [
        (RunProgress(experiment="direction", state="not begun"), "–"),
        (RunProgress(experiment="direction", state="not begun", practised=True), "–\npractice done"),
        (
            RunProgress(experiment="direction", state="not begun", practised=True, practice_missed=True),
            "–\npractice done, too little right",
        ),
        (RunProgress(experiment="direction", state="done", answered=60, planned=60, last_utc="x"), "done"),
        (RunProgress(experiment="direction", state="unreadable"), "cannot be read"),
        (RunProgress(experiment="direction", state="synthetic"), "synthetic"),
        (RunProgress(experiment="direction", state="open elsewhere"), "open elsewhere"),
    ],
)
def test_a_cell_says_how_a_run_stands(run: RunProgress, shown: str) -> None:
    assert cell_text(run) == shown


def test_a_run_under_way_is_shown_with_its_trials_and_its_date() -> None:
    assert cell_text(STOPPED) == f"in progress, 12 of 60\n{date_text(STOPPED.last_utc)}"


def test_an_exclusion_is_a_note() -> None:
    assert note_text(someone("done", "done", excluded="fell ill")) == "excluded: fell ill"
    assert note_text(someone("done", "done")) == ""


# what is said of a choice


@pytest.mark.parametrize(
    ("states", "experiment", "said", "mood"),
    [
        (("not begun", "not begun"), "direction", "P01 has not begun.", "good"),
        (("done", "not begun"), "preference", "P01 has done direction.", "good"),
        (
            ("synthetic", "not begun"),
            "direction",
            "A synthetic participant did direction as P01; that run is set aside when P01 begins.",
            "good",
        ),
        (("done", "not begun"), "direction", "P01 has done direction.", "bad"),
        (("done", "done"), "direction", "P01 has done everything.", "bad"),
        (("open elsewhere", "not begun"), "direction", "P01 sits at another console.", "bad"),
        (("unreadable", "not begun"), "direction", "The journal of P01's direction cannot be read.", "bad"),
        (
            ("in progress", "not begun"),
            "preference",
            "Order broken: direction comes before preference in this study, and P01 has not done it.",
            "ask",
        ),
    ],
)
def test_what_there_is_to_know_of_a_choice_is_said(
    states: tuple[RunState, RunState], experiment: str, said: str, mood: str
) -> None:
    assert remark("P01", someone(*states), experiment, ORDER) == (said, mood)


def test_of_a_new_code_it_is_said_that_it_is_new_and_of_none_what_to_do() -> None:
    assert remark("P09", None, "direction", ORDER) == ("P09 is new.", "good")
    assert remark("P09", None, "preference", ORDER)[0].startswith("Order broken: direction comes before preference")
    assert remark("", None, "direction", ORDER)[0].startswith("Who comes?")


@pytest.mark.parametrize(("code", "known"), [("P1", "P01"), ("p01", "P01"), ("P001", "P01")])
def test_a_new_code_that_looks_like_one_that_is_there_is_asked_about(code: str, known: str) -> None:
    doubt = code_doubt(code, ["P10", known], "P")
    assert doubt is not None
    assert doubt_text(doubt) == f"{code} is new, and {known} is there: is it the same person?"
    assert code_doubt("P100", ["P10", known], "P") is None


def test_a_new_code_without_the_prefix_of_the_study_is_asked_about() -> None:
    doubt = code_doubt("X99", ["P01"], "P")
    assert doubt is not None
    assert doubt_text(doubt) == "X99 is new, and the codes of this study begin with P: is it right?"
    assert [code_doubt(code, ["X99"], "P") for code in ("X99", "", "X 9", "P99")] == [None] * 4


def test_an_exclusion_is_said_before_all_else() -> None:
    gone = someone("done", "not begun", excluded="fell ill")
    assert remark("P01", gone, "direction", ORDER) == ("P01 is excluded: fell ill.", "bad")


def test_a_stop_is_told_with_its_local_date() -> None:
    assert stopped_text("P01", STOPPED) == (
        f"P01 stopped direction on {date_text(STOPPED.last_utc)} with 12 of 60 trials answered."
    )


# who comes next


NEVER_FROZEN = FreezeStatus(chain=Chain(folder=Path()))


def seen(*people: Participant, coming: NextParticipant | None = None) -> Overview:
    return Overview(participants=people, next=coming, orders={}, problems=(), frozen=NEVER_FROZEN)


def test_who_comes_next_is_said_and_otherwise_why_nobody_does() -> None:
    runs = someone("not begun", "not begun").runs
    assert coming_text(seen(coming=NextParticipant(participant_id="P02", new=True, runs=runs))) == (
        "Next: P02 (new), direction and preference"
    )
    assert coming_text(seen(someone("done", "done"))) == "Everyone has done everything."
    assert coming_text(seen(someone("open elsewhere", "not begun"))) == "Nobody waits; at another console now: P01."
    assert coming_text(seen(someone("unreadable", "done"))) == "Nobody can be named next: see what cannot be read."


def test_the_sentences_of_the_start_window_need_no_window() -> None:
    import ast

    import experiments.screens.console.people as module

    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    assert not [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and "PyQt6" in str(node.module)]
