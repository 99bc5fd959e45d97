"""What a console's window does while gun or disk do not: it stays awake, says so, and records nothing that was not.

Each case is a program of its own (this module, called with a case and a folder) in which the simulated gun or the disk
is given a fault; a timer in the window's thread ticks, and measures the longest pause between two of its ticks.
"""

from __future__ import annotations

import csv
import json
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from device import Gun, LinkError, Shot, ShotReport
from experiments import catalogue
from experiments import run as runs
from experiments.clock import RealClock
from experiments.live_run import RunStopped
from experiments.load import load_setup
from experiments.record import storage
from experiments.record.journal import Contents, read
from experiments.record.replay import history
from experiments.run import RunRequest
from experiments.screens.console import widgets
from experiments.session.states import State
from experiments.session.steps import Answered, Ask, Failed, Fire, Fired
from experiments.study.places import place
from tests.at_controls import short_direction

pytest.importorskip("PyQt6")

TICK_MS = 5
HANG_S = 1.0
SLOW_SYNC_S = 0.2
PATIENCE_S = 60.0


# the program


class FaultyGun:
    """The simulated gun with a fault at its second shot, or from then on. It keeps when it was disarmed."""

    def __init__(self, gun: Gun, case: str) -> None:
        self._gun, self._case = gun, case
        self.shots = 0
        self.hangs = threading.Event()
        self.hung_until_s = math.inf
        self.disarmed_s: list[float] = []

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        self.shots += 1
        if self.shots == 2:
            self._trouble()
        return self._gun.fire(shot, at_s)

    def _trouble(self) -> None:
        match self._case:
            case "hangs":
                self._hang(HANG_S)
                raise LinkError("no answer within 1 s")
            case "hangs-emergency":
                before = len(self.disarmed_s)
                self._hang(PATIENCE_S, until=lambda: len(self.disarmed_s) > before)
                raise LinkError("no answer: it was disarmed")
            case "late":
                self._hang(0.4)
            case "link" | "vanishes":
                raise LinkError("the line is dead")
            case _:
                pass

    def _hang(self, longest_s: float, until: Callable[[], bool] = lambda: False) -> None:
        self.hangs.set()
        end_s = time.monotonic() + longest_s
        while time.monotonic() < end_s and not until():
            time.sleep(0.002)
        self.hangs.clear()
        self.hung_until_s = time.monotonic()

    def disarm(self) -> None:
        self.disarmed_s.append(time.monotonic())
        self._answers()
        self._gun.disarm()

    def arm(self) -> None:
        self._answers()
        self._gun.arm()

    def status(self) -> Any:
        self._answers()
        return self._gun.status()

    def _answers(self) -> None:
        if self._case == "vanishes" and self.shots >= 2:
            raise LinkError("the line is dead")

    def __getattr__(self, name: str) -> Any:
        return getattr(self._gun, name)


def slow_disk(syncs: threading.Event) -> None:
    """From now on a sync takes its time; `syncs` is set meanwhile."""
    sync = storage.sync

    def slow(descriptor: int) -> None:
        syncs.set()
        time.sleep(SLOW_SYNC_S)
        sync(descriptor)
        syncs.clear()

    storage.sync = slow


class Watcher:
    """Ticks in the window's thread, remembers what was shown, presses the emergency stop, and closes what is halted.

    `longest_ms` is the longest pause between two ticks; `ticks_in_fault` are those while the second shot hangs, or
    a slow disk syncs.
    """

    def __init__(self, console: Any, guns: list[FaultyGun], case: str, syncs: threading.Event) -> None:
        from PyQt6.QtCore import Qt, QTimer

        self._console, self._guns, self._syncs = console, guns, syncs
        self._presses = case == "hangs-emergency"
        self._last_s: float | None = None
        self.seen: dict[str, Any] = {"longest_ms": 0.0, "ticks_in_fault": 0, "titles": [], "lines": []}
        self._timer = QTimer()
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._tick)
        self._timer.start(TICK_MS)

    def _tick(self) -> None:
        now_s, window = time.perf_counter(), self._console.window
        if window is None or (window.drawn.step is None and self._last_s is None):
            return  # from the first step on: opening a window takes its time
        if self._last_s is None:
            window.closed.connect(lambda: self._read(window))  # the last words may stand for less than a tick
        else:
            self.seen["longest_ms"] = max(self.seen["longest_ms"], 1000 * (now_s - self._last_s))
        self._last_s = now_s
        self.seen["ticks_in_fault"] += self._guns[0].hangs.is_set() or self._syncs.is_set()
        self._read(window)
        self._act(window)

    def _read(self, window: Any) -> None:
        for name, text in (("titles", window.notice.title.text()), ("lines", window.saved.text())):
            if text not in self.seen[name]:
                self.seen[name].append(text)

    def _act(self, window: Any) -> None:
        from PyQt6.QtCore import Qt
        from PyQt6.QtTest import QTest

        if self._presses and self._guns[0].hangs.is_set():
            self._presses = False
            self.seen["pressed_s"] = time.monotonic()
            QTest.keyClick(window.windowHandle(), Qt.Key.Key_F12)
        elif window.drawn.state is State.HALTED and window.ended is None:
            QTest.keyClick(window.windowHandle(), Qt.Key.Key_Q)


