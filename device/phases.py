"""A shot as a chain of smooth phases: the hybrid automaton of the gun.

Which phase comes next is a function of time and state alone; what an event does to the state is in `_jump`.
"""

from __future__ import annotations

from collections.abc import Iterator

from device.arcs import free_phase, rest_phase
from device.motion import Event, Phase, State, breakaway_slack, coil_is_live, motor_force, spring_force
from device.parameters import GunParameters
from device.stepping import coil_phase

MAX_PHASES = 400
"""The most phases of one shot; a plain shot has about ten."""

FINAL: tuple[Event, ...] = ("settled", "given-up")


def phases(gun: GunParameters) -> Iterator[Phase]:
    """The phases of one shot, in order, from the onset of the pulse.

    The last one is `settled` (at rest for good), unless the shot was given up: beyond `HORIZON_S`, after
    `MAX_PHASES`, or where the numbers leave the range of floats.
    """
    time_s, state, halted = 0.0, State(0.0, 0.0, 0.0), False
    for _ in range(MAX_PHASES):
        phase = _next(gun, time_s, state, halted)
        yield phase
        if phase.ended_by in FINAL:
            return
        time_s, state = phase.end_s, _jump(gun, phase)
        halted = phase.direction != 0 and phase.end_s == phase.start_s


def _next(gun: GunParameters, time_s: float, state: State, halted: bool) -> Phase:
    """The phase that follows. `halted`: the last one set out and got nowhere, a hop below what floats resolve."""
    direction = 0 if halted and state.v == 0 else _direction(gun, time_s, state)
    if direction == 0:
        return rest_phase(gun, time_s, state)
    inside = state.x < gun.coil_reach_m or (state.x == gun.coil_reach_m and direction < 0)
    run = coil_phase if inside and coil_is_live(gun, time_s) else free_phase
    return run(gun, time_s, state, direction)


def _direction(gun: GunParameters, time_s: float, state: State) -> int:
    """Which way the magnet goes on; at v = 0 the forces decide, and friction or the stop may hold it."""
    if state.v != 0:
        return 1 if state.v > 0 else -1
    net_N = (motor_force(gun, state) if coil_is_live(gun, time_s) else 0.0) - spring_force(gun, state.x)
    held_N = gun.friction_N + breakaway_slack(gun, state.x) / 2
    if net_N > held_N:
        return 1
    return -1 if net_N < -held_N and state.x > 0 else 0


def _jump(gun: GunParameters, phase: Phase) -> State:
    """The state after the event: the inelastic stop takes the velocity, an opened drive the current."""
    x, v, i = phase.end
    return State(x, 0.0 if phase.ended_by == "stop" else v, i if coil_is_live(gun, phase.end_s) else 0.0)
