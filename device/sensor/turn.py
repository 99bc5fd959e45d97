"""The magnet's friction from where it turns back, as an accelerometer on the gun's enclosure sees it. Pure.

There friction changes its sign, and the enclosure's acceleration leaps from a to b; what the hand does has no step.

- Where the magnet moves on, M (b - a) = F_out + F_back, and half of that is the mean friction F.
- In a firm hand it rests there for a while, held by some f < F_back, and goes with the enclosure: m b = P - f, with the
  pull P = k (x + x_0) of the spring. Then M (b - a) = F_out + f, so that F_out = M (b - a) + m b - P.

Where the magnet moves on the second would be less than F_out, as more than F_back would be needed to hold it; where it
rests the first is less than F. So the larger of the two is taken.

The acceleration before the turn is that of a parabola there, and after it of a straight line, as a rest may be short.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from device.physics.hand import Vector

LINE_S, GAP_S = 0.008, 0.001
"""The line's length, and what is left out on either side of the turn, where a sensor's filter rounds the step."""
CURVE_S, CURVE_SHARE = 0.015, 0.6
"""The parabola's length, and at most this share of the time since the pulse ended."""
TURN_WITHIN = (0.6, 1.5)
"""Within these multiples of the turn's time by the model the step is looked for."""
STEP_NOISES = 5.0
"""A step of fewer standard deviations is none."""
LEAST_OUTWARD = 0.2
"""A magnet that rests shows the friction outwards; where that is a smaller part of the mean, it tells too little."""
MAX_RATE_HZ = 6400.0
"""More samples than so many a second are thinned out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpectedTurn:
    """Where a method's magnet turns back by the model: `turn_s` after the onset of its pulse, `free_s` after the end.

    `pull_N`: the spring's P there. `friction_N`: the model's mean friction; `outward`: F_out as a part of it.
    """

    turn_s: float
    free_s: float
    enclosure_kg: float
    magnet_kg: float
    pull_N: float
    friction_N: float
    outward: float = 1.0

    @property
    def until_s(self) -> float:
        """So long after the onset a trace has to go on."""
        return TURN_WITHIN[1] * self.turn_s + 3 * GAP_S + LINE_S


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredFriction:
    """What the two edges say, in N with standard uncertainties: `moves_N` is the mean friction if the magnet moves on.

    If it rests, `rests_N` less `pull_N` is. Both go with the sensor's scale, the pull does not.
    """

    moves_N: float
    moves_u_N: float
    rests_N: float
    rests_u_N: float
    pull_N: float

    def at_scale(self, scale: float = 1.0, scale_u: float = 0.0) -> tuple[float, float]:
        """The mean friction, and its uncertainty, if the sensor says `scale` times what is."""
        moves = (self.moves_N / scale, self.moves_u_N / scale, 0.0)
        rests = (self.rests_N / scale, self.rests_u_N / scale, self.pull_N)
        of_N, of_u_N, pull_N = max(moves, rests, key=lambda one: one[0] - one[2])
        return of_N - pull_N, math.hypot(of_u_N, of_N * scale_u / scale)


def measured_friction(time_s: Vector, signal: Vector, noise: float, turn: ExpectedTurn) -> MeasuredFriction | None:
    """The friction that accelerations in m/s2 show, with their noise; `None` where no step shows.

    Time counts from the onset.
    """
    sampling = _Sampling.of((len(time_s) - 1) / float(time_s[-1] - time_s[0]), turn)
    early_s, late_s = (part * turn.turn_s for part in TURN_WITHIN)
    spacing_s = 1 / sampling.rate_Hz
    around, after_s = sampling.curve + 3 * sampling.gap, (sampling.line + 3 * sampling.gap) * spacing_s
    grid = np.arange(early_s - around * spacing_s, late_s + after_s, spacing_s)
    signal = np.interp(grid, time_s, signal)
    place = _turn_place(signal, sampling)
    before, after = _before(signal, place, sampling), _after(signal, place, sampling)
    leap_u = noise * math.hypot(before.factor, after.factor)
    if after.value - before.value < STEP_NOISES * leap_u:
        return None
    return _friction(before, after, noise, turn)


def friction_uncertainty_N(noise_m_s2: float, rate_Hz: float, enclosure_kg: float, magnet_kg: float) -> float:  # noqa: N802 - the unit ends the name
    """What a sensor's noise leaves uncertain of a friction in a firm hand, where it is known least."""
    turn = ExpectedTurn(
        turn_s=1.0, free_s=1.0, enclosure_kg=enclosure_kg, magnet_kg=magnet_kg, pull_N=0.0, friction_N=1.0
    )
    sampling = _Sampling.of(rate_Hz, turn)
    still, place = np.zeros(2 * (sampling.curve + sampling.gap)), sampling.curve + sampling.gap + 0.5
    edges = _before(still, place, sampling), _after(still, place, sampling)
    return _friction(*edges, noise_m_s2, turn).rests_u_N


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sampling:
    """How many samples the line and the parabola have, and how far from the turn they begin."""

    rate_Hz: float
    line: int
    curve: int
    gap: int

    @classmethod
    def of(cls, rate_Hz: float, turn: ExpectedTurn) -> _Sampling:
        rate_Hz = min(MAX_RATE_HZ, rate_Hz)
        curve_s = max(LINE_S, min(CURVE_S, CURVE_SHARE * turn.free_s))
        line, curve, gap = (round(length_s * rate_Hz) for length_s in (LINE_S, curve_s, GAP_S))
        return cls(rate_Hz=rate_Hz, line=max(4, line), curve=max(6, curve), gap=max(1, gap))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Edge:
    """The acceleration right at a step, its slope a sample, and the factor from the noise of samples to its own."""

    value: float
    slope: float
    factor: float


