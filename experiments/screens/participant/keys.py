"""Keys that answer with a time: PsychoPy's keyboard, which stamps them as they happen and not as frames are drawn.

It hears the keys whichever window has the focus, so that a two-button box that acts as keys needs none; and so the
console must not use the participant's keys for its own ends.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

from experiments.screens.participant.toolkit import Toolkit

_KEPT = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class Press:
    """A key by PsychoPy's name, and when it went down on the clock of this process."""

    name: str
    pressed_s: float


class Keys:
    """The last keys that went down, oldest first."""

    def __init__(self, toolkit: Toolkit) -> None:
        self._board = toolkit.keyboard.Keyboard()
        self._epoch_s = toolkit.key_epoch_s
        self._presses: deque[Press] = deque(maxlen=_KEPT)

    def since(self, onset_s: float) -> Iterator[Press]:
        """The keys that went down from a moment on."""
        self.poll()
        return (
            press for press in sorted(self._presses, key=lambda press: press.pressed_s) if press.pressed_s >= onset_s
        )

    def poll(self) -> None:
        """Take what PsychoPy holds. It gives keys still down and keys let go apart, a key that was both twice."""
        for released in (False, True):
            for found in self._board.getKeys(waitRelease=released):
                press = Press(name=str(found.name), pressed_s=float(found.tDown) + self._epoch_s)
                if press not in self._presses:
                    self._presses.append(press)
