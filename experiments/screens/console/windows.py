"""Windows: they open as they were left, else maximised, their type grows with them, and they end in Qt's own thread.

When the display is lost, Qt says so in a warning, then calls `exit`, which can hang. The warning is heard here, so that
the run ends in order first. Signals end a window in order too: an exception out of a Qt slot would end the process.
"""

from __future__ import annotations

import os
import re
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from types import FrameType
from typing import Any

from PyQt6.QtCore import (
    QByteArray,
    QCoreApplication,
    QEvent,
    QMessageLogContext,
    QObject,
    QSettings,
    QTimer,
    QtMsgType,
    qInstallMessageHandler,
)
from PyQt6.QtWidgets import QWidget

DESIGNED_FOR_PX = (1280, 800)
"""The size of a window at which type has the sizes that the style sheet says."""
_SMALLEST, _LARGEST, _GRAIN = 0.7, 2.5, 0.05


def open_as_left(window: QWidget, name: str) -> None:
    """Show a window where and as large as it was when it was closed; maximised if it never was, or lay elsewhere."""
    left = _settings().value(name)
    if isinstance(left, QByteArray) and window.restoreGeometry(left):
        window.show()
        return
    screen = window.screen()
    if screen is not None:  # without a window manager nobody would make it large
        window.setGeometry(screen.availableGeometry())
    window.showMaximized()


def remember(window: QWidget, name: str) -> None:
    """Keep where a window lies, for the next time; where the folder of settings cannot be written, nothing is kept."""
    settings = _settings()
    settings.setValue(name, window.saveGeometry())
    settings.sync()


def let_go(thing: QObject) -> None:
    """Have Qt delete a window, or a timer, now and in this thread: Python's garbage collector works in any thread."""
    thing.deleteLater()
    QCoreApplication.sendPostedEvents(thing, QEvent.Type.DeferredDelete.value)


def _settings() -> QSettings:
    return QSettings(QSettings.Format.IniFormat, QSettings.Scope.UserScope, "recoil", "windows")


def type_scale(width_px: int, height_px: int) -> float:
    """How much larger type is in a window of a size, in steps, so that not every pixel draws it anew.

    >>> type_scale(1280, 800), type_scale(1920, 1200), type_scale(1024, 600)
    (1.0, 1.5, 0.75)
    """
    fitting = min(width_px / DESIGNED_FOR_PX[0], height_px / DESIGNED_FOR_PX[1])
    return round(_GRAIN * int(min(max(fitting, _SMALLEST), _LARGEST) / _GRAIN + 1e-9), 2)


def scaled(sheet: str, scale: float) -> str:
    """A style sheet with all its sizes in pixels scaled.

    >>> scaled("font-size: 20px; border: 1px", 1.5)
    'font-size: 30px; border: 2px'
    """
    return re.sub(r"\b(\d+)px", lambda size: f"{max(1, round(int(size[1]) * scale))}px", sheet)


_SIGNS = ("connection broke", "X connection", "XIO:", "Did the X11 server die", "compositor die")
LOST = "the display was lost"

_on_loss: list[Callable[[], None]] = []


def on_loss(act: Callable[[], None]) -> Callable[[], None]:
    """Have something done when the display is lost; gives back what takes it back."""
    _on_loss.append(act)
    return lambda: _on_loss.remove(act)


def listen() -> None:
    """Hear Qt's messages from now on; they still go where they went."""
    qInstallMessageHandler(_heard)


def _heard(kind: QtMsgType, context: QMessageLogContext, text: str | None) -> None:
    del kind, context
    sys.stderr.write(f"{text}\n")
    if text and any(sign in text for sign in _SIGNS):
        lost()


def lost() -> None:
    """End everything that is under way, then the process."""
    for act in _on_loss:
        act()
    sys.stderr.write(f"recoil: stopped: {LOST}. Every window is gone; go on with --resume.\n")
    sys.stderr.flush()
    os._exit(1)


WAKE_MS = 100
"""How often Python looks at signals while Qt waits."""


@contextmanager
def signals_to(leave: Callable[[str], None] | None = None) -> Iterator[list[str]]:
    """Have SIGINT, SIGTERM and SIGHUP call `leave` with the signal's name; gives the names of those that came.

    `leave` is called by Qt's event loop, never in the midst of what was going on, such as painting. Without `leave`,
    where there is no window, a signal raises `KeyboardInterrupt`. Where one such context lies in another, the inner one
    takes a signal and the outer one notes it: what ends a run also ends the day around it.
    """
    known = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    handler = _Handler(leave, {number: signal.getsignal(number) for number in known}, [])
    _wake()
    try:
        for number in known:
            signal.signal(number, handler)
        yield handler.came
    finally:
        for number, before in handler.before.items():
            signal.signal(number, before)


@lru_cache(maxsize=1)
def _wake() -> QTimer:
    """Lets Python look at signals while Qt waits; one for the whole program, as long as it lasts."""
    wake = QTimer(QCoreApplication.instance())
    wake.timeout.connect(lambda: None)
    wake.start(WAKE_MS)
    return wake


@dataclass(frozen=True, slots=True)
class _Handler:
    leave: Callable[[str], None] | None
    before: dict[int, Any]
    came: list[str]

    def __call__(self, number: int, frame: FrameType | None) -> None:
        del frame
        name, leave = signal.Signals(number).name, self.leave
        self._note(number)
        if leave is None:
            raise KeyboardInterrupt(name)
        QTimer.singleShot(0, lambda: leave(name))

    def _note(self, number: int) -> None:
        self.came.append(signal.Signals(number).name)
        outer = self.before.get(number)
        if isinstance(outer, _Handler):
            outer._note(number)
