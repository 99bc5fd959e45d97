"""One shot of the haptic gun, predicted: its summary and its course over time.

    m d2x/dt2 = F_m - k (x + x_0) - F_f sign(dx/dt)    (1), the spring pre-loaded against the rear stop at x = 0
    F_m = (x_c - x)/x_c k_m i inside the coil, else 0  (2)
    u = k_e dx/dt + i R + L di/dt                      (3)

All times count from the onset of the pulse. The force on the hand F = m d2x/dt2 is positive in the direction of
recoil; the collision with the stop is apart from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from device.motion import Phase, drive_voltage, hand_force, hand_force_rate, motor_force
from device.parameters import DriveOff, Emf, GunParameters
from device.phases import phases

__all__ = ["FIDELITIES", "DriveOff", "Emf", "GunParameters", "ShotSummary", "ShotTrace", "Status", "simulate", "trace"]

Status = Literal["home", "no-break-away", "stuck", "not-home"]
FIDELITIES = ("full",)
"""The models on offer: `full` is equations (1) to (3) as they stand."""

_DENSE_S = 0.015  # where the current and the force change fast: pulse and recoil stage
_REST_AFTER_S = 0.010  # shown after the last motion


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotSummary:
    """What one shot comes to. What was not reached is None.

    The recoil stage lasts from the first rise of F_m until F_m falls to 0 (or, if that is earlier, until the magnet
    turns while the coil still pushes: there is no bullet firing stage then). Firing ends at the first dx/dt = 0,
    resetting when the magnet meets its stop at x = 0. The current that a shorted coil still carries may then lift it
    off once more, by micrometres; the summary leaves that hop out, the trace shows it. `max_displacement_m` is 0 if
    the magnet never broke away.

    Status: `home`; `no-break-away`; `stuck` (friction holds the magnet off its stop); `not-home` (still moving or
    held by the coil after 10 s, or beyond what floats can express).
    """

    status: Status
    peak_force_N: float | None  # largest F in the recoil stage
    recoil_end_s: float | None
    recoil_impulse_Ns: float | None  # integral of F over the recoil stage = m v at its end
    firing_end_s: float | None
    max_displacement_m: float | None
    reset_end_s: float | None
    impact_speed_m_s: float | None  # at the landing that ends the resetting stage
    collision_force_N: float | None  # equation (4): m v^2 / x_k


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShotTrace:
    """One shot over time, arrays of one length, and its summary. `force_N` is F, without the collision."""

    time_s: NDArray[np.float64]
    displacement_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    current_A: NDArray[np.float64]
    motor_force_N: NDArray[np.float64]
    force_N: NDArray[np.float64]
    drive_V: NDArray[np.float64]
    summary: ShotSummary


def simulate(parameters: GunParameters, fidelity: str = "full") -> ShotSummary:
    """The summary of one shot from rest. `ValueError`: no such fidelity.

    >>> shot = simulate(GunParameters(friction_N=1.12))
    >>> shot.status, round(shot.peak_force_N, 2), round(shot.reset_end_s, 3)
    ('home', 35.14, 0.211)
    """
    if fidelity not in FIDELITIES:
        raise ValueError(f"fidelity is {fidelity!r}; it must be one of {', '.join(FIDELITIES)}")
    return _summary(parameters, list(phases(parameters)))


def trace(parameters: GunParameters, points: int = 2000) -> ShotTrace:
    """One shot from rest over time, half of the points in its first 15 ms. `ValueError`: fewer than 2 points."""
    if points < 2:
        raise ValueError(f"points is {points}; it must be at least 2")
    shot = list(phases(parameters))
    times = _grid(parameters, shot, points)
    places = np.searchsorted([phase.start_s for phase in shot], times, side="right") - 1
    rows = [_row(parameters, shot[place], t) for place, t in zip(places.tolist(), times.tolist(), strict=True)]
    x, v, i, motor, force, drive = np.array(rows).T
    return ShotTrace(
        time_s=times,
        displacement_m=x,
        velocity_m_s=v,
        current_A=i,
        motor_force_N=motor,
        force_N=force,
        drive_V=drive,
        summary=_summary(parameters, shot),
    )


def _grid(gun: GunParameters, shot: list[Phase], points: int) -> NDArray[np.float64]:
    last = shot[-1].start_s if shot[-1].ended_by == "settled" else shot[-1].end_s
    end_s = max(last, gun.pulse_s if math.isfinite(shot[-1].end_s) else last) + _REST_AFTER_S
    dense_s = min(_DENSE_S, end_s / 2)
    dense = np.linspace(0.0, dense_s, points // 2, endpoint=False)
    return np.concatenate([dense, np.linspace(dense_s, end_s, points - points // 2)])


def _row(gun: GunParameters, phase: Phase, time_s: float) -> tuple[float, ...]:
    state = phase.at(time_s)
    force_N = hand_force(gun, state, phase.direction)
    return (*state, motor_force(gun, state), force_N, drive_voltage(gun, time_s))


def _summary(gun: GunParameters, shot: list[Phase]) -> ShotSummary:
    recoil = _recoil_stage(gun, shot)
    ended = recoil is not None and _ends_recoil(gun, recoil[-1])
    landing = _landing(gun, shot)
    return ShotSummary(
        status=_status(shot),
        peak_force_N=_peak_force(gun, recoil) if recoil else None,
        recoil_end_s=recoil[-1].end_s if recoil and ended else None,
        recoil_impulse_Ns=gun.magnet_mass_kg * recoil[-1].end.v if recoil and ended else None,
        firing_end_s=next((phase.end_s for phase in shot if phase.ended_by == "turn"), None),
        max_displacement_m=max(phase.end.x for phase in shot),
        reset_end_s=landing.end_s if landing else None,
        impact_speed_m_s=abs(landing.end.v) if landing else None,
        collision_force_N=gun.magnet_mass_kg * landing.end.v**2 / gun.contact_depth_m if landing else None,
    )


def _status(shot: list[Phase]) -> Status:
    if shot[-1].ended_by != "settled":
        return "not-home"
    if shot[-1].end.x > 0:
        return "stuck"
    return "home" if any(phase.direction for phase in shot) else "no-break-away"


def _landing(gun: GunParameters, shot: list[Phase]) -> Phase | None:
    """The landing that ends the resetting stage, if the magnet comes home: the first one after the pulse.

    During the pulse the coil may still push the magnet out again, so an earlier landing counts only if it is the last.
    """
    landings = [phase for phase in shot if phase.ended_by == "stop"]
    if not landings or _status(shot) != "home":
        return None
    return next((phase for phase in landings if phase.end_s >= gun.pulse_s), landings[-1])


def _recoil_stage(gun: GunParameters, shot: list[Phase]) -> list[Phase] | None:
    """The moving phases of the recoil stage; None if the magnet never moved."""
    stage: list[Phase] = []
    for phase in (phase for phase in shot if phase.direction > 0):
        stage.append(phase)
        if _ends_recoil(gun, phase):
            break
    return stage or None


def _ends_recoil(gun: GunParameters, phase: Phase) -> bool:
    cut = phase.ended_by == "pulse-end" and gun.drive_off == "open"
    return cut or phase.ended_by in ("coil-edge", "coil-force-zero", "turn")


def _peak_force(gun: GunParameters, stage: list[Phase]) -> float:
    return max(_peak_of(gun, phase) for phase in stage)


def _peak_of(gun: GunParameters, phase: Phase) -> float:
    """The largest F of one phase: at an end, or where dF/dt falls through 0 between two knots."""
    u = drive_voltage(gun, phase.start_s)

    def rate(t: float) -> float:
        return hand_force_rate(gun, u, phase.at(t))

    slopes = [(t, rate(t)) for t in phase.knots_s]
    tops = [brentq(rate, a, b, xtol=1e-17) for (a, up), (b, down) in pairwise(slopes) if up > 0 > down]
    return max(hand_force(gun, phase.at(t), phase.direction) for t in (phase.start_s, *tops, phase.end_s))
