"""What was delivered, from an accelerometer on the gun's enclosure: onset, peak and friction of one shot. Pure.

- The peak is the top of the parabola through the largest sample of the recoil and its neighbours.
- The onset is where half of the peak is passed, less the time that the model takes to get there.
- Where the magnet turns, friction changes its sign, and the enclosure's acceleration leaps by (F_out + F_back)/M. Two
  straight lines, up to the turn and from it on, meet there with that step: what the hand does has none. The mean
  friction (F_out + F_back)/2 is M/2 times the step. In a firm hand the magnet rests there for a while, held by less
  than the whole friction: then the step is less, and the enclosure's acceleration rises no longer after it.

Each has its standard uncertainty. What is expected goes through the same reckoning, at the sensor's own rate
(`device.sensor.expected`), so that what the reckoning adds of its own is on both sides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from device.physics.hand import Vector

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
LINE_S, GAP_S = 0.005, 0.001
"""Each line's length, and what is left out on either side of the turn, where a sensor's filter rounds the step."""
TURN_WITHIN = (0.6, 1.5)
"""Within these multiples of the turn's time by the model the step is looked for."""
STEP_NOISES = 5.0
"""A step of fewer standard deviations is none."""
MAX_RATE_HZ = 6400.0
"""More samples than so many a second are thinned out for the lines."""


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
    """What the model says that a sensor sees of a method's shot; times from the onset of the pulse.

    `rise_s`: until half of the peak. `turn_s`, `friction_N`: of a method with a magnet. `..._sampling_...`: the
    standard deviation that comes from where the samples happen to lie.
    """

    peak_m_s2: float
    rise_s: float
    mass_kg: float
    peak_sampling_m_s2: float = 0.0
    turn_s: float | None = None
    friction_N: float | None = None
    friction_sampling_N: float = 0.0

    @property
    def until_s(self) -> float:
        """So long after the pulse a trace has to go on."""
        turn_s = 0.0 if self.turn_s is None else TURN_WITHIN[1] * self.turn_s + GAP_S + LINE_S
        return LATE_S + max(turn_s, RECOIL_S)


@dataclass(frozen=True, slots=True, kw_only=True)
class DeliveredShot:
    """What was measured of one shot, with standard uncertainties. `onset_s` is on the host's clock.

    `friction_N` is `None` of a vibration, and where no step shows. `turn_rise`: how steeply the acceleration rises
    after the turn, as a part of how it rises before. By the model it is 0.3 to 0.8, and below 0.15 where the magnet
    rests at its turn; the friction is then as large or larger.
    """

    onset_s: float
    onset_u_s: float
    peak_m_s2: float
    peak_u_m_s2: float
    friction_N: float | None = None
    friction_u_N: float | None = None
    turn_rise: float | None = None


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
    friction = _friction(time_s - half_s + expected.rise_s, signal, noise, expected) or (None, None, None)
    spacing_s = float(time_s[top] - time_s[top - 1])
    return DeliveredShot(
        onset_s=pulse_start_s + half_s - expected.rise_s,
        onset_u_s=math.hypot(noise / slope, spacing_s / math.sqrt(12), trace.clock_s),
        peak_m_s2=peak,
        peak_u_m_s2=math.hypot(noise * factor, expected.peak_sampling_m_s2),
        friction_N=friction[0],
        friction_u_N=friction[1],
        turn_rise=friction[2],
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


def _friction(
    time_s: Vector, signal: Vector, noise: float, expected: ExpectedShot
) -> tuple[float, float, float] | None:
    """The mean friction and its uncertainty in N, from the step at the turn, and the rise after that.

    Time counts from the onset.
    """
    if expected.turn_s is None:
        return None
    rate_Hz = min(MAX_RATE_HZ, (len(time_s) - 1) / float(time_s[-1] - time_s[0]))
    weights = _step_weights(rate_Hz)
    reach_s = len(weights) / rate_Hz / 2
    start_s, end_s = expected.turn_s * TURN_WITHIN[0] - reach_s, expected.turn_s * TURN_WITHIN[1] + reach_s
    signal = np.interp(np.arange(start_s, end_s, 1 / rate_Hz), time_s, signal)
    steps = np.correlate(signal, weights, "valid")
    at = int(steps.argmax())
    friction_N, noise_N = (
        float(steps[at]) * expected.mass_kg / 2,
        friction_uncertainty_N(noise, rate_Hz, expected.mass_kg),
    )
    if friction_N < STEP_NOISES * noise_N:
        return None
    uncertain_N = math.hypot(noise_N, expected.friction_sampling_N)
    return friction_N, uncertain_N, _rise(signal[at : at + len(weights)], rate_Hz)


def _rise(signal: Vector, rate_Hz: float) -> float:
    """The slope after the turn, which lies in the middle of these samples, as a part of that before."""
    count, _ = _line_and_gap(rate_Hz)
    places = np.arange(count) - (count - 1) / 2
    before = abs(float(places @ signal[:count]))
    return float(places @ signal[-count:]) / max(before, 1e-9)


def friction_uncertainty_N(noise_m_s2: float, rate_Hz: float, mass_kg: float) -> float:  # noqa: N802 - the unit ends the name
    """What a sensor's noise leaves uncertain of a friction."""
    weights = _step_weights(min(MAX_RATE_HZ, rate_Hz))
    return noise_m_s2 * float(np.sqrt((weights**2).sum())) * mass_kg / 2


def _step_weights(rate_Hz: float) -> Vector:
    """What gives, of samples around a moment, the step there between two straight lines."""
    count, gap = _line_and_gap(rate_Hz)
    places = gap + np.arange(count, dtype=float)
    centred = places - places.mean()
    ahead = 1 / count - places.mean() * centred / (centred**2).sum()
    return np.concatenate([-ahead[::-1], np.zeros(2 * gap - 1), ahead])


def _line_and_gap(rate_Hz: float) -> tuple[int, int]:
    """How many samples a line has, and how far from the turn it begins."""
    return max(4, round(LINE_S * rate_Hz)), max(1, round(GAP_S * rate_Hz))
