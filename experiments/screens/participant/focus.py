"""Whose the keys are, and which of them are held; and whether the window is minimised.

On X a program may say whose the keys are; elsewhere the system decides, and nothing is given back here. The console
cannot take them back by itself: X and window managers refuse whoever was not worked at last.
"""

from __future__ import annotations

from ctypes import POINTER, addressof, byref, c_int, c_ubyte, c_ulong, string_at
from typing import Any

_NO_WINDOW = 1
"""Up to this X means nobody, or whoever is under the pointer."""
_CODES = range(8, 256)
"""The numbers that keys have on X."""
_WHILE_GRABBED = 3
"""How X says that the focus came while another program has the keyboard."""
_ICONIC = 3
"""What a window manager on X says of a window that is minimised, or lies on another desktop."""


class Focus:
    """The focus of a pyglet window."""

    def __init__(self, window: Any) -> None:
        self._window = window
        self._lender = 0
        self.grabbed = False
        """Whether the keys go to another program that has grabbed the keyboard, though the window has the focus."""
        if self._on_x:  # pyglet asks for it on another connection: a key that is held would be let go at each repeat
            from pyglet.window import xlib as xlib_window  # noqa: PLC0415 - where there is no X, it cannot be imported

            xlib_window.XkbSetDetectableAutoRepeat(window._x_display, 1, byref(c_int()))
            self._note_grabs()

    def _note_grabs(self) -> None:
        """X says of a focus that comes whether that is so; pyglet does not pass it on."""
        handlers, came = self._window._event_handlers, _xlib().FocusIn
        activate = handlers[came]

        def note(event: Any) -> None:
            self.grabbed = event.xfocus.mode == _WHILE_GRABBED
            activate(event)

        handlers[came] = note

    def take(self) -> None:
        """Take the keys and come to the front, and keep in mind whose they were."""
        self._note_lender()
        self._window.activate()
        self._raise(self._ours)

    def take_front(self) -> None:
        """Come to the front without the keys, which the lender has, or has again."""
        self.give_back()
        self._note_lender()
        self._raise(self._ours)

    def give_back(self) -> None:
        """Let the lender have the keys and the front again, if nobody has taken them since."""
        if self._lender > _NO_WINDOW and (holder := self._holder()) in (self._ours, self._lender):
            if holder == self._ours:
                xlib = _xlib()
                xlib.XSetInputFocus(self._window._x_display, self._lender, xlib.RevertToParent, xlib.CurrentTime)
            self._raise(self._lender)
        self._lender = 0

    def _note_lender(self) -> None:
        holder = self._holder()
        if holder not in (None, self._ours):
            self._lender = holder or 0

    def _raise(self, window: int | None) -> None:
        """On one screen one of the two windows lies upon the other: whoever has the keys is to see theirs."""
        if self._on_x:
            _xlib().XRaiseWindow(self._window._x_display, window)
            _xlib().XFlush(self._window._x_display)

    def find_held(self) -> None:
        """Have pyglet know the keys that were down as the window got the keys: it takes their repeats for presses.

        X says so behind each time. Elsewhere the system tells repeats from presses.
        """
        if not hasattr(self._window, "pressed_keys"):
            return
        xlib, told, bits = _xlib(), _xlib().XEvent(), None
        while xlib.XCheckTypedEvent(self._window._x_display, xlib.KeymapNotify, byref(told)):
            bits = string_at(addressof(told.xkeymap) + xlib.XKeymapEvent.key_vector.offset, _CODES.stop // 8)
        if bits is not None:
            codes = [code for code in _CODES if bits[code // 8] >> code % 8 & 1]
            self._window.pressed_keys = {symbol for code in codes for symbol in self._symbols(code)}

    def _symbols(self, code: int) -> list[int]:
        """What pyglet may call a key: by what stands on it, without and with shift, or by its number."""
        from pyglet.window.key import user_key  # noqa: PLC0415 - pyglet is there when its window is

        shown = [_xlib().XKeycodeToKeysym(self._window._x_display, code, level) for level in (0, 1)]
        return [*shown, user_key(code)]

    @property
    def here(self) -> bool:
        """Whether the window has the keys now; where there is no X, that is not known."""
        return self._ours is not None and self._holder() == self._ours

    @property
    def minimised(self) -> bool:
        """Whether the window is minimised, so that nobody sees it; of a Mac's that is not known."""
        if not self._on_x:
            return bool(getattr(self._window, "_hidden", False))
        xlib, display, said = _xlib(), self._window._x_display, POINTER(c_ubyte)()
        kind, width, count, left = c_ulong(), c_int(), c_ulong(), c_ulong()
        name = xlib.XInternAtom(display, b"WM_STATE", 0)
        of_kind = (byref(kind), byref(width), byref(count), byref(left), byref(said))
        xlib.XGetWindowProperty(display, self._ours, name, 0, 1, 0, name, *of_kind)
        if not count.value:  # no window manager says anything
            return False
        is_iconic = bool(said[0] == _ICONIC)
        xlib.XFree(said)
        return is_iconic

    @property
    def _on_x(self) -> bool:
        return hasattr(self._window, "_x_display")

    @property
    def _ours(self) -> int | None:
        return getattr(self._window, "_window", None)

    def _holder(self) -> int | None:
        """The window that has the keys; `None` where there is no X."""
        if not self._on_x:
            return None
        holder, reverts = c_ulong(), c_int()
        _xlib().XGetInputFocus(self._window._x_display, byref(holder), byref(reverts))
        return holder.value


def _xlib() -> Any:
    from pyglet.libs.x11 import xlib  # noqa: PLC0415 - where there is no X, it cannot be imported

    return xlib
