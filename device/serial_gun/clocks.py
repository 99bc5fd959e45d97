"""The gun's clock on the host's, with a bound: what exchanges tell about offset and drift. Pure.

Of each exchange it is certain that the gun read its clock between writing and answer. So the host's time of a tick
lies between two lines, host = offset + rate x gun, through all exchanges; the middle is the estimate, half the gap
its bound.
How long the bytes take, and how unlike they take each way, does not matter: one quick exchange each way is enough.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

MAX_DRIFT = 1e-3
"""Assumed bound of what a gun's crystal and a host's clock differ in rate: ten times what they are sold with."""
RECENT, LANDMARKS = 64, 32
MIN_APART_US = 100_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Exchange:
    """A question and its answer: when it was written and read on the host's clock, and the gun's clock between."""

    sent_s: float
    gun_us: int
    received_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class HostTime:
    """A time on the host's clock, true to within the uncertainty."""

    time_s: float
    uncertainty_s: float


class Clocks:
    """The last exchanges, and the quickest of those before, in a bounded number."""

    def __init__(self) -> None:
        self._recent: deque[Exchange] = deque(maxlen=RECENT)
        self._landmarks: deque[Exchange] = deque(maxlen=LANDMARKS)
        self._rate = (1 - MAX_DRIFT, 1 + MAX_DRIFT)
        self._count = 0

    @property
    def known(self) -> bool:
        """Whether there was any exchange."""
        return bool(self._recent)

    @property
    def drift_ppm(self) -> float:
        """How much faster the host's clock runs than the gun's, in millionths; the middle of what is possible."""
        return (sum(self._rate) / 2 - 1) * 1e6

    def add(self, exchange: Exchange) -> None:
        """Learn from an exchange. One that contradicts those before takes their place: a clock was set."""
        if not self._fits(exchange):
            self._forget()
        self._recent.append(exchange)
        self._count += 1
        if self._count % RECENT == 0:
            self._landmarks.append(min(self._recent, key=lambda one: one.received_s - one.sent_s))

    def host(self, gun_us: int) -> HostTime:
        """When the gun's clock showed this, on the host's. `ValueError`: there was no exchange yet."""
        low, high = self._bounds(gun_us)
        return HostTime(time_s=(low + high) / 2, uncertainty_s=(high - low) / 2)

    def gun_us(self, host_s: float) -> int:
        """What the gun's clock shows at a time on the host's. `ValueError`: there was no exchange yet."""
        last = self._last()
        middle = self.host(last.gun_us).time_s
        return last.gun_us + round((host_s - middle) * 1e6 / (sum(self._rate) / 2))

    def _last(self) -> Exchange:
        if not self._recent:
            raise ValueError("nothing is known of the gun's clock: no exchange yet")
        return self._recent[-1]

    def _fits(self, new: Exchange) -> bool:
        """Whether all exchanges with the new one lie on a line; the rates that it can have are narrowed."""
        low, high = self._rate
        for old in (*self._landmarks, *self._recent):
            apart_us = new.gun_us - old.gun_us
            if apart_us < 0:
                return False
            if apart_us >= MIN_APART_US:
                low = max(low, (new.sent_s - old.received_s) * 1e6 / apart_us)
                high = min(high, (new.received_s - old.sent_s) * 1e6 / apart_us)
        if low > high:
            return False
        self._rate = (low, high)
        if not self._recent:
            return True
        earliest_s, latest_s = self._bounds(new.gun_us)
        return max(earliest_s, new.sent_s) <= min(latest_s, new.received_s)

    def _forget(self) -> None:
        self._recent.clear()
        self._landmarks.clear()
        self._rate = (1 - MAX_DRIFT, 1 + MAX_DRIFT)

    def _bounds(self, gun_us: int) -> tuple[float, float]:
        self._last()
        bounds = [self._bound(one, (gun_us - one.gun_us) / 1e6) for one in (*self._landmarks, *self._recent)]
        return max(low for low, _ in bounds), min(high for _, high in bounds)

    def _bound(self, one: Exchange, since_s: float) -> tuple[float, float]:
        spans = (self._rate[0] * since_s, self._rate[1] * since_s)
        return one.sent_s + min(spans), one.received_s + max(spans)
