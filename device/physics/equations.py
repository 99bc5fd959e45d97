"""The equations of a shot, and what they speak of: the gun's constants, the state, the series of a step, the result.

    F = m d2x/dt2 = F_m - k (x + x_0) - F_f sign(dx/dt)   (1)
    F_m = (x_c - x)/x_c k_m i inside the coil, else 0     (2)

The functions here and in `coil`, `polynomial`, `segments`, `series`, `shot` and `slips` are handed the classes below if
interpreted, and records with the same fields if compiled (`device.physics.batch`). Both give the same digits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from device.messages import cut_values
from device.parameters import GunParameters

ORDER = 24
"""Of the Taylor series. Measured: orders 20 to 28 take the same time within 15 %, 24 the least."""
HORIZON_S = 10.0
"""Where a shot that has not come to rest is given up."""
MAX_SEGMENTS = 20_000
"""The most segments of one shot, steps and closed forms together; a plain shot has about 20."""
MAX_WORK = 65_000
"""The most work of one shot: its segments, passes over series that settle, and pieces of steps in which roots are
looked for. It takes about a second, interpreted; a plain shot has about 30."""

FARTHEST = 0.5
"""How far the speed may swing about the one that follows the position, relative, as it is taken for that: at less than
1 the magnet does not turn meanwhile."""

FULL, NO_INDUCTANCE, CLOSED_FORM, BALLISTIC = range(4)
"""The models; those without inductance have L = 0 among their constants."""
MODELS = {"full": FULL, "no-inductance": NO_INDUCTANCE, "closed-form": CLOSED_FORM, "ballistic": BALLISTIC}
FIDELITIES = tuple(MODELS)
"""The models on offer, the best first.

`full`: equations (1) to (3) as they stand. `no-inductance`: L = 0. `closed-form`: no back-EMF either, so the current
is that of the pulse. `ballistic`: `full` up to the end of the recoil stage, then no coil, the magnet's heights and
speeds by energy and its times under the mean of the spring's force. `device.physics.scenes` states their errors.
"""

REST, COIL, FREE = range(3)
"""Kinds of segment: at rest, moving inside the live coil, moving beyond its force."""

CONTINUES, BREAK_AWAY, COIL_EDGE, FORCE_ZERO, TURN, STOP, DRIVE_CHANGE, SETTLED, GIVEN_UP = range(9)
"""How a segment ends."""

WAITING, RECOILING, OVER = range(3)
"""Where a shot stands in its recoil stage."""

HOME, NO_BREAK_AWAY, STUCK, NOT_HOME, INVALID = range(5)
"""How a shot ends, by its place in `STATUSES`."""
Status = Literal["home", "no-break-away", "stuck", "not-home"]
STATUSES: tuple[Status, Status, Status, Status, Literal["invalid"]] = (
    "home",
    "no-break-away",
    "stuck",
    "not-home",
    "invalid",
)
"""The last one is what a batch says of numbers that physics has not; it comes to no summary."""

Coefficients = Sequence[float]
"""Of a polynomial of degree `ORDER`, the constant one first."""


class Constants(NamedTuple):
    """One gun in SI units, under the symbols of equations (1) to (4); in the order of `GunParameters`."""

    mass: float  # m
    back_emf: float  # k_e
    resistance: float  # R
    inductance: float  # L
    motor_constant: float  # k_m
    coil_reach: float  # x_c
    stiffness: float  # k
    preload: float  # x_0
    friction_out: float  # F_f away from the stop
    voltage: float  # u during the pulse
    pulse_s: float
    contact_depth: float  # x_k
    opens: bool  # no current flows after the pulse
    reciprocal: bool  # the back-EMF fades along x as the motor's force does
    friction_back: float  # F_f towards the stop
    model: int


@dataclass(slots=True)
class ShotState:
    """The magnet and the coil now, the drive, and how the current segment came about."""

    time: float = 0.0
    x: float = 0.0  # position, 0 at the stop, positive in the direction of recoil
    v: float = 0.0  # velocity
    i: float = 0.0  # current
    kind: int = REST
    began: float = 0.0  # when the segment did
    heading: float = 0.0  # 1 away from the stop, -1 towards it, 0 at rest
    u: float = 0.0  # the drive's voltage
    live: bool = False  # whether current can flow
    drive_until: float = 0.0
    recoiling: bool = True  # whether the end of the recoil stage may still come
    guess: float = 0.0  # of the span of the next step in the coil
    span: float = 0.0  # of the last one
    used: float = 0.0  # how much of it, before its event
    transient_until: float = 0.0  # from then on the current only follows the motion
    creeping: bool = False  # whether speed and current follow the position
    creeping_from: float = 0.0  # when to look next whether they do
    farthest: float = FARTHEST  # a trace, in which nothing may jump, has less
    until: float = HORIZON_S
    slips: int = 0  # how often the magnet has broken away since the slips ahead were last looked at


def _zeros() -> list[float]:
    return [0.0] * (ORDER + 1)


@dataclass(slots=True)
class StepSeries:
    """Taylor coefficients over one step in the coil, in parts of its span, and room for a polynomial in two bases."""

    x: list[float] = field(default_factory=_zeros)
    v: list[float] = field(default_factory=_zeros)
    i: list[float] = field(default_factory=_zeros)
    other: list[float] = field(default_factory=_zeros)  # whose roots are looked for
    bernstein: list[float] = field(default_factory=_zeros)
    beyond: list[float] = field(default_factory=_zeros)  # the other half of an interval
    shares: list[float] = field(default_factory=_zeros)  # of the way left, by slips, in Chebyshev's polynomials
    waits: list[float] = field(default_factory=_zeros)  # from each slip to the next, in the same way
    limit: float = 0.0  # where slips lead to
    work: int = 0  # how often a series was made, or turned into another basis


@dataclass(slots=True)
class ShotResult:
    """What a shot comes to, as in `ShotSummary`; NaN is what was not reached."""

    status: int = NOT_HOME
    peak_force_N: float = math.nan
    recoil_end_s: float = math.nan
    recoil_impulse_Ns: float = math.nan
    firing_end_s: float = math.nan
    max_displacement_m: float = math.nan
    reset_end_s: float = math.nan  # the first landing after the pulse
    impact_speed_m_s: float = math.nan
    collision_force_N: float = math.nan
    stage: int = WAITING
    last_landing_s: float = math.nan
    last_impact_m_s: float = math.nan


def grip(p: Constants, x: float) -> float:
    """The coil's hold on the magnet, (x_c - x)/x_c inside the coil and 0 outside (equation 2)."""
    return max(0.0, (p.coil_reach - x) / p.coil_reach)


