"""The console in a real window on a virtual desktop, worked by real keys: whole runs, kills, the start window."""

from __future__ import annotations

import os
import random
import re
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.at_display import (
    HAND_S,
    OTHER,
    RIGHT_BUTTON,
    AtConsole,
    AtDisplay,
    another_window,
    needs_display,
    records,
    remarks,
    taken_keyboard,
    virtual_display,
)
from tests.at_runs import DIRECTION, PREFERENCE, RUN, SHORT_TRIALS, answers, rows, shorten, words
from tests.warm_start import warm
from tests.watched_console import Watch

pytest.importorskip("PyQt6")
pytestmark = [needs_display, pytest.mark.slow]

START = "Recoil – start"
WORD_OF_HELP = (35, 136)
"""“Space” in the list of keys."""
NOTE_LINE = (300, 610)
"""Where a note is typed, on a screen of 1280x800."""


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display() as name:
        yield name


def start(screen: AtConsole, code: str = "P01", later: int = 0) -> None:
    """From the start window: read the code back, say what is asked, start, on the simulated gun as well.

    `later` is how many experiments of the study are passed over.
    """
    keys = screen.keys
    screen.stands(START)
    if later:
        for key, held in [("Tab", ["Shift_L"]), ("Tab", ["Shift_L"]), *([("Down", [])] * later), *([("Tab", [])] * 2)]:
            keys.press(key, *held)
    keys.type(code)
    keys.press("Tab")
    keys.type("25")
    keys.press("Tab")
    keys.press("Down")
    keys.press("Tab")
    keys.press("Down")
    keys.press("Return", "Control_L")
    keys.press("s", "Control_L")
    screen.stands(RUN)


@contextmanager
def in_a_train(configs: Path, folder: Path, display: str) -> Iterator[AtConsole]:
    """At the console, while the first train goes on."""
    with AtConsole(words(configs, "preference", "--participant", "P01"), folder, display) as screen:
        screen.stands(RUN)
        screen.to("train", trial=1)
        yield screen


def close_the_day(screen: AtConsole) -> tuple[int, str]:
    """From an end screen back to the start window, and out of it."""
    screen.until(lambda look: look.ended)
    screen.keys.press("q")
    screen.stands(START)
    screen.keys.press("q", "Control_L")
    return screen.end()


