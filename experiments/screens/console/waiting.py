"""A small window that says what is waited for, while something is done that takes seconds."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

from PyQt6.QtCore import QEventLoop, Qt, QTimer
from PyQt6.QtWidgets import QLabel

from experiments.screens.console import theme

LOOK_MS = 30
Made = TypeVar("Made")


def while_shown(text: str, make: Callable[[], Made]) -> Made:
    """What `make` gives back, done in a thread of its own while a window shows the text. Raises what it raises."""
    shown = QLabel(text)
    shown.setWindowTitle("Recoil – please wait")
    shown.setStyleSheet(f"{theme.sheet('dark')} QLabel {{ font-size: 26px; padding: 40px; }}")
    shown.setAlignment(Qt.AlignmentFlag.AlignCenter)
    made: list[Made] = []
    errors: list[BaseException] = []

    def work() -> None:
        try:
            made.append(make())
        except BaseException as error:  # noqa: BLE001 - raised again where it is waited for
            errors.append(error)

    loop, look, thread = QEventLoop(), QTimer(), threading.Thread(target=work, daemon=True, name="waiting")
    look.timeout.connect(lambda: None if thread.is_alive() else loop.quit())
    shown.show()
    thread.start()
    look.start(LOOK_MS)
    loop.exec()
    shown.close()
    if errors:
        raise errors[0]
    return made[0]
