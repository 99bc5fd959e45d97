"""`recoil study` as its users call it: real processes over real runs, what they say and how they end."""

from __future__ import annotations

import json
import os
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from experiments.clock import Clock, VirtualClock
from experiments.load import load_setup
from experiments.record.journal import hold_journal
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study.enrolment import code_prefix_of, not_on_record
from experiments.study.new_study import new_study
from experiments.study.register import append, entry
from tests.at_terminal import AtTerminal
from tests.conftest import Recoil, refused
from tests.waiting import PATIENCE_S
from tests.warm_start import warm

pytestmark = pytest.mark.slow

RIGHT = ("--age", 25, "--sex", "female", "--handedness", "right")


@pytest.fixture
def pilot(tmp_path: Path) -> Path:
    """A new study whose orders are balanced by a Latin square of three rows."""
    new_study(tmp_path / "pilot")
    for name in ("direction", "preference"):
        config = tmp_path / "pilot" / f"{name}.toml"
        text = config.read_text().replace('sessions = "random"', 'sessions = "latin-square"')
        config.write_text(text.replace('trials = "random"', 'trials = "latin-square"'))
    return tmp_path / "pilot"


def do(
    pilot: Path, code: str, experiment: str = "direction", results: Path | None = None, clock: Clock | None = None
) -> None:
    """A run at a terminal, as a person does it; for speed it is typed by the screen of a synthetic participant."""
    setup, where = load_setup(str(pilot / f"{experiment}.toml")), results or pilot / "results"
    request = RunRequest(setup=setup, participant_id=code, results=where, screen="terminal")
    run(request, synthetic_screen, clock or VirtualClock())


def told(recoil: Recoil, *more: object, folder: str = "pilot", code: int = 0) -> Any:
    done = recoil("study", folder, "--json", *more)
    assert done.returncode == code, done
    return json.loads(done.stdout)


def states(found: Any) -> dict[str, list[str]]:
    return {
        one["participant_id"]: [run["state"] for run in one["experiments"].values()] for one in found["participants"]
    }


def journal_of(pilot: Path, code: str, experiment: str = "direction") -> Path:
    return pilot / "results" / f"sub-{code}" / f"sub-{code}_task-{experiment}_journal.jsonl"


def cut(journal: Path, lines: int) -> int:
    """The journal as a power cut would leave it: so many whole lines and a part of the next. The answers it holds."""
    whole = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(whole[:lines]) + whole[lines][:20])
    return sum(b'"kind":"answered"' in line for line in whole[:lines])


# looking


def test_a_new_study_has_nobody_and_its_first_code_comes_next(recoil: Recoil, pilot: Path) -> None:
    found = told(recoil)
    assert found["participants"] == []
    assert (found["next"]["participant_id"], found["next"]["new"]) == ("P01", True)
    assert found["next"]["orders"]["direction"] == ["vibration", "asymmetric-1", "asymmetric-2"]
    assert not (pilot / "results" / "participants.jsonl").exists()


def test_the_table_tells_who_is_done_in_progress_and_next(recoil: Recoil, pilot: Path) -> None:
    recoil("study", "pilot", "--join", "P01", *RIGHT)
    clock = VirtualClock()
    for experiment in ("direction", "preference"):
        do(pilot, "P01", experiment, clock=clock)
    do(pilot, "P02")
    answered = cut(journal_of(pilot, "P02"), 40)
    assert answered
    done = recoil("study", "pilot")
    assert (done.returncode, done.stderr) == (0, "")
    row = next(line for line in done.stdout.splitlines() if "P01" in line)
    assert row.replace("│", " ").split() == ["P01", "25", "female", "right", "done", "done"]
    assert re.search(rf"in progress, {answered} of 60 trials, last record \w+ \d+ \w+ \d{{4}}, \d\d:\d\d", done.stdout)
    assert "asymmetric-1 > asymmetric-2 > vibration" in done.stdout
    assert "1 of 14 participants done, 0 excluded" in done.stdout
    assert "Next: P02\n  direction: asymmetric-1 > asymmetric-2 > vibration (go on with --resume)" in done.stdout


