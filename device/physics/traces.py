"""One shot over time: its segments, each of which can be asked for any moment of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.parameters import GunParameters
from device.physics.kernel import (
    BREAK_AWAY,
    COIL,
    DRIVE,
    DRIVE_CHANGE,
    END,
    FREE,
    GIVEN_UP,
    HEADING,
    HORIZON_S,
    IS,
    KIND,
    LIMIT,
    LIVE,
    MASS,
    MAX_SEGMENTS,
    MOTOR,
    SETTLED,
    STATE_SIZE,
    STEP,
    STIFFNESS,
    TIME,
    VS,
    WORK_SIZE,
    XS,
    Floats,
    I,
    V,
    X,
    pack,
)
from device.physics.polynomial import value
from device.physics.segments import (
    advance,
    enter,
    free_current,
    free_position,
    free_velocity,
    grip,
    pulse_off,
    pulse_on,
    resting_current,
    spring_force,
)
from device.physics.series import friction
from device.physics.summary import ShotTrace, interpret, summary_of

_DENSE_S = 0.015  # where the current and the force change fast: pulse and recoil stage
_REST_AFTER_S = 0.010  # shown after the last motion


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """One smooth stretch of a shot. `heading` is 1 away from the stop, -1 towards it, 0 at rest."""

    packed: Floats
    kind: float
    heading: float
    drive_V: float
    live: bool
    start_s: float
    end_s: float
    start: tuple[float, float, float]  # x, v, i
    end: tuple[float, float, float]  # just before the event: an impact keeps its speed
    ended_by: int
    step_s: float = 1.0
    series: Floats = ()  # type: ignore[assignment] # the coil's only

    def at(self, time_s: float) -> tuple[float, float, float]:
        """Position, velocity and current at a time of the segment."""
        t = time_s - self.start_s
        if self.kind == COIL:
            s = t / self.step_s
            return value(self.series, XS, s), value(self.series, VS, s), value(self.series, IS, s)
        x, v, i = self.start
        if self.kind != FREE:
            return x, 0.0, resting_current(self.packed, self.drive_V, i, t) if self.live else 0.0
        omega, a = math.sqrt(self.packed[STIFFNESS] / self.packed[MASS]), self.force(self.start) / self.packed[MASS]
        current = free_current(self.packed, self.drive_V, i, v, a, t) if self.live else 0.0
        return free_position(omega, x, v, a, t), free_velocity(omega, v, a, t), current

    def motor_force(self, state: tuple[float, float, float]) -> float:
        """The electromagnetic force F_m on the magnet in N (equation 2)."""
        return self.packed[MOTOR] * grip(self.packed, state[0]) * state[2]

    def force(self, state: tuple[float, float, float]) -> float:
        """The force on the hand F = m d2x/dt2 in N (equation 1): positive in the direction of recoil, 0 at rest."""
        if self.heading == 0.0:
            return 0.0
        motor = self.motor_force(state) if self.kind == COIL else 0.0
        return motor - spring_force(self.packed, state[0]) + friction(self.packed, self.heading)


def segments(packed: Floats) -> Iterator[Segment]:
    """The segments of one shot from rest, in order; the last one is settled for good, or given up."""
    s, w = [0.0] * STATE_SIZE, [0.0] * WORK_SIZE
    s[END] = HORIZON_S
    pulse_on(packed, s)
    enter(packed, s, BREAK_AWAY)
    for _ in range(MAX_SEGMENTS):
        before = list(s)
        event = advance(packed, s, w)
        yield _segment(packed, before, s, w, event)
        if event in (SETTLED, GIVEN_UP) or (event == DRIVE_CHANGE and s[LIMIT] == s[END]):
            return
        if event == DRIVE_CHANGE:
            pulse_off(packed, s)
        enter(packed, s, event)


def _segment(packed: Floats, before: list[float], s: list[float], w: list[float], event: int) -> Segment:
    coil = before[KIND] == COIL
    return Segment(
        packed=packed,
        kind=before[KIND],
        heading=before[HEADING],
        drive_V=before[DRIVE],
        live=before[LIVE] != 0.0,
        start_s=before[TIME],
        end_s=math.inf if event == SETTLED else s[TIME],
        start=(before[X], before[V], before[I]),
        end=(s[X], s[V], s[I]),
        ended_by=event,
        step_s=s[STEP] if coil else 1.0,
        series=list(w) if coil else [],
    )


def trace(parameters: GunParameters, points: int = 2000) -> ShotTrace:
    """One shot from rest over time, half of the points in its first 15 ms. `ValueError`: fewer than 2 points."""
    if points < 2:
        raise ValueError(f"points is {points}; it must be at least 2")
    packed = pack(parameters)
    shot = list(segments(packed))
    times = _grid(parameters, shot, points)
    places = np.searchsorted([segment.start_s for segment in shot], times, side="right") - 1
    rows = [_row(shot[place], t) for place, t in zip(places.tolist(), times.tolist(), strict=True)]
    x, v, i, motor, force, drive = np.array(rows).T
    return ShotTrace(
        time_s=times,
        displacement_m=x,
        velocity_m_s=v,
        current_A=i,
        motor_force_N=motor,
        force_N=force,
        drive_V=drive,
        summary=summary_of(interpret(packed)),
    )


def _grid(gun: GunParameters, shot: list[Segment], points: int) -> NDArray[np.float64]:
    settled = shot[-1].ended_by == SETTLED
    last = shot[-1].start_s if settled else shot[-1].end_s
    end_s = (max(last, gun.pulse_s) if not settled or last < gun.pulse_s else last) + _REST_AFTER_S
    dense_s = min(_DENSE_S, end_s / 2)
    dense = np.linspace(0.0, dense_s, points // 2, endpoint=False)
    return np.concatenate([dense, np.linspace(dense_s, end_s, points - points // 2)])


def _row(segment: Segment, time_s: float) -> tuple[float, ...]:
    state = segment.at(time_s)
    return (*state, segment.motor_force(state), segment.force(state), segment.drive_V)
