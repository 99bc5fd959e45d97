"""The console as a program: the run in a thread of its own, and its window in Qt's."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache

from PyQt6.QtCore import QEventLoop, QObject, Qt, pyqtSignal
from PyQt6.QtWidgets import QApplication

from device import DeviceError, GunStatus
from device.messages import RecoilError
from experiments.clock import Clock
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.live_run import LiveRun, RunStopped, Screen
from experiments.run import Finished, run
from experiments.run_request import RunRequest
from experiments.screens.console import view
from experiments.screens.console.controls import Controls
from experiments.screens.console.participant_link import ParticipantSide
from experiments.screens.console.tone import finish_tone
from experiments.screens.console.window import ConsoleWindow
from experiments.screens.console.windows import (
    errors_to,
    hear_of_grabs,
    hear_of_loss,
    on_loss,
    open_as_left,
    signals_to,
)
from experiments.screens.display import no_display
from experiments.session import events
from experiments.session.events import Hand
from experiments.session.remarks import Remark
from experiments.session.states import Position
from experiments.session.steps import Outcome, Step
from experiments.study.folders import PlaceError
from experiments.synthetic.answers import SyntheticParticipant, synthetic_participant_of
from experiments.tasks.questions import first_choices

GUN_LOOK_S = 0.2
"""How often the gun's state is looked at."""
SWITCH_S = 0.0005
"""How soon a thread gets its turn: an answer is not to wait for its journal while the window is painted."""
_END_S = 1.5
"""How long a run may take to end in order when the display is lost."""


def application() -> QApplication:
    """The Qt application. `PlaceError` without a display, where Qt would end the process."""
    if not _only_application.cache_info().currsize and (why := no_display(os.environ, sys.platform)):
        raise PlaceError(f"--screen console: there is no display: {why}; use --screen terminal, or set DISPLAY")
    return _only_application()


@lru_cache(maxsize=1)
def _only_application() -> QApplication:
    """Made once and kept: Qt's windows live only as long as it."""
    made = QApplication(["recoil"])
    made.setQuitOnLastWindowClosed(False)  # one window may follow the other
    hear_of_loss()
    hear_of_grabs()
    return made


@contextmanager
def _quick_threads() -> Iterator[None]:
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_S)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


class _Bridge(QObject):
    """Takes what the run's thread tells to Qt's own."""

    opening = pyqtSignal(view.About)
    message = pyqtSignal(view.Message)


