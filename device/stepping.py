"""The phase with the magnet inside a live coil: equations (1) to (3), integrated step by step, events found exactly.

The steps are scipy's: the explicit order-8 method, or an implicit one if the phase proves stiff (an inductance or
a mass near 0). Events are looked for inside each step, in the order in which they can happen.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853, OdeSolver, Radau
from scipy.optimize import brentq

from device.motion import Event, Phase, State, coil_rates, drive_voltage, latest_end
from device.parameters import GunParameters

EXPLICIT_STEPS = 2000
"""Steps of the explicit method before the implicit one takes over; a plain phase takes about 30."""
MAX_STEPS = 6000

_RTOL, _STIFF_RTOL = 1e-12, 1e-10
_ATOL = 1e-15  # m, m/s and A: far below anything that a shot reaches
_PARTS = (0.0, *(2.0**-n for n in range(16, 4, -1)), *(n / 16 for n in range(1, 16)))  # of a step, to look for a hop


@dataclass(frozen=True, slots=True)
class _Step:
    """One step, in seconds since the start of the phase, its two states, and the state at any time of it."""

    start_s: float
    end_s: float
    start: State
    end: State
    at: Callable[[float], State]


def coil_phase(gun: GunParameters, start_s: float, state: State, direction: int) -> Phase:
    """The magnet moving inside the coil until it turns, leaves the coil, hits the stop or F_m falls to 0."""
    limit_s, last = latest_end(gun, start_s)
    taken, found = _march(gun, drive_voltage(gun, start_s), direction, limit_s - start_s, state)
    at = _lookup(taken, start_s, state)
    end_s, event, end = limit_s, last, at(limit_s)
    if found:
        end_s, event = start_s + found[0], found[1]
        end = _exactly(gun, event, taken[-1].at(found[0]))
    elif not taken or taken[-1].end_s < limit_s - start_s:
        end_s, event = start_s + (taken[-1].end_s if taken else 0.0), "given-up"
    return Phase(
        name="coil",
        direction=direction,
        start_s=start_s,
        end_s=end_s,
        end=end,
        ended_by=event,
        at=at,
        knots_s=(start_s, *(start_s + step.start_s for step in taken[1:]), end_s),
    )


def _march(
    gun: GunParameters, u: float, direction: int, duration_s: float, state: State
) -> tuple[list[_Step], tuple[float, Event] | None]:
    """The steps up to the first event, and the event; None if the steps end before there is one."""
    taken: list[_Step] = []
    for step in _steps(gun, u, direction, duration_s, state):
        taken.append(step)
        if found := _event_in(gun, step, direction):
            return taken, found
    return taken, None


def _lookup(taken: list[_Step], start_s: float, state: State) -> Callable[[float], State]:
    ends = [step.end_s for step in taken]

    def at(time_s: float) -> State:
        if not taken:
            return state
        local_s = min(time_s - start_s, ends[-1])
        return taken[bisect_left(ends, local_s)].at(local_s)

    return at


def _steps(gun: GunParameters, u: float, direction: int, duration_s: float, state: State) -> Iterator[_Step]:
    """The steps of one phase; they end early where the numbers leave the finite range or the steps run out."""

    def rates(_t: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.array(coil_rates(gun, u, direction, State(*y.tolist())))

    with np.errstate(all="ignore"):  # numbers out of range end the phase, see below
        solver: OdeSolver = DOP853(rates, 0.0, np.array(state), duration_s, rtol=_RTOL, atol=_ATOL)
    for count in range(MAX_STEPS):
        with np.errstate(all="ignore"):
            if count == EXPLICIT_STEPS:
                solver = Radau(rates, solver.t, solver.y, duration_s, rtol=_STIFF_RTOL, atol=_ATOL)
            solver.step()
        start, state = state, State(*solver.y.tolist())
        if solver.status == "failed" or not all(map(math.isfinite, state)):
            return
        yield _Step(solver.t_old, solver.t, start, state, _interpolant(solver))
        if solver.status == "finished":
            return


def _interpolant(solver: OdeSolver) -> Callable[[float], State]:
    dense = solver.dense_output()
    return lambda t: State(*dense(t).tolist())


def _event_in(gun: GunParameters, step: _Step, direction: int) -> tuple[float, Event] | None:
    """The first event of a step. Up to a turn x is monotone, so edge and stop are looked for before it only."""
    end_s, end = step.end_s, step.end
    event: Event | None = None
    if direction * end.v <= 0:
        end_s, event = _turn(step, direction), "turn"
        end = step.at(end_s)
    target = gun.coil_reach_m if direction > 0 else 0.0
    if direction * (end.x - target) >= 0:
        end_s, event = _root(lambda t: step.at(t).x - target, step.start_s, end_s), _arrival(direction)
        end = step.at(end_s)
    if direction > 0 and step.start.i > 0 > end.i:
        end_s, event = _root(lambda t: step.at(t).i, step.start_s, end_s), "coil-force-zero"
    return (end_s, event) if event else None


def _arrival(direction: int) -> Event:
    return "coil-edge" if direction > 0 else "stop"


def _exactly(gun: GunParameters, event: Event, state: State) -> State:
    """The state at an event, with the quantity that defines the event set to its exact value."""
    exact = {
        "turn": {"v": 0.0},
        "coil-edge": {"x": gun.coil_reach_m},
        "stop": {"x": 0.0},
        "coil-force-zero": {"i": 0.0},
    }
    return state._replace(**exact[event])


def _turn(step: _Step, direction: int) -> float:
    """Where the velocity falls to 0. A hop from rest may rise and fall within one step, hence the samples."""
    width_s = step.end_s - step.start_s
    samples = [step.start_s + width_s * part for part in _PARTS]
    moving = [t for t in samples if direction * step.at(t).v > 0]
    return _root(lambda t: step.at(t).v, moving[-1], step.end_s) if moving else step.start_s


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """The root between two times; a rounded start on the wrong side counts as the root."""
    if low == high or function(low) == 0 or math.copysign(1, function(low)) == math.copysign(1, function(high)):
        return low
    return float(brentq(function, low, high, xtol=1e-17, rtol=9e-16))
