"""What the sensor's own process does: it keeps the last samples, and answers what they show of a shot. Pure."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from device.methods import Method
from device.sensor.expected import NO_COURSE, expected_shot
from device.sensor.measuring import BEFORE_S, DeliveredShot, ExpectedShot, SensorTrace, measured
from device.sensor.streams import ClockLine, Sample, SensorClock

KEPT_S = 5.0
"""Samples of so long are kept."""
SAMPLES_S = 1.0
"""A sensor is ready once it gave so much."""
UNHEARD_S = 2.0
"""A sensor that was asked and gave no sample for so long is silent, and shots that it gave none of are not measured."""
LOOK_EVERY_S = 0.2
"""So often it is looked whether a sensor is silent."""
LEAST_RATE_HZ = 1500.0
"""With fewer samples a second the recoil's peak, which is over in 2 ms, is lost between them."""
MAX_GAP_S = 0.002
_RATE_STEP = 0.01
"""The rate is taken in steps of 1 %, so that what is expected is reckoned once."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorReady:
    """A sensor that is heard: samples a second, and their noise at rest."""

    rate_Hz: float
    noise_m_s2: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotAsked:
    """A shot to be measured: its pulse on the host's monotonic clock, and the actuator with its drive."""

    number: int
    pulse_start_s: float
    actuator: Method


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotReply:
    """What was seen of a shot, and what was expected. `because`: why it was not measured; else `None` is no peak."""

    number: int
    seen: DeliveredShot | None = None
    expected: ExpectedShot | None = None
    because: str = ""


class SensorSilence:
    """Whether a sensor gives nothing, looked at every `LOOK_EVERY_S` beside the reading, which may hang.

    Only time in which it was asked counts: none in which this process stood still, or was busy with a shot.
    """

    def __init__(self) -> None:
        self._asking, self._full, self._empty = False, 0, 0  # of the reading alone
        self._seen, self._looked_s, self._length_s = (0, 0), -np.inf, 0.0  # of the looking alone

    def ask(self) -> None:
        """A read begins."""
        self._asking = True

    def answered(self, samples: int) -> None:
        """A read ended with so many samples."""
        self._full, self._empty = self._full + (samples > 0), self._empty + (samples == 0)
        self._asking = False

    def look(self, now_s: float) -> bool:
        """Whether it is silent now."""
        asking, (full, empty) = self._asking, self._seen
        self._seen = self._full, self._empty
        passed_s, self._looked_s = min(now_s - self._looked_s, 2 * LOOK_EVERY_S), now_s
        if self._seen[0] > full:
            self._length_s = 0.0
        elif asking or self._seen[1] > empty:
            self._length_s += passed_s
        return self._length_s > UNHEARD_S


class SampleBuffer:
    """The last samples, and what they show. Times are the sensor's own until a shot is looked for."""

    def __init__(self) -> None:
        self._samples: deque[Sample] = deque()
        self._clock = SensorClock()

    @property
    def last_s(self) -> float:
        """The time of the last sample on the sensor's clock; without end before the first."""
        return self._samples[-1][0] if self._samples else -np.inf

    @property
    def length_s(self) -> float:
        """How long they cover."""
        return self.last_s - self._samples[0][0] if self._samples else 0.0

    @property
    def rate_Hz(self) -> float:  # noqa: N802 - the unit ends the name
        """Samples a second; 0 where there are too few to say."""
        return (len(self._samples) - 1) / self.length_s if self.length_s > 0 else 0.0

    def take(self, samples: Sequence[Sample], now_s: float) -> None:
        """Keep those that came now, and let old ones go."""
        if not samples:
            return
        self._samples.extend(samples)
        self._clock.heard(self.last_s, now_s)
        while self.length_s > KEPT_S:
            self._samples.popleft()

    def noise_m_s2(self) -> float:
        """The standard deviation at rest: the median of those of 50 ms each."""
        values = np.array([value for _, value in self._samples])
        return float(np.median([part.std() for part in np.array_split(values, max(1, round(20 * self.length_s)))]))

    def reply_to(self, shot: ShotAsked, asked_s: float) -> ShotReply | None:
        """What was measured of a shot by the read begun at `asked_s`; `None` as long as its trace is not whole."""
        expected = expected_shot(shot.actuator, _stepped(self.rate_Hz)) if self.rate_Hz > LEAST_RATE_HZ else None
        if expected is None:
            why = NO_COURSE if self.rate_Hz > LEAST_RATE_HZ else "too few samples"
            return ShotReply(number=shot.number, because=why)
        reply = ShotReply(number=shot.number, expected=expected)
        end_s = shot.pulse_start_s + expected.until_s
        if asked_s < end_s:
            return None
        line = self._clock.line()
        if line.host_s(np.array(self.last_s)) < end_s:
            late = asked_s > end_s + UNHEARD_S
            return replace(reply, because="the sensor gave no samples of it") if late else None
        try:
            trace = self._trace(line, shot.pulse_start_s - BEFORE_S, end_s)
            return replace(reply, seen=measured(trace, shot.pulse_start_s, expected))
        except ValueError as error:
            return replace(reply, because=str(error))

    def _trace(self, line: ClockLine, start_s: float, end_s: float) -> SensorTrace:
        """The samples of a time. `ValueError`: some are missing."""
        times = line.host_s(np.array([time_s for time_s, _ in self._samples]))
        found = slice(*np.searchsorted(times, (start_s, end_s)).tolist())
        gap_s = float(np.diff(times[found], prepend=start_s, append=end_s).max())
        if gap_s > MAX_GAP_S:
            raise ValueError(f"its trace has a gap of {gap_s:.3f} s")
        values = np.array([value for _, value in islice(self._samples, found.start, found.stop)])
        return SensorTrace(time_s=times[found], acceleration_m_s2=values, clock_s=line.u_s)


def _stepped(rate_Hz: float) -> float:
    return float(np.exp(_RATE_STEP * round(np.log(rate_Hz) / _RATE_STEP)))
