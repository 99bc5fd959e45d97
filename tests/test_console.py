"""The console in a real window on a virtual screen, worked by real keys: whole runs, kills, faults."""

from __future__ import annotations

import csv
import itertools
import json
import math
import random
import re
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from experiments.journal import read
from experiments.replay import history
from experiments.steps import Answered
from tests import watched_console
from tests.at_display import AGAIN_S, AtDisplay, last_record, needs_display, virtual_display, work_console
from tests.conftest import RECOIL
from tests.waiting import wait_for

pytest.importorskip("PyQt6")
pytestmark = needs_display

DIRECTION = "results/sub-P01/sub-P01_task-direction"
PREFERENCE = "results/sub-P01/sub-P01_task-preference"
EYE = "seen.jsonl"


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display() as name:
        yield name


def words(configs: Path, experiment: str, *more: object) -> list[object]:
    config = configs / f"{experiment}.toml"
    return [RECOIL, "run", config, "--screen", "console", "--results", "results", "--seed", 1, *more]


def watched(configs: Path, experiment: str, *more: object) -> list[object]:
    """The same under the eye, which writes into the folder of the run."""
    return watched_console.words(Path(EYE), words(configs, experiment, *more))


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
    elif kind in ("rate", "describe"):
        type_in(screen, body, ("0\n" if body["trial"]["trial"] == 1 else "7.5\n") if kind == "rate" else "like a toy\n")


def type_in(screen: AtDisplay, body: dict[str, Any], text: str) -> None:
    """Type a rating or a description once its question stands."""
    asked = (f"Feedback {body['trial']['trial']} ", body["question"])
    wait_for(lambda: all(shows(screen.folder, start) for start in asked))
    screen.keys.type(text)


def start(screen: AtDisplay, code: str = "P01") -> None:
    """From the start window: read the code back, say what is asked, start."""
    keys = screen.keys
    screen.focus_on("start")
    keys.type(code)
    keys.press("Tab")
    keys.type("25")
    keys.press("Tab")
    keys.press("Down")
    keys.press("Tab")
    keys.press("Down")
    keys.press("Return", "Control_L")


def focus_on_console(screen: AtDisplay, journal: Path) -> None:
    wait_for(lambda: last_record(journal) or screen.process.poll() is not None)
    screen.focus_on("P01")


def press_until(screen: AtDisplay, key: str, done: Callable[[], object]) -> None:
    """Press a key, and again every few seconds, until it did what it does: before its window stands it does nothing."""
    pressed_s = -math.inf

    def is_done() -> object:
        nonlocal pressed_s
        if not done() and time.monotonic() - pressed_s > AGAIN_S:
            screen.keys.press(key)
            pressed_s = time.monotonic()
        return done()

    wait_for(is_done)


def stop(screen: AtDisplay, journal: Path) -> None:
    """The emergency stop, once the run goes on."""
    press_until(screen, "F12", lambda: last_record(journal)["kind"] == "stopped")


def leave(screen: AtDisplay) -> None:
    """Close the run's window once it shows that the run has ended: before, Q asks why."""
    wait_for(lambda: shows(screen.folder, "Finished") or shows(screen.folder, "Stopped"))
    screen.keys.press("q")


def shows(folder: Path, start: str) -> bool:
    """Whether a text in the watched windows starts so."""
    seen = watched_console.seen(folder / EYE)
    return bool(seen) and any(text.startswith(start) for text in seen[-1])


