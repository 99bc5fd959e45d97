"""One shot over time: its segments, each of which can be asked for any moment of it, and where its energy went.

    supplied + created = heat + friction + impacts + switched off + stored,   created = motor work - back-EMF work

With the reciprocal back-EMF (and k_e = k_m) nothing is created; the printed one k_e dx/dt is constant along the stroke
while the force fades, and makes or swallows energy. The impulse on the hand over a whole cycle is zero.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.parameters import GunParameters
from device.physics.equations import (
    BREAK_AWAY,
    COIL,
    FREE,
    GIVEN_UP,
    HORIZON_S,
    MAX_SEGMENTS,
    MAX_WORK,
    SETTLED,
    STOP,
    Coefficients,
    Constants,
    ShotState,
    StepSeries,
    friction,
    grip,
    motor_force,
    pack,
    spring_force,
)
from device.physics.polynomial import value_at
from device.physics.segments import (
    advance,
    enter,
    free_current,
    free_position,
    free_velocity,
    half_of,
    pulse_on,
    resting_current,
)
from device.physics.shot import ShotSummary, goes_on, simulate

_DENSE_S = 0.015  # where the current and the force change fast: pulse and recoil stage
FARTHEST_IN_TRACE = 1e-11
"""How far speed may jump where a ring is left, as a share: what is felt or drawn shows a jump."""
_REST_AFTER_S = 0.010  # shown after the last motion
_NO_FLOATS = "this shot goes beyond what numbers can express"


class CoilSeries(NamedTuple):
    """Taylor coefficients over one step in the coil, in parts of its span."""

    x: Coefficients
    v: Coefficients
    i: Coefficients


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """One smooth stretch of a shot. `heading` is 1 away from the stop, -1 towards it, 0 at rest."""

    constants: Constants
    kind: int
    heading: float
    drive_V: float
    live: bool
    start_s: float
    end_s: float
    start: tuple[float, float, float]  # x, v, i
    end: tuple[float, float, float]  # just before the event: an impact keeps its speed
    ended_by: int
    step_s: float = 1.0
    series: CoilSeries | None = None  # the coil's only

    def at(self, time_s: float) -> tuple[float, float, float]:
        """Position, velocity and current at a time of the segment."""
        t = time_s - self.start_s
        if self.series is not None:
            s = t / self.step_s if self.step_s else 0.0  # a step may be too short for a number
            return value_at(self.series.x, s), value_at(self.series.v, s), value_at(self.series.i, s)
        x, v, i = self.start
        if self.kind != FREE:
            return x, 0.0, resting_current(self.constants, self.drive_V, i, t) if self.live else 0.0
        p = self.constants
        omega, a = math.sqrt(p.stiffness / p.mass), self.force(self.start) / p.mass
        half = half_of(omega, t)
        current = free_current(p, self.drive_V, i, half, v, a, t) if self.live else 0.0
        return free_position(omega, half, x, v, a), free_velocity(omega, half, v, a), current

    def motor_force(self, state: tuple[float, float, float]) -> float:
        """The electromagnetic force F_m on the magnet in N (equation 2)."""
        return motor_force(self.constants, state[0], state[2])

    def force(self, state: tuple[float, float, float]) -> float:
        """The force on the hand F = m d2x/dt2 in N (equation 1): positive in the direction of recoil, 0 at rest."""
        if self.heading == 0.0:
            return 0.0
        motor = self.motor_force(state) if self.kind == COIL else 0.0
        return motor - spring_force(self.constants, state[0]) + friction(self.constants, self.heading)


def segments(constants: Constants) -> Iterator[Segment]:
    """The segments of one shot from rest, in order. The last one is settled for good, or where the shot's time ended.

    Or where it was given up: as too much work, or beyond floats.
    """
    try:
        yield from _followed(constants)
    except (ArithmeticError, ValueError):  # as in `device.physics.shot.interpret`
        return


def _followed(constants: Constants) -> Iterator[Segment]:
    s, w = ShotState(farthest=FARTHEST_IN_TRACE), StepSeries()
    pulse_on(constants, s)
    enter(constants, s, BREAK_AWAY)
    for _ in range(MAX_SEGMENTS):
        began = s.kind, s.heading, s.u, s.live, s.time, (s.x, s.v, s.i)
        event = advance(constants, s, w)
        if event == GIVEN_UP or not math.isfinite(s.x + s.v + s.i):
            return
        yield _segment(constants, began, s, w, event)
        w.work += 1
        if w.work > MAX_WORK or not goes_on(constants, s, event):
            return


def given_up_s(shot: Sequence[Segment]) -> float | None:
    """When a shot was given up that was neither at rest nor followed to the end of its time; None if it was not."""
    if not shot:
        return 0.0
    return None if shot[-1].ended_by == SETTLED or shot[-1].end_s >= HORIZON_S else shot[-1].end_s


_Began = tuple[int, float, float, bool, float, tuple[float, float, float]]
"""Of a segment: kind, heading, drive, whether current can flow, time, state."""


def _segment(constants: Constants, began: _Began, s: ShotState, w: StepSeries, event: int) -> Segment:
    kind, heading, drive_V, live, start_s, start = began
    coil = kind == COIL
    return Segment(
        constants=constants,
        kind=kind,
        heading=heading,
        drive_V=drive_V,
        live=live,
        start_s=start_s,
        end_s=math.inf if event == SETTLED else s.time,
        start=start,
        end=(s.x, s.v, s.i),
        ended_by=event,
        step_s=s.span if coil else 1.0,
        series=CoilSeries(w.x.copy(), w.v.copy(), w.i.copy()) if coil else None,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShotTrace:
    """One shot over time, arrays of one length, and its summary. `force_N` is F, without the collision.

    A trace follows each ring and slip, so it may be given up where the summary is not; it ends there.
    """

    time_s: NDArray[np.float64]
    displacement_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    current_A: NDArray[np.float64]
    motor_force_N: NDArray[np.float64]
    force_N: NDArray[np.float64]
    drive_V: NDArray[np.float64]
    summary: ShotSummary
    given_up_s: float | None


def trace(parameters: GunParameters, points: int = 2000) -> ShotTrace:
    """One shot from rest over time, half of the points in its first 15 ms.

    `ValueError`: fewer than 2 points, or numbers beyond floats.
    """
    if points < 2:
        raise ValueError(f"points is {points}; it must be at least 2")
    shot = list(segments(pack(parameters)))
    if not shot:
        raise ValueError(_NO_FLOATS)
    times = _grid(parameters, shot, points)
    places = np.searchsorted([segment.start_s for segment in shot], times, side="right") - 1
    rows = np.array([_row(shot[place], t) for place, t in zip(places.tolist(), times.tolist(), strict=True)])
    if not np.isfinite(rows).all():
        raise ValueError(_NO_FLOATS)
    x, v, i, motor, force, drive = rows.T
    return ShotTrace(
        time_s=times,
        displacement_m=x,
        velocity_m_s=v,
        current_A=i,
        motor_force_N=motor,
        force_N=force,
        drive_V=drive,
        summary=simulate(parameters),
        given_up_s=given_up_s(shot),
    )


def _grid(gun: GunParameters, shot: list[Segment], points: int) -> NDArray[np.float64]:
    last = shot[-1]
    end_s = max(last.start_s, gun.pulse_s) + _REST_AFTER_S if last.ended_by == SETTLED else last.end_s
    dense_s = min(_DENSE_S, end_s / 2)
    dense = np.linspace(0.0, dense_s, points // 2, endpoint=False)
    return np.concatenate([dense, np.linspace(dense_s, end_s, points - points // 2)])


def _row(segment: Segment, time_s: float) -> tuple[float, ...]:
    state = segment.at(time_s)
    return (*state, segment.motor_force(state), segment.force(state), segment.drive_V)


_NODES, _WEIGHTS = (row.tolist() for row in np.polynomial.legendre.leggauss(32))
_PIECE_S = 0.05  # of a free arc: a small part of the spring's period
_FADED = 60.0  # time constants after which no current is left

Motion = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyBalance:
    """The energies of one shot in J and its impulses in N s, from the onset to rest (or to where it was given up)."""

    supplied_J: float  # by the drive
    created_J: float  # by a back-EMF that is not reciprocal; below 0 if it swallows
    heat_J: float
    friction_J: float
    impacts_J: float
    switched_off_J: float  # the coil's energy that an opened drive takes
    stored_J: float  # in spring, motion and coil, more than at the onset
    residual_J: float  # what does not add up: rounding
    force_impulse_Ns: float  # integral of F on the hand
    collision_impulse_Ns: float  # of the impacts on the stop, of the other sign
    residual_impulse_Ns: float  # both, and the momentum that is left
    given_up_s: float | None  # None: until the magnet rests, or for 10 s


def energy_balance(gun: GunParameters) -> EnergyBalance:
    """The energies and impulses of one shot from rest. `ValueError`: numbers beyond floats."""
    shot = list(segments(pack(gun)))
    with suppress(ArithmeticError):
        found = _balance_of(shot, gun) if shot else None
        if found is not None and math.isfinite(found.residual_J):
            return found
    raise ValueError(_NO_FLOATS)


def _balance_of(shot: Sequence[Segment], gun: GunParameters) -> EnergyBalance:
    supplied, heat, motor, emf, force = (math.fsum(row) for row in zip(*map(_integrals, shot), strict=True))
    friction = math.fsum(_friction_work(segment) for segment in shot)
    impacts = [gun.magnet_mass_kg * segment.end[1] for segment in shot if segment.ended_by == STOP]
    lost = math.fsum(impulse**2 / gun.magnet_mass_kg / 2 for impulse in impacts)
    cut = math.fsum(gun.inductance_H / 2 * (a.end[2] ** 2 - b.start[2] ** 2) for a, b in pairwise(shot))
    x, v, i = shot[-1].end
    stored = gun.magnet_mass_kg / 2 * v**2 + gun.stiffness_N_m * x * (gun.preload_length_m + x / 2)
    stored += 0.0 if shot[-1].ended_by == SETTLED else gun.inductance_H / 2 * i**2
    return EnergyBalance(
        supplied_J=supplied,
        created_J=motor - emf,
        heat_J=heat,
        friction_J=friction,
        impacts_J=lost,
        switched_off_J=cut,
        stored_J=stored,
        residual_J=supplied + motor - emf - heat - friction - lost - cut - stored,
        force_impulse_Ns=force,
        collision_impulse_Ns=-math.fsum(impacts),
        residual_impulse_Ns=force - math.fsum(impacts) - gun.magnet_mass_kg * v,
        given_up_s=given_up_s(shot),
    )


def _friction_work(segment: Segment) -> float:
    p = segment.constants
    return (p.friction_back if segment.heading < 0 else p.friction_out) * abs(segment.end[0] - segment.start[0])


def _integrals(segment: Segment) -> tuple[float, ...]:
    """Over the segment: u i, R i^2, F_m v, emf i and F."""
    total = [0.0] * 5
    for start_s, end_s in _pieces(segment):
        half = (end_s - start_s) / 2
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            rates = _rates(segment, segment.at(start_s + half * (1 + node)))
            total = [sum_ + half * weight * rate for sum_, rate in zip(total, rates, strict=True)]
    return tuple(total)


def _rates(segment: Segment, state: Motion) -> tuple[float, ...]:
    x, v, i = state
    p = segment.constants
    seen = grip(p, x) if p.reciprocal else 1.0
    heat, emf = p.resistance * i * i, p.back_emf * seen * v * i
    return segment.drive_V * i, heat, segment.motor_force(state) * v, emf, segment.force(state)


def _pieces(segment: Segment) -> Iterator[tuple[float, float]]:
    """Stretches over which 32 nodes integrate to rounding: steps of the series, or doubling from the transient on."""
    if segment.kind == COIL:
        yield segment.start_s, segment.end_s
        return
    time_constant_s = segment.constants.inductance / segment.constants.resistance
    end_s = segment.end_s
    if end_s == math.inf:
        end_s = segment.start_s + (_FADED * time_constant_s if segment.live else 0.0)
    most_s = _PIECE_S if segment.kind == FREE else max(_PIECE_S, 4 * time_constant_s)  # at rest only current changes
    start_s, width_s = segment.start_s, min(4 * time_constant_s, most_s) if segment.live else _PIECE_S
    while start_s < end_s:
        following_s = min(start_s + width_s, end_s)
        yield start_s, following_s
        start_s, width_s = following_s, min(2 * width_s, most_s)
