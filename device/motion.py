"""The gun's equations, and the words for its motion: a state, and a phase that an event ends.

Equation (1) is read as m x'' = F_m - k (x + x_0) -/+ F_f: the pre-loaded spring presses the magnet on its rear stop
at x = 0. Friction opposes the motion of its phase, so no equation holds a sign function; rest is a state of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

from device.parameters import GunParameters

HORIZON_S = 10.0
"""Where a shot that has not come to rest is given up."""

Event = Literal["break-away", "coil-edge", "coil-force-zero", "turn", "stop", "pulse-end", "settled", "given-up"]

_FORCE_SLACK = 1e-12  # relative: the magnet breaks away this far beyond the threshold, so that it does accelerate
_FORCE_FLOOR_N = 1e-15  # the same for a gun with neither spring nor friction


class State(NamedTuple):
    """Displacement x from the rear stop (m), velocity v (m/s) and coil current i (A)."""

    x: float
    v: float
    i: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Phase:
    """One smooth stretch of a shot. `direction` is 1 away from the stop, -1 towards it, 0 at rest.

    `end` is the state just before the event: an impact keeps its speed, a cut current its value. `at` gives the
    state at any time of the phase; `knots_s` are times close enough together to bracket an extremum.
    """

    name: Literal["rest", "coil", "free"]
    direction: int
    start_s: float
    end_s: float
    end: State
    ended_by: Event
    at: Callable[[float], State]
    knots_s: tuple[float, ...] = ()


def drive_voltage(gun: GunParameters, time_s: float) -> float:
    """The drive signal u in V: the pulse, then 0."""
    return gun.voltage_V if time_s < gun.pulse_s else 0.0


def coil_is_live(gun: GunParameters, time_s: float) -> bool:
    """Whether the coil can carry a current: always if shorted after the pulse, else during the pulse only."""
    return gun.drive_off == "shorted" or time_s < gun.pulse_s


def latest_end(gun: GunParameters, time_s: float) -> tuple[float, Event]:
    """Where a phase that starts now ends at the latest: nothing smooth goes past the end of the pulse."""
    if time_s < gun.pulse_s < HORIZON_S:
        return gun.pulse_s, "pulse-end"
    return HORIZON_S, "given-up"


def grip(gun: GunParameters, x: float) -> float:
    """The coil's hold on the magnet, (x_c - x)/x_c inside the coil and 0 outside (equation 2)."""
    return max(0.0, (gun.coil_reach_m - x) / gun.coil_reach_m)


def motor_force(gun: GunParameters, state: State) -> float:
    """The electromagnetic force F_m on the magnet in N (equation 2)."""
    return gun.motor_constant_N_A * grip(gun, state.x) * state.i


def spring_force(gun: GunParameters, x: float) -> float:
    """The spring's push towards the stop in N, k (x + x_0)."""
    return gun.stiffness_N_m * (x + gun.preload_length_m)


def breakaway_slack(gun: GunParameters, x: float) -> float:
    """How far beyond friction, in N, a force must go before the model lets the magnet move (rounding only)."""
    return _FORCE_SLACK * (spring_force(gun, x) + gun.friction_N) + _FORCE_FLOOR_N


def hand_force(gun: GunParameters, state: State, direction: int) -> float:
    """The force on the hand F = m d2x/dt2 in N (equation 1): positive in the direction of recoil, 0 at rest."""
    if direction == 0:
        return 0.0
    return motor_force(gun, state) - spring_force(gun, state.x) - direction * gun.friction_N


def hand_force_rate(gun: GunParameters, u: float, state: State) -> float:
    """The time derivative dF/dt of the force on the hand inside the coil in N/s."""
    x, v, _ = state
    fading = (gun.coil_reach_m - x) * coil_rates(gun, u, 1, state).i - v * state.i
    return gun.motor_constant_N_A / gun.coil_reach_m * fading - gun.stiffness_N_m * v


def coil_rates(gun: GunParameters, u: float, direction: int, state: State) -> State:
    """Equations (1) to (3) inside the coil: dx/dt, dv/dt and di/dt. Smooth past x_c, where a trial step may land."""
    x, v, i = state
    hold = (gun.coil_reach_m - x) / gun.coil_reach_m
    force_N = gun.motor_constant_N_A * hold * i - spring_force(gun, x) - direction * gun.friction_N
    emf_V = gun.back_emf_V_s_m * v * (hold if gun.emf == "reciprocal" else 1.0)
    return State(v, force_N / gun.magnet_mass_kg, (u - emf_V - gun.resistance_ohm * i) / gun.inductance_H)
