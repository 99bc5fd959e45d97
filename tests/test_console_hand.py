"""What a hand does by accident, by real keys and clicks on the real window: held, doubled, ahead, beside.

Every state with every accident is a table of `make soak`; here are those that hurt.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from experiments.session.judging import STOOD_STILL
from experiments.session.states import State
from tests.at_display import (
    HAND_S,
    AtConsole,
    check_disarmed,
    needs_display,
    remarks,
    run_words,
    virtual_display,
)
from tests.at_hand import ACTIONS, HELD_S, Cell, check_cell, check_gun, check_in_one_run, check_participants_keys
from tests.at_runs import RUN
from tests.journals import raw
from tests.pseudo_languages import RIGHT_TO_LEFT, write_pseudo_languages
from tests.waiting import wait_for

pytest.importorskip("PyQt6")
pytestmark = [needs_display, pytest.mark.slow]
needs_psychopy = pytest.mark.skipif(
    importlib.util.find_spec("psychopy") is None, reason="PsychoPy is not installed: extra `gui`"
)
S = State


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display() as name:
        yield name


def test_accidents_of_the_hand_do_what_the_table_says(tmp_path: Path, display: str) -> None:
    check_in_one_run(
        Cell(tmp_path, display, S.SETTING),
        (S.SETTING, "double Space"),
        (S.PREPARING, "Space held 3 s"),
        (S.CORRECTING, "double Space"),
        (S.PAUSED, "Space held 3 s"),
        (S.PREPARING, "double Space"),
        (S.PREPARING, "double click on Fire"),
        (S.PREPARING, "Tab Tab Space"),
        (S.HALTED, "double Space"),
    )


def test_no_menu_of_a_field_keeps_f12_from_being_heard_in_a_train(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    with AtConsole(run_words(quick_configs, "preference"), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("train", trial=1)
        screen.keys.press("n")
        screen.until(lambda look: look.line)
        screen.keys.press("Menu")
        screen.keys.press("F12")
        screen.until(lambda look: look.state == "halted")
        check_disarmed(screen.watch)


@pytest.mark.parametrize("action", ["F12", "P"])
def test_a_shot_under_way_is_halted_or_paused_as_the_table_says(tmp_path: Path, display: str, action: str) -> None:
    check_cell(Cell(tmp_path, display, S.FIRING), ACTIONS[action])


def test_what_fires_a_train_does_not_end_it_and_what_pauses_or_halts_it_does(tmp_path: Path, display: str) -> None:
    check_in_one_run(
        Cell(tmp_path, display, S.PREPARING, experiment="preference"),
        (S.PREPARING, "Space held 3 s"),
        (S.PREPARING, "double Space"),
        (S.PREPARING, "double click on Fire"),
        (S.TRAIN, "P"),
        (S.TRAIN, "F12"),
    )


@pytest.mark.parametrize(
    ("key", "text", "place", "name"),
    [
        ("Key_1", "1", 10, "1"),
        ("Key_0", "0", 19, "0"),
        ("Key_Ampersand", "&", 10, "1"),  # a French keyboard
        ("Key_Eacute", "é", 11, "2"),
        ("Key_F", "f", 41, "F"),
        ("Key_Left", "", 83, "4"),  # the number pad without Num Lock
        ("Key_Insert", "", 90, "0"),
        ("Key_Plus", "+", 86, "#43"),
        ("Key_Left", "", 113, "left"),
        ("Key_Apostrophe", "'", 24, "#39"),  # where Q is on others
        ("Key_unknown", "ф", 38, "A"),
        ("Key_unknown", "\u0941", 42, "G"),  # a vowel sign of Hindi
        ("Key_unknown", "\u0e34", 56, "B"),  # of Thai
        ("Key_Semicolon", ";", 24, "Q"),  # a Greek keyboard
        ("Key_Slash", "/", 24, "Q"),  # a Hebrew one
        ("Key_Slash", "\x1f", 24, "Q"),  # the same with Ctrl
        ("Key_unknown", "€", 26, "#33554431"),
    ],
)
def test_a_key_is_a_digit_or_a_letter_by_what_it_types_or_where_it_lies(
    key: str, text: str, place: int, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from PyQt6.QtCore import QEvent, Qt
    from PyQt6.QtGui import QKeyEvent

    from experiments.screens.console.windows import key_name

    number = {"Key_Eacute": 0xC9}.get(key) or getattr(Qt.Key, key).value
    no = Qt.KeyboardModifier.NoModifier
    assert key_name(QKeyEvent(QEvent.Type.KeyPress, number, no, place, 0, 0, text)) == name
    monkeypatch.setattr("sys.platform", "win32")  # where 9 lies on 10, which is where 1 lies elsewhere
    assert key_name(QKeyEvent(QEvent.Type.KeyPress, number, no, place - 8, 0, 0, text)) == name


def test_where_no_label_has_a_letter_a_to_z_answers_are_typed_as_digits(tmp_path: Path, display: str) -> None:
    spoken = ["--language", RIGHT_TO_LEFT, "--catalogues", write_pseudo_languages(tmp_path / "own")]
    command = ["run", "direction", "--screen", "console", "--participant", "P01", "--results", "results", *spoken]
    with AtConsole(command, tmp_path, display) as screen:
        screen.answer = lambda _: "2"
        screen.to("preparing", trial=2)
        screen.stop()
    said = [
        one["body"]
        for one in raw(tmp_path / "results/sub-P01/sub-P01_task-direction_journal.jsonl")
        if one["kind"] == "outcome"
    ]
    assert [body["value"] for body in said if body["kind"] == "answered"] == ["backward"]


def test_letters_beside_the_field_of_a_rating_are_text_and_no_commands(tmp_path: Path, display: str) -> None:
    cell = Cell(tmp_path, display, S.RATING)
    with cell.reach() as screen:
        screen.keys.type("feels sharp\n")
        screen.until(lambda look: look.says("Not a rating: type a number from 0 to 10."))
        look = screen.heard()
        assert (look.state, look.typed) == ("rating", "feels sharp")
        screen.keys.press("a", "Control_L")
        screen.keys.type("7.5\n")
        screen.at("describing")
        screen.keys.press("u", "Control_L")
        screen.until(lambda look: look.says("It was entered as 7.5."))
        screen.at("correcting")
    assert not remarks(cell.journal)


def test_what_is_half_typed_outlives_a_pause_a_note_and_a_correction(tmp_path: Path, display: str) -> None:
    cell = Cell(tmp_path, display, S.RATING)
    with cell.reach() as screen:
        screen.keys.type("6")
        screen.keys.press("p", "Control_L")
        screen.at("paused")
        screen.keys.press("p")
        screen.until(lambda look: look.state == "rating" and look.typed == "6")
        screen.line("n", "a dog", "Control_L")
        screen.until(lambda look: look.typed == "6" and look.ready)
        screen.keys.type(".5\n")
        screen.at("describing")
        screen.keys.type("like a")
        screen.keys.press("u", "Control_L")
        screen.until(lambda look: look.state == "correcting" and look.typed == "6.5" and look.ready)
        screen.keys.press("Escape")
        screen.until(lambda look: look.state == "describing" and look.typed == "like a")
        screen.keys.type(" toy")
        screen.until(lambda look: look.typed == "like a toy")


def test_a_key_that_is_held_is_not_typed_into_the_field_that_opens_under_it(tmp_path: Path, display: str) -> None:
    cell = Cell(tmp_path, display, S.ASKING)
    with cell.reach() as screen:
        screen.keys.key_down("n")
        screen.until(lambda look: look.line)
        time.sleep(HELD_S)  # this is what the hand does
        screen.keys.key_up("n")
        assert screen.heard().typed == ""
        screen.hold("n", until=lambda look: look.typed.startswith("nnn"))


def test_a_shot_that_was_asked_for_while_the_console_stood_still_is_not_fired(tmp_path: Path, display: str) -> None:
    cell = Cell(tmp_path, display, S.PREPARING)
    with cell.reach() as screen:
        with screen.standing_still(1.5):
            screen.keys.press("space")
        screen.until(lambda look: look.says("The console stood still as that was pressed") and look.ready)
        assert cell.watch.calls("fired") == []
        screen.until(lambda look: not look.says("The console stood still"))
        screen.keys.press("space")
        screen.at("asking")
    assert [one["event"] for one in remarks(cell.journal, "refused")] == ["fire"]


def test_a_standstill_after_the_first_of_two_intervals_pauses_and_says_why_and_that_is_on_record(
    tmp_path: Path, display: str
) -> None:
    cell = Cell(tmp_path, display, S.PREPARING, experiment="stronger")
    with cell.reach() as screen:
        screen.keys.press("space")
        wait_for(lambda: cell.watch.calls("fired"))
        with screen.standing_still(2.0):
            pass
        screen.until(lambda look: look.state == "paused" and look.says("The program stood still for more"))
        screen.until(lambda look: look.says("The pause ended the stimulus: its trial is presented again."))
        assert screen.look().says("The program stood still for more than 1 s, and nothing was fired after it")
        assert len(cell.watch.calls("fired")) == 1
    assert [one["cause"] for one in remarks(cell.journal, "paused")] == [STOOD_STILL]
    assert remarks(cell.journal, "noted") == []


def test_each_press_while_the_console_stood_still_is_on_record_and_a_key_that_was_held_is_one(
    tmp_path: Path, display: str
) -> None:
    cell = Cell(tmp_path, display, S.PREPARING)
    with cell.reach() as screen:
        with screen.standing_still(2.5):
            for key in ("space", "space", "m", "space"):
                screen.keys.press(key)
                time.sleep(HAND_S)
            screen.keys.key_down("space")
            time.sleep(HELD_S)
            screen.keys.key_up("space")
        screen.heard()
        assert cell.watch.calls("fired") == []
    refused = [one["event"] for one in remarks(cell.journal, "refused")]
    assert refused == ["fire", "fire", "damper", "fire", "fire"]


def test_a_test_shot_whose_key_was_let_go_while_the_console_stood_still_is_not_fired(
    tmp_path: Path, display: str
) -> None:
    cell = Cell(tmp_path, display, S.REARMING)
    with cell.reach() as screen:
        fired = len(cell.watch.calls("fired"))
        screen.keys.key_down("t")
        screen.until(lambda look: look.says("Hold it"))
        with screen.standing_still(1.5):
            screen.keys.key_up("t")
        screen.until(lambda look: look.says("Let go too soon: hold it for 1 s."))
        assert len(cell.watch.calls("fired")) == fired
        screen.hold("t", until=lambda look: look.state != "rearming")
        wait_for(lambda: remarks(cell.journal, "test-shot"), "the test shot is on record")
    (shot,) = remarks(cell.journal, "test-shot")
    assert 1.0 <= shot["held_s"] < 1.5


def test_whatever_is_pressed_while_the_key_of_the_test_shot_is_held_calls_it_off(tmp_path: Path, display: str) -> None:
    cell = Cell(tmp_path, display, S.REARMING)
    with cell.reach() as screen:
        fired = len(cell.watch.calls("fired"))
        for other in ("x", "Tab", "F5", "Delete", "Shift_L", "mouse", "wheel", "close"):
            screen.keys.key_down("t")
            screen.until(lambda look: look.says("Hold it"))
            if other in ("mouse", "wheel"):
                with screen.button_down("help", mouse={"mouse": 3, "wheel": 4}[other]):
                    pass
            elif other == "close":
                screen.keys.press("F4", "Alt_L")  # by the window manager
            else:
                screen.keys.press(other)
            screen.until(lambda look: look.says("Something else was pressed meanwhile"))
            time.sleep(1.3)
            screen.keys.key_up("t")
            assert screen.look().state == "rearming"
            assert len(cell.watch.calls("fired")) == fired, other
            time.sleep(0.3)


def test_a_key_that_is_tapped_again_and_again_is_not_held(tmp_path: Path, display: str) -> None:
    cell = Cell(tmp_path, display, S.REARMING)
    with cell.reach() as screen:
        fired = len(cell.watch.calls("fired"))
        for _ in range(14):
            screen.keys.key_down("t")
            time.sleep(0.08)
            screen.keys.key_up("t")
            time.sleep(0.04)
        assert screen.look().state == "rearming"
        assert len(cell.watch.calls("fired")) == fired


@needs_psychopy
def test_on_the_participants_window_f12_halts_a_train_and_other_keys_do_nothing(tmp_path: Path, display: str) -> None:
    cell = Cell(tmp_path, display, S.TRAIN, "--participant-screen")
    with cell.reach() as screen:
        check_participants_keys(screen, cell, "p", "Escape", "space")
    check_gun(cell.watch, cell.journal)
