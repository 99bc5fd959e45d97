"""The console in a real window on a virtual screen, worked by real keys: whole runs, kills, faults."""

from __future__ import annotations

import csv
import json
import random
import re
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from experiments.journal import read
from experiments.replay import history
from experiments.steps import Answered
from tests.at_display import AtDisplay, last_record, needs_display, virtual_display, work_console
from tests.conftest import RECOIL

pytest.importorskip("PyQt6")
pytestmark = needs_display

DIRECTION = "results/sub-P01/sub-P01_task-direction"
PREFERENCE = "results/sub-P01/sub-P01_task-preference"


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display() as name:
        yield name


def words(configs: Path, experiment: str, *more: object) -> list[object]:
    config = configs / f"{experiment}.toml"
    return [RECOIL, "run", config, "--screen", "console", "--results", "results", "--seed", 1, *more]


def rows(folder: Path, stem: str, kind: str) -> list[dict[str, str]]:
    with (folder / f"{stem}_{kind}.csv").open(newline="", encoding="utf-8") as table:
        return list(csv.DictReader(table))


def answer_by(screen: AtDisplay, body: dict[str, Any]) -> None:
    """What an experimenter presses at a step."""
    kind = body["kind"]
    if kind in ("prepare", "present"):
        screen.keys.press("space")
    elif kind == "ask":
        screen.keys.press("f" if body["trial"]["trial"] % 2 else "b")
    elif kind == "rate":
        time.sleep(0.2)  # as a person would, look before typing
        screen.keys.type("0\n" if body["trial"]["trial"] == 1 else "7.5\n")
    elif kind == "describe":
        time.sleep(0.2)
        screen.keys.type("like a toy\n")


def start(screen: AtDisplay, code: str = "P01", later: int = 0) -> None:
    """From the start window: read the code back, say what is asked, start, on the simulated gun as well.

    `later` is how many experiments of the study are passed over.
    """
    keys = screen.keys
    screen.focus_on("start")
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


def focus_on_console(screen: AtDisplay, journal: Path) -> None:
    deadline = time.monotonic() + 30
    while not last_record(journal) and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(0.3)
    screen.focus_on("P01")


