"""The console as a program: the run in a thread of its own, the window in the main one."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from PyQt6.QtCore import QEventLoop, QTimer
from PyQt6.QtWidgets import QApplication

from experiments.clock import Clock
from experiments.journal import JournalError
from experiments.load import ConfigError
from experiments.places import PlaceError
from experiments.plan import Plan
from experiments.run import Finished, Request, run
from experiments.runner import RunStopped, Screen
from experiments.screens.console.beside import ParticipantSide
from experiments.screens.console.messages import Ended
from experiments.screens.console.screen import ConsoleScreen, Hand
from experiments.screens.console.signals import signals_to
from experiments.screens.console.state import State
from experiments.screens.console.window import Bridge, ConsoleWindow
from experiments.screens.console.windows import let_go
from experiments.screens.synthetic import observer_of
from experiments.setup import Setup

WAKE_MS = 100
SWITCH_S = 0.0005
"""How soon a thread gets its turn: an answer is not to wait for its journal while the window is painted."""


def application() -> QApplication:
    """The Qt application. `PlaceError` without a display, where Qt would end the process."""
    if sys.platform == "linux" and not any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"))):
        raise PlaceError("--screen console: there is no display; use --screen terminal, or set DISPLAY")
    return _only_application()


@lru_cache(maxsize=1)
def _only_application() -> QApplication:
    """Made once and kept: Qt's windows live only as long as it."""
    made = QApplication(["recoil"])
    made.setQuitOnLastWindowClosed(False)  # one window may follow the other
    return made


class Console:
    """One run at the console. `Finished` or the reason it ended stands in `result` or `error` afterwards.

    `observer` is the synthetic participant, where one works it, from when the window is there.
    """

    def __init__(self, request: Request, clock: Clock, hand: Hand, beside: ParticipantSide | None) -> None:
        self._request, self._clock = request, clock
        self._hand, self._beside = hand, beside
        self._bridge = Bridge()
        self._opened = threading.Event()
        self.closed: Callable[[], None] = lambda: None
        self.window: ConsoleWindow | None = None
        self.observer: Any = None
        self.result: Finished | None = None
        self.error: BaseException | None = None
        self._bridge.message.connect(self._first)
        self._thread = threading.Thread(target=self._run, name="run")

    def start(self) -> None:
        """Begin the run; the window opens once its plan is there."""
        self._thread.start()

    def leave(self, reason: str) -> None:
        """Stop the run and close the window."""
        if self.window is not None:
            self.window.controls.stop_for(reason)
            self.window.close()

    def finish(self) -> None:
        """Wait until the run has let go of gun and journal."""
        self._thread.join()

    def _first(self, message: object) -> None:
        """Open the window when the run asks for it. It is made here, in Qt's own thread."""
        if isinstance(message, _Open):
            self.window = ConsoleWindow(message.state, message.screen, self._bridge, self._clock)
            self.window.resize(1280, 800)
            self.window.closed.connect(self.closed)
            self.window.show()
            self.window.activateWindow()
            self._opened.set()

    def _make_screen(self, setup: Setup[Any], plan: Plan, clock: Clock) -> Screen:
        self.observer = observer_of(setup, plan) if self._hand == "synthetic" else None
        screen = ConsoleScreen(
            clock,
            self._bridge.message.emit,
            setup=setup,
            hand=self._hand,
            beside=self._beside,
            observer=self.observer,
        )
        self._bridge.message.emit(_Open(State(setup=setup, plan=plan), screen))
        self._opened.wait()
        return screen

    def _run(self) -> None:
        try:
            self.result = run(self._request, self._make_screen, self._clock)
        except (RunStopped, JournalError, PlaceError, ConfigError) as error:
            self.error = error
        except BaseException as error:
            self.error = error
            raise
        finally:
            self._bridge.message.emit(Ended(reason=None if self.error is None else str(self.error)))


class _Open:
    """Asks for the window."""

    def __init__(self, state: State, screen: ConsoleScreen) -> None:
        self.state, self.screen = state, screen


def run_console(
    request: Request,
    clock: Clock,
    *,
    hand: Hand = "experimenter",
    beside: ParticipantSide | None = None,
    watch: Callable[[Console], None] = lambda _: None,
) -> Finished:
    """Carry out a run at the console. Raises what `run` raises; `watch` is given the console, to drive it.

    The window stays open at the end until it is closed. Without a window, an error is raised at once.
    """
    application()
    sys.setswitchinterval(SWITCH_S)
    console, loop = Console(request, clock, hand, beside), QEventLoop()
    console.closed = loop.quit
    wake = QTimer()  # lets Python look at signals such as Ctrl-C while Qt waits
    wake.timeout.connect(lambda: _leave_without_window(loop, console))
    wake.start(WAKE_MS)
    with signals_to(console.leave):
        console.start()
        watch(console)
        loop.exec()
        console.finish()
    let_go(wake)
    if console.error is not None:
        raise console.error
    if console.result is None:
        raise RunStopped("the run ended without a result")
    return console.result


def _leave_without_window(loop: QEventLoop, console: Console) -> None:
    if console.error is not None and console.window is None:
        loop.quit()
