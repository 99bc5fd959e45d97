"""A console whose gun or disk has a fault, as a program of its own: called with a case and a folder.

A timer in the window's thread ticks, and measures the longest pause between two of its ticks.
"""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from device import Gun, LinkError, Shot, ShotReport
from experiments import run as runs
from experiments.clock import RealClock
from experiments.design.planning import plan_of
from experiments.live_run import RunStopped
from experiments.load import load_setup
from experiments.record import storage
from experiments.run_request import RunRequest
from experiments.screens.console import progress, widgets
from experiments.session.remarks import Noted
from experiments.session.states import State
from tests.at_controls import short_direction
from tests.warm_start import warm

TICK_MS = 5
HANG_S = 1.0
SLOW_SYNC_S = 0.2
PATIENCE_S = 60.0
SETUP = short_direction(sets=1, trials=4, set_break_s=0.0)
TRIALS = 8
"""Two methods of four trials."""


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


SIGNAL_HEARD_S = 1.0
"""Longer than Qt's event loop needs to call what a signal has to do."""


def slow_disk(syncs: threading.Event) -> None:
    """From now on a sync takes its time; `syncs` is set meanwhile."""
    sync = storage.sync

    def slow(descriptor: int) -> None:
        syncs.set()
        time.sleep(SLOW_SYNC_S)
        sync(descriptor)
        syncs.clear()

    storage.sync = slow


def undrawable(guns: list[FaultyGun]) -> None:
    """What comes next cannot be shown any more from the second shot on."""
    coming = progress.coming

    def failing(seen: Any) -> list[str]:
        return [str(1 / 0)] if guns[0].shots > 1 else coming(seen)

    progress.coming = failing


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
        self.seen: dict[str, Any] = {"longest_ms": 0.0, "ticks_in_fault": 0, "titles": [], "lines": [], "asking": []}
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
        if window.drawn.state is State.ASKING:
            self.seen["asking"].append(window.saved.text())

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
    from experiments.screens.console.visual_participant import VisualParticipant

    guns, stopped = faulty_guns(case), None
    syncs = threading.Event()
    if case == "slow-disk":
        slow_disk(syncs)
    if case == "undrawable":
        undrawable(guns)

    request = RunRequest(setup=SETUP, participant_id="P01", results=folder, seed=1, screen="console", visual=True)
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
        if case == "signalled":  # before the window is made and the run begins
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(SIGNAL_HEARD_S)
        return guns[-1]

    runs.open_gun = open_faulty
    return guns


def window_alone() -> dict[str, Any]:
    """A console's window without a run: in which colour it says bad news, and what good ones stay below an end."""
    from experiments.screens.console.app import application
    from experiments.screens.console.view import About, Ended, Saved
    from experiments.screens.console.window import ConsoleWindow

    app, setup = application(), load_setup("preference")
    plan = plan_of(setup.config, "P01", 1)
    window = ConsoleWindow(About(setup=setup, plan=plan), RealClock())
    window.show()
    window.say("bad news", "bad")
    app.processEvents()
    bad = window.saved.palette().color(window.saved.foregroundRole()).name()
    below = []
    for saved in (7, None):  # as many answers were read back at the end, or none could be
        window.take(Saved(step=None, word=Noted(trial=plan.trials[0], text="a dog barked")))
        window.take(Ended(reason="stopped", saved=saved))
        below.append(window.saved.text())
    return {"bad": bad, "wanted": widgets.colour("dark", "bad"), "below": below}


def child(*words: object) -> dict[str, Any]:
    """What the program of this module tells of a case."""
    done = subprocess.run(
        warm("-m", "tests.faulty_console", *words),
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
        timeout=4 * PATIENCE_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout.splitlines()[-1]))


if __name__ == "__main__":
    done = window_alone() if sys.argv[1] == "window-alone" else program(sys.argv[1], Path(sys.argv[2]))
    print(json.dumps(done))  # noqa: T201 - what the test reads
