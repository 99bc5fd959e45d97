"""What every window of the console needs of the system: its place, its keys, signals; and the display's loss.

When the display is lost, Qt says so in a warning, then calls `exit`, which can hang. The warning is heard here, so that
the run ends in order first. Signals end a window in order too, and so do errors: an exception out of a Qt slot would
end the process, or be printed and no more.
"""

from __future__ import annotations

import os
import re
import signal
import sys
import traceback
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any, Protocol

from PyQt6 import QtCore, QtGui
from PyQt6.QtGui import QKeyEvent
from PyQt6.QtWidgets import QApplication, QWidget

from device.interrupts import INTERRUPTS
from device.machine_clock import machine_s
from experiments.screens.console.keys import EventClock, Name, Presses

DESIGNED_FOR_PX = (1280, 800)
"""The size of a window at which type has the sizes that the style sheet says."""
_SMALLEST, _LARGEST, _GRAIN = 0.7, 2.5, 0.05


def open_as_left(window: QWidget, name: str) -> None:
    """Show a window where and as large as it was when it was closed; maximised if it never was, or lay elsewhere."""
    left = _settings().value(name)
    if isinstance(left, QtCore.QByteArray) and window.restoreGeometry(left):
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


def let_go(thing: QtCore.QObject) -> None:
    """Have Qt delete a window, or a timer, now and in this thread: Python's garbage collector works in any thread."""
    thing.deleteLater()
    QtCore.QCoreApplication.sendPostedEvents(thing, QtCore.QEvent.Type.DeferredDelete.value)


def _settings() -> QtCore.QSettings:
    return QtCore.QSettings(QtCore.QSettings.Format.IniFormat, QtCore.QSettings.Scope.UserScope, "recoil", "windows")


def type_scale(width_px: int, height_px: int) -> float:
    """How much larger type is in a window of a size, in steps, so that not every pixel draws it anew.

    >>> type_scale(1280, 800), type_scale(1920, 1200), type_scale(1024, 600)
    (1.0, 1.5, 0.75)
    """
    fitting = min(width_px / DESIGNED_FOR_PX[0], height_px / DESIGNED_FOR_PX[1])
    return round(_GRAIN * int(min(max(fitting, _SMALLEST), _LARGEST) / _GRAIN + 1e-9), 2)


def scaled_sheet(sheet: str, scale: float) -> str:
    """A style sheet with all its sizes in pixels scaled.

    >>> scaled_sheet("font-size: 20px; border: 1px", 1.5)
    'font-size: 30px; border: 2px'
    """
    return re.sub(r"\b(\d+)px", lambda size: f"{max(1, round(int(size[1]) * scale))}px", sheet)


_SIGNS = ("connection broke", "X connection", "XIO:", "Did the X11 server die", "compositor die")
_on_loss: list[Callable[[], None]] = []


@contextmanager
def on_loss(act: Callable[[], None]) -> Iterator[None]:
    """Have something done when the display is lost meanwhile."""
    _on_loss.append(act)
    try:
        yield
    finally:
        _on_loss.remove(act)


def hear_of_loss() -> None:
    """Hear Qt's messages from now on; they still go where they went."""
    QtCore.qInstallMessageHandler(_heard)


def _heard(kind: QtCore.QtMsgType, context: QtCore.QMessageLogContext, text: str | None) -> None:
    del kind, context
    sys.stderr.write(f"{text}\n")
    if text and any(sign in text for sign in _SIGNS):
        _end_all()


def _end_all() -> None:
    """End everything that is under way, then the process."""
    for act in _on_loss:
        act()
    sys.stderr.write("recoil: stopped: the display was lost. Every window is gone; go on with --resume.\n")
    sys.stderr.flush()
    os._exit(1)