def test_experiment_1_from_the_start_window_to_the_end_screen(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    with AtDisplay(watched(quick_configs, "direction"), tmp_path, display) as screen:
        start(screen)
        focus_on_console(screen, journal)
        last = work_console(screen, journal, lambda body: answer_by(screen, body))
        assert last["kind"] == "finished"
        code, said = close_the_day(screen)
    assert code == 0, said
    table = rows(tmp_path, DIRECTION, "trials")
    assert [row["response"] for row in table] == ["forward", "backward"] * 30
    assert {row["response_source"] for row in table} == {"experimenter"}
    register = (tmp_path / "results" / "participants.jsonl").read_text()
    assert '"age_years":25' in register


def close_the_day(screen: AtDisplay) -> tuple[int, str]:
    """From an end screen back to the start window, and out of it."""
    leave(screen)
    screen.focus_on("start")
    screen.keys.press("q", "Control_L")
    return screen.end()


def test_experiment_2_from_the_start_window_to_the_end_screen_with_a_rating_of_zero(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{PREFERENCE}_journal.jsonl"
    with AtDisplay(watched(quick_configs, "preference"), tmp_path, display) as screen:
        start(screen)
        focus_on_console(screen, journal)
        last = work_console(screen, journal, lambda body: answer_by(screen, body))
        assert last["kind"] == "finished"
        code, said = close_the_day(screen)
    assert code == 0, said
    table = rows(tmp_path, PREFERENCE, "ratings")
    assert [row["rating"] for row in table] == ["0.0", "7.5", "7.5"]
    assert {row["comment"] for row in table} == {"like a toy"}


def test_a_training_leaves_nothing_behind(quick_configs: Path, tmp_path: Path, display: str) -> None:
    with AtDisplay(watched(quick_configs, "direction"), tmp_path, display) as screen:
        screen.focus_on("start")
        screen.keys.press("r", "Control_L")
        screen.focus_on("training")
        keys = itertools.cycle(("space", "f"))
        while not shows(tmp_path, "Finished") and screen.process.poll() is None:
            screen.keys.press(next(keys))  # what comes before the window is ready does nothing
            time.sleep(0.4)
        code, said = close_the_day(screen)
    assert code == 0, said
    assert not list(tmp_path.glob("results/sub-*"))


@pytest.mark.parametrize(("key", "kept"), [("g", 2), ("a", 0)])
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

    run = watched(quick_configs, "direction", "--participant", "P01")
    with AtDisplay(run, tmp_path, display) as screen:
        focus_on_console(screen, journal)
        two_answers(screen)
        leave(screen)
        assert screen.end()[0] == 130
    with AtDisplay(run, tmp_path, display) as screen:
        screen.focus_on("unfinished")
        screen.keys.press(key, "Alt_L")
        wait_for(lambda: last_record(journal).get("kind") == "step")
        screen.focus_on("P01")
        answered = len(answers(journal))
        stop(screen, journal)
        leave(screen)
        assert screen.end()[0] == 130
    assert answered == kept
    assert bool(list(journal.parent.glob("*aside*"))) is (kept == 0)


KEYS_AND_REMARKS = (
    ("uub", 1),
    ("gdoor slam\n", 2),
    ("na dog barked\n", 3),
    ("p", 4),
    ("p", 5),
    ("rnoise\n", 5),
)
"""What is typed, and how many remarks there are then."""


def test_undo_flag_note_pause_and_repeat_by_keys(quick_configs: Path, tmp_path: Path, display: str) -> None:
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    done: list[str] = []

    def key(body: dict[str, Any]) -> None:
        trial = body["trial"]["trial"]
        if body["kind"] == "prepare" and trial == 4 and not done:
            done.append("all")
            wait_for(lambda: shows(tmp_path, "Trial 4 "))
            for text, count in KEYS_AND_REMARKS:
                screen.keys.type(text)
                wait_for(lambda count=count: len(remarks(journal)) >= count)
        elif trial == 5:
            screen.keys.press("F12")
        else:
            answer_by(screen, body)

    with AtDisplay(watched(quick_configs, "direction", "--participant", "P01"), tmp_path, display) as screen:
        focus_on_console(screen, journal)
        last = work_console(screen, journal, key)
        assert last["kind"] == "stopped"
        assert last["reason"] == "emergency stop"
        leave(screen)
        assert screen.end()[0] == 130
    first, second, third, fourth, *_ = rows(tmp_path, DIRECTION, "trials")
    assert (second["response"], second["flags"], second["response_time_valid"]) == ("backward", "corrected", "0")
    assert (third["attempts"], third["flags"]) == ("2", "repeated")
    assert (fourth["flags"], fourth["note"]) == ("door-slam", "a dog barked")
    assert first["flags"] == ""
    assert remarks(journal) == ["answer-corrected", "flagged", "noted", "paused", "continued"]


def remarks(journal: Path) -> list[str]:
    return [json.loads(line)["body"]["kind"] for line in journal.read_text().splitlines() if '"remark"' in line]


def answers(journal: Path) -> list[str]:
    return [outcome.response for _, outcome in history(read(journal)) if isinstance(outcome, Answered)]


def check_killed_console(configs: Path, folder: Path, display: str, seconds: float) -> None:
    """A console killed some seconds into its run loses nothing, and goes on as an unbroken one would."""
    journal = folder / f"{DIRECTION}_journal.jsonl"
    with AtDisplay(watched(configs, "direction", "--participant", "P01"), folder, display) as screen:
        focus_on_console(screen, journal)
        killer = threading.Timer(seconds, screen.kill)
        killer.start()
        work_console(screen, journal, lambda body: answer_by(screen, body), timeout_s=seconds + 1)
        killer.join()
    before = answers(journal)
    with AtDisplay(watched(configs, "direction", "--participant", "P01", "--resume"), folder, display) as screen:
        focus_on_console(screen, journal)
        goal = min(60, len(before) + 2)
        while len(answers(journal)) < goal and screen.process.poll() is None:
            work_console(screen, journal, lambda body: answer_by(screen, body), timeout_s=0.5)
        stop(screen, journal)
        leave(screen)
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
            assert screen.end()[0] == 0
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
    with AtDisplay(watched(quick_configs, "direction", "--participant", "P01"), tmp_path, display) as screen:
        focus_on_console(screen, journal)
        screen.process.terminate()
        code, said = screen.end()
    assert code == 130, said
    assert last_record(journal)["kind"] == "stopped"
    assert last_record(journal)["reason"] == "SIGTERM"