def _before(signal: Vector, place: float, sampling: _Sampling) -> _Edge:
    last = math.floor(place) - sampling.gap + 1
    return _edge(signal, np.arange(last - sampling.curve, last), place, 2)


def _after(signal: Vector, place: float, sampling: _Sampling) -> _Edge:
    first = math.floor(place) + sampling.gap
    return _edge(signal, np.arange(first, first + sampling.line), place, 1)


def _edge(signal: Vector, places: np.ndarray, place: float, degree: int) -> _Edge:
    """Of the polynomial through the samples at these places."""
    *_, slopes, values = np.linalg.pinv(np.vander(places - place, degree + 1))
    of = signal[places]
    return _Edge(value=float(values @ of), slope=float(slopes @ of), factor=float(np.linalg.norm(values)))


def _friction(before: _Edge, after: _Edge, noise: float, turn: ExpectedTurn) -> MeasuredFriction:
    outward = turn.outward if turn.outward >= LEAST_OUTWARD else math.inf
    moves_N, moves_u_N = _sum(before, turn.enclosure_kg / 2, after, turn.enclosure_kg / 2, noise)
    both_kg = turn.enclosure_kg + turn.magnet_kg
    rests_N, rests_u_N = _sum(before, turn.enclosure_kg / outward, after, both_kg / outward, noise)
    pull_N = turn.pull_N / outward
    return MeasuredFriction(moves_N=moves_N, moves_u_N=moves_u_N, rests_N=rests_N, rests_u_N=rests_u_N, pull_N=pull_N)


def _sum(before: _Edge, before_kg: float, after: _Edge, after_kg: float, noise: float) -> tuple[float, float]:
    """By noise, and by where between two samples the turn lies, it is uncertain."""
    place_u = (after_kg * after.slope - before_kg * before.slope) / math.sqrt(12)
    uncertain = math.hypot(noise * after_kg * after.factor, noise * before_kg * before.factor, place_u)
    return after_kg * after.value - before_kg * before.value, uncertain


def _turn_place(signal: Vector, sampling: _Sampling) -> float:
    """Where the step is, in samples: where two straight lines leap, and how far the samples there have gone by then."""
    line, gap = sampling.line, sampling.gap
    skipped = sampling.curve + 2 * gap - line
    away, inside = gap + np.arange(line), np.arange(1 - gap, gap)
    at_turn = np.linalg.pinv(np.vander(away, 2))[-1]
    weights = np.concatenate([-at_turn[::-1], np.zeros(len(inside)), at_turn])
    leaps = np.correlate(signal[skipped : len(signal) - 2 * gap], weights, "valid")
    at, leap = skipped + line + gap - 1 + int(leaps.argmax()), float(leaps.max())
    if leap <= 0:
        return float(at)
    low = np.polyval(np.polyfit(-away, signal[at - away], 1), inside)
    gone = float((signal[at + inside] - low).sum()) / leap
    return at + gap - 0.5 - min(len(inside), max(0.0, gone))