class _Grabs(QtCore.QAbstractNativeEventFilter):
    """Hears from X itself whether another program has grabbed the keyboard: Qt knows of the focus alone.

    A click brings the focus here while the keys still go there.
    """

    def __init__(self) -> None:
        super().__init__()
        self.elsewhere = False

    def nativeEventFilter(self, kind: Any, message: Any) -> tuple[bool, Any]:  # noqa: N802 - Qt's name
        """Look at what X says of the focus, as in `xcb_focus_in_event_t`; every event goes on."""
        if message is not None and kind == b"xcb_generic_event_t":
            event = message.asstring(9)
            came, detail, mode = event[0] & 0x7F, event[1], event[8]
            if came == _FOCUS_IN and detail != _OF_POINTER:
                self.elsewhere = mode == _WHILE_GRABBED
            elif came == _FOCUS_OUT and mode == _BY_GRAB:
                self.elsewhere = True
        return False, 0


_FOCUS_IN, _FOCUS_OUT, _OF_POINTER, _BY_GRAB, _WHILE_GRABBED = 9, 10, 5, 1, 3
_grabs = _Grabs()


def hear_of_grabs() -> None:
    """Hear of grabbed keyboards from now on, where there is X."""
    if (app := QtCore.QCoreApplication.instance()) is not None:
        app.installNativeEventFilter(_grabs)


def has_keys(window: QWidget) -> bool:
    """Whether what is pressed comes to a window."""
    return window.isActiveWindow() and not _grabs.elsewhere


WAKE_MS = 100
"""How often Python looks at signals while Qt waits."""


@contextmanager
def signals_to(leave: Callable[[str], object] | None = None) -> Iterator[list[str]]:
    """Have the signals of `INTERRUPTS` call `leave` with the signal's name; gives the names of those that came.

    `leave` is called by Qt's event loop, never in the midst of what was going on, such as painting. Without `leave`,
    where there is no window, a signal raises `KeyboardInterrupt`. Where one such context lies in another, the inner one
    takes a signal and the outer one notes it: what ends a run also ends the day around it.
    """
    handler = _Handler(leave, {number: signal.getsignal(number) for number in INTERRUPTS}, [])
    _wake()
    try:
        for number in INTERRUPTS:
            signal.signal(number, handler)
        yield handler.came
    finally:
        for number, before in handler.before.items():
            signal.signal(number, before)


