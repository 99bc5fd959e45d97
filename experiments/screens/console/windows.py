"""Windows: they open as they were left, else maximised, their type grows with them, and they end in Qt's own thread."""

from __future__ import annotations

import re

from PyQt6.QtCore import QByteArray, QCoreApplication, QEvent, QObject, QSettings
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
