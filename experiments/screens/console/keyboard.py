"""The keys of the console's window, before any widget hears of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from PyQt6.QtCore import QEvent, QObject, Qt, QTimer
from PyQt6.QtGui import QKeyEvent
from PyQt6.QtWidgets import QApplication, QWidget

from experiments.screens.console.keys import EventClock, Name, Presses

LET_GO_MS = 100
"""A key is let go when it is not down again after so long: a busy machine tells an auto-repeat as two events, and they
may come apart.
"""
_NAMES = {
    Qt.Key.Key_Space: "Space",
    Qt.Key.Key_Return: "Enter",
    Qt.Key.Key_Enter: "Enter",
    Qt.Key.Key_Escape: "Esc",
    Qt.Key.Key_F1: "F1",
    Qt.Key.Key_F2: "F2",
    Qt.Key.Key_F12: "F12",
}
_PLACES = {
    24: "Q",
    26: "E",
    27: "R",
    28: "T",
    29: "Y",
    30: "U",
    33: "P",
    39: "S",
    41: "F",
    42: "G",
    46: "L",
    53: "X",
    56: "B",
    57: "N",
    58: "M",
}
"""Letters by X's number of their place on the keyboard, for alphabets that have others there."""


class Hears(Protocol):
    """Who is told of the keys."""

    def command(self, key: str, *, ctrl: bool) -> Name | None:
        """The command that a key is now."""

    def down(self, name: Name, at_s: float) -> None:
        """The key of a command went down."""

    def up(self, key: str) -> None:
        """A key was let go."""


class Keyboard(QObject):
    """An event filter for a window (`QWindow`): what is a command is taken out, the rest is text for the widgets."""

    def __init__(self, hears: Hears, now: Callable[[], float]) -> None:
        super().__init__()
        self._hears, self._now = hears, now
        self._presses, self._clock = Presses(), EventClock()
        self._into: dict[str, QWidget | None] = {}
        """Where a key went as text when it went down."""

    def eventFilter(self, watched: QObject | None, event: QEvent | None) -> bool:  # noqa: N802 - Qt's name
        """Take a key that is a command; true keeps it from everybody else."""
        del watched
        if event is not None and event.type() == QEvent.Type.FocusOut:
            for key in self._presses.lost():
                self._hears.up(key)
        if not isinstance(event, QKeyEvent):
            return False
        key, at_s = key_name(event), self._clock.at(event.timestamp(), self._now())
        if event.type() == QEvent.Type.KeyRelease:
            number = self._presses.up(key, at_s, repeated=event.isAutoRepeat())
            if not event.isAutoRepeat():
                QTimer.singleShot(LET_GO_MS, lambda: self._let_go(key, number))
            return False
        if event.type() != QEvent.Type.KeyPress:
            return False
        return self._pressed(key, event, at_s)

    def _let_go(self, key: str, number: int) -> None:
        """Say that a key was let go by a release, if it was."""
        if self._presses.was_let_go(key, number):
            self._hears.up(key)

    def _pressed(self, key: str, event: QKeyEvent, at_s: float) -> bool:
        acts = self._presses.down(key, at_s, repeated=event.isAutoRepeat())
        name = self._hears.command(key, ctrl=bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier))
        if name is None:
            return self._is_stale_text(key, fresh=acts)
        self._into.pop(key, None)
        if acts:
            self._hears.down(name, at_s)
        return True

    def _is_stale_text(self, key: str, *, fresh: bool) -> bool:
        """Whether text comes from a key that went down for something else and is held still."""
        into = QApplication.focusWidget()
        if fresh:
            self._into[key] = into
        return key not in self._into or self._into[key] is not into


class FreshShortcuts(QObject):
    """Has each shortcut of a window act once a press, however long its key is held.

    Qt itself takes a repeated key for a new one when the machine is too busy to read its two events together.
    """

    def __init__(self, widget: QWidget, now: Callable[[], float]) -> None:
        super().__init__(widget)
        self._now, self._presses, self._clock = now, Presses(), EventClock()
        self._stale = ""
        widget.winId()  # it has no window (`QWindow`) before
        if (window := widget.windowHandle()) is not None:
            window.installEventFilter(self)

    def eventFilter(self, watched: QObject | None, event: QEvent | None) -> bool:  # noqa: N802 - Qt's name
        """Take a key that is held still; true keeps it from everybody else. Text repeats as it always does."""
        del watched
        if event is not None and event.type() == QEvent.Type.FocusOut:
            self._presses.lost()
        if not isinstance(event, QKeyEvent):
            return False
        key, at_s = key_name(event), self._clock.at(event.timestamp(), self._now())
        if event.type() == QEvent.Type.KeyRelease:
            if self._presses.is_down(key):
                self._presses.up(key, at_s, repeated=event.isAutoRepeat())
            return False
        if event.type() == QEvent.Type.ShortcutOverride and _may_be_shortcut(event):
            acts = self._presses.down(key, at_s, repeated=event.isAutoRepeat())
            self._stale = "" if acts else key
            event.setAccepted(not acts)
        elif event.type() == QEvent.Type.ShortcutOverride:
            self._stale = ""
        return key == self._stale


def _may_be_shortcut(event: QKeyEvent) -> bool:
    """Whether a key is no text, nor moves within it."""
    held = event.modifiers() & (Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier)
    return bool(held) or event.key() == Qt.Key.Key_Escape or Qt.Key.Key_F1 <= event.key() <= Qt.Key.Key_F12


def key_name(event: QKeyEvent) -> str:
    """A key by the name that commands have: letters as capitals, by their place where the alphabet is another."""
    key = event.key()
    named = _NAMES.get(Qt.Key(key)) if key in set(_NAMES) else None
    if named is not None:
        return named
    if Qt.Key.Key_A <= key <= Qt.Key.Key_Z:
        return chr(key)
    if event.text().isalpha() and not event.text().isascii():
        return _PLACES.get(event.nativeScanCode(), f"#{key}")
    return f"#{key}"