def test_the_next_order_that_is_shown_is_the_one_the_run_gets(recoil: Recoil, pilot: Path) -> None:
    for code in ("P01", "P02", "P03", "P04"):
        shown = told(recoil)["next"]
        assert shown["participant_id"] == code
        for experiment in ("direction", "preference"):
            do(pilot, code, experiment)
        runs = told(recoil)["participants"][-1]["experiments"]
        assert {experiment: run["methods"] for experiment, run in runs.items()} == shown["orders"]


def test_a_random_order_is_not_foretold(recoil: Recoil, tmp_path: Path) -> None:
    recoil("new", "pilot")
    assert told(recoil)["next"]["orders"] == {"direction": None, "preference": None}
    assert "order drawn when the run begins" in recoil("study", "pilot").stdout


def test_a_results_folder_is_its_studys_and_without_one_the_shipped_studys(recoil: Recoil, pilot: Path) -> None:
    do(pilot, "P01")
    do(pilot, "P01", results=pilot.parent / "elsewhere")
    assert told(recoil, folder="pilot/results") == told(recoil)
    assert told(recoil, folder="elsewhere")["planned_participants"] == 14
    assert states(told(recoil, folder="elsewhere")) == {"P01": ["done", "not begun"]}
    assert "elsewhere: no study.toml here or in the folder above" in recoil("study", "elsewhere").stderr


def test_other_results_beside_a_studys_file_are_its_own(recoil: Recoil, pilot: Path) -> None:
    config = pilot / "study.toml"
    config.write_text(config.read_text().replace("participants = 14", "participants = 3"))
    do(pilot, "P01", results=pilot / "simulated")
    assert told(recoil, folder="pilot/simulated")["planned_participants"] == 3
    assert recoil("study", "pilot/simulated").stderr == ""


def test_a_study_ends_when_its_participants_are_done(recoil: Recoil, pilot: Path) -> None:
    config = pilot / "study.toml"
    text = config.read_text().replace("participants = 14", "participants = 1")
    config.write_text(text.replace('"direction.toml", "preference.toml"', '"preference.toml"'))
    do(pilot, "P01", "preference")
    assert told(recoil)["next"] is None
    assert "Next: nobody, the study is done" in recoil("study", "pilot").stdout


# a journal that is cut off, empty, damaged, or being written


@pytest.mark.parametrize(("lines", "state"), [(0, "not begun"), (1, "in progress"), (40, "in progress")])
def test_a_journal_cut_off_is_read_and_left_as_it_is(recoil: Recoil, pilot: Path, lines: int, state: str) -> None:
    do(pilot, "P01")
    answered = cut(journal_of(pilot, "P01"), lines)
    before = journal_of(pilot, "P01").read_bytes()
    run = told(recoil)["participants"][0]["experiments"]["direction"]
    assert (run["state"], run["answered"]) == (state, answered)
    assert journal_of(pilot, "P01").read_bytes() == before


def test_looking_while_a_run_writes_disturbs_neither(recoil: Recoil, pilot: Path) -> None:
    words = ["run", "direction.toml", "--participant", "P01", "--screen", "synthetic"]
    for number in range(1, 4):
        words[3] = f"P{number:02d}"
        running = subprocess.Popen(warm(*words), cwd=pilot, stdout=subprocess.DEVNULL)
        while running.poll() is None:
            assert all(one[1] == "not begun" for one in states(told(recoil)).values())
        assert running.returncode == 0
    assert states(told(recoil)) == {f"P{number:02d}": ["synthetic", "not begun"] for number in range(1, 4)}


