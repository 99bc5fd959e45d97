"""Hands on an X display that type text as well: what tests need beyond what a synthetic participant does."""

from __future__ import annotations

from experiments.screens.xkeys import Hands

_NAMES = {" ": "space", "\n": "Return", ".": "period", "-": "minus", ",": "comma", "?": "question"}


class TypingHands(Hands):
    """Two hands that type."""

    def title_at(self, x_px: int, y_px: int) -> str:
        """The title of the window that is to be seen at a place of the display."""
        window = root = self.display.screen().root
        sign, title = self.display.intern_atom("_NET_WM_NAME"), ""
        while not title and (window := window.translate_coords(root, x_px, y_px).child):
            title = window.get_full_text_property(sign) or window.get_wm_name() or ""
        return str(title)

    def type(self, text: str) -> None:
        """Type text of letters, digits and blanks, and what stands in `_NAMES`."""
        for letter in text:
            shifted = letter.isupper() or letter == "?"
            self.press(_NAMES.get(letter, letter.lower()), *(["Shift_L"] if shifted else []))
