"""Hands on an X display that type text as well: what tests need beyond what a synthetic participant does."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from experiments.screens.xkeys import Hands

_NAMES = {" ": "space", "\n": "Return", ".": "period", "-": "minus", ",": "comma", "?": "question"}


class TypingHands(Hands):
    """Two hands that type."""

    def title_at(self, x_px: int, y_px: int) -> str:
        """The title of the window that is to be seen at a place of the display; none of one that is just going."""
        from Xlib.error import BadWindow

        window = root = self.display.screen().root
        sign, title = self.display.intern_atom("_NET_WM_NAME"), ""
        with suppress(BadWindow):
            while not title and (window := window.translate_coords(root, x_px, y_px).child):
                title = window.get_full_text_property(sign) or window.get_wm_name() or ""
        return str(title)

    def minimise(self, title: str) -> None:
        """Minimise the window of a title, as the button in its frame does."""
        from Xlib import X, Xutil
        from Xlib.protocol.event import ClientMessage

        window, root = self.window_of(title), self.display.screen().root
        asked, data = self.display.intern_atom("WM_CHANGE_STATE"), (32, [Xutil.IconicState, 0, 0, 0, 0])
        message = ClientMessage(window=window, client_type=asked, data=data)
        root.send_event(message, X.SubstructureRedirectMask | X.SubstructureNotifyMask)
        self.display.sync()

    def bring_back(self, title: str) -> None:
        """Show a window that is minimised, as a list of windows does."""
        self.window_of(title).map()
        self.display.sync()

    def window_of(self, title: str) -> Any:
        """The window of a title, also one that is not to be seen; a window manager lists all that it knows."""
        root = self.display.screen().root
        listed = root.get_full_property(self.display.intern_atom("_NET_CLIENT_LIST"), 0).value
        windows = [self.display.create_resource_object("window", number) for number in listed]
        return next(one for one in windows if title in str(one.get_wm_name()))

    def type(self, text: str) -> None:
        """Type text of letters, digits and blanks, and what stands in `_NAMES`."""
        for letter in text:
            shifted = letter.isupper() or letter == "?"
            self.press(_NAMES.get(letter, letter.lower()), *(["Shift_L"] if shifted else []))
