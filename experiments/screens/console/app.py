"""The console as a program: the run in a thread of its own, its screen, and the window in Qt's."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

from PyQt6.QtCore import QEventLoop, QObject, QTimer, pyqtSignal
from PyQt6.QtWidgets import QApplication

from device import DeviceError, Gun, GunStatus
from experiments.clock import Clock
from experiments.config.door import ConfigError
from experiments.config.setup import Setup
from experiments.design.plan import Plan
from experiments.live_run import LiveRun, RunStopped, Screen
from experiments.record.journal import JournalError
from experiments.run import Finished, Request, run
from experiments.screens.console import windows
from experiments.screens.console.participant_link import ParticipantSide
from experiments.screens.console.view import About, Began, Ended, GunSeen, Message, Saved, Shown, Trouble
from experiments.screens.console.window import Bridge, ConsoleWindow
from experiments.screens.console.windows import let_go, open_as_left, signals_to
from experiments.screens.synthetic import synthetic_participant_of
from experiments.session import events
from experiments.session.events import Hand
from experiments.session.remarks import Noted, Remark
from experiments.session.states import Position
from experiments.session.steps import Outcome, Step
from experiments.study.places import PlaceError

GUN_LOOK_S = 0.2
"""How often the gun's state is looked at."""


class ConsoleScreen:
    """Shows a run in a window, which offers what its keys and buttons mean. `tell` takes messages to it.

    `beside` is the participant's own screen, where there is one.
    """

    def __init__(self, tell: Callable[[Message], None], beside: ParticipantSide | None = None) -> None:
        self._tell, self._beside = tell, beside
        self._stop_looking = threading.Event()

    def begin(self, live: LiveRun) -> None:
        """Show where the run stands, and look after the gun from now on."""
        self._tell(Began(live=live))
        if self._beside is not None:
            noise = self._beside.begin(live, self._tell)
            if noise:
                live.remark(Noted(trial=None, text=noise))
        threading.Thread(target=self._look, args=(live.gun,), daemon=True, name="gun-look").start()

    def end(self) -> None:
        """Look no more, and let the participant's screen go."""
        self._stop_looking.set()
        if self._beside is not None:
            threading.Thread(target=self._beside.close, daemon=True).start()

    def show(self, position: Position) -> None:
        """Have a position shown, on the participant's screen as well."""
        self._tell(Shown(position=position))
        if self._beside is not None:
            self._beside.follow(position)

    def act(self, position: Position, until_s: float | None) -> None:
        """The window acts whenever a key does."""

    def acknowledge(self, step: Step | None, word: Outcome | Remark) -> None:
        """Show that it is safe."""
        self._tell(Saved(step=step, word=word))

    def trouble(self, text: str) -> None:
        """Show what went wrong."""
        self._tell(Trouble(text=text))

    def gun_seen(self, status: GunStatus | None, fault: str) -> None:
        """Show what the gun itself says."""
        self._tell(GunSeen(status=status, fault=fault))

    def _look(self, gun: Gun) -> None:
        """Look at the gun until the run ends."""
        while not self._stop_looking.is_set():
            try:
                self.gun_seen(gun.status(), "")
            except DeviceError as error:
                self.gun_seen(None, str(error))
            self._stop_looking.wait(GUN_LOOK_S)


WAKE_MS = 100
SWITCH_S = 0.0005
"""How soon a thread gets its turn: an answer is not to wait for its journal while the window is painted."""
END_S = 1.5
"""How long a run may take to end in order when the display is lost."""


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
    windows.listen()
    return made


class _Opening(QObject):
    """Asks Qt's own thread for the window."""

    wanted = pyqtSignal(object)


