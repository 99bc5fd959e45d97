"""Designs other than the paper's at a real terminal: what is repeated, corrected and told there, and what is kept."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from experiments.clock import VirtualClock
from experiments.load import load_setup
from experiments.record.journal import read_journal
from experiments.record.replay import history, outcomes
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.session.steps import NO_MOTION, Fired
from tests.at_terminal import DAMPER, AtTerminal
from tests.warm_start import warm

pytestmark = pytest.mark.slow

_HEAD = """
design = "tried"
title = "Tried at a terminal"
gun = "gun.toml"
{more}
[fatigue]
max_trials_without_break = 60
max_planned_s = 3600.0
[timing]
hand_over_s = 5.0
planned_s = 200.0
[console]
guard_s = 0.0
"""
_FACTOR = """
[factors.method]
levels = ["vibration", "asymmetric-1"]
"""
_RATING = """
[questions.{name}]
kind = "rating"
when = "{when}"
text = "How {name}?"
minimum = 0.0
maximum = 10.0
grain = 1.0
"""
_WAY = """
[factors.method]
levels = ["vibration"]
[factors.direction]
levels = ["forward", "backward"]
[trial]
feedback = true
[questions.way]
kind = "choice"
text = "Which way?"
answers = ["forward", "backward"]
correct = "direction"
"""


Sit = Callable[[str], AtTerminal]


@pytest.fixture
def sitting(quick_configs: Path, tmp_path: Path) -> Iterator[Sit]:
    """Opens a run of a design, by its tables, at a terminal."""
    with ExitStack() as opened:

        def sit(tables: str) -> AtTerminal:
            config = quick_configs / "tried.toml"
            config.write_text(_HEAD.format(more=tables))
            words = warm("run", config, "--participant", "P01", "--results", "results", "--seed", "3")
            return opened.enter_context(AtTerminal(words, tmp_path))

        yield sit


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "results" / "sub-P01" / "sub-P01_task-tried_trials.csv").open(newline="", encoding="utf-8") as table:
        return list(csv.DictReader(table))


def says(screen: AtTerminal, *lines: str) -> None:
    """Type each line when something is asked for that was not before; what is asked for is last on the screen."""
    after = 0
    for line in lines:
        asked = screen.prompt(after)
        while DAMPER in asked and line != "d":
            after = len(screen.seen)
            screen.type("d")
            asked = screen.prompt(after)
        after = len(screen.seen)
        screen.type(line)
    screen.prompt(after)


def test_a_number_with_a_grain_is_called_a_number(sitting: Sit) -> None:
    screen = sitting(_FACTOR + _RATING.format(name="strong", when="trial").replace('"rating"', '"number"'))
    says(screen, "", "hard", "3", "", "4")
    said = screen.seen
    assert "Not a number: type a number from 0 to 10." in said
    assert "rating" not in said


def test_a_train_can_be_followed_by_a_choice_which_has_no_time(sitting: Sit, tmp_path: Path) -> None:
    train = '[trial]\nkind = "train"\nleast_exposure_s = 0.0\n'
    asked = '[questions.liked]\nkind = "yes-no"\ntext = "Did you like it?"\n'
    screen = sitting(_FACTOR + train + asked)
    says(screen, "", "", "y", "", "", "n", "")
    assert screen.end() == 0
    table = rows(tmp_path)
    assert [row["liked"] for row in table] == ["yes", "no"]
    assert {row["liked_time_s"] + row["liked_time_valid"] for row in table} == {""}
    assert all(float(row["exposure_s"]) > 0 for row in table)


def test_a_key_that_is_shown_is_of_its_own_answer_also_where_another_has_that_name(
    sitting: Sit, tmp_path: Path
) -> None:
    asked = '[questions.which]\nkind = "choice"\ntext = "Which?"\nanswers = ["a", "b"]\n'
    screen = sitting(_FACTOR + asked + 'labels = { a = "den första", b = "den andra" }\n')
    says(screen, "", "a", "", "den första", "")
    assert screen.end() == 0
    assert [row["which"] for row in rows(tmp_path)] == ["b", "a"]


def test_a_trial_of_which_something_was_told_from_memory_is_not_presented_again(sitting: Sit, tmp_path: Path) -> None:
    screen = sitting(_FACTOR + "".join(_RATING.format(name=name, when="block") for name in ("strong", "mild")))
    says(screen, "", "", "7", "repeat slipped")
    assert "There is no trial of this set to repeat now." in screen.seen
    says(screen, "6", "repeat slipped", "", "4", "3")  # of the second one nothing was told
    assert "Trial 2 is presented again (slipped)" in screen.seen
    says(screen, "")
    assert screen.end() == 0
    assert [(row["strong"], row["mild"], row["flags"]) for row in rows(tmp_path)] == [
        ("7.0", "6.0", ""),
        ("4.0", "3.0", "repeated"),
    ]


def test_a_trial_that_is_repeated_after_later_ones_does_not_say_that_the_clock_was_set_back(
    sitting: Sit, tmp_path: Path
) -> None:
    screen = sitting(_FACTOR + _RATING.format(name="strong", when="block"))
    says(screen, "", "", "repeat slipped", "", "4", "5", "")
    assert screen.end() == 0
    table = rows(tmp_path)
    assert [row["flags"] for row in table] == ["repeated", ""]
    assert table[0]["onset_utc"] > table[1]["onset_utc"]


def test_the_trial_before_can_be_repeated_where_numbers_are_said_of_single_shots(sitting: Sit, tmp_path: Path) -> None:
    screen = sitting(_FACTOR + _RATING.format(name="strong", when="trial"))
    says(screen, "", "5", "repeat spoiled", "", "6", "", "7", "")
    assert screen.end() == 0
    assert [(row["strong"], row["attempts"]) for row in rows(tmp_path)] == [("6.0", "2"), ("7.0", "1")]


def told(screen: AtTerminal) -> tuple[int, int]:
    """How often it was said that an answer was right, and that it was wrong."""
    return screen.seen.count("“That was right.”"), screen.seen.count("“That was wrong.”")


def test_what_is_told_of_an_answer_is_true_of_the_one_that_counts(sitting: Sit, tmp_path: Path) -> None:
    screen = sitting(_WAY)
    first = "f" if "FORWARD" in screen.prompt(0) else "b"
    other = "b" if first == "f" else "f"
    says(screen, "", first)
    assert told(screen) == (1, 0)
    says(screen, "repeat spoiled", "", other)
    assert told(screen) == (1, 1)
    says(screen, "undo", first)  # it was entered wrongly
    assert told(screen) == (2, 1)
    says(screen, "", "repeat spoiled", "", other)  # at the next one's hand-over
    assert told(screen) == (2, 2)
    says(screen, "", "", other, "", "")
    assert screen.end() == 0
    assert [row["correct"] for row in rows(tmp_path)] == ["0", "1"]


def test_a_row_of_two_intervals_has_the_onset_of_the_first_and_what_became_of_the_shot(tmp_path: Path) -> None:
    request = RunRequest(setup=load_setup("staircase"), participant_id="S01", results=tmp_path, seed=1)
    done = run(request, synthetic_screen, VirtualClock())
    fired = [
        (step, word) for step, word in outcomes(history(read_journal(done.place.journal))) if isinstance(word, Fired)
    ]
    with done.place.table.open(newline="", encoding="utf-8") as table:
        felt = [row for row in csv.DictReader(table) if row["attempts"]]
    assert len(felt) > 10
    assert [row["onset_utc"] for row in felt] == [word.onset_utc for _, word in fired[::2]]
    assert {row["status"] for row in felt} <= {"home", "no-break-away"}
    shot = [
        next(word.motion for _, word in fired[at : at + 2] if word.motion != NO_MOTION)
        for at in range(0, len(fired), 2)
    ]
    assert [row["status"] for row in felt] == shot


def test_each_entry_is_called_by_its_question_where_there_are_several(sitting: Sit) -> None:
    screen = sitting(_FACTOR + "".join(_RATING.format(name=name, when="trial") for name in ("strong", "mild")))
    says(screen, "", "7", "5", "undo")
    assert "Correct the rating “mild” of Trial 1 of 2" in screen.seen
    says(screen, "undo")
    assert "Correct the rating “strong” of Trial 1 of 2" in screen.seen
    assert "(entered: 7): a number;" in screen.seen
    says(screen, "undo")
    assert "There is nothing further back in this set." in screen.seen
    says(screen, "6")
    screen.wait_for("Saved. Trial 1, rating “strong” corrected to 6.")


def test_words_are_corrected_and_left_as_the_screen_says(sitting: Sit, tmp_path: Path) -> None:
    number = '[questions.size]\nkind = "number"\ntext = "How strong?"\nminimum = 0.000001\n'
    words = '[questions.words]\nkind = "text"\ntext = "Please say it in your own words."\n'
    screen = sitting(_FACTOR + number + words)
    says(screen, "", "1,000")
    assert "1,000 may be 1 or 1000: type it without a comma." in screen.seen
    says(screen, "1234567.89", "a thump", "undo")
    screen.wait_for("Saved. Trial 1: 1234567.89.")
    assert "`/undo` goes further back" in screen.seen
    says(screen, "/undo", "", "", "2", "", "")
    assert screen.end() == 0
    assert [(row["size"], row["words"]) for row in rows(tmp_path)] == [("1234567.89", "a thump"), ("2.0", "")]


def test_a_correction_after_an_emergency_stop_leaves_the_run_halted_until_it_is_closed(sitting: Sit) -> None:
    screen = sitting(_WAY)
    first = "f" if "FORWARD" in screen.prompt(0) else "b"
    says(screen, "", first)
    assert told(screen) == (1, 0)
    says(screen, "!", "/undo", "b" if first == "f" else "f")
    screen.wait_for("EMERGENCY STOP.", 2)  # it stands there again: nothing was told anew, and nothing closed
    assert sum(told(screen)) == 1
    assert screen.process.poll() is None
    says(screen, "the hand slipped", "")
    assert screen.end() == 130


def test_the_trial_at_hand_is_the_one_to_be_repeated_between_its_shots(sitting: Sit, tmp_path: Path) -> None:
    pairs = """
[factors.method]
levels = ["asymmetric-1", "asymmetric-2"]
[trial]
kind = "pair"
compare = "method"
[questions.rather]
kind = "choice"
text = "Which one?"
answers = ["first", "second"]
[order]
repetitions = 2
"""
    screen = sitting(pairs)
    after, fired = 0, 0
    while "Which one?" not in (asked := screen.prompt(after)):
        after = len(screen.seen)
        if " for shot 2 of 2" in asked and fired == 1:
            screen.type("repeat the first one slipped")
            fired = 2
            continue
        fired += "Enter fires" in asked and fired == 0
        screen.type("d" if DAMPER in asked else "")
    assert "Trial 1 is presented again (the first one slipped)" in screen.seen
