"""Where samples come from: the sensor's words, its clock put on this machine's, and our own reader of CSV lines."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Protocol

from device.words import DeviceError, is_finite

Sample = tuple[float, float]
"""Seconds on the host's monotonic clock, and m/s2 along the barrel, recoil positive."""
MAX_BYTES = 1 << 16
DRIFT = 2e-4
"""So much faster or slower than this machine's a sensor's clock may go (assumed)."""


class SensorError(DeviceError):
    """A sensor that is refused, that ended, or whose samples cannot be."""


class Sensor(Protocol):
    """What every sensor does. It may only be read."""

    def read(self) -> Sequence[Sample]:
        """The samples since the last call, in order; none if there are none yet. It may wait 0.1 s for them.

        An exception, or `EOFError` for a stream that is over, ends the measuring.
        """

    def close(self) -> None:
        """Let go of it."""


class SensorClock:
    """Times of a sensor's own clock put on this machine's, by the samples that came soonest.

    What comes late was on its way for longer; nothing comes before it was measured. Of a transport's least delay
    nothing is known: times are late by it.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._offset_s, self._at_s = math.inf, -math.inf

    def host_times(self, sensor_s: Sequence[float]) -> list[float]:
        """When, on this machine's clock, samples were measured that all came just now, in order."""
        if not sensor_s:
            return []
        now_s = self._clock()
        grown_s = self._offset_s + DRIFT * (now_s - self._at_s) if math.isfinite(self._offset_s) else math.inf
        self._offset_s, self._at_s = min(grown_s, now_s - sensor_s[-1]), now_s
        return [one + self._offset_s for one in sensor_s]


class CsvSensor:
    """Lines `time_s,acceleration_m_s2` on the sensor's own clock, from a file that grows, a pipe or a device.

    What is there already is passed over; so are lines of words, such as a header, before the first of numbers.
    """

    def __init__(self, path: str, clock: Callable[[], float]) -> None:
        try:
            self._descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | getattr(os, "O_NOCTTY", 0))
        except OSError as error:
            raise SensorError(f"cannot be opened ({error.strerror})") from error
        with suppress(OSError):  # a pipe has no end to go to
            os.lseek(self._descriptor, 0, os.SEEK_END)
        self._clock, self._rest, self._begun = SensorClock(clock), b"", False

    def read(self) -> Sequence[Sample]:
        """The samples of the whole lines since the last call. `SensorError` names a line that is none."""
        try:
            data = os.read(self._descriptor, MAX_BYTES)
        except BlockingIOError:
            return ()
        except OSError as error:
            raise SensorError(f"cannot be read any more ({error.strerror})") from error
        *lines, self._rest = (self._rest + data).split(b"\n")
        found = list(self._numbers(lines))
        return list(zip(self._clock.host_times([one for one, _ in found]), (value for _, value in found), strict=True))

    def _numbers(self, lines: list[bytes]) -> Iterator[tuple[float, float]]:
        for line in filter(None, map(bytes.strip, lines)):
            try:
                time_s, acceleration = map(float, line.split(b","))
            except ValueError as error:
                if not self._begun:
                    continue  # a header, or the end of a line that was cut in two
                shown = line[:60].decode(errors="replace")
                raise SensorError(f"{shown!r} is no line `time_s,acceleration_m_s2`") from error
            self._begun = True
            yield time_s, acceleration

    def close(self) -> None:
        """Close the file."""
        os.close(self._descriptor)


def checked_samples(who: str, said: object, after_s: float) -> list[Sample]:
    """What a sensor gave back, if it can be. `SensorError` names the rule that it breaks.

    Times may not go back by more than the clock's own corrections do, 1 ms; then they are put in order.
    """
    if not isinstance(said, Sequence):
        raise SensorError(f"{who}: read gave back {said!r:.60}; it must be a sequence of (time_s, acceleration_m_s2)")
    found = list[Sample]()
    for one in said:
        if not (isinstance(one, Sequence) and len(one) == 2 and all(map(is_finite, one))):
            raise SensorError(f"{who}: a sample is {one!r:.60}; it must be two finite numbers, time_s and m/s2")
        time_s = float(one[0])
        if time_s < after_s - 1e-3:
            raise SensorError(f"{who}: its time went back from {after_s:.6f} s to {time_s:.6f} s")
        if time_s > after_s:
            found.append((time_s, float(one[1])))
            after_s = time_s
    return found
