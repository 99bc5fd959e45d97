"""Whether a window can open here: Qt ends the whole process where its display does not answer."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping


def unset_display(environment: Mapping[str, str], platform: str) -> str:
    """That no display is named, where one is needed; the platform is `sys.platform`."""
    if platform != "linux" or any(map(environment.get, ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"))):
        return ""
    return "neither DISPLAY nor WAYLAND_DISPLAY is set"


def no_display(environment: Mapping[str, str], platform: str) -> str:
    """Why no window can open here; empty if one may."""
    if platform != "linux":
        return ""
    if unset := unset_display(environment, platform):
        return unset
    drawn_by = environment.get("QT_QPA_PLATFORM", "").partition(":")[0]
    wayland = environment.get("WAYLAND_DISPLAY") and not drawn_by
    return "" if wayland or drawn_by not in {"", "xcb"} else _no_answer(environment.get("DISPLAY", ""))


def _no_answer(display: str) -> str:
    """Why an X display does not answer; empty if it does, or if nothing here can ask it."""
    if not display:
        return "DISPLAY is not set"
    try:
        xcb = ctypes.CDLL("libxcb.so.1")  # by which Qt asks it as well
    except OSError:
        return ""
    xcb.xcb_connect.restype = ctypes.c_void_p
    connection = ctypes.c_void_p(xcb.xcb_connect(display.encode(), None))
    failed = xcb.xcb_connection_has_error(connection)
    xcb.xcb_disconnect(connection)
    return f"DISPLAY is {display!r}, which does not answer" if failed else ""