@pytest.mark.parametrize("lines", [0, 40])
def test_a_run_that_another_process_is_at_is_open_elsewhere_until_it_lets_go(
    recoil: Recoil, pilot: Path, lines: int
) -> None:
    do(pilot, "P01")
    answered = cut(journal_of(pilot, "P01"), lines)
    descriptor = hold_journal(journal_of(pilot, "P01"))
    found = told(recoil)
    run = found["participants"][0]["experiments"]["direction"]
    assert (run["state"], run["answered"]) == ("open elsewhere", answered)
    assert found["next"]["participant_id"] == "P02"
    assert "open elsewhere" in recoil("study", "pilot").stdout
    os.close(descriptor)
    assert states(told(recoil))["P01"][0] == ("in progress" if lines else "not begun")


def test_when_all_who_are_left_sit_at_a_console_the_study_is_not_called_done(recoil: Recoil, pilot: Path) -> None:
    config = pilot / "study.toml"
    config.write_text(config.read_text().replace("participants = 14", "participants = 1"))
    do(pilot, "P01")
    cut(journal_of(pilot, "P01"), 40)
    descriptor = hold_journal(journal_of(pilot, "P01"))
    assert "Next: nobody waits; at a console now: P01" in recoil("study", "pilot").stdout
    os.close(descriptor)


def test_a_finished_run_is_done_whoever_still_looks_at_it(recoil: Recoil, pilot: Path) -> None:
    do(pilot, "P01")
    descriptor = hold_journal(journal_of(pilot, "P01"))
    assert states(told(recoil)) == {"P01": ["done", "not begun"]}
    os.close(descriptor)


def test_results_that_may_only_be_read_are_shown(recoil: Recoil, pilot: Path) -> None:
    do(pilot, "P01")
    cut(journal_of(pilot, "P01"), 40)
    journal_of(pilot, "P01").chmod(0o400)
    assert states(told(recoil)) == {"P01": ["in progress", "not begun"]}


def test_a_practice_is_told_once_it_was_done_to_its_end(recoil: Recoil, pilot: Path) -> None:
    setup = load_setup(str(pilot / "direction.toml"))
    request = RunRequest(setup=setup, participant_id="P01", results=pilot / "results", practice=True, screen="terminal")
    practice = run(request, synthetic_screen, VirtualClock()).place.journal
    whole = practice.read_bytes()
    assert told(recoil)["participants"][0]["experiments"]["direction"]["practised"]
    assert "practice done" in recoil("study", "pilot").stdout
    practice.write_bytes(whole[: whole.rfind(b"{")])
    assert not told(recoil)["participants"][0]["experiments"]["direction"]["practised"]
    practice.with_name(f"{practice.stem}.aside-1.jsonl").write_bytes(whole)
    assert told(recoil)["participants"][0]["experiments"]["direction"]["practised"]


def test_what_cannot_be_read_is_listed_once_and_the_rest_is_shown(recoil: Recoil, pilot: Path) -> None:
    for code in ("P01", "P02", "P03"):
        do(pilot, code)
    whole = journal_of(pilot, "P02").read_bytes().splitlines(keepends=True)
    journal_of(pilot, "P02").write_bytes(b"".join([*whole[:5], b"damage\n", *whole[6:]]))
    journal_of(pilot, "P03").write_bytes(journal_of(pilot, "P01").read_bytes())
    (pilot / "results" / "sub-Jane Doe").mkdir()
    done = recoil("study", "pilot")
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    problems = done.stderr.splitlines()
    assert len(problems) == 3
    assert "sub-Jane Doe" in problems[0]
    assert "sub-P02_task-direction_journal.jsonl: line 6" in problems[1]
    assert "is of participant P01" in problems[2]
    assert states(told(recoil, code=1)) == {
        "P01": ["done", "not begun"],
        "P02": ["unreadable", "not begun"],
        "P03": ["unreadable", "not begun"],
    }


