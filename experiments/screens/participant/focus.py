"""The keys, borrowed from another program's window and given back to it.

On X a program may say whose the keys are; elsewhere the system decides, and nothing is given back here. The console
cannot take them back by itself: X and window managers refuse whoever was not worked at last.
"""

from __future__ import annotations

from ctypes import byref, c_int, c_ulong
from typing import Any

_NO_WINDOW = 1
"""Up to this X means nobody, or whoever is under the pointer."""


class Focus:
    """The focus of a pyglet window."""

    def __init__(self, window: Any) -> None:
        self._window = window
        self._lender = 0

    def take(self) -> None:
        """Take the keys, and keep in mind whose they were."""
        holder = self._holder()
        if holder not in (None, self._ours):
            self._lender = holder or 0
        self._window.activate()

    def give_back(self) -> None:
        """Let the lender have the keys again, if nobody has taken them since."""
        if self._lender > _NO_WINDOW and self._holder() == self._ours:
            xlib = _xlib()
            xlib.XSetInputFocus(self._window._x_display, self._lender, xlib.RevertToParent, xlib.CurrentTime)
            xlib.XFlush(self._window._x_display)
        self._lender = 0

    @property
    def _ours(self) -> int | None:
        return getattr(self._window, "_window", None)

    def _holder(self) -> int | None:
        """The window that has the keys; `None` where there is no X."""
        if not hasattr(self._window, "_x_display"):
            return None
        holder, reverts = c_ulong(), c_int()
        _xlib().XGetInputFocus(self._window._x_display, byref(holder), byref(reverts))
        return holder.value


def _xlib() -> Any:
    from pyglet.libs.x11 import xlib  # noqa: PLC0415 - where there is no X, it cannot be imported

    return xlib
