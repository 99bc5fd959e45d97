"""What happens when the display of the console is lost: Qt ends the process, but not before the run has ended in order.

Qt says so in a warning, then calls `exit`, which can hang. The warning is heard here, in Qt's own thread.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable

from PyQt6.QtCore import QMessageLogContext, QtMsgType, qInstallMessageHandler

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