def test_a_damaged_register_is_listed_and_stops_changes_but_not_looking(recoil: Recoil, pilot: Path) -> None:
    do(pilot, "P01")
    (pilot / "results" / "participants.jsonl").write_text("damage\n")
    done = recoil("study", "pilot")
    assert done.returncode == 1
    assert done.stderr.count("participants.jsonl: line 1") == done.stderr.count("\n") == 1
    assert "P01" in done.stdout
    refused(recoil("study", "pilot", "--exclude", "P01", "--reason", "left"), "participants.jsonl: line 1", "restore")
    assert (pilot / "results" / "participants.jsonl").read_text() == "damage\n"


def test_whose_experiments_were_not_in_the_order_of_the_study_is_told(recoil: Recoil, pilot: Path) -> None:
    do(pilot, "P01", "preference")
    assert "order broken:" in recoil("study", "pilot").stdout
    assert told(recoil)["participants"][0]["order_broken"] == ["preference was begun before direction was done"]


# joining, excluding, readmitting


def test_who_joins_has_facts_and_comes_next(recoil: Recoil, pilot: Path) -> None:
    found = told(recoil, "--join", "P07", *RIGHT)
    assert found["participants"][0]["facts"] == {"age_years": 25, "sex": "female", "handedness": "right"}
    assert (found["next"]["participant_id"], found["next"]["new"]) == ("P07", False)
    assert (pilot / "results" / "participants.jsonl").stat().st_mode & 0o077 == 0


@pytest.mark.parametrize(
    ("code", "doubt"),
    [("P1", "P1 is new, and P01 is there"), ("X99", "X99 is new, and the codes of this study begin with P")],
)
def test_who_joins_with_a_code_that_may_be_mistyped_is_asked_about(
    code: str, doubt: str, recoil: Recoil, pilot: Path
) -> None:
    assert recoil("study", "pilot", "--join", "P01", *RIGHT).stderr == ""
    done = recoil("study", "pilot", "--join", code, *RIGHT)
    assert done.returncode == 0
    assert doubt in done.stderr
    assert recoil("study", "pilot", "--join", code, *RIGHT).stderr == ""


def test_facts_are_corrected_and_then_told_if_they_break_a_rule(recoil: Recoil, pilot: Path) -> None:
    recoil("study", "pilot", "--join", "P01", *RIGHT)
    done = recoil("study", "pilot", "--join", "P01", "--age", 35, *RIGHT[2:])
    assert done.returncode == 0
    assert "P01 is not eligible: age_years = 35: must be at most 29" in done.stderr
    one = told(recoil)["participants"][0]
    assert one["facts"]["age_years"] == 35
    assert one["not_eligible"] == ["age_years = 35: must be at most 29"]


def test_who_is_not_eligible_is_refused_and_nothing_is_recorded(recoil: Recoil, pilot: Path) -> None:
    done = recoil("study", "pilot", "--join", "P01", "--age", 35, "--sex", "male", "--handedness", "left")
    refused(done, "age_years = 35: must be at most 29; handedness = left: must be right", "pilot/study.toml")
    assert told(recoil)["participants"] == []


def test_an_exclusion_gives_the_row_to_the_next_one_until_it_is_taken_back(recoil: Recoil, pilot: Path) -> None:
    for code in ("P01", "P02", "P03"):
        for experiment in ("direction", "preference"):
            do(pilot, code, experiment)
    found = told(recoil, "--exclude", "P02", "--reason", "slept [twice]")
    assert found["participants"][1]["excluded"] == "slept [twice]"
    assert found["next"]["participant_id"] == "P04"
    assert found["next"]["orders"] == {
        experiment: run["methods"] for experiment, run in found["participants"][1]["experiments"].items()
    }
    shown = recoil("study", "pilot").stdout
    assert "excluded: slept [twice]" in shown
    assert "2 of 14 participants done, 1 excluded" in shown
    found = told(recoil, "--readmit", "P02", "--reason", "was awake")
    assert found["participants"][1]["excluded"] is None
    assert found["next"]["orders"]["direction"] == found["participants"][0]["experiments"]["direction"]["methods"]


