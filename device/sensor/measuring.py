"""What was delivered, from an accelerometer on the gun's enclosure: onset, peak and friction of one shot. Pure.

- The peak is the top of the parabola through the largest sample of the recoil and its neighbours.
- The onset is where half of the peak is passed, less the time that the model takes to get there.
- The friction is what the acceleration's step shows where the magnet turns (`device.sensor.turn`).

Each has its standard uncertainty. What is expected goes through the same reckoning, at the sensor's own rate
(`device.sensor.expected`), so that what the reckoning adds of its own is on both sides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from device.physics.hand import Vector
from device.sensor.turn import ExpectedTurn, MeasuredFriction, measured_friction

BEFORE_S = 0.060
"""So long before the pulse a trace begins: rest, from which the noise is known."""
EARLY_S = 0.015
"""So much a sensor's clock may be ahead."""
LATE_S = 0.050
"""A shot that shows later than this after its pulse does not show: a gun's delay and a sensor's lateness (assumed)."""
RECOIL_S = 0.010
"""The recoil's peak lies within this of its onset; the landing, which may be harder, comes later."""
NOISES, PEAK_SHARE = 6.0, 0.2
"""What shows has so many standard deviations of the noise, and this share of the peak expected."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorTrace:
    """Samples of an accelerometer: seconds on the host's monotonic clock, rising, and m/s2 along the barrel.

    Recoil is positive. `clock_s`: the standard uncertainty of the times as a whole.
    """

    time_s: Vector
    acceleration_m_s2: Vector
    clock_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpectedShot:
    """What the model says that a sensor sees of a method's shot.

    `rise_s`: from the onset of the pulse until half of the peak. `peak_sampling_m_s2`: the standard deviation that
    comes from where the samples happen to lie. `turn`, `friction_N`: of a method with a magnet.
    """

    peak_m_s2: float
    rise_s: float
    peak_sampling_m_s2: float = 0.0
    turn: ExpectedTurn | None = None
    friction_N: float | None = None

    @property
    def until_s(self) -> float:
        """So long after the pulse a trace has to go on."""
        return LATE_S + max(RECOIL_S, self.turn.until_s if self.turn is not None else 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class DeliveredShot:
    """What was measured of one shot, with standard uncertainties. `onset_s` is on the host's clock.

    `friction` is `None` of a vibration, and where no step shows.
    """

    onset_s: float
    onset_u_s: float
    peak_m_s2: float
    peak_u_m_s2: float
    friction: MeasuredFriction | None = None


def measured(trace: SensorTrace, pulse_start_s: float, expected: ExpectedShot) -> DeliveredShot | None:
    """What a trace shows of a shot whose pulse began then; `None` if it shows none.

    `ValueError`: the trace has too few samples before the pulse to know the noise by.
    """
    time_s, rest = trace.time_s - pulse_start_s, slice(0, int(np.searchsorted(trace.time_s, pulse_start_s - EARLY_S)))
    level, noise = _at_rest(time_s[rest], trace.acceleration_m_s2[rest])
    signal = trace.acceleration_m_s2 - level
    shows = np.abs(signal) > max(NOISES * noise, PEAK_SHARE * expected.peak_m_s2)
    shows &= (time_s > -EARLY_S) & (time_s < LATE_S)
    first = int(shows.argmax())
    if not shows[first] or first + 2 >= len(time_s):
        return None
    recoil = slice(first, int(np.searchsorted(time_s, time_s[first] + RECOIL_S)))
    top = min(recoil.start + int(np.abs(signal[recoil]).argmax()), len(time_s) - 2)
    peak, factor = _parabola(np.abs(signal[top - 1 : top + 2]))
    half_s, slope = _half_way(time_s, np.abs(signal), first, peak / 2)
    since_s, turn = time_s - half_s + expected.rise_s, expected.turn
    spacing_s = float(time_s[top] - time_s[top - 1])
    return DeliveredShot(
        onset_s=pulse_start_s + half_s - expected.rise_s,
        onset_u_s=math.hypot(noise / slope, spacing_s / math.sqrt(12), trace.clock_s),
        peak_m_s2=peak,
        peak_u_m_s2=math.hypot(noise * factor, expected.peak_sampling_m_s2),
        friction=None if turn is None else measured_friction(since_s, signal, noise, turn),
    )


def _at_rest(time_s: Vector, acceleration: Vector) -> tuple[float, float]:
    """The level at the pulse, and the noise about a straight line, as a hand's drift is none."""
    if len(time_s) < 10:
        raise ValueError(f"{len(time_s)} samples before the pulse; at least 10 are needed to know the noise by")
    line = np.polynomial.Polynomial.fit(time_s, acceleration, 1)
    noise = float(np.sqrt(((acceleration - line(time_s)) ** 2).sum() / (len(time_s) - 2)))
    return float(acceleration.mean()), noise


def _parabola(three: Vector) -> tuple[float, float]:
    """The top of the parabola through three samples, and the factor from their noise to its own."""
    low, top, high = three.tolist()
    bend = 2 * top - low - high
    if bend <= 0:
        return top, 1.0
    shift = (high - low) / (2 * bend)
    weights = (shift * (shift - 1) / 2, 1 - shift**2, shift * (shift + 1) / 2)
    return top + (high - low) * shift / 4, math.hypot(*weights)


def _half_way(time_s: Vector, size: Vector, first: int, half: float) -> tuple[float, float]:
    """When half of the peak is passed, and how steeply, per s."""
    after = first + int((size[first:] >= half).argmax())
    before = max(after - 1, 0)
    while before > 0 and size[before] >= half:  # it showed, at more than half, from its first sample on
        after, before = before, before - 1
    slope = float(size[after] - size[before]) / max(float(time_s[after] - time_s[before]), 1e-9)
    slope = max(slope, 1e-9)
    return float(time_s[before]) + max(0.0, half - float(size[before])) / slope, slope
