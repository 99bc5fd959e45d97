"""Runs by a person at a terminal, keys and screen included."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import signal
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from experiments import run as runs
from experiments.clock import RealClock
from experiments.live_run import RunStopped
from experiments.run_request import RunRequest
from experiments.screens.terminal import TerminalScreen
from tests.at_controls import gated
from tests.at_terminal import DAMPER, FIRES, AtTerminal
from tests.conftest import Recoil
from tests.designs import changed
from tests.waiting import PATIENCE_S, stand_still, wait_for
from tests.warm_start import warm

pytestmark = pytest.mark.slow


def recoil_words(configs: Path, experiment: str, *more: object) -> list[object]:
    return ["run", configs / f"{experiment}.toml", "--participant", "P01", "--results", "results", *more]


def run(configs: Path, experiment: str, *more: object) -> list[str]:
    return warm(*recoil_words(configs, experiment, *more))


def rows(folder: Path, name: str) -> list[dict[str, str]]:
    with (folder / "results" / "sub-P01" / f"sub-P01_task-{name}.csv").open(newline="", encoding="utf-8") as table:
        return list(csv.DictReader(table))


@pytest.fixture
def short_configs(quick_configs: Path) -> Path:
    """Experiment 1 with a session of two sets of two trials a method, and breaks of a second."""
    config = quick_configs / "direction.toml"
    changes = {
        "sets": "2",
        "repetitions": "2",
        "between_sets_s": "1.0",
        "between_sessions_s": "60.0",
    }
    text = config.read_text()
    for key, value in changes.items():
        text = re.sub(rf"^{key} = [\d.]+", f"{key} = {value}", text, flags=re.MULTILINE)
    config.write_text(text)
    return quick_configs


def test_experiment_1_from_the_first_hand_over_to_the_table(short_configs: Path, tmp_path: Path) -> None:
    with AtTerminal(run(short_configs, "direction", "--seed", 3), tmp_path) as screen:
        for trial in range(12):
            screen.fire(trial + 1)
            screen.wait_for("b = backward:", trial + 1)
            if trial == 0:
                screen.type("left")
                screen.wait_for("Not an answer")
                screen.wait_for("b = backward:", 2)
            screen.type("f" if trial % 2 else "B")
            screen.wait_for("Saved.", trial + 1)
            if trial in (3, 7):
                second = trial == 7
                screen.wait_for("Break between sessions: 60 s", 3 if second else 1)  # what is refused says it anew
                screen.type("skip")
                screen.wait_for("type `skip` and the reason", 2 if second else 1)
                screen.type("skip fire drill")
            if trial == 0:  # one prompt more was shown for the answer that was none
                screen.seen = screen.seen.replace("b = backward:", "", 1)
        screen.close()
        assert screen.end() == 0
        shown = screen.seen
    assert "Break between sets: 1 s" in shown
    assert "SET THE DAMPER" in shown.upper()
    assert not re.search(r"correct|wrong|score|%", shown, re.IGNORECASE)
    table = rows(tmp_path, "direction_trials")
    assert [row["response"] for row in table] == ["backward", "forward"] * 6
    assert {row["response_source"] for row in table} == {"experimenter"}
    assert {row["response_time_valid"] for row in table} == {"0"}
    journal = (tmp_path / "results/sub-P01/sub-P01_task-direction_journal.jsonl").read_text()
    assert journal.count('"cut_reason":"fire drill"') == 2


@pytest.mark.parametrize(
    ("terminal", "count"), [("xterm", r"\x1b7\r    [45]\d s \x1b8"), ("dumb", r"\r    [45]\d s (?!\x1b)")]
)
def test_a_break_is_counted_beside_what_is_typed(
    short_configs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, terminal: str, count: str
) -> None:
    """A terminal that can go back to where it was has the count before what is typed, and leaves that as it stands."""
    monkeypatch.setenv("TERM", terminal)
    with AtTerminal(run(short_configs, "direction", "--seed", 3), tmp_path) as screen:
        screen.answer_trials(4)
        screen.wait_for("Break between sessions: 60 s")
        wait_for(lambda: re.search(count, screen.seen) is not None)
        shown = screen.seen.partition("Break between sessions")[2]
    assert shown.partition("early.)\n")[2].startswith(" " * 9)
    assert (terminal == "xterm") == ("\x1b" in shown)


def test_a_practice_without_breaks_says_how_a_round_went_as_the_next_one_begins(
    quick_configs: Path, tmp_path: Path
) -> None:
    config = quick_configs / "direction.toml"
    rounds = '[practice]\nrepetitions = 1\nof = ["direction"]\nuntil_right = 1.0\nrounds = 2\n'
    config.write_text(re.sub(r"\[practice\].*\n(?:[a-z].*\n)+", rounds, config.read_text()))
    with AtTerminal(run(quick_configs, "direction", "--seed", 1, "--practice"), tmp_path) as screen:
        for trial in range(2):
            screen.fire(trial + 1)
            screen.wait_for("b = backward:", trial + 1)
            assert "Round 1" not in screen.seen
            screen.type("f")
        screen.wait_for("\nRound 1: 1 of 2 right; wanted: 100 %.\n")
        screen.wait_for("set 2")
        screen.type("stop")
        assert screen.end() == 130


def test_a_run_whose_table_cannot_be_written_as_it_stops_says_that_nothing_is_lost(
    short_configs: Path, recoil: Recoil, tmp_path: Path
) -> None:
    folder = tmp_path / "results" / "sub-P01"
    with AtTerminal(run(short_configs, "direction", "--seed", 3), tmp_path) as screen:
        screen.answer_trials(2)
        (folder / "sub-P01_task-direction_trials.csv").mkdir()  # nothing can be put there, as on a full disk
        screen.type("!")
        screen.wait_for("EMERGENCY STOP.")
        screen.type("")
        assert screen.end() == 130
    assert "stopped: emergency stop; every answer is in the journal, but its table could not be written" in screen.seen
    assert "Go on with --resume." in screen.seen
    (folder / "sub-P01_task-direction_trials.csv").rmdir()
    done = recoil("rebuild", folder / "sub-P01_task-direction_journal.jsonl")
    assert done.returncode == 0
    assert [row["response"] for row in rows(tmp_path, "direction_trials") if row["response"]] == ["forward", "backward"]


def all_are_felt(screen: AtTerminal) -> None:
    """The three trains of experiment 2, each until somebody says next."""
    for trial in range(1, 4):
        screen.fire(trial)
        screen.wait_for("says next:", trial)
        screen.type("")
        screen.wait_for("Presented and saved.", trial)


def test_experiment_2_with_a_rating_of_zero_no_answer_and_a_comment_that_looks_like_a_formula(
    quick_configs: Path, tmp_path: Path
) -> None:
    with AtTerminal(run(quick_configs, "preference"), tmp_path) as screen:
        all_are_felt(screen)
        for trial, (rating, comment) in enumerate((("0", "=1+1"), ("none", ""), ("7,5", 'a "toy", said she'))):
            screen.wait_for("for no answer:", trial + 1)
            screen.type(rating)
            screen.wait_for("in your own words.", trial + 1)
            screen.type(comment)
        screen.close()
        assert screen.end() == 0
    table = rows(tmp_path, "preference_ratings")
    assert [row["rating"] for row in table] == ["0.0", "", "7.5"]
    assert [row["comment"] for row in table] == ["'=1+1", "", 'a "toy", said she']
    assert all(int(row["shots"]) >= 1 for row in table)


def test_a_bare_command_where_words_are_typed_is_asked_about_before_it_is_stored_as_words(
    quick_configs: Path, tmp_path: Path
) -> None:
    with AtTerminal(run(quick_configs, "preference"), tmp_path) as screen:
        all_are_felt(screen)
        screen.wait_for("for no answer:")
        screen.type("5")
        asked = "As a command that is `/undo`. If it is what was said, type `undo` again."
        screen.wait_for("in your own words.")
        screen.type("undo")
        screen.wait_for(asked)
        screen.type("like a toy")
        screen.wait_for("Saved. Trial 1 of 3: “comment”.")
        screen.wait_for("for no answer:", 2)
        screen.type("undo")
        screen.wait_for("Correct the “comment” of")
        screen.type("undo")
        screen.wait_for(asked, 2)
        screen.type("undo")
        screen.wait_for("“comment” corrected.")
        screen.wait_for("for no answer:", 3)
        screen.type("stop")
        assert screen.end() == 130
    assert [row["comment"] for row in rows(tmp_path, "preference_ratings") if row["comment"]] == ["undo"]


def test_a_rating_off_the_scale_is_asked_again(quick_configs: Path, tmp_path: Path) -> None:
    with AtTerminal(run(quick_configs, "preference"), tmp_path) as screen:
        all_are_felt(screen)
        for count, typed in enumerate(("11", "-1", "much", "nan", ""), start=1):
            screen.wait_for("for no answer:", count)
            screen.type(typed)
            screen.wait_for("Not a rating: type a number from 0 to 10. `none` is no answer.", count)
        screen.wait_for("for no answer:", 6)
        screen.type("7.25")  # nothing is rounded: what is kept is what was said
        screen.wait_for("It goes in steps of 0.1: type 7.2 or 7.3.")
        screen.wait_for("for no answer:", 7)
        screen.type("stop")
        assert screen.end() == 130


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), "Go on with --resume."),
        (("--sensor", "simulated"), "Go on with --resume --sensor simulated."),
        (("--practice",), "begun anew each time"),
    ],
)
def test_an_interrupted_run_says_how_to_go_on(
    words: tuple[str, ...], told: str, quick_configs: Path, tmp_path: Path
) -> None:
    with AtTerminal(run(quick_configs, "direction", *words), tmp_path) as screen:
        screen.wait_for("rial 1 of ")
        screen.process.send_signal(signal.SIGINT)
        assert screen.end() == 130
        assert told in screen.seen


def test_a_stopped_run_keeps_its_table_and_needs_a_decision(quick_configs: Path, tmp_path: Path) -> None:
    with AtTerminal(run(quick_configs, "direction"), tmp_path) as screen:
        screen.answer_trials(2)
        screen.wait_for(FIRES, 3)
        screen.type("stop lunch")
        assert screen.end() == 130
        assert "stopped: lunch. Go on with --resume." in screen.seen
    assert sum(row["response"] != "" for row in rows(tmp_path, "direction_trials")) == 2
    with AtTerminal(run(quick_configs, "direction"), tmp_path) as screen:
        assert screen.end() == 2
        assert "has an unfinished run of direction" in screen.seen
    with AtTerminal(run(quick_configs, "direction", "--fresh"), tmp_path) as screen:
        assert screen.end() == 2
        assert "has answers: 2; --fresh sets them aside, so say why with --reason TEXT" in screen.seen
    with AtTerminal(run(quick_configs, "direction", "--fresh", "--reason", "wrong damper"), tmp_path) as screen:
        screen.wait_for("Trial 1 of")
        screen.type("stop")
        assert screen.end() == 130
    with AtTerminal(run(quick_configs, "direction", "--fresh"), tmp_path) as screen:  # nothing was answered yet
        screen.wait_for("Trial 1 of")
        screen.type("stop")
        assert screen.end() == 130
    assert "wrong damper" in (tmp_path / "results/participants.jsonl").read_text(encoding="utf-8")
    aside = sorted(path.name for path in (tmp_path / "results/sub-P01").glob("*aside*"))
    names = ("sub-P01_task-direction_journal.aside-{}.jsonl", "sub-P01_task-direction_trials.aside-{}.csv")
    assert aside == [name.format(number) for name in names for number in (1, 2)]


def test_two_consoles_cannot_run_one_participant(quick_configs: Path, tmp_path: Path) -> None:
    with AtTerminal(run(quick_configs, "direction"), tmp_path) as first:
        first.wait_for("Trial 1 of")
        with AtTerminal(run(quick_configs, "direction", "--resume"), tmp_path) as second:
            assert second.end() == 2
            assert "another run holds this journal" in second.seen
        first.answer_trials(1)


def test_a_terminal_that_is_closed_stops_the_run(quick_configs: Path, tmp_path: Path) -> None:
    with AtTerminal(run(quick_configs, "direction"), tmp_path) as screen:
        screen.answer_trials(1)
        screen.hang_up()
        assert screen.end() == 130
    journal = (tmp_path / "results/sub-P01/sub-P01_task-direction_journal.jsonl").read_text()
    assert '"kind":"stopped"' in journal.splitlines()[-1]


# a hand that is hasty


def journal_of(folder: Path) -> list[dict[str, Any]]:
    lines = (folder / "results/sub-P01/sub-P01_task-direction_journal.jsonl").read_text().splitlines()
    return [json.loads(line) for line in lines]


def bodies(folder: Path, kind: str) -> list[dict[str, Any]]:
    return [one["body"] for one in journal_of(folder) if one.get("body", {}).get("kind") == kind]


@pytest.mark.parametrize("keys", ["\x03", "\x1c"], ids=["Ctrl+C", "Ctrl+backslash"])
def test_the_keys_that_end_a_program_end_a_run_in_order(keys: str, quick_configs: Path, tmp_path: Path) -> None:
    with AtTerminal(run(quick_configs, "direction", "--seed", 1), tmp_path) as screen:
        screen.fire()
        screen.wait_for("b = backward:")
        screen.press(keys)
        assert screen.end() == 130
    assert [one["kind"] for one in journal_of(tmp_path)].count("stopped") == 1


def test_what_is_typed_ahead_fires_nothing_and_answers_nothing(quick_configs: Path, tmp_path: Path) -> None:
    config = quick_configs / "direction.toml"
    config.write_text(config.read_text().replace("guard_s = 0.0", "guard_s = 5.0"))
    with AtTerminal(run(quick_configs, "direction", "--seed", 1), tmp_path) as screen:
        screen.wait_for(DAMPER)
        screen.type("d\n\nf\n\nf")  # all at once: nothing of it was asked for yet
        screen.wait_for("press again")
        screen.type("stop")
        assert screen.end() == 130
    assert bodies(tmp_path, "fired") == bodies(tmp_path, "answered") == []
    assert {one["because"] for one in bodies(tmp_path, "refused")} >= {"Too soon after the change: press again."}


def test_what_is_typed_while_the_program_stands_still_fires_nothing(quick_configs: Path, tmp_path: Path) -> None:
    words = [sys.executable, "-m", "recoil", *recoil_words(quick_configs, "direction", "--seed", 1)]
    with AtTerminal(words, tmp_path) as screen:  # not a warm one, whose process stands in for the program
        screen.wait_for(DAMPER)
        screen.type("d")
        screen.wait_for(FIRES)
        stand_still(screen.process.pid)
        screen.type("")
        screen.type("")
        time.sleep(1.5)  # this is how long it stands still
        screen.process.send_signal(signal.SIGCONT)
        screen.wait_for("The console stood still as that was pressed: look where the gun is, and press again.", 2)
        assert bodies(tmp_path, "fired") == []
        time.sleep(1.0)  # this is the hand that looks
        screen.type("")
        screen.wait_for("b = backward:")
        screen.type("stop")
        assert screen.end() == 130
    assert [one["event"] for one in bodies(tmp_path, "refused")] == ["fire", "fire"]
    assert len(bodies(tmp_path, "fired")) == 1


HELD, GOES_ON = "\x13", "\x11"
"""Ctrl+S and Ctrl+Q: the terminal shows nothing in between."""


@pytest.mark.parametrize("first", ["x", ""])
def test_what_is_typed_while_the_terminal_shows_nothing_fires_nothing(
    first: str, quick_configs: Path, tmp_path: Path
) -> None:
    with AtTerminal(run(quick_configs, "direction", "--seed", 1), tmp_path) as screen:
        screen.wait_for(DAMPER)
        screen.type("d")
        screen.wait_for(FIRES)
        screen.type(f"{HELD}{first}")  # who reads it waits to answer
        screen.type("")
        time.sleep(1.5)  # this is how long it is held
        screen.type(GOES_ON)
        screen.wait_for("The console stood still as that was pressed: look where the gun is, and press again.", 2)
        assert bodies(tmp_path, "fired") == []
        screen.type("stop")
        assert screen.end() == 130


def preference_journal(folder: Path) -> list[dict[str, Any]]:
    path = folder / "results/sub-P01/sub-P01_task-preference_journal.jsonl"
    whole = path.read_text(encoding="utf-8").rpartition("\n")[0]
    return [json.loads(line) for line in whole.splitlines()]


def train_shots(folder: Path) -> int:
    return sum(one["kind"] == "shot" for one in preference_journal(folder))


@pytest.mark.parametrize("typed", ["", "x\n"], ids=["nothing", "a line"])
def test_a_train_fires_no_shot_while_the_terminal_shows_nothing(
    typed: str, quick_configs: Path, tmp_path: Path
) -> None:
    with AtTerminal(run(quick_configs, "preference", "--seed", 1), tmp_path) as screen:
        screen.fire()
        screen.wait_for("Enter when the participant says next:")
        screen.press(f"{HELD}{typed}")
        wait_for(lambda: any(one.get("body", {}).get("kind") == "paused" for one in preference_journal(tmp_path)))
        before = train_shots(tmp_path)
        time.sleep(1.0)  # this is how long a train would have fired on
        screen.type("!")
        assert train_shots(tmp_path) == before
        screen.type(GOES_ON)
        screen.wait_for("EMERGENCY STOP.")
        screen.type("")
        assert screen.end() == 130
    assert train_shots(tmp_path) == before


def test_an_answer_that_is_typed_while_the_last_one_is_being_saved_is_on_record_as_what_it_was(tmp_path: Path) -> None:
    setup = changed("direction", console={"guard_s": 0.0})
    request = RunRequest(setup=setup, participant_id="P01", results=tmp_path / "results", seed=1, again="ask")
    ours, theirs = os.pipe()
    out = io.StringIO()
    with gated() as gate, os.fdopen(ours) as lines, os.fdopen(theirs, "w", buffering=1) as hand:

        def carried_out() -> None:
            with suppress(RunStopped):
                runs.run(request, lambda _, plan, clock: TerminalScreen(plan, clock, lines, out), RealClock())

        sitting = threading.Thread(target=carried_out)
        sitting.start()
        for line, asked in (("d", "type d and Enter"), ("", "Enter fires:"), ("f", "b = backward:")):
            wait_for(lambda asked=asked: asked in out.getvalue())
            if line == "f":
                gate.shut()
            print(line, file=hand)
        assert gate.holds.wait(PATIENCE_S)
        for line in ("b", "what?"):
            print(line, file=hand)
        wait_for(lambda: out.getvalue().count("One moment: the last step is being saved.") == 2)
        gate.open()
        wait_for(lambda: "Saved. Trial 1: FORWARD." in out.getvalue())
        print("stop", file=hand)
        sitting.join(PATIENCE_S)
    assert [(one["event"], one["answer"]) for one in bodies(tmp_path, "refused")] == [
        ("answer", "backward"),
        ("answer", "what?"),
    ]


def test_undo_flag_note_pause_and_repeat_by_typed_words(quick_configs: Path, tmp_path: Path) -> None:
    with AtTerminal(run(quick_configs, "direction", "--seed", 1), tmp_path) as screen:
        screen.answer_trials(2)
        screen.wait_for(FIRES, 3)
        for line, shown in (
            ("undo", "(entered: BACKWARD)"),
            ("undo", "(entered: FORWARD)"),
            ("b", "Trial 1 corrected to BACKWARD."),
            ("flag Door slam", "flagged door-slam"),
            ("note a dog barked", "Saved. Note."),
            ("pause", "Paused."),
            ("f", "type `go on` and Enter"),
        ):
            before = len(screen.seen)
            screen.type(line)
            screen.wait_for(shown)
            assert screen.prompt(before), "what is asked for stands last, whenever it was said that something is saved"
        hand_overs = screen.seen.count(FIRES)
        screen.type("go on")
        screen.wait_for(FIRES, hand_overs + 1)
        screen.type("repeat noise")
        screen.wait_for("is presented again (noise)")
        screen.wait_for("for the second time")
        screen.type("stop")
        assert screen.end() == 130
    first, second, third, *_ = rows(tmp_path, "direction_trials")
    assert (first["response"], first["flags"], first["response_time_valid"]) == ("backward", "corrected", "0")
    assert (second["flags"], second["attempts"]) == ("repeated", "1")
    assert (third["flags"], third["note"]) == ("door-slam", "a dog barked")
    assert [one["kind"] for one in journal_of(tmp_path) if one["kind"] == "stopped"] == ["stopped"]


@pytest.mark.parametrize(
    "typed",
    ["fo!", "stop!", "\uff01", "fo\uff01", "\x1b[24~", "note it\x1b[24~", "\x1b[24;5~", "stop\x1b[24;2~", "\x1b[24^"],
)
def test_what_was_half_typed_does_not_swallow_an_emergency_stop(
    typed: str, quick_configs: Path, tmp_path: Path
) -> None:
    with AtTerminal(run(quick_configs, "direction", "--seed", 1), tmp_path) as screen:
        screen.answer_trials(1)
        screen.wait_for(FIRES, 2)
        screen.type(typed)
        screen.wait_for("EMERGENCY STOP.")
        screen.type("")
        assert screen.end() == 130
    assert len(bodies(tmp_path, "fired")) == 1


def test_an_answer_with_a_mark_is_an_answer(quick_configs: Path, tmp_path: Path) -> None:
    design = quick_configs / "direction.toml"
    text = design.read_text()
    keys = 'keys = { forward = "up"'
    assert keys in text
    design.write_text(text.replace(keys, f'labels = {{ forward = "There!", backward = "back" }}\n{keys}'))
    with AtTerminal(run(quick_configs, "direction", "--seed", 1), tmp_path) as screen:
        screen.wait_for("and Enter:")
        screen.type("d")
        screen.wait_for(FIRES)
        screen.type("")
        screen.wait_for("t = There!")
        screen.type("There!")
        screen.wait_for("Saved. Trial 1: THERE!")
        screen.type("stop")
        assert screen.end() == 130


def test_a_mark_within_words_is_a_mark(quick_configs: Path, tmp_path: Path) -> None:
    with AtTerminal(run(quick_configs, "direction", "--seed", 1), tmp_path) as screen:
        screen.answer_trials(1)
        screen.wait_for(FIRES, 2)
        screen.type("note that was loud!")
        screen.wait_for("Saved. Note.")
        screen.type("stop")
        assert screen.end() == 130
    assert [one["text"] for one in bodies(tmp_path, "noted")] == ["that was loud!"]


def test_after_an_emergency_stop_nothing_fires_and_a_resumed_run_begins_with_a_test_shot(
    quick_configs: Path, tmp_path: Path
) -> None:
    with AtTerminal(run(quick_configs, "direction", "--seed", 1), tmp_path) as screen:
        screen.answer_trials(1)
        screen.wait_for(FIRES, 2)
        screen.type("pause")  # the gun says then that it is disarmed: that vouches for nothing later
        screen.wait_for("Paused.")
        screen.type("!!")  # as a hand in a hurry types it
        screen.wait_for("Unless the gun says that it is disarmed, SWITCH OFF ITS POWER.")
        screen.wait_for("The gun says that it is disarmed.")
        screen.type("the cable burnt")
        screen.wait_for("Reason of the emergency stop.")
        screen.type("")
        assert screen.end() == 130
    assert [one["text"] for one in bodies(tmp_path, "halt-reason")] == ["the cable burnt"]
    assert journal_of(tmp_path)[-1]["reason"] == "emergency stop"
    assert len(bodies(tmp_path, "fired")) == 1
    with AtTerminal(run(quick_configs, "direction", "--resume"), tmp_path) as screen:
        screen.wait_for("Type `test shot` and Enter to fire it:")
        screen.type("")
        screen.wait_for("Type `test shot` and Enter.")
        screen.type("test shot")
        screen.wait_for("The test shot was fired")
        screen.wait_for(DAMPER)
        screen.type("stop")
        assert screen.end() == 130
    assert [one["cause"] for one in bodies(tmp_path, "test-shot")] == [""]