def test_experiment_1_from_the_start_window_to_the_end_screen(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    shorten(quick_configs)
    with AtConsole(words(quick_configs, "direction"), tmp_path, display) as screen:
        start(screen)
        screen.to_the_end()
        screen.until(lambda look: look.says(f"Read back from the disk: {SHORT_TRIALS} answers, all that were given."))
        code, said = close_the_day(screen)
    assert code == 0, said
    assert records(tmp_path / f"{DIRECTION}_journal.jsonl")[-1]["kind"] == "finished"
    table = rows(tmp_path, DIRECTION, "trials")
    assert [row["response"] for row in table] == ["forward", "backward"] * (SHORT_TRIALS // 2)
    assert {row["response_source"] for row in table} == {"experimenter"}
    assert {row["attempts"] for row in table} == {"1"}
    register = (tmp_path / "results" / "participants.jsonl").read_text()
    assert '"age_years":25' in register


def test_experiment_2_from_the_start_window_to_the_end_screen_with_a_rating_of_zero(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    with AtConsole(words(quick_configs, "preference"), tmp_path, display) as screen:
        start(screen, later=1)
        screen.to_the_end()
        code, said = close_the_day(screen)
    assert code == 0, said
    table = rows(tmp_path, PREFERENCE, "ratings")
    assert [row["rating"] for row in table] == ["0.0", "7.5", "7.5"]
    assert {row["comment"] for row in table} == {"like a toy"}


def test_a_training_leaves_nothing_behind(quick_configs: Path, tmp_path: Path, display: str) -> None:
    with AtConsole(words(quick_configs, "direction"), tmp_path, display) as screen:
        screen.stands(START)
        screen.keys.press("r", "Control_L")
        screen.stands("training")
        screen.to_the_end()
        code, said = close_the_day(screen)
    assert code == 0, said
    assert not list(tmp_path.glob("results/sub-*"))


def test_no_menu_takes_the_keys_of_a_run(quick_configs: Path, tmp_path: Path, display: str) -> None:
    with AtConsole(words(quick_configs, "direction", "--participant", "P01"), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("asking")
        screen.keys.press("n")
        screen.until(lambda look: look.says("Note on trial 1"))
        screen.ask_for_menu(NOTE_LINE)
        time.sleep(HAND_S)
        screen.keys.press("F12")
        screen.at("halted")
        screen.keys.press("q")
        screen.close()


def test_no_text_that_is_dragged_takes_the_keys_of_a_run(quick_configs: Path, tmp_path: Path, display: str) -> None:
    with AtConsole(words(quick_configs, "direction", "--participant", "P01"), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("asking")
        screen.keys.press("F1")
        time.sleep(HAND_S)
        with screen.dragging(*WORD_OF_HELP):
            screen.keys.press("F12")
            screen.at("halted")


@pytest.mark.parametrize(("name", "state"), [("emergency", "halted"), ("pause", "paused")])
def test_what_stops_does_so_as_its_button_goes_down(
    quick_configs: Path, tmp_path: Path, display: str, name: str, state: str
) -> None:
    with in_a_train(quick_configs, tmp_path, display) as screen:
        with screen.button_down(name):
            screen.until(lambda look: look.state == state)
            screen.off_and_back(name)  # a press counts once
        for _ in range(3):
            screen.click(name)
            time.sleep(2 * HAND_S)
        assert screen.look().state == state


@pytest.mark.parametrize(("held", "mouse"), [(RIGHT_BUTTON, 1), (1, RIGHT_BUTTON)])
def test_what_stops_is_heard_beside_a_button_of_the_mouse_that_is_held_elsewhere(
    quick_configs: Path, tmp_path: Path, display: str, held: int, mouse: int
) -> None:
    with in_a_train(quick_configs, tmp_path, display) as screen, screen.button_down("next", held):
        for name, state in (("pause", "paused"), ("emergency", "halted")):
            with screen.button_down(name, mouse):
                screen.until(lambda look, state=state: look.state == state)


@pytest.mark.parametrize(("name", "state"), [("emergency", "halted"), ("pause", "paused")])
def test_what_stops_does_so_by_the_wrong_button_of_the_mouse_too(
    quick_configs: Path, tmp_path: Path, display: str, name: str, state: str
) -> None:
    with in_a_train(quick_configs, tmp_path, display) as screen, screen.button_down(name, RIGHT_BUTTON):
        screen.until(lambda look: look.state == state)


def test_a_second_click_on_the_emergency_stop_counts_where_the_first_fell_beside_it(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    with in_a_train(quick_configs, tmp_path, display) as screen:
        left, top, width, _ = screen.look().places["emergency"]
        for beside_px in (-2, 2):
            screen.keys.click(left + width // 2, top + beside_px)
            time.sleep(2 * HAND_S)
        screen.until(lambda look: look.state == "halted")


def test_a_train_does_not_go_on_while_another_window_has_the_keys(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    with in_a_train(quick_configs, tmp_path, display) as screen:
        with another_window(display):
            screen.keys.focus_on(OTHER)
            screen.until(lambda look: look.state == "paused")
        screen.stands(RUN)
        assert screen.look().says("Another window had the keys")
        screen.keys.press("p")
        screen.until(lambda look: look.state != "paused")


def test_a_train_does_not_go_on_while_another_program_has_the_keyboard_whatever_is_clicked(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    with in_a_train(quick_configs, tmp_path, display) as screen:
        with taken_keyboard(display):
            screen.until(lambda look: look.state == "paused")
            for name, state in (("go on", "preparing"), ("fire", "paused")):
                screen.click(name)
                screen.until(lambda look, state=state: look.state == state)
                time.sleep(20 * HAND_S)  # or the next is the second click of a double one
            assert screen.look().active  # for all that Qt knows
            kept = [one["kind"] for one in records(next(tmp_path.rglob("*_journal.jsonl")))]
            assert "shot" in kept
            assert "shot" not in kept[kept.index("remark") :]
        screen.keys.press("p")
        screen.to("train")
        screen.keys.press("F12")
        screen.until(lambda look: look.state == "halted")


def test_a_train_does_not_go_on_while_it_is_typed_why_it_stops(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    with in_a_train(quick_configs, tmp_path, display) as screen:
        screen.keys.press("q")
        screen.until(lambda look: look.state == "paused" and look.line)
        screen.keys.type("enough")
        screen.keys.press("Return")
        assert screen.close()[0] == 130


@pytest.mark.parametrize("practises", [True, False], ids=["practice", "run"])
def test_after_an_emergency_stop_in_a_practice_the_next_one_and_the_run_begin_with_a_test_shot(
    quick_configs: Path, tmp_path: Path, display: str, practises: bool
) -> None:
    watch = Watch(str(tmp_path))
    practice = words(quick_configs, "direction", "--participant", "P01", "--practice")
    with AtConsole(practice, tmp_path, display, watch) as screen:
        screen.stands(RUN)
        screen.to("preparing")
        screen.keys.press("F12")
        screen.at("halted")
        screen.keys.press("q")
        screen.close()
    again = practice if practises else practice[:-1]
    with AtConsole(again, tmp_path, display, watch) as screen:
        screen.stands(RUN)
        screen.at("rearming")
        assert screen.look().says("Stand clear.")
        screen.keys.press("space")
        screen.until(lambda look: look.says("After an emergency stop a test shot comes first."))
        assert watch.calls("fired") == []
        screen.to("preparing")
        assert len(watch.calls("fired")) == 1
        screen.stop()


@pytest.mark.parametrize(("key", "kept"), [("g", 2), ("n", 0)])
def test_an_unfinished_run_is_shown_and_asked_about(
    quick_configs: Path, tmp_path: Path, display: str, key: str, kept: int
) -> None:
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    run = words(quick_configs, "direction", "--participant", "P01")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("preparing", trial=3)
        assert screen.stop()[0] == 130
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands("unfinished")
        screen.keys.type("loose" if key == "n" else "")
        for _ in range(3):
            screen.keys.press("Return")  # as a hand that still holds Enter does: nothing is decided by it
        screen.keys.press(key, "Control_L")
        screen.stands(RUN)
        screen.ready()
        answered = len(answers(journal))
        assert screen.stop()[0] == 130
    assert answered == kept
    assert bool(list(journal.parent.glob("*aside*"))) is (kept == 0)


def test_undo_flag_note_pause_and_repeat_by_keys(quick_configs: Path, tmp_path: Path, display: str) -> None:
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    with AtConsole(words(quick_configs, "direction", "--participant", "P01"), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("preparing", trial=4)
        for trial in (3, 2):
            screen.keys.press("u")
            screen.until(
                lambda look, trial=trial: look.says(f"Trial {trial} of 20") and look.says("Correct the answer")
            )
        screen.at("correcting")
        screen.keys.press("f")
        screen.at("preparing")
        screen.line("g", "door slam")
        screen.line("n", "a dog barked")
        screen.keys.press("p")
        screen.at("paused")
        screen.keys.press("p")
        screen.at("preparing")
        screen.line("r", "noise")
        screen.to("preparing", trial=5)
        code, said = screen.stop()
    assert code == 130, said
    assert records(journal)[-1]["reason"] == "enough"
    first, second, third, fourth, *_ = rows(tmp_path, DIRECTION, "trials")
    assert (second["response"], second["flags"], second["response_time_valid"]) == ("forward", "corrected", "0")
    assert (third["attempts"], third["flags"]) == ("2", "repeated")
    assert (fourth["flags"], fourth["note"]) == ("door-slam", "a dog barked")
    assert first["flags"] == ""
    assert [body["kind"] for body in remarks(journal)] == [
        "corrected",
        "flagged",
        "noted",
        "paused",
        "continued",
    ]


def check_killed_console(configs: Path, folder: Path, display: str, seconds: float) -> int:
    """A console killed some seconds after its first trial stands there loses nothing, and goes on as an unbroken one
    would; the answers that it had acknowledged.
    """
    journal = folder / f"{DIRECTION}_journal.jsonl"
    with AtConsole(words(configs, "direction", "--participant", "P01"), folder, display) as screen:
        screen.stands(RUN)
        screen.ready()
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s and not (look := screen.look()).ended:
            if look.ready and look.state in ("setting", "preparing", "asking"):
                screen.due(look)
                _until_moved(screen, look.serial, end_s)
        screen.kill()
        said = {text for look in screen.watch.looks() for text in look.texts if re.fullmatch(r"Saved\. Trial .*", text)}
    before = answers(journal)
    assert len(before) - len(said) in (0, 1)  # the last is on the disk a moment before it is said
    with AtConsole(words(configs, "direction", "--participant", "P01", "--resume"), folder, display) as screen:
        screen.stands(RUN)
        goal = min(60, len(before) + 2)
        while len(answers(journal)) < goal:
            screen.go_on(screen.ready())
        screen.ready()
        screen.stop()
    assert answers(journal)[: len(before)] == before
    table = rows(folder, DIRECTION, "trials")
    assert len({(row["session"], row["trial"]) for row in table}) == len(table) == 60
    assert [row["response"] for row in table[:goal]] == (["forward", "backward"] * 30)[:goal]
    return len(said)


def _until_moved(screen: AtConsole, serial: int, end_s: float) -> None:
    while time.monotonic() < end_s and screen.look().serial == serial:
        time.sleep(0.002)


@pytest.mark.parametrize("kill", range(2))
def test_a_killed_console_loses_nothing_and_goes_on(
    quick_configs: Path, tmp_path: Path, display: str, kill: int
) -> None:
    check_killed_console(quick_configs, tmp_path, display, random.Random(kill).uniform(0.2, 1.5))


def test_a_synthetic_participant_at_the_console_answers_as_in_data_mode(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    shorten(quick_configs)
    for experiment, kind in (("direction", "trials"), ("preference", "ratings")):
        with AtDisplay(
            words(quick_configs, experiment, "--participant", "P01", "--visual"), tmp_path, display
        ) as screen:
            code, said = screen.end()
            assert code == 0, said
        data = ["run", quick_configs / f"{experiment}.toml", "--participant", "P01", "--seed", "1"]
        data += ["--screen", "synthetic", "--results", "data"]
        subprocess.run(warm(*data), cwd=tmp_path, check=True, capture_output=True)
        stem = DIRECTION if experiment == "direction" else PREFERENCE
        column = "response" if experiment == "direction" else "rating"
        seen = [row[column] for row in rows(tmp_path, stem, kind)]
        assert seen == [row[column] for row in rows(tmp_path, re.sub("^results", "data", stem), kind)]


@pytest.mark.parametrize("named", [{}, {"DISPLAY": ":65432"}, {"QT_QPA_PLATFORM": "xcb"}])
def test_without_a_display_the_console_says_so(quick_configs: Path, tmp_path: Path, named: dict[str, str]) -> None:
    others = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    environment = {key: value for key, value in os.environ.items() if key not in others} | named
    done = subprocess.run(
        warm(*words(quick_configs, "direction", "--participant", "P01")),
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "there is no display" in done.stderr
