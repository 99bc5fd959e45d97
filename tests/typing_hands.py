"""Hands on an X display that type text as well: what tests need beyond what a synthetic participant does."""

from __future__ import annotations

from experiments.screens.xkeys import Hands

_NAMES = {" ": "space", "\n": "Return", ".": "period", "-": "minus", ",": "comma", "?": "question"}


class TypingHands(Hands):
    """Two hands that type."""

    def type(self, text: str) -> None:
        """Type text of letters, digits and blanks, and what stands in `_NAMES`."""
        for letter in text:
            shifted = letter.isupper() or letter == "?"
            self.press(_NAMES.get(letter, letter.lower()), *(["Shift_L"] if shifted else []))
