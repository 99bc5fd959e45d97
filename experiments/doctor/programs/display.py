"""Does Qt open a window here? On which screen?"""

from __future__ import annotations

import time

from PyQt6.QtCore import QCoreApplication, QEventLoop
from PyQt6.QtWidgets import QApplication, QLabel, QWidget

from device.machine_clock import machine_s
from experiments.doctor.figures import Display
from experiments.doctor.programs import Absent

SEEN_WITHIN_S = 5.0


def label(text: str) -> QLabel:
    """A small window that says what it is."""
    made = QLabel(text)
    made.setWindowTitle("Recoil doctor")
    made.resize(480, 120)
    return made


def until_seen(window: QWidget) -> bool:
    """Show a window and wait until the display has it; false if it never has."""
    window.show()
    end_s = machine_s() + SEEN_WITHIN_S
    while machine_s() < end_s:
        QCoreApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 10)
        handle = window.windowHandle()
        if handle is not None and handle.isExposed():
            return True
        time.sleep(0.001)  # asked for anew, since nothing tells Qt of a window that is never shown
    return False


def look() -> Display:
    """Open a window and measure its screen."""
    app = QApplication(["recoil"])
    screen = app.primaryScreen()
    if screen is None:
        raise Absent("the desktop has no screen")
    start_s = machine_s()
    seen = until_seen(label("Recoil looks at the display."))
    return Display(
        platform=app.platformName(),
        width_px=screen.size().width(),
        height_px=screen.size().height(),
        refresh_Hz=screen.refreshRate(),
        opened_ms=1000 * (machine_s() - start_s) if seen else None,
    )