@contextmanager
def errors_to(told: Callable[[str], None]) -> Iterator[None]:
    """Have an error in what Qt calls told, with its place: printed alone, it would leave a window that stands still."""
    before = sys.excepthook

    def tell(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        *_, (frame, line) = traceback.walk_tb(trace)
        told(f"{kind.__name__}: {error} ({Path(frame.f_code.co_filename).name}, line {line})")

    sys.excepthook = tell
    try:
        yield
    finally:
        sys.excepthook = before


@lru_cache(maxsize=1)
def _wake() -> QtCore.QTimer:
    """Lets Python look at signals while Qt waits; one for the whole program, as long as it lasts."""
    wake = QtCore.QTimer(QtCore.QCoreApplication.instance())
    wake.timeout.connect(lambda: None)
    wake.start(WAKE_MS)
    return wake


@dataclass(frozen=True, slots=True)
class _Handler:
    leave: Callable[[str], object] | None
    before: dict[int, Any]
    came: list[str]

    def __call__(self, number: int, frame: FrameType | None) -> None:
        del frame
        name, leave = signal.Signals(number).name, self.leave
        self._note(number)
        if leave is None:
            raise KeyboardInterrupt(name)
        QtCore.QTimer.singleShot(0, lambda: leave(name))

    def _note(self, number: int) -> None:
        self.came.append(signal.Signals(number).name)
        outer = self.before.get(number)
        if isinstance(outer, _Handler):
            outer._note(number)


LET_GO_MS = 100
"""A key is let go when it is not down again after so long: a busy machine tells an auto-repeat as two events, and they
may come apart.
"""
_NAMES = {
    QtCore.Qt.Key.Key_Space: "Space",
    QtCore.Qt.Key.Key_Return: "Enter",
    QtCore.Qt.Key.Key_Enter: "Enter",
    QtCore.Qt.Key.Key_Escape: "Esc",
    QtCore.Qt.Key.Key_F1: "F1",
    QtCore.Qt.Key.Key_F2: "F2",
    QtCore.Qt.Key.Key_F12: "F12",
    QtCore.Qt.Key.Key_Left: "left",
    QtCore.Qt.Key.Key_Right: "right",
    QtCore.Qt.Key.Key_Up: "up",
    QtCore.Qt.Key.Key_Down: "down",
}
_PLACES = {
    first + place: letter
    for first, row in ((24, "QWERTYUIOP"), (38, "ASDFGHJKL"), (52, "ZXCVBNM"))
    for place, letter in enumerate(row)
}
"""Letters by X's number of their place on the keyboard, for alphabets that have others there."""
_BELOW_X = 8
"""So much less than X's are Windows' numbers; a Mac's Qt gives each key the number 1, which is no place."""
_DIGITS = {10 + place: digit for place, digit in enumerate("1234567890")}
"""As the letters, for keyboards that have digits with Shift alone."""
_PAD = dict(zip((79, 80, 81, 83, 84, 85, 87, 88, 89, 90), "7894561230", strict=True))
"""The digits of the number pad, which without Num Lock are arrows and the like."""


class Hears(Protocol):
    """Who is told of the keys."""

    def command(self, key: str, *, ctrl: bool) -> Name | None:
        """The command that a key is now."""

    def is_elsewhere(self, key: str) -> bool:
        """Whether a key is the participant's, and does nothing here."""

    def down(self, name: Name, at_s: float) -> None:
        """The key of a command went down."""

    def up(self, key: str) -> None:
        """A key was let go."""


class Keyboard(QtCore.QObject):
    """An event filter for a window (`QWindow`): what is a command is taken out, the rest is text for the widgets."""

    def __init__(self, hears: Hears, now: Callable[[], float]) -> None:
        super().__init__()
        self._hears, self._now = hears, now
        self._presses = Presses()
        self._clock = EventClock()
        self._into: dict[str, QWidget | None] = {}
        """Where a key went as text when it went down."""

    def eventFilter(self, watched: QtCore.QObject | None, event: QtCore.QEvent | None) -> bool:  # noqa: N802 - Qt's name
        """Take a key that is a command; true keeps it from everybody else."""
        del watched
        if event is not None and event.type() == QtCore.QEvent.Type.FocusOut:
            for key in self._presses.lost():
                self._hears.up(key)
        if not isinstance(event, QKeyEvent):
            return False
        key = key_name(event)
        if event.type() == QtCore.QEvent.Type.KeyRelease:
            number = self._presses.up(key, _stamp_s(event), repeated=event.isAutoRepeat())
            if not event.isAutoRepeat():
                QtCore.QTimer.singleShot(LET_GO_MS, lambda: self._let_go(key, number))
            return False
        if event.type() != QtCore.QEvent.Type.KeyPress:
            return False
        return self._pressed(key, event)

    def is_down(self, key: str) -> bool:
        """Whether a key is down, and not perhaps let go."""
        return self._presses.is_down(key)

    def _let_go(self, key: str, number: int) -> None:
        """Say that a key was let go by a release, if it was."""
        if self._presses.was_let_go(key, number):
            self._hears.up(key)

    def _pressed(self, key: str, event: QKeyEvent) -> bool:
        stamp_s = _stamp_s(event)
        at_s = self._clock.at(stamp_s, self._now())
        acts = self._presses.down(key, stamp_s, repeated=event.isAutoRepeat())
        name = self._hears.command(key, ctrl=bool(event.modifiers() & QtCore.Qt.KeyboardModifier.ControlModifier))
        if name is None:
            return self._hears.is_elsewhere(key) or self._is_stale_text(key, fresh=acts)
        self._into.pop(key, None)
        if acts:
            self._hears.up(key)  # a hand let it go just now, for however short a time
            self._hears.down(name, at_s)
        return True

    def _is_stale_text(self, key: str, *, fresh: bool) -> bool:
        """Whether text comes from a key that went down for something else and is held still."""
        into = QApplication.focusWidget()
        if fresh:
            self._into[key] = into
        return key not in self._into or self._into[key] is not into


class FreshShortcuts(QtCore.QObject):
    """Has each shortcut of a window act once a press, however long its key is held.

    Qt itself takes a repeated key for a new one when the machine is too busy to read its two events together.
    """

    def __init__(self, widget: QWidget) -> None:
        super().__init__(widget)
        self._widget = widget
        self._presses = Presses()
        self._stale = ""
        widget.winId()  # it has no window (`QWindow`) before
        if (window := widget.windowHandle()) is not None:
            window.installEventFilter(self)

    def eventFilter(self, watched: QtCore.QObject | None, event: QtCore.QEvent | None) -> bool:  # noqa: N802 - Qt's name
        """Take a key that is held still; true keeps it from everybody else. Text repeats as it always does."""
        del watched
        if event is not None and event.type() == QtCore.QEvent.Type.FocusOut:
            self._presses.lost()
        if not isinstance(event, QKeyEvent):
            return False
        key, stamp_s = key_name(event), _stamp_s(event)
        if event.type() == QtCore.QEvent.Type.KeyRelease:
            self._presses.up(key, stamp_s, repeated=event.isAutoRepeat())
            return False
        if event.type() == QtCore.QEvent.Type.ShortcutOverride and _may_be_shortcut(event):
            acts = self._presses.down(key, stamp_s, repeated=event.isAutoRepeat())
            taken = not acts or self._act_by_place(event, key)
            self._stale = key if taken else ""
            event.setAccepted(taken)
        elif event.type() == QtCore.QEvent.Type.ShortcutOverride:
            self._stale = ""
        return key == self._stale

    def _act_by_place(self, event: QKeyEvent, key: str) -> bool:
        """Activate the shortcut of a key whose alphabet has no such letter: Qt, which looks for letters, finds none."""
        if key not in _PLACES.values() or event.key() == ord(key):
            return False
        wanted = QtGui.QKeySequence(QtCore.QKeyCombination(event.modifiers(), QtCore.Qt.Key(ord(key))))
        there = [one for one in self._widget.findChildren(QtGui.QShortcut) if one.key() == wanted and _is_active(one)]
        if len(there) == 1:
            there[0].activated.emit()
        return len(there) == 1


def _is_active(shortcut: QtGui.QShortcut) -> bool:
    """Whether a shortcut of a window that has the keys acts."""
    parent = shortcut.parent()
    return shortcut.isEnabled() and isinstance(parent, QWidget) and parent.isVisible() and parent.isEnabled()


def _may_be_shortcut(event: QKeyEvent) -> bool:
    """Whether a key is no text, nor moves within it."""
    held = event.modifiers() & (QtCore.Qt.KeyboardModifier.ControlModifier | QtCore.Qt.KeyboardModifier.AltModifier)
    return (
        bool(held)
        or event.key() == QtCore.Qt.Key.Key_Escape
        or QtCore.Qt.Key.Key_F1 <= event.key() <= QtCore.Qt.Key.Key_F12
    )


_ASCII_END = 128


def _stamp_s(event: QKeyEvent) -> float:
    """When the window system saw an event, on its clock; one that an input method makes may have no stamp."""
    return event.timestamp() / 1000 or machine_s()


def key_name(event: QKeyEvent) -> str:
    """A key by the name that commands and answers have: digits, letters as capitals.

    Both by their place on the keyboard, where that has something else there.
    """
    key, place = event.key(), event.nativeScanCode() + (_BELOW_X if sys.platform == "win32" else 0)
    if place in _PAD:
        return _PAD[place]
    named = _NAMES.get(QtCore.Qt.Key(key)) if key in set(_NAMES) else None
    if named is not None:
        return named
    if key < _ASCII_END and chr(key).isalnum():  # Qt's numbers of letters and digits are those of ASCII
        return chr(key)
    is_letter = _is_of_other_alphabet(event.text()) or (place == _Q_PLACE and key in _ON_Q)
    return _DIGITS.get(place) or (_PLACES.get(place) if is_letter else None) or f"#{key}"


_Q_PLACE, _ON_Q = 24, (QtCore.Qt.Key.Key_Semicolon, QtCore.Qt.Key.Key_Slash)
"""The place of Q, and what Greek and Hebrew keyboards have there, which no Latin one has."""


def _is_of_other_alphabet(text: str) -> bool:
    """Whether a key gives a letter, or a sign on one as a vowel is in Thai and Hindi, that is none of ours."""
    return bool(text) and not text.isascii() and all(unicodedata.category(one)[0] in "LM" for one in text)
