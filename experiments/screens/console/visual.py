"""A synthetic participant in visual mode: it works the real console by key events, as an experimenter would for it.

It rates on the participant's own screen where there is one. Answers, response times and ratings are those of data mode
for the same seed; an answer comes after its response time, and breaks end early for a recorded reason.
"""

from __future__ import annotations

from typing import Any

from PyQt6.QtCore import Qt, QTimer
from PyQt6.QtTest import QTest
from PyQt6.QtWidgets import QApplication, QWidget

from experiments.clock import Clock
from experiments.screens.console.app import Console
from experiments.screens.console.beside import ParticipantSide
from experiments.screens.console.messages import Waiting
from experiments.screens.console.rater import Rater
from experiments.screens.console.window import ConsoleWindow
from experiments.steps import Ask, Describe, Prepare, Present, Rate, Rest

LOOK_MS = 10
BREAK_REASON = "synthetic participant"
_KEYS = {"forward": Qt.Key.Key_F, "backward": Qt.Key.Key_B}


class VisualParticipant:
    """Watches a console's window and presses a key at every step that waits. Keep it for as long as the run lasts."""

    def __init__(
        self,
        console: Console,
        clock: Clock,
        rater: Rater | None = None,
        beside: ParticipantSide | None = None,
    ) -> None:
        self._console, self._clock = console, clock
        self._rater, self._beside = rater, beside
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
        if waiting is None or waiting is self._done or self._thinks(waiting):
            return
        self._done = waiting
        self._press(window, waiting)

    def _rates_beside(self, window: ConsoleWindow) -> bool:
        """Whether a rating is being given on the participant's screen. No answer has no place there."""
        step = window.state.step
        if self._rater is None or self._beside is None or not isinstance(step, Rate):
            return False
        rating = self._observer.rate(step.trial)
        if rating is None:
            return False
        if self._beside.asking:  # only then: what comes later would be done to the next question
            self._rater.rate(step, rating)
        return True

    @property
    def _observer(self) -> Any:
        """The observer, which is there once the window is."""
        return self._console.observer

    def _thinks(self, waiting: Waiting) -> bool:
        """Whether the response time is not over yet."""
        if not isinstance(waiting.step, Ask):
            return False
        answer_s = waiting.since_s + self._observer.answer(waiting.step.trial).response_time_s
        return bool(self._clock.now() < answer_s)

    def _press(self, window: ConsoleWindow, waiting: Waiting) -> None:
        step = waiting.step
        match step:
            case Prepare() | Present():
                _key(window, Qt.Key.Key_Space)
            case Ask():
                _key(window, _KEYS[self._observer.answer(step.trial).response])
            case Rest():
                _key(window, Qt.Key.Key_E)
                _type(BREAK_REASON, window)
            case Rate():
                rating = self._observer.rate(step.trial)
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
