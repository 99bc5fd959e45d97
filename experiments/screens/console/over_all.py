"""What is above every widget of a window: keys that stop the gun, which no menu and no list may take for itself."""

from __future__ import annotations

import atexit
from collections.abc import Callable
from contextlib import suppress
from weakref import WeakSet

from PyQt6 import QtCore
from PyQt6.QtGui import QKeyEvent, QMouseEvent, QWindow
from PyQt6.QtWidgets import QApplication, QPlainTextEdit, QTextEdit, QWidget

from experiments.screens.console.widgets import ConsoleButton
from experiments.screens.console.windows import key_name

_made: WeakSet[_OverAll] = WeakSet()


@atexit.register
def _end_all() -> None:
    """Before Qt goes: it would ask what is gone already, and crash. A run may end with its window there."""
    for one in _made:
        with suppress(RuntimeError):  # Qt has deleted it
            one.end()


class _OverAll(QtCore.QObject):
    """Sees every event of this program while a window is shown: a menu or a list that is open takes keys for itself."""

    def __init__(self, window: QWidget) -> None:
        super().__init__(window)
        self._window, self._shown = window, False
        window.installEventFilter(self)
        _made.add(self)

    def end(self) -> None:
        """See nothing more."""
        self._window.removeEventFilter(self)
        if (app := QApplication.instance()) is not None:
            app.removeEventFilter(self)

    def eventFilter(self, watched: QtCore.QObject | None, event: QtCore.QEvent | None) -> bool:  # noqa: N802 - Qt's name
        """Begin and end with the window, of which nothing is left behind that; true keeps an event to itself."""
        app = QApplication.instance()
        if event is None or app is None:
            return False
        if watched is self._window and event.type() == QtCore.QEvent.Type.Show:
            self._shown = True
            app.installEventFilter(self)
        elif watched is self._window and event.type() == QtCore.QEvent.Type.Hide:
            self._shown = False
            app.removeEventFilter(self)
        return self._shown and self.takes(watched, event)

    def takes(self, watched: QtCore.QObject | None, event: QtCore.QEvent) -> bool:
        """Whether an event is for this alone."""
        raise NotImplementedError


class AnyHeld(_OverAll):
    """Has a key act in a window whatever else is held, and whatever menu or list is open there.

    With Ctrl beside it Qt takes it for another shortcut.
    """

    def __init__(
        self, window: QWidget, key: str, act: Callable[[], object], when: Callable[[], bool] = lambda: True
    ) -> None:
        super().__init__(window)
        self._key, self._act, self._when = key, act, when

    def takes(self, watched: QtCore.QObject | None, event: QtCore.QEvent) -> bool:
        """Take the key before it is looked for among the shortcuts, and as it is pressed."""
        del watched
        if not isinstance(event, QKeyEvent) or key_name(event) != self._key or not self._when():
            return False
        if event.type() == QtCore.QEvent.Type.KeyRelease:
            return False  # who heard it go down before is to hear that it is up
        if event.type() == QtCore.QEvent.Type.KeyPress and not event.isAutoRepeat():
            if (popup := QApplication.activePopupWidget()) is not None:
                popup.close()
            self._act()
        event.accept()
        return True


class WhateverPressed(_OverAll):
    """Has any press act, of all keys but one, and of the mouse and its wheel if so asked; each goes on to its place.

    Of what is a shortcut Qt tells no press, but that it is about to look for it.
    """

    def __init__(self, window: QWidget, act: Callable[[], object], *, but: str, mouse: bool = False) -> None:
        super().__init__(window)
        self._act, self._but, self._mouse = act, but, mouse

    def takes(self, watched: QtCore.QObject | None, event: QtCore.QEvent) -> bool:
        """Look at it, and take nothing."""
        del watched
        if isinstance(event, QKeyEvent):
            went_down = event.type() != QtCore.QEvent.Type.KeyRelease and not event.isAutoRepeat()
            beside = "Ctrl+" if event.modifiers() & QtCore.Qt.KeyboardModifier.ControlModifier else ""
            acts = went_down and f"{beside}{key_name(event)}" != self._but
        else:
            acts = self._mouse and event.type() in (QtCore.QEvent.Type.MouseButtonPress, QtCore.QEvent.Type.Wheel)
        if acts:
            self._act()
        return False


class KeepsKeys(_OverAll):
    """Keeps menus shut, and text from being dragged, while a page is shown: both take every key for themselves.

    A menu takes the first click as well, also one on EMERGENCY STOP. So does what another button of the mouse is held
    on: a press on a button that stops is taken from it.
    """

    def takes(self, watched: QtCore.QObject | None, event: QtCore.QEvent) -> bool:
        """Take what asks for a menu, a press on text that is only read, and one to stop that would go elsewhere."""
        kind = event.type()
        if kind == QtCore.QEvent.Type.MouseButtonPress and isinstance(watched, QWindow):
            return self._stops(event)
        if kind not in _OPENING or not isinstance(watched, QWidget) or watched.window() is not self._window.window():
            return False
        return kind == QtCore.QEvent.Type.ContextMenu or isinstance(watched.parent(), QTextEdit | QPlainTextEdit)

    def _stops(self, event: QtCore.QEvent) -> bool:
        """Whether a press beside a held button of the mouse was on what stops: Qt gives it to what that is held on."""
        if not isinstance(event, QMouseEvent) or event.buttons() == event.button():
            return False
        under = QApplication.widgetAt(event.globalPosition().toPoint())
        if not isinstance(under, ConsoleButton) or not under.stops or under.window() is not self._window.window():
            return False
        under.went_down.emit()
        return True


_OPENING = {
    QtCore.QEvent.Type.ContextMenu,
    QtCore.QEvent.Type.MouseButtonPress,
    QtCore.QEvent.Type.MouseButtonDblClick,
}
