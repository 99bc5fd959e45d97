"""Where samples come from: the sensor's words, its clock put on this machine's, and our own reader of CSV lines."""

from __future__ import annotations

import os
import re
import stat
import sys
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from device.physics.hand import Vector
from device.words import DeviceError, is_finite

Sample = tuple[float, float]
"""Seconds on the sensor's own clock, which never go back, and m/s2 along the barrel, recoil positive."""
MAX_BYTES = 1 << 16
LINE_BYTES = 1000
"""No line of a sample is longer."""
BAD_LINES = 20
"""So many lines in a row that are no samples end a stream of lines. Assumed: longer than a header."""
CLOCK_DRIFT = 0.01
"""So much faster or slower than this machine's a sensor's clock may go (assumed)."""
ARRIVALS_S = 20.0
"""Arrivals of so long tell how the clocks stand."""
_SLOPES = 41
_REFINED = 3
_NEAREST = 8


class SensorError(DeviceError):
    """A sensor that is refused, that ended, or whose samples cannot be."""


class Sensor(Protocol):
    """What every sensor does. It may only be read."""

    def read(self) -> Sequence[Sample]:
        """The samples since the last call, in order; none if there are none yet. It may wait 0.1 s for them.

        They may come in batches: when a sample came does not matter as long as some come soon.

        An exception, or `EOFError` for a stream that is over, ends the measuring.
        """

    def close(self) -> None:
        """Let go of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockLine:
    """How a sensor's clock stands to this machine's: host = sensor + offset_s + drift (sensor - at_s).

    `u_s`: the standard uncertainty of times near the last ones.
    """

    offset_s: float
    drift: float
    at_s: float
    u_s: float

    def host_s(self, sensor_s: Vector) -> Vector:
        """Times of the sensor's clock on this machine's."""
        return sensor_s + self.offset_s + self.drift * (sensor_s - self.at_s)


class SensorClock:
    """A sensor's clock beside this machine's, by when its samples came.

    A sample comes after it was measured, sooner or later: arrival less stamp lies above the offset of the clocks, and
    those that came soonest lie on it. So the offset is the straight line under all of them that is highest in their
    middle, which lines that come in batches, in bursts or after a pause do not move. As many as lie a little above the
    line, so far it may lie above the truth: its uncertainty. Of a transport's least delay nothing is known: times are
    late by it.

    Source: the linear bound of Moon, Skelly and Towsley, Proc. IEEE INFOCOM 1999.
    """

    def __init__(self) -> None:
        self._arrivals = deque[tuple[float, float]]()

    def heard(self, sensor_s: float, now_s: float) -> None:
        """The newest sample came now."""
        self._arrivals.append((sensor_s, now_s - sensor_s))
        while sensor_s - self._arrivals[0][0] > ARRIVALS_S:
            self._arrivals.popleft()

    def line(self) -> ClockLine:
        """How the clocks stand. `ValueError`: nothing came yet."""
        if not self._arrivals:
            raise ValueError("no sample came yet")
        stamps, offsets = np.array(self._arrivals).T
        at_s, span_s = float(stamps.mean()), float(np.ptp(stamps))
        drift, reach = 0.0, CLOCK_DRIFT if span_s > 0 else 0.0
        for _ in range(_REFINED):
            drifts = np.clip(drift + np.linspace(-reach, reach, _SLOPES), -CLOCK_DRIFT, CLOCK_DRIFT)
            heights = (offsets - drifts[:, None] * (stamps - at_s)).min(axis=1)
            drift, reach = float(drifts[heights.argmax()]), 2 * reach / (_SLOPES - 1)
        above = offsets - drift * (stamps - at_s)
        lowest = np.sort(above)[: _NEAREST + 1]
        return ClockLine(
            offset_s=float(lowest[0]), drift=drift, at_s=at_s, u_s=float(lowest[-1] - lowest[0]) if span_s else 0.0
        )


class CsvSensor:
    """Lines `time_s,acceleration_m_s2`, from a file that grows, a pipe or a device.

    What is there already is passed over. A line that is none, such as a header or one that was garbled, or whose time
    goes back, is left out; several in a row end the stream. `dropped`: how many were left out since the first sample.
    """

    def __init__(self, path: str) -> None:
        if not path:
            raise SensorError("names no file; give one, as in csv:/dev/ttyACM0")
        if sys.platform == "win32" and _PORT.fullmatch(path):
            raise SensorError(_NO_FILE_THERE)
        try:
            self._descriptor = os.open(path, _READ_AT_ONCE)
        except OSError as error:
            raise SensorError(f"cannot be opened ({error.strerror})") from error
        if stat.S_ISDIR(os.fstat(self._descriptor).st_mode):
            os.close(self._descriptor)
            raise SensorError("is a folder; it must be a file that grows, a pipe or a device")
        with suppress(OSError):  # a pipe has no end to go to
            os.lseek(self._descriptor, 0, os.SEEK_END)
        self._rest, self._last_s, self._in_a_row = b"", -np.inf, 0
        self.dropped = 0

    def read(self) -> Sequence[Sample]:
        """The samples of the whole lines since the last call. `SensorError` names a line that is none."""
        try:
            data = os.read(self._descriptor, MAX_BYTES)
        except BlockingIOError:
            return ()
        except OSError as error:
            raise SensorError(f"cannot be read any more ({error.strerror})") from error
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > LINE_BYTES:
            raise SensorError(f"{_shown(self._rest)} goes on for {LINE_BYTES} bytes; {_LINE_RULE}")
        return list(self._samples(lines))

    def _samples(self, lines: list[bytes]) -> Iterator[Sample]:
        for line in filter(None, map(bytes.strip, lines)):
            sample = _sample_of(line)
            if sample is None or sample[0] < self._last_s:
                self._leave_out(line, sample)
            else:
                self._last_s, self._in_a_row = sample[0], 0
                yield sample

    def _leave_out(self, line: bytes, sample: Sample | None) -> None:
        self._in_a_row += 1
        self.dropped += bool(np.isfinite(self._last_s))
        if self._in_a_row == BAD_LINES:
            why = f"is no sample: {_LINE_RULE}" if sample is None else f"lies before {self._last_s:.6f} s, as others do"
            raise SensorError(f"{_shown(line)} {why}")

    def close(self) -> None:
        """Close the file."""
        os.close(self._descriptor)


_READ_AT_ONCE = os.O_RDONLY
for _flag in ("O_NONBLOCK", "O_NOCTTY", "O_BINARY"):  # no system knows all of them
    _READ_AT_ONCE |= getattr(os, _flag, 0)
_PORT = re.compile(r"(\\\\\.\\)?COM\d+:?", re.IGNORECASE)
_NO_FILE_THERE = (
    "is a serial port, which Windows does not read as a file; have a program write its lines to a file that grows, or "
    "use a plug-in"
)
_LINE_RULE = (
    "a line is `time_s,acceleration_m_s2`, two numbers with decimal points and a comma between them, and ends with LF"
)


def _shown(line: bytes) -> str:
    return repr(line[:60].decode(errors="replace"))


def _sample_of(line: bytes) -> Sample | None:
    """What is on a line; `None` if it is no sample."""
    try:
        time_s, acceleration = map(float, line.split(b","))
    except ValueError:
        return None
    return (time_s, acceleration) if is_finite(time_s) and is_finite(acceleration) else None


def checked_samples(who: str, said: object, after_s: float) -> list[Sample]:
    """What a sensor gave back, if it can be. `SensorError` names the rule that it breaks.

    Its times may not go back; of samples with the same time the first is taken.
    """
    if not isinstance(said, Sequence):
        raise SensorError(f"{who}: read gave back {said!r:.60}; it must be a sequence of (time_s, acceleration_m_s2)")
    found = list[Sample]()
    for one in said:
        if not (isinstance(one, Sequence) and len(one) == 2 and all(map(is_finite, one))):
            raise SensorError(f"{who}: a sample is {one!r:.60}; it must be two finite numbers, time_s and m/s2")
        time_s = float(one[0])
        if time_s < after_s:
            raise SensorError(f"{who}: its time went back from {after_s:.6f} s to {time_s:.6f} s")
        if time_s > after_s:
            found.append((time_s, float(one[1])))
            after_s = time_s
    return found
