"""Keyboard and mouse of an X display by synthetic events (XTest): what a real hand does, as every program sees it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

from Xlib import XK, X
from Xlib.display import Display
from Xlib.error import DisplayError, XError
from Xlib.ext import xtest

from device.machine_clock import machine_s

LOOK_S = 0.05
_SMALLEST_PX = 400
"""Qt keeps small windows of its own; what people work at is wider."""


class NoDisplay(Exception):  # noqa: N818 - a machine may well have none
    """There is no X display that takes synthetic events."""


class Hands:
    """Two hands on keyboard and mouse. `NoDisplay` where there is no X; `name` is another display than `DISPLAY`."""

    def __init__(self, name: str | None = None) -> None:
        try:
            self.display = Display(name)
        except (DisplayError, OSError) as error:
            raise NoDisplay(f"no X display ({' '.join(str(error).split())})") from error
        if not self.display.has_extension("XTEST"):
            raise NoDisplay("the X display has no XTEST extension")
        self._root = self.display.screen().root

    def close(self) -> None:
        """Let go of the display."""
        self.display.close()

    def key_down(self, name: str) -> float:
        """Press a key by its X name and keep it down, so that the system repeats it.

        Gives back when, on the monotonic clock.
        """
        return self._key(X.KeyPress, name)

    def key_up(self, name: str) -> float:
        """Let go of a key; gives back when."""
        return self._key(X.KeyRelease, name)

    def _key(self, event: int, name: str) -> float:
        at_s = machine_s()
        xtest.fake_input(self.display, event, self.display.keysym_to_keycode(XK.string_to_keysym(name)))
        self.display.sync()
        return at_s

    def press(self, name: str, *held: str) -> float:
        """Press a key by its X name, with others held; gives back when, on the monotonic clock."""
        for key in held:
            self.key_down(key)
        pressed_s = self.key_down(name)
        for key in (name, *reversed(held)):
            self.key_up(key)
        return pressed_s

    def move(self, x_px: int, y_px: int) -> None:
        """Move the pointer to a place of the display, in pixels from its upper left."""
        xtest.fake_input(self.display, X.MotionNotify, x=x_px, y=y_px)
        self.display.sync()

    def button_down(self) -> None:
        """Press the mouse's left button and keep it down."""
        xtest.fake_input(self.display, X.ButtonPress, 1)
        self.display.sync()

    def button_up(self) -> None:
        """Let go of the mouse's left button."""
        xtest.fake_input(self.display, X.ButtonRelease, 1)
        self.display.sync()

    def click(self, x_px: int, y_px: int) -> None:
        """Click at a place of the display."""
        self.move(x_px, y_px)
        self.button_down()
        self.button_up()

    def focus_on(self, title: str, timeout_s: float = 0.0) -> tuple[int, int, int, int] | None:
        """Raise the newest window whose title holds a text, and give it the keys.

        Gives back its place and size in pixels (x, y, width, height) once its middle lies open, as a window manager
        takes its time to raise it and a click meets whatever lies there; `None` if it does not within the time.
        """
        end_s = machine_s() + timeout_s
        while (found := self._focused(title)) is None and machine_s() < end_s:
            time.sleep(LOOK_S)
        return found

    def _focused(self, title: str) -> tuple[int, int, int, int] | None:
        """A window may go while it is looked at: then there is none."""
        try:
            window = next(filter(None, (self._holding(top, title) for top in self._shown(self._root))), None)
            if window is None:
                return None
            window.configure(stack_mode=X.Above)
            window.set_input_focus(X.RevertToParent, X.CurrentTime)
            self.display.sync()
            corner, size = self._root.translate_coords(window, 0, 0), window.get_geometry()
            lies_open = self._holding(self._top_at(corner.x + size.width // 2, corner.y + size.height // 2), title)
        except XError:
            return None
        return (corner.x, corner.y, size.width, size.height) if lies_open == window else None

    def _shown(self, parent: Any) -> Iterator[Any]:
        """The windows under a parent that people work at, the topmost first."""
        for window in reversed(parent.query_tree().children):
            if window.get_attributes().map_state == X.IsViewable and window.get_geometry().width > _SMALLEST_PX:
                yield window

    def _holding(self, window: Any, title: str) -> Any:
        """The window of a title, which is this one or within it: a window manager puts frames of its own around."""
        if window is None or title in self._title(window):
            return window
        return next(filter(None, (self._holding(inner, title) for inner in self._shown(window))), None)

    def _top_at(self, x_px: int, y_px: int) -> Any:
        """The topmost window at a place of the display."""
        for window in self._shown(self._root):
            box = window.get_geometry()
            if box.x <= x_px < box.x + box.width and box.y <= y_px < box.y + box.height:
                return window
        return None

    def _title(self, window: Any) -> str:
        """The title as modern programs say it, else as old ones do."""
        told = window.get_full_text_property(self.display.intern_atom("_NET_WM_NAME"))
        return str(told or window.get_wm_name() or "")