def motor_force(p: Constants, x: float, i: float) -> float:
    """F_m in N (equation 2)."""
    return p.motor_constant * grip(p, x) * i


def spring_force(p: Constants, x: float) -> float:
    """The spring's push towards the stop in N, k (x + x_0)."""
    return p.stiffness * (x + p.preload)


def friction(p: Constants, heading: float) -> float:
    """-F_f sign(dx/dt) in N: against the way the magnet goes."""
    return -p.friction_out if heading > 0.0 else p.friction_back


def force_on_hand(p: Constants, heading: float, x: float, i: float) -> float:
    """F = m d2x/dt2 in N (equation 1) of a moving magnet."""
    return motor_force(p, x, i) - spring_force(p, x) + friction(p, heading)


def pack(gun: GunParameters, model: int = FULL) -> Constants:
    """The gun's constants under a model. One without back-EMF has no current but in the pulse."""
    driven = model == CLOSED_FORM
    return Constants(
        gun.magnet_mass_kg,
        0.0 if driven else gun.back_emf_V_s_m,
        gun.resistance_ohm,
        0.0 if driven or model == NO_INDUCTANCE else gun.inductance_H,
        gun.motor_constant_N_A,
        gun.coil_reach_m,
        gun.stiffness_N_m,
        gun.preload_length_m,
        gun.friction_N,
        gun.voltage_V,
        gun.pulse_s,
        gun.contact_depth_m,
        driven or gun.drive_off == "open",
        gun.emf == "reciprocal",
        gun.homeward_friction_N,
        model,
    )


def model_number(fidelity: object) -> int:
    """The number of a model. `ValueError`: there is no such one."""
    if not isinstance(fidelity, str) or fidelity not in MODELS:
        raise ValueError(cut_values(f"fidelity is {fidelity!r}; it must be one of {', '.join(FIDELITIES)}"))
    return MODELS[fidelity]
