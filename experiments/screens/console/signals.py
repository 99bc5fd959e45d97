"""Signals that end a window in order: an exception out of a Qt slot would end the process at once."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

from PyQt6.QtCore import QTimer

WAKE_MS = 100
"""How often Python looks at signals while Qt waits."""


@contextmanager
def signals_to(leave: Callable[[str], None]) -> Iterator[None]:
    """Have SIGINT, SIGTERM and SIGHUP call `leave` with the signal's name.

    Where one such context lies in another, the inner one is called first and then the outer: what ends a run also ends
    the day around it.
    """
    known = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    handler = _Handler(leave, {number: signal.getsignal(number) for number in known})
    wake = QTimer()
    wake.timeout.connect(lambda: None)
    wake.start(WAKE_MS)
    try:
        for number in known:
            signal.signal(number, handler)
        yield
    finally:
        wake.stop()
        for number, before in handler.before.items():
            signal.signal(number, before)


@dataclass(frozen=True, slots=True)
class _Handler:
    leave: Callable[[str], None]
    before: dict[int, Any] = field(repr=False)

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self.leave(signal.Signals(number).name)
        outer = self.before.get(number)
        if isinstance(outer, _Handler):
            outer(number, frame)