def test_experiment_1_from_the_start_window_to_the_end_screen(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    with AtDisplay(words(quick_configs, "direction"), tmp_path, display) as screen:
        start(screen)
        focus_on_console(screen, journal)
        last = work_console(screen, journal, lambda body: answer_by(screen, body))
        assert last["kind"] == "finished"
        time.sleep(0.5)
        screen.keys.press("q")
        time.sleep(1.0)
        screen.focus_on("start")
        screen.keys.press("q", "Control_L")
        code, said = screen.end()
    assert code == 0, said
    table = rows(tmp_path, DIRECTION, "trials")
    assert [row["response"] for row in table] == ["forward", "backward"] * 30
    assert {row["response_source"] for row in table} == {"experimenter"}
    register = (tmp_path / "results" / "participants.jsonl").read_text()
    assert '"age_years":25' in register


def close_the_day(screen: AtDisplay) -> tuple[int, str]:
    """From an end screen back to the start window, and out of it."""
    time.sleep(0.5)
    screen.keys.press("q")
    time.sleep(1.0)
    screen.focus_on("start")
    screen.keys.press("q", "Control_L")
    return screen.end()


def test_experiment_2_from_the_start_window_to_the_end_screen_with_a_rating_of_zero(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{PREFERENCE}_journal.jsonl"
    with AtDisplay(words(quick_configs, "preference"), tmp_path, display) as screen:
        start(screen, later=1)
        focus_on_console(screen, journal)
        last = work_console(screen, journal, lambda body: answer_by(screen, body))
        assert last["kind"] == "finished"
        code, said = close_the_day(screen)
    assert code == 0, said
    table = rows(tmp_path, PREFERENCE, "ratings")
    assert [row["rating"] for row in table] == ["0.0", "7.5", "7.5"]
    assert {row["comment"] for row in table} == {"like a toy"}


def test_a_training_leaves_nothing_behind(quick_configs: Path, tmp_path: Path, display: str) -> None:
    with AtDisplay(words(quick_configs, "direction"), tmp_path, display) as screen:
        screen.focus_on("start")
        screen.keys.press("r", "Control_L")
        screen.focus_on("training")
        for _ in range(14):  # six trials, and some keys for those that came before the window was ready
            for key in ("space", "f"):
                time.sleep(0.4)
                screen.keys.press(key)
        time.sleep(0.6)
        code, said = close_the_day(screen)
    assert code == 0, said
    assert not list(tmp_path.glob("results/sub-*"))


@pytest.mark.parametrize(("key", "kept"), [("g", 2), ("n", 0)])
def test_an_unfinished_run_is_shown_and_asked_about(
    quick_configs: Path, tmp_path: Path, display: str, key: str, kept: int
) -> None:
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"

    def two_answers(screen: AtDisplay) -> None:
        work_console(
            screen,
            journal,
            lambda body: screen.keys.press("F12") if body["trial"]["trial"] == 3 else answer_by(screen, body),
        )
        time.sleep(0.5)
        screen.keys.press("q")

    run = words(quick_configs, "direction", "--participant", "P01")
    with AtDisplay(run, tmp_path, display) as screen:
        focus_on_console(screen, journal)
        two_answers(screen)
        assert screen.end()[0] == 130
    with AtDisplay(run, tmp_path, display) as screen:
        screen.focus_on("unfinished")
        screen.keys.type("loose" if key == "n" else "")
        for _ in range(3):
            screen.keys.press("Return")  # as a hand that still holds Enter does: nothing is decided by it
        screen.keys.press(key, "Control_L")
        time.sleep(2.0)
        screen.focus_on("P01")
        answered = len(answers(journal))
        screen.keys.press("F12")
        time.sleep(0.5)
        screen.keys.press("q")
        assert screen.end()[0] == 130
    assert answered == kept
    assert bool(list(journal.parent.glob("*aside*"))) is (kept == 0)


def test_undo_flag_note_pause_and_repeat_by_keys(quick_configs: Path, tmp_path: Path, display: str) -> None:
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    done: list[str] = []

    def key(body: dict[str, Any]) -> None:
        trial = body["trial"]["trial"]
        if body["kind"] == "prepare" and trial == 4 and not done:
            done.append("all")
            time.sleep(0.5)  # as a person would, look before undoing
            for text in ("u", "u", "b", "gdoor slam\n", "na dog barked\n", "p", "p", "rnoise\n"):
                screen.keys.type(text)
                time.sleep(0.15)
        elif trial == 5:
            screen.keys.press("F12")
        else:
            answer_by(screen, body)

    with AtDisplay(words(quick_configs, "direction", "--participant", "P01"), tmp_path, display) as screen:
        focus_on_console(screen, journal)
        last = work_console(screen, journal, key)
        assert last["kind"] == "stopped"
        assert last["reason"] == "emergency stop"
        time.sleep(0.3)
        screen.keys.press("q")
        assert screen.end()[0] == 130
    first, second, third, fourth, *_ = rows(tmp_path, DIRECTION, "trials")
    assert (second["response"], second["flags"], second["response_time_valid"]) == ("backward", "corrected", "0")
    assert (third["attempts"], third["flags"]) == ("2", "repeated")
    assert (fourth["flags"], fourth["note"]) == ("door-slam", "a dog barked")
    assert first["flags"] == ""
    kinds = [json.loads(line)["body"]["kind"] for line in journal.read_text().splitlines() if '"remark"' in line]
    assert kinds == ["answer-corrected", "flagged", "noted", "paused", "continued"]


def answers(journal: Path) -> list[str]:
    return [outcome.response for _, outcome in history(read(journal)) if isinstance(outcome, Answered)]


def check_killed_console(configs: Path, folder: Path, display: str, seconds: float) -> None:
    """A console killed some seconds into its run loses nothing, and goes on as an unbroken one would."""
    journal = folder / f"{DIRECTION}_journal.jsonl"
    with AtDisplay(words(configs, "direction", "--participant", "P01"), folder, display) as screen:
        focus_on_console(screen, journal)
        killer = threading.Timer(seconds, screen.kill)
        killer.start()
        work_console(screen, journal, lambda body: answer_by(screen, body), timeout_s=seconds + 1)
        killer.join()
    before = answers(journal)
    with AtDisplay(words(configs, "direction", "--participant", "P01", "--resume"), folder, display) as screen:
        focus_on_console(screen, journal)
        time.sleep(0.5)
        screen.focus_on("P01")
        goal = min(60, len(before) + 2)
        limit = time.monotonic() + 30
        while len(answers(journal)) < goal and time.monotonic() < limit:
            work_console(screen, journal, lambda body: answer_by(screen, body), timeout_s=0.5)
        screen.keys.press("F12")
        time.sleep(0.5)
        screen.keys.press("q")
        screen.end()
    assert answers(journal)[: len(before)] == before
    table = rows(folder, DIRECTION, "trials")
    assert len({(row["session"], row["trial"]) for row in table}) == len(table) == 60
    assert [row["response"] for row in table[: goal - 1]] == (["forward", "backward"] * 30)[: goal - 1]


@pytest.mark.parametrize("kill", range(10))
def test_a_killed_console_loses_nothing_and_goes_on(
    quick_configs: Path, tmp_path: Path, display: str, kill: int
) -> None:
    check_killed_console(quick_configs, tmp_path, display, random.Random(kill).uniform(0.2, 3.0))


def test_a_synthetic_participant_at_the_console_answers_as_in_data_mode(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    import subprocess

    for experiment, kind in (("direction", "trials"), ("preference", "ratings")):
        with AtDisplay(
            words(quick_configs, experiment, "--participant", "P01", "--visual"), tmp_path, display
        ) as screen:
            assert screen.end(90)[0] == 0
        data = [RECOIL, "run", quick_configs / f"{experiment}.toml", "--participant", "P01", "--seed", "1"]
        data += ["--screen", "synthetic", "--results", "data"]
        subprocess.run(data, cwd=tmp_path, check=True, capture_output=True)
        stem = DIRECTION if experiment == "direction" else PREFERENCE
        column = "response" if experiment == "direction" else "rating"
        seen = [row[column] for row in rows(tmp_path, stem, kind)]
        assert seen == [row[column] for row in rows(tmp_path, re.sub("^results", "data", stem), kind)]


def test_without_a_display_the_console_says_so(quick_configs: Path, tmp_path: Path) -> None:
    import os
    import subprocess

    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "QT_QPA_PLATFORM")}
    done = subprocess.run(
        [str(word) for word in words(quick_configs, "direction", "--participant", "P01")],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "there is no display" in done.stderr


def test_a_terminated_console_stops_in_order_and_says_so(quick_configs: Path, tmp_path: Path, display: str) -> None:
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    with AtDisplay(words(quick_configs, "direction", "--participant", "P01"), tmp_path, display) as screen:
        focus_on_console(screen, journal)
        screen.process.terminate()
        code, said = screen.end()
    assert code == 130, said
    assert last_record(journal)["kind"] == "stopped"
    assert last_record(journal)["reason"] == "SIGTERM"
