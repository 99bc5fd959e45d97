"""Trains of shots, each from the state that the last one left, and the damper that lands most gently at a rate.

Onsets are whole microseconds, as the limits count them: a float time would drop a shot here and there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from itertools import pairwise

from scipy.optimize import brentq

from device.limits import TICKS
from device.parameters import GunParameters
from device.physics.equations import HORIZON_S, ShotResult, ShotState, StepSeries, pack
from device.physics.shot import ShotSummary, shoot_on, simulate, summary_from

_FRICTIONS = 64  # looked at before the boundary of the allowed ones is solved for
_CREEP_S = 5.0  # a return slower than this is no shooting


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """The magnet and the coil at the onset of a shot; at rest at the stop by default."""

    displacement_m: float = 0.0
    velocity_m_s: float = 0.0
    current_A: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainShot:
    """One shot of a train. The summary's times count from its own onset, and end at the next one."""

    onset_tick: int
    start: State
    summary: ShotSummary


def train(gun: GunParameters, onset_ticks: Sequence[int], start: State | None = None) -> tuple[TrainShot, ...]:
    """The shots whose pulses begin at these ticks. A pulse is cut short by the next one.

    `ValueError`: the ticks do not rise, or the magnet is not between its stop and infinity.
    """
    if any(b <= a for a, b in pairwise(onset_ticks)):
        raise ValueError(f"onset_ticks are {list(onset_ticks)}; they must rise")
    constants, state, series, shots = pack(gun), _begun(start or State()), StepSeries(), list[TrainShot]()
    for onset, following in zip(onset_ticks, (*onset_ticks[1:], None), strict=True):
        begin = State(displacement_m=state.x, velocity_m_s=state.v, current_A=state.i)
        state.until = HORIZON_S if following is None else min((following - onset) / TICKS, HORIZON_S)
        result = ShotResult()
        shoot_on(constants, state, series, result)
        shots.append(TrainShot(onset_tick=onset, start=begin, summary=summary_from(astuple(result)[:9])))
    return tuple(shots)


def _begun(start: State) -> ShotState:
    values = (start.displacement_m, start.velocity_m_s, start.current_A)
    if not all(map(math.isfinite, values)) or start.displacement_m < 0:
        raise ValueError(f"start is {start}; it must be finite, and displacement_m at least 0")
    return ShotState(x=start.displacement_m, v=start.velocity_m_s, i=start.current_A)


def repeated(gun: GunParameters, rate_Hz: float, shots: int) -> tuple[TrainShot, ...]:
    """So many shots from rest at a steady rate, rounded to whole ticks. `ValueError`: a rate that is none."""
    if not 0 < rate_Hz <= TICKS:
        raise ValueError(f"rate_Hz is {rate_Hz}; it must be above 0 and at most {TICKS}")
    period = round(TICKS / rate_Hz)
    return train(gun, range(0, period * shots, period))


def gentlest_friction_N(gun: GunParameters, rate_Hz: float) -> float | None:
    """The damper's friction at which the magnet lands most gently while the gun can shoot at `rate_Hz`.

    More friction lands more gently and, beyond an optimum, later: the answer is where the rate is just met. None if
    no friction allows that rate. Looked for from none to what the pre-load can overcome. A gun with a friction of its
    own on the way back keeps that one.
    """
    if not 1 / _CREEP_S < rate_Hz < math.inf:
        raise ValueError(f"rate_Hz is {rate_Hz}; it must be a finite rate above {1 / _CREEP_S:g}")
    most = gun.stiffness_N_m * gun.preload_length_m
    frictions = [most * n / _FRICTIONS for n in range(_FRICTIONS + 1)]
    spare = [_spare_s(gun, friction_N, rate_Hz) for friction_N in frictions]
    allowed = [n for n, seconds in enumerate(spare) if seconds >= 0]
    if not allowed:
        return None
    last = allowed[-1]
    if last == _FRICTIONS:
        return most
    edge = brentq(lambda f: _spare_s(gun, f, rate_Hz), frictions[last], frictions[last + 1], xtol=1e-12)
    while _spare_s(gun, edge, rate_Hz) < 0:  # the root's own rounding
        edge = math.nextafter(edge - 1e-13, 0.0)
    return float(edge)


def _spare_s(gun: GunParameters, friction_N: float, rate_Hz: float) -> float:
    """How much earlier than needed the magnet is home."""
    summary = simulate(replace(gun, friction_N=friction_N))
    return 1 / rate_Hz - (summary.reset_end_s if summary.reset_end_s is not None else 2 * _CREEP_S)