def test_who_left_and_a_code_that_was_nobodys_come_no_more_and_what_was_done_counts(
    recoil: Recoil, pilot: Path
) -> None:
    do(pilot, "P01")
    recoil("study", "pilot", "--join", "X99", *RIGHT)
    assert told(recoil)["next"]["participant_id"] == "P01"
    found = told(recoil, "--left", "P01", "--reason", "moved away")
    assert found["next"]["participant_id"] == "X99"
    found = told(recoil, "--left", "X99", "--reason", "mistyped for P01")
    assert [one["left"] for one in found["participants"]] == ["moved away", "mistyped for P01"]
    assert (found["next"]["participant_id"], found["next"]["new"]) == ("P02", True)
    shown = recoil("study", "pilot").stdout
    assert "comes no more: moved away" in shown
    assert "0 of 14 participants done, 0 excluded, 2 left" in shown
    words = ("--participant", "X99", "--screen", "synthetic", "--seed", 1, "--results", "pilot/results")
    refused(recoil("run", "pilot/direction.toml", *words), "X99 comes no more (mistyped for P01); readmit them")
    refused(recoil("study", "pilot", "--left", "X99", "--reason", "?"), "X99 comes no more (mistyped for P01) already")
    found = told(recoil, "--readmit", "P01", "--reason", "is back")
    assert [one["left"] for one in found["participants"]] == [None, "mistyped for P01"]
    assert found["next"]["participant_id"] == "P01"
    do(pilot, "P01", "preference")
    assert told(recoil, "--left", "P01", "--reason", "done anyway")["next"]["participant_id"] == "P02"
    assert "1 of 14 participants done, 0 excluded, 2 left" in recoil("study", "pilot").stdout


# wrong usage


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--exclude", "P09", "--reason", "left"), ("P09 is not known in pilot/results", "P01")),
        (("--readmit", "P01", "--reason", "back"), ("P01 is not excluded",)),
        (("--readmit", "P09", "--reason", "back"), ("P09 is not known",)),
        (("--exclude", "P01"), ("--exclude: needs --reason",)),
        (("--left", "P01"), ("--left: needs --reason",)),
        (("--exclude", "P01", "--reason", " "), ("reason = ' '", "must say why")),
        (("--exclude", "P01", "--reason", "two\nlines"), ("must say why",)),
        (("--exclude", "P01", "--reason", "x" * 201), ("200",)),
        (("--exclude", "p01", "--reason", "left"), ("'p01' differs from 'P01'",)),
        (("--exclude", "../P01", "--reason", "left"), ("must be 1 to 32 letters and digits",)),
        (("--exclude", "P01", "--readmit", "P01", "--reason", "?"), ("--exclude and --readmit: give one",)),
        (("--reason", "left"), ("--reason: goes with --exclude",)),
        (("--age", 25), ("--age: facts go with --join",)),
        (("--join", "Jane Doe", *RIGHT), ("'Jane Doe'", "use a code, not a name")),
        (("--join", "p01", *RIGHT), ("'p01' differs from 'P01'",)),
        (("--join", "P02", "--age", 25), ("not given: sex, handedness", "eligibility.ask")),
        (("--join", "P02", *RIGHT[:4], "--handedness", "strong"), ("--handedness 'strong'", "'right'")),
        (("--join", "P02", "--age", 0, *RIGHT[2:]), ("--age",)),
        (("--join", "P02", "--age", "young", *RIGHT[2:]), ("--age",)),
        (("--join", "P02", *RIGHT, "--reason", "because"), ("--reason: goes with",)),
    ],
)
def test_what_cannot_be_done_is_refused_and_changes_nothing(
    recoil: Recoil, pilot: Path, words: tuple[str, ...], said: tuple[str, ...]
) -> None:
    append(pilot / "results", entry("joined", "P01", facts={}), VirtualClock())
    before = (pilot / "results" / "participants.jsonl").read_bytes()
    refused(recoil("study", "pilot", *words), *said)
    assert (pilot / "results" / "participants.jsonl").read_bytes() == before


