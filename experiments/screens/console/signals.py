"""Signals that end a window in order: an exception out of a Qt slot would end the process at once."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from types import FrameType
from typing import Any

from PyQt6.QtCore import QCoreApplication, QTimer

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
