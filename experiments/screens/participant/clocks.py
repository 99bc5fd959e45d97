"""Two clocks, and what is known of the way from one to the other. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class RoundTrip:
    """A ping: when it left, what time it was there, when the answer came back."""

    sent_s: float
    there_s: float
    back_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockMap:
    """There minus here. The truth is within the uncertainty, half the shortest round trip."""

    offset_s: float
    uncertainty_s: float

    def here(self, there_s: float) -> float:
        """A moment of the other clock on ours."""
        return there_s - self.offset_s

    def there(self, here_s: float) -> float:
        """A moment of our clock on the other."""
        return here_s + self.offset_s


def surely_moved_s(before: ClockMap, after: ClockMap) -> float:
    """How far the clocks moved against each other between two maps, at least: what both leave open is no movement.

    >>> surely_moved_s(ClockMap(offset_s=100.0, uncertainty_s=0.5), ClockMap(offset_s=102.0, uncertainty_s=0.25))
    1.25
    """
    return max(0.0, abs(after.offset_s - before.offset_s) - before.uncertainty_s - after.uncertainty_s)


def clock_map(trips: Iterable[RoundTrip]) -> ClockMap:
    """The map by the shortest of some round trips: the other clock was read somewhere between leaving and return.

    >>> clock_map([RoundTrip(sent_s=1.0, there_s=101.5, back_s=2.0), RoundTrip(sent_s=3.0, there_s=103.9, back_s=5.0)])
    ClockMap(offset_s=100.0, uncertainty_s=0.5)
    """
    best = min(trips, key=lambda trip: trip.back_s - trip.sent_s)
    middle_s = (best.sent_s + best.back_s) / 2
    return ClockMap(offset_s=best.there_s - middle_s, uncertainty_s=(best.back_s - best.sent_s) / 2)
