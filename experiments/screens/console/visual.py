"""A synthetic participant in visual mode: it works the real console by key events, as an experimenter would for it.

It rates on the participant's own screen where there is one. Its answers are those of data mode for the same seed; times
are real, but for breaks, which it ends early for a recorded reason.
"""

from __future__ import annotations

from typing import Any

from PyQt6.QtCore import Qt, QTimer
from PyQt6.QtTest import QTest
from PyQt6.QtWidgets import QApplication, QWidget

from experiments import catalogue
from experiments.screens.console.app import Console
from experiments.screens.console.beside import ParticipantSide
from experiments.screens.console.messages import Waiting
from experiments.screens.console.rater import Rater
from experiments.screens.console.window import ConsoleWindow
from experiments.setup import Setup
from experiments.steps import Ask, Describe, Prepare, Present, Rate, Rest

LOOK_MS = 10
BREAK_REASON = "synthetic participant"
_KEYS = {"forward": Qt.Key.Key_F, "backward": Qt.Key.Key_B}


class VisualParticipant:
    """Watches a console's window and presses a key at every step that waits. Keep it for as long as the run lasts."""

    def __init__(
        self,
        setup: Setup[Any],
        console: Console,
        rater: Rater | None = None,
        beside: ParticipantSide | None = None,
    ) -> None:
        self._setup, self._console = setup, console
        self._rater, self._beside = rater, beside
        self._observer: Any = None
        self._done: Waiting | None = None
        self._timer = QTimer()
        self._timer.timeout.connect(self._look)
        self._timer.start(LOOK_MS)

    def _look(self) -> None:
        window = self._console.window
        if window is None or self._rates_beside(window):
            return
        if not window.isActiveWindow():
            window.activateWindow()  # keys reach the window that has the focus
            return
        if window.state.ended is not None:
            self._timer.stop()
            window.close()
            return
        waiting = window.state.waiting
        if waiting is None or waiting is self._done:
            return
        self._done = waiting
        self._press(window, waiting)

    def _rates_beside(self, window: ConsoleWindow) -> bool:
        """Whether a rating is being given on the participant's screen. No answer has no place there."""
        step = window.state.step
        if self._rater is None or self._beside is None or not isinstance(step, Rate):
            return False
        rating = self._seen(window).rate(step.trial)
        if rating is None:
            return False
        if self._beside.asking:  # only then: what comes later would be done to the next question
            self._rater.rate(step, rating)
        return True

    def _seen(self, window: ConsoleWindow) -> Any:
        """The observer, made when the plan is known."""
        if self._observer is None:
            self._observer = catalogue.experiment(self._setup).observer(self._setup, window.state.plan)
        return self._observer

    def _press(self, window: ConsoleWindow, waiting: Waiting) -> None:
        step = waiting.step
        match step:
            case Prepare() | Present():
                _key(window, Qt.Key.Key_Space)
            case Ask():
                _key(window, _KEYS[self._seen(window).answer(step.trial).response])
            case Rest():
                _key(window, Qt.Key.Key_E)
                _type(BREAK_REASON, window)
            case Rate():
                rating = self._seen(window).rate(step.trial)
                if rating is None:
                    _key(window, Qt.Key.Key_X, Qt.KeyboardModifier.ControlModifier)
                else:
                    _type(repr(rating), window)
            case Describe():
                _type("", window)
            case _:
                pass


def _target(window: QWidget) -> QWidget:
    """Where keys go: the widget with the cursor, else the window."""
    return QApplication.focusWidget() or window.focusWidget() or window


def _key(window: QWidget, key: Qt.Key, modifier: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
    QTest.keyClick(_target(window), key, modifier)  # type: ignore[call-overload] # its stubs take it for a method


def _type(text: str, window: QWidget) -> None:
    QTest.keyClicks(_target(window), text)  # type: ignore[call-arg,arg-type] # as above
    _key(window, Qt.Key.Key_Return)