def program(case: str, folder: Path) -> dict[str, Any]:
    """One run at a console worked by a synthetic participant: the longest stall, and what happened."""
    from experiments.screens.console.app import Console
    from experiments.screens.console.visual import VisualParticipant

    guns, stopped = faulty_guns(case), None
    syncs = threading.Event()
    if case == "slow-disk":
        slow_disk(syncs)

    setup = short_direction(sets=1, trials=3, set_break_s=0.0)
    request = RunRequest(setup=setup, participant_id="P01", results=folder, seed=1, screen="console", visual=True)
    console = Console(request, RealClock())
    watcher = Watcher(console, guns, case, syncs)
    try:
        with VisualParticipant(console):
            console.run()
    except RunStopped as stop:
        stopped = str(stop)
    gun = guns[0]
    told = {"disarmed_s": gun.disarmed_s, "hung_until_s": gun.hung_until_s, "shots": gun.shots}
    return watcher.seen | told | {"stopped": stopped}


def faulty_guns(case: str) -> list[FaultyGun]:
    """From now on every gun that is opened has the fault of the case; they are kept in the list."""
    guns: list[FaultyGun] = []
    opened = runs.open_gun

    def open_faulty(*where: Any, **how: Any) -> Any:
        guns.append(FaultyGun(opened(*where, **how), case))
        return guns[-1]

    runs.open_gun = open_faulty
    return guns


def window_alone() -> dict[str, Any]:
    """A console's window without a run: in which colour it says bad news."""
    from experiments.screens.console.app import application
    from experiments.screens.console.view import About
    from experiments.screens.console.window import ConsoleWindow

    app, setup = application(), load_setup("preference")
    plan = catalogue.experiment(setup).make_plan(setup.config, "P01", 1, None)
    window = ConsoleWindow(About(setup=setup, plan=plan), RealClock())
    window.show()
    window.say("bad news", "bad")
    app.processEvents()
    bad = window.saved.palette().color(window.saved.foregroundRole()).name()
    return {"bad": bad, "wanted": widgets.colour("dark", "bad")}


# the tests


def child(*words: object) -> dict[str, Any]:
    """What the program of this module tells of a case."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.test_console_faults", *map(str, words)],
        cwd=Path(__file__).parent.parent,
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
        timeout=4 * PATIENCE_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout.splitlines()[-1]))


Case = Callable[[str], tuple[dict[str, Any], Contents, list[dict[str, str]]]]


@pytest.fixture
def case(tmp_path: Path) -> Case:
    """Runs a case: what its window saw, its journal and its table."""

    def carry_out(name: str) -> tuple[dict[str, Any], Contents, list[dict[str, str]]]:
        seen = child(name, tmp_path)
        where = place(tmp_path, "P01", "direction")
        with where.table.open(newline="", encoding="utf-8") as file:
            return seen, read(where.journal), list(csv.DictReader(file))

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
            assert isinstance(before, Fire)
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
    assert [(row["attempts"], row["flags"]) for row in rows] == [("1", ""), ("2", "device-error"), *[("1", "")] * 4]
    assert all(row["response"] for row in rows)
    assert any(cause in line for line in seen["lines"])
    assert contents.finished


def test_a_gun_that_answers_late_changes_nothing_but_the_time(case: Case) -> None:
    seen, contents, rows = case("late")
    check_awake(seen)
    check_answers(contents)
    assert [(row["attempts"], row["flags"]) for row in rows] == [("1", "")] * 6
    assert "Firing" in seen["titles"]


def test_a_gun_that_vanishes_stops_the_run_with_nothing_answered_for_it(case: Case) -> None:
    seen, contents, rows = case("vanishes")
    check_answers(contents)
    assert "switch off its power" in seen["stopped"]
    assert contents.records[-1].kind == "stopped"
    assert [bool(row["response"]) for row in rows] == [True] + [False] * 5
    assert "Stopped" in seen["titles"]


def test_what_was_fired_when_the_gun_vanished_is_marked_and_presented_again_on_resumption(
    case: Case, tmp_path: Path
) -> None:
    from experiments.clock import VirtualClock
    from experiments.screens.synthetic import synthetic_screen

    case("vanishes")
    setup = short_direction(sets=1, trials=3, set_break_s=0.0)
    request = RunRequest(setup=setup, participant_id="P01", results=tmp_path, again="resume")
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
    assert [bool(row["response"]) for row in rows] == [True] + [False] * 5
    assert contents.records[-1].reason == "emergency stop"


def test_a_disk_whose_sync_takes_200_ms_keeps_no_window_waiting(case: Case) -> None:
    seen, contents, rows = case("slow-disk")
    check_awake(seen)
    check_answers(contents)
    times = [record.monotonic_s for record in contents.records]
    assert times[-1] - times[0] > SLOW_SYNC_S * (len(times) - 1)
    assert [(row["attempts"], row["flags"]) for row in rows] == [("1", "")] * 6


def test_bad_news_have_their_colour() -> None:
    seen = child("window-alone")
    assert seen["bad"] == seen["wanted"]


if __name__ == "__main__":
    done = window_alone() if sys.argv[1] == "window-alone" else program(sys.argv[1], Path(sys.argv[2]))
    print(json.dumps(done))  # noqa: T201 - what the test reads