class Console:
    """One run at the console. `Finished` or the reason it ended stands in `result` or `error` afterwards.

    `observer` is the synthetic participant, where one works it, from when the window is there. `band` says that it is a
    practice or a training, `last` what comes after it.
    """

    def __init__(
        self,
        request: Request,
        clock: Clock,
        hand: Hand,
        beside: ParticipantSide | None,
        *,
        band: str = "",
        last: str = "Thank the participant.",
    ) -> None:
        self._request, self._clock = request, clock
        self._hand, self._beside = hand, beside
        self._band, self._last = band, last
        self._bridge, self._opening = Bridge(), _Opening()
        self._opened = threading.Event()
        self._screen: ConsoleScreen | None = None
        self.closed: Callable[[], None] = lambda: None
        self.window: ConsoleWindow | None = None
        self.live: LiveRun | None = None
        self.observer: Any = None
        self.result: Finished | None = None
        self.error: BaseException | None = None
        self._opening.wanted.connect(self._open)
        self._thread = threading.Thread(target=self._run, name="run")

    def start(self) -> None:
        """Begin the run; the window opens once its plan is there."""
        self._thread.start()

    def leave(self, reason: str) -> None:
        """Stop the run, and close the window when it has ended."""
        self._closes = True
        if self.live is not None:
            self.live.offer(events.Stop(reason=reason))
        if self.window is not None and self.window.ended is not None:
            self.window.close()

    _closes = False

    def lose_display(self) -> None:
        """End the run in order although nobody sees it; within `END_S`."""
        if self.live is not None:
            self.live.offer(events.DisplayLost())
        self._thread.join(END_S)

    def finish(self) -> None:
        """Wait until the run has let go of gun and journal."""
        self._thread.join()

    def _open(self, about: About) -> None:
        """Make the window, in Qt's own thread."""
        self.window = ConsoleWindow(
            about, self._bridge, self._clock, hand=self._hand, beside=self._beside, observer=self.observer
        )
        self.window.closed.connect(self.closed)
        self._bridge.message.connect(self._ends)
        open_as_left(self.window, "run")
        self.window.activateWindow()
        self._opened.set()

    def _ends(self, message: Message) -> None:
        """When the run has ended: nothing is looked at any more, and a window that was told to close does."""
        if isinstance(message, Ended):
            if self._screen is not None:
                self._screen.end()
            if self._closes and self.window is not None:
                self.window.close()

    def _make_screen(self, setup: Setup[Any], plan: Plan, clock: Clock) -> Screen:
        del clock
        self.observer = synthetic_participant_of(setup, plan) if self._hand == "synthetic" else None
        about = About(
            setup=setup,
            plan=plan,
            band=self._band,
            last=self._last,
            simulated=self._request.gun == "simulated",
            participant_rates=self._beside is not None and self._beside.rates,
            participant_keys=self._beside is not None and self._beside.own_keys,
        )
        self._opening.wanted.emit(about)
        self._opened.wait()
        self._screen = ConsoleScreen(self._tell, self._beside)
        return self._screen

    def _tell(self, message: Message) -> None:
        if isinstance(message, Began):
            self.live = message.live
        self._bridge.message.emit(message)

    def _run(self) -> None:
        saved: int | None = None
        try:
            self.result = run(self._request, self._make_screen, self._clock)
            saved = self.result.saved
        except (RunStopped, JournalError, PlaceError, ConfigError) as error:
            self.error = error
            saved = error.saved if isinstance(error, RunStopped) else None
        except BaseException as error:
            self.error = error
            raise
        finally:
            reason = None if self.error is None else str(self.error) or type(self.error).__name__
            self._bridge.message.emit(Ended(reason=reason, saved=saved))


def run_console(
    request: Request,
    clock: Clock,
    *,
    hand: Hand = "experimenter",
    beside: ParticipantSide | None = None,
    band: str = "",
    last: str = "Thank the participant.",
    watch: Callable[[Console], None] = lambda _: None,
) -> Finished:
    """Carry out a run at the console. Raises what `run` raises; `watch` is given the console, to drive it.

    The window stays open at the end until it is closed. Without a window, an error is raised at once.
    """
    application()
    console, loop = Console(request, clock, hand, beside, band=band, last=last), QEventLoop()
    console.closed = loop.quit
    wake = QTimer()  # lets Python look at signals such as Ctrl-C while Qt waits
    wake.timeout.connect(lambda: _leave_without_window(loop, console))
    wake.start(WAKE_MS)
    keep = windows.on_loss(console.lose_display)
    with signals_to(console.leave), _quick_threads():
        console.start()
        watch(console)
        loop.exec()
        console.finish()
    keep()
    let_go(wake)
    windows.finish_tone()
    if console.error is not None:
        raise console.error
    if console.result is None:
        raise RunStopped("the run ended without a result")
    return console.result


def _leave_without_window(loop: QEventLoop, console: Console) -> None:
    if console.error is not None and console.window is None:
        loop.quit()


@contextmanager
def _quick_threads() -> Iterator[None]:
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_S)
    try:
        yield
    finally:
        sys.setswitchinterval(before)
