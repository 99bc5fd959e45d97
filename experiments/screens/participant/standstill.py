"""When the whole program stood still: swapped out, stopped or starved.

Keys pressed meanwhile are stamped too late, and a question that was to be shown meanwhile is seen too late.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

LONGEST_STANDSTILL_S = 0.1
"""How long the program may stand still: less is little beside how people differ from trial to trial."""

LONGEST_UNSEEN_S = 0.5
"""How long while a question comes: its page takes up to 0.3 s to draw at first, in which nothing else runs."""

_LOOK_S = 0.01
_KEPT = 64


class Standstills:
    """A thread that does nothing but look at the clock, and what it missed. `now` is the clock that stamps keys."""

    def __init__(self, now: Callable[[], float], *, look_s: float = _LOOK_S) -> None:
        self._now, self._look_s = now, look_s
        self._seen_s = now()
        self._missed: deque[tuple[float, float]] = deque(maxlen=_KEPT)

    def watch(self) -> None:
        """Begin to look."""
        threading.Thread(target=self._watch, name="standstills", daemon=True).start()

    def look(self) -> None:
        """Look once: more than `LONGEST_STANDSTILL_S` since the last time is a standstill."""
        now_s = self._now()
        if now_s - self._seen_s > LONGEST_STANDSTILL_S:
            self._missed.append((self._seen_s, now_s))
        self._seen_s = now_s

    def around_s(self, stamped_s: float) -> float:
        """How long the program stood still when a key was stamped, or just before, in seconds: 0 if it did not.

        A key may be stamped before the thread has looked again: what is missing until now counts too.
        """
        near = (end - start for start, end in self._all if start <= stamped_s <= end + LONGEST_STANDSTILL_S)
        return max((stood_s for stood_s in near if stood_s > LONGEST_STANDSTILL_S), default=0.0)

    def within_s(self, from_s: float, to_s: float) -> float:
        """For how long at a time the program stood still while a page came, in seconds: 0 if it did not."""
        stood = (min(end, to_s) - max(start, from_s) for start, end in self._all)
        return max((stood_s for stood_s in stood if stood_s > LONGEST_UNSEEN_S), default=0.0)

    @property
    def _all(self) -> list[tuple[float, float]]:
        return [*self._missed, (self._seen_s, self._now())]

    def _watch(self) -> None:
        while True:
            time.sleep(self._look_s)
            self.look()