class Console:
    """One run at the console, and the screen that the run knows: what it is shown becomes messages to the window.

    `participant` is the participant's own screen, where there is one; `synthetic` the synthetic participant, where one
    works the console, from when the window is there. `band` says that it is a practice or a training, `last` what
    comes after it. `PlaceError` without a display.
    """

    def __init__(
        self,
        request: RunRequest,
        clock: Clock,
        *,
        band: str = "",
        last: str = view.THANK_PARTICIPANT,
    ) -> None:
        application()
        self.clock, self._request = clock, request
        self.participant: ParticipantSide | None = None
        self._hand: Hand = "synthetic" if request.visual else "experimenter"
        self._band, self._last = band, last
        self.window: ConsoleWindow | None = None
        self.live: LiveRun | None = None
        self.synthetic: SyntheticParticipant | None = None
        self._result: Finished | None = None
        self._error: BaseException | None = None
        self._leaving, self._failed, self._halts = "", False, False
        self._opened, self._over = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="run")
        self._loop, self._bridge = QEventLoop(), _Bridge()
        self._bridge.opening.connect(self._open)
        self._bridge.message.connect(self._take, Qt.ConnectionType.QueuedConnection)  # type: ignore[call-arg] # as Qt has it
        self._tell = self._bridge.message.emit

    def halt_at_once(self) -> None:
        """The emergency stop was pressed before the run is there: it begins halted."""
        self._halts = True

    def run(self) -> Finished:
        """Carry the run out. Raises what `experiments.run.run` raises.

        The window stays open at the end until it is closed. Without a window, an error is raised at once.
        """
        with on_loss(self._lose_display), signals_to(self._end), errors_to(self._fail), _quick_threads():
            self._thread.start()
            self._loop.exec()
            self._thread.join()
        finish_tone()
        if self._error is not None:
            raise self._error
        if self._result is None:
            raise RunStopped("the run ended without a result")
        return self._result

    # in Qt's own thread

    def _open(self, about: view.About) -> None:
        self.window = ConsoleWindow(about, self.clock)
        self.window.closed.connect(self._loop.quit)
        open_as_left(self.window, "run")
        self.window.activateWindow()
        self._opened.set()

    def _take(self, message: view.Message) -> None:
        if self._failed and isinstance(message, view.Ended):
            self._loop.quit()
            return
        if self.window is not None and isinstance(message, view.Began):
            self.window.begin(message.live, self._controls(self.window, message.live))
        if self.window is not None:
            self.window.take(message)
        if isinstance(message, view.Ended) and self.window is None:
            self._loop.quit()
        elif isinstance(message, view.Ended) and self._leaving and self.window is not None:
            self.window.close()

    def _controls(self, window: ConsoleWindow, live: LiveRun) -> Controls:
        return Controls(
            live,
            self.clock,
            window,
            choices=first_choices(window.about.setup.config),
            hand=self._hand,
            participant=self.participant,
            synthetic=self.synthetic,
            kept=not window.about.band,
        )

    def _end(self, reason: str) -> None:
        """As `_leave`, by a signal: nobody is asked about what is half typed."""
        try:
            if self.window is not None and self.window.controls is not None and self.window.ended is None:
                self.window.controls.keep_typed()
        finally:
            self._leave(reason)

    def _leave(self, reason: str) -> None:
        """Stop the run, also one that has not begun yet, and close the window when it has ended."""
        self._leaving = reason
        if self.live is not None:
            self.live.offer(events.Stop(reason=reason))
        if self.window is not None and self.window.ended is not None:
            self.window.close()

    def _fail(self, error: str) -> None:
        """Stop the run and go, once: a window that cannot do what it has to may show what is not so."""
        if self._failed:
            return
        self._failed = True
        self._opened.set()  # the run waits for its window no longer
        self._leave(f"the console failed: {error}")
        if self._over.is_set():
            self._loop.quit()

    def _lose_display(self) -> None:
        """End the run in order although nobody sees it; within `_END_S`."""
        if self.live is not None:
            self.live.offer(events.DisplayLost())
        self._thread.join(_END_S)

    # in the run's thread

    def _run(self) -> None:
        saved: int | None = None
        try:
            self._result = run(self._request, self._make_screen, self.clock)
            saved = self._result.saved
        except RecoilError as error:
            self._error, saved = error, getattr(error, "saved", None)
        except BaseException as error:
            self._error = error
            raise
        finally:
            self._over.set()
            if self.participant is not None and self.window is not None:
                threading.Thread(target=self.participant.close, daemon=True).start()
            reason = None if self._error is None else str(self._error) or type(self._error).__name__
            self._tell(view.Ended(reason=reason, saved=saved))

    def _make_screen(self, setup: Setup[DesignConfig], plan: Plan, clock: Clock) -> Screen:
        del clock
        self.synthetic = synthetic_participant_of(setup, plan) if self._hand == "synthetic" else None
        about = view.About(
            setup=setup,
            plan=plan,
            band=self._band,
            last=self._last,
            participant_rates=self.participant is not None and self.participant.rates,
            participant_keys=self.participant is not None and self.participant.own_keys,
            messages=self._request.language.messages,
        )
        self._bridge.opening.emit(about)
        self._opened.wait()
        return self

    def _look_at(self, live: LiveRun) -> None:
        """Look at the gun until the run ends: one that does not answer is not fired, one with a fault does not arm."""
        while not self._over.is_set():
            asked_s = self.clock.now()
            try:
                seen = view.GunSeen(status=live.gun.status(), asked_s=asked_s)
            except DeviceError as error:
                seen = view.GunSeen(status=None, asked_s=asked_s, fault=str(error))
            self._tell(seen)
            self._over.wait(GUN_LOOK_S)

    # the screen that the run knows

    def begin(self, live: LiveRun) -> None:
        """Show where the run stands, and look after the gun from now on."""
        self.live = live
        self._tell(view.Began(live=live))
        if self._leaving:
            live.offer(events.Stop(reason=self._leaving))
        if self._halts:
            live.offer(events.EmergencyStop())
        if self.participant is not None:
            self.participant.begin(live, self._tell)
        threading.Thread(target=self._look_at, args=(live,), daemon=True, name="gun-look").start()

    def show(self, position: Position) -> None:
        """Have a position shown, on the participant's screen as well."""
        self._tell(view.Shown())
        if self.participant is not None:
            self.participant.follow(position)

    def act(self, position: Position, until_s: float | None) -> None:
        """The window acts whenever a key does."""

    def acknowledge(self, step: Step | None, word: Outcome | Remark) -> None:
        """Show that it is safe."""
        self._tell(view.Saved(step=step, word=word))

    def trouble(self, text: str) -> None:
        """Show what went wrong."""
        self._tell(view.Trouble(text=text))

    def gun_seen(self, status: GunStatus | None, fault: str) -> None:
        """Show what the gun itself says, now that it was told to disarm."""
        self._tell(view.GunSeen(status=status, asked_s=self.clock.now(), fault=fault))
