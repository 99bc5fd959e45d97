"""What the kernel is written in: the mark of its functions, and where each number stands in its rows of floats.

A session runs these functions interpreted, a batch compiled (`device.physics.batch`); both give the same digits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

from device.parameters import GunParameters

_Function = TypeVar("_Function", bound=Callable[..., object])

KERNEL: dict[str, Callable[..., object]] = {}
"""The marked functions by name, each after those that it calls."""


class Floats(Protocol):
    """A list of floats, or an array of them."""

    def __getitem__(self, index: int, /) -> float: ...

    def __setitem__(self, index: int, value: float, /) -> None: ...


def kernel(function: _Function) -> _Function:
    """The function itself, marked. Its name is unique in the kernel."""
    if function.__name__ in KERNEL:
        raise ValueError(f"the kernel has a function {function.__name__} already")
    KERNEL[function.__name__] = function
    return function


@kernel
def clear(row: Floats, size: int, number: float) -> None:
    """A row of one number."""
    for n in range(size):
        row[n] = number


ORDER = 24
"""Of the Taylor series. Measured: orders 20 to 28 take the same time within 15 %, 24 the least."""
HORIZON_S = 10.0
"""Where a shot that has not come to rest is given up."""
MAX_SEGMENTS = 20_000
"""The most segments of one shot, steps and closed forms together; a plain shot has about 20."""

# parameters; friction is that of the way out and that of the way back
MASS, BACK_EMF, RESISTANCE, INDUCTANCE, MOTOR, REACH, STIFFNESS, PRELOAD = range(8)
FRICTION_OUT, FRICTION_BACK, VOLTAGE, PULSE, CONTACT, OPEN, RECIPROCAL, MODEL = range(8, 16)
PARAMETERS_SIZE = 16

FULL, NO_INDUCTANCE, CLOSED_FORM, BALLISTIC = 0.0, 1.0, 2.0, 3.0  # models; without inductance L = 0 in the row

# state: time, motion and current; which kind of segment, since when and which way; the drive and when it changes;
# the span of the next step, that of the last one and how much of it was used; when the transient and the shot are over
TIME, X, V, I, KIND, BEGAN, HEADING, DRIVE, LIVE, LIMIT, SPAN, STEP, USED, TRANSIENT_END, END = range(15)  # noqa: E741 - the field's symbol
STATE_SIZE = 15

# work: the series of one step (position, velocity, current, grip), and room for two polynomials; one row to hand on
ROW = ORDER + 1
XS, VS, IS, GS, QS, BS = (ROW * n for n in range(6))
WORK_SIZE = 6 * ROW

REST, COIL, FREE = 0.0, 1.0, 2.0  # kinds of segment

# how a segment ends
CONTINUES, BREAK_AWAY, COIL_EDGE, FORCE_ZERO, TURN, STOP, DRIVE_CHANGE, SETTLED, GIVEN_UP = range(9)

# results of one shot; the first landing after the pulse and the last landing of all
STATUS, PEAK, RECOIL_END, IMPULSE, FIRING_END, TOP, RESET_END, IMPACT, COLLISION = range(9)
STAGE, LAST_LANDING, LAST_IMPACT, SEGMENTS = range(9, 13)
RESULT_SIZE = 13

HOME, NO_BREAK_AWAY, STUCK, NOT_HOME, INVALID = range(5)
STATUSES = ("home", "no-break-away", "stuck", "not-home", "invalid")
"""By their number in the results."""


def pack(gun: GunParameters, model: float = FULL) -> list[float]:
    """The parameters as the kernel's row. A model without back-EMF has no current but in the pulse."""
    driven = model == CLOSED_FORM
    return [
        gun.magnet_mass_kg,
        0.0 if driven else gun.back_emf_V_s_m,
        gun.resistance_ohm,
        0.0 if driven or model == NO_INDUCTANCE else gun.inductance_H,
        gun.motor_constant_N_A,
        gun.coil_reach_m,
        gun.stiffness_N_m,
        gun.preload_length_m,
        gun.friction_N,
        gun.homeward_friction_N,
        gun.voltage_V,
        gun.pulse_s,
        gun.contact_depth_m,
        float(driven or gun.drive_off == "open"),
        float(gun.emf == "reciprocal"),
        model,
    ]
