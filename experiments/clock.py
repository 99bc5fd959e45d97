"""The clock of a run: the machine's own, or a virtual one on which breaks take no time; two clocks mapped; dates."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo
from typing import Protocol

from device.interrupts import AWAKE_S
from device.machine_clock import machine_s


class Clock(Protocol):
    """Seconds that never run backwards, the date and time they fall on, and waiting."""

    name: str

    def now(self) -> float:
        """Monotonic time in seconds."""

    def utc(self) -> str:
        """Date and time in UTC, ISO 8601, to the microsecond."""

    def sleep(self, seconds: float) -> None:
        """Wait; not at all if the time is over."""

    def wait(self, news: threading.Condition, seconds: float | None) -> None:
        """Wait for news, at most for so long; the condition's lock is held before and after.

        It may end without any news, so whoever waits looks again.
        """

    def go_on_after(self, utc: str) -> None:
        """A run that stopped at this date and time goes on."""


class RealClock:
    """The machine's monotonic clock; with a twin in a hurry, as many times faster as the twin lives."""

    def __init__(self, speed: float = 1.0) -> None:
        self.name = "real" if speed == 1 else f"real x {speed:g}"
        self._speed = speed

    def now(self) -> float:
        """Monotonic time in seconds."""
        return machine_s() * self._speed

    def utc(self) -> str:
        """Date and time in UTC."""
        return utc_text(datetime.now(UTC))

    def sleep(self, seconds: float) -> None:
        """Wait for real."""
        if seconds > 0:
            time.sleep(seconds / self._speed)

    def wait(self, news: threading.Condition, seconds: float | None) -> None:
        """Wait for news for real, but no longer than `AWAKE_S`, so that interrupts come through."""
        news.wait(AWAKE_S if seconds is None else min(AWAKE_S, max(0.0, seconds / self._speed)))

    def go_on_after(self, utc: str) -> None:
        """The machine's date and time are what they are, earlier ones too."""


class VirtualClock:
    """A clock that moves only when someone waits. It starts at 0 s on the date and time of its making."""

    name = "virtual"

    def __init__(self) -> None:
        self._elapsed_s = 0.0
        self._start = datetime.now(UTC)

    def now(self) -> float:
        """Virtual seconds since the start."""
        return self._elapsed_s

    def utc(self) -> str:
        """The start plus the virtual seconds."""
        return utc_text(self._start + timedelta(seconds=self._elapsed_s))

    def sleep(self, seconds: float) -> None:
        """Move on at once."""
        self._elapsed_s += max(0.0, seconds)

    def wait(self, news: threading.Condition, seconds: float | None) -> None:
        """Move on at once; without an end, wait for real."""
        if seconds is None:
            news.wait()
        else:
            self.sleep(seconds)

    def go_on_after(self, utc: str) -> None:
        """No earlier than that: the virtual time of the run that stopped may be ahead of the machine's."""
        with suppress(ValueError, OverflowError):  # what is no date says nothing
            stopped = datetime.fromisoformat(utc).astimezone(UTC)
            self._start = max(self._start, stopped - timedelta(seconds=self._elapsed_s))


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


def utc_text(moment: datetime) -> str:
    """A moment of UTC as journals have it: ISO 8601, to the microsecond."""
    return moment.isoformat(timespec="microseconds").replace("+00:00", "Z")


_DAYS = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")
_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
"""In the language of the screens, whatever language the system speaks."""


def date_text(utc: str, zone: tzinfo | None = None) -> str:
    """Date and time of a record (ISO 8601) in local time; what is no date is given back as it is.

    >>> from datetime import timedelta, timezone
    >>> date_text("2026-11-22T01:09:58.895306Z", timezone(timedelta(hours=2)))
    'Sun 22 Nov 2026, 03:09'
    """
    try:
        moment = datetime.fromisoformat(utc).astimezone(zone)
    except (ValueError, OverflowError, OSError):  # the last: before 1970, on Windows
        return utc
    day = f"{_DAYS[moment.weekday()]} {moment.day} {_MONTHS[moment.month - 1]} {moment.year}"
    return f"{day}, {time_text(moment)}"


def time_text(moment: datetime) -> str:
    """The time of day: `14:05`."""
    return f"{moment:%H:%M}"