def test_a_fact_that_the_study_does_not_ask_for_is_refused(recoil: Recoil, pilot: Path) -> None:
    text = (pilot / "study.toml").read_text()
    (pilot / "study.toml").write_text(text[: text.index("[eligibility]")])
    refused(recoil("study", "pilot", "--join", "P01", "--age", 25), "age_years", "does not ask")
    assert told(recoil, "--join", "P01")["participants"][0]["facts"]["age_years"] is None


def asked(pilot: Path, code: str = "P01") -> str:
    return not_on_record(pilot / "results", code)


def test_a_run_says_what_the_study_asks_for_and_nobody_said(recoil: Recoil, pilot: Path) -> None:
    missing = "participant P01: age, sex, handedness not on record (rules: "
    assert asked(pilot).startswith(missing)
    words = warm("run", pilot / "direction.toml", "--participant", "P01", "--results", pilot / "results")
    with AtTerminal(words, pilot) as sitting:
        sitting.wait_for(f"recoil: {missing}")
        sitting.wait_for("Trial 1 of 20")
    recoil("study", "pilot", "--join", "P01", *RIGHT)
    assert asked(pilot) == ""
    recoil("study", "pilot", "--join", "P01", *RIGHT[2:], "--age", "70")
    assert "P01: not eligible: age_years = 70: must be at most 29 (rules: " in asked(pilot)


@pytest.mark.parametrize(
    ("code", "said"),
    [("P1", "P01 is there: is it the same person?"), ("X01", "the codes of this study begin with P: is it right?")],
)
def test_a_run_asks_about_a_new_code_that_may_be_mistyped(recoil: Recoil, pilot: Path, code: str, said: str) -> None:
    recoil("study", "pilot", "--join", "P01", *RIGHT)
    words = warm("run", pilot / "direction.toml", "--participant", code, "--results", pilot / "results")
    with AtTerminal(words, pilot) as sitting:
        sitting.wait_for(f"recoil: participant {code} is new, and {said} The run goes on all the same; if the code is")


def test_where_results_lie_in_no_study_nobody_asks_how_codes_begin(pilot: Path, tmp_path: Path) -> None:
    assert code_prefix_of(pilot / "results") == "P"
    (pilot / "study.toml").write_text("title = 1")
    assert code_prefix_of(pilot / "results") == code_prefix_of(tmp_path / "results") == ""


def test_a_run_says_nothing_of_facts_where_none_are_asked_for(pilot: Path) -> None:
    text = (pilot / "study.toml").read_text()
    (pilot / "study.toml").write_text(text[: text.index("[eligibility]")])
    assert asked(pilot) == ""
    (pilot / "study.toml").write_text("title = 1")
    assert "study.toml:1: title = 1" in asked(pilot)
    (pilot / "study.toml").unlink()
    assert asked(pilot) == ""


def test_a_folder_that_is_no_study_is_refused(recoil: Recoil, tmp_path: Path) -> None:
    refused(recoil("study", "nowhere"), "nowhere: no such folder")
    (tmp_path / "other").mkdir()
    refused(recoil("study", "other"), "other: neither a study's folder", "recoil new")
    (tmp_path / "other" / "study.toml").write_text("title = 1\n")
    refused(recoil("study", "other"), "other/study.toml:1: title = 1")
    refused(recoil("study"), "DIR")


def test_consoles_that_join_people_at_once_all_find_them_there(recoil: Recoil, pilot: Path) -> None:
    words = warm("study", "pilot", *RIGHT, "--join")
    environment = {**os.environ, "COLUMNS": "120"}
    started = [
        subprocess.Popen([*words, f"P{n:02d}"], cwd=pilot.parent, env=environment, stdout=subprocess.DEVNULL)
        for n in range(1, 7)
    ]
    assert [one.wait(PATIENCE_S) for one in started] == [0] * 6
    assert list(states(told(recoil))) == [f"P{n:02d}" for n in range(1, 7)]
