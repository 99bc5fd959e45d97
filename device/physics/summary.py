"""One shot: its summary and its course, interpreted in about half a millisecond, or in microseconds once compiled."""

# ruff: noqa: PLR0124 - NaN is what does not equal itself, and this runs a million times a minute

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from device.parameters import GunParameters
from device.physics.kernel import (
    BALLISTIC,
    CLOSED_FORM,
    FULL,
    NO_INDUCTANCE,
    NOT_HOME,
    RESULT_SIZE,
    STATE_SIZE,
    STATUS,
    WORK_SIZE,
    Floats,
    clear,
    pack,
)
from device.physics.shot import shoot

Status = Literal["home", "no-break-away", "stuck", "not-home"]
_STATUS: tuple[Status, ...] = ("home", "no-break-away", "stuck", "not-home")
"""By their number in the kernel's results, as `STATUSES`; `invalid` parameters come to no summary."""


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


def summary_of(row: Sequence[float]) -> ShotSummary:
    """The kernel's row of results as a summary; NaN, which equals nothing, is what was not reached.

    The slots are filled directly: a frozen dataclass's own constructor costs a sixth of a whole shot.
    """
    status, peak, recoil, impulse, firing, top, reset, impact, collision = row[:9]
    summary = object.__new__(ShotSummary)
    _put_status(summary, _STATUS[int(status)])
    _put_peak(summary, peak if peak == peak else None)
    _put_recoil(summary, recoil if recoil == recoil else None)
    _put_impulse(summary, impulse if impulse == impulse else None)
    _put_firing(summary, firing if firing == firing else None)
    _put_top(summary, top if top == top else None)
    _put_reset(summary, reset if reset == reset else None)
    _put_impact(summary, impact if impact == impact else None)
    _put_collision(summary, collision if collision == collision else None)
    return summary


(
    _put_status,
    _put_peak,
    _put_recoil,
    _put_impulse,
    _put_firing,
    _put_top,
    _put_reset,
    _put_impact,
    _put_collision,
) = (getattr(ShotSummary, field.name).__set__ for field in fields(ShotSummary))

MODELS = {"full": FULL, "no-inductance": NO_INDUCTANCE, "closed-form": CLOSED_FORM, "ballistic": BALLISTIC}
FIDELITIES = tuple(MODELS)
"""The models on offer, the best first.

`full`: equations (1) to (3) as they stand. `no-inductance`: L = 0. `closed-form`: no back-EMF either, so the current
is that of the pulse. `ballistic`: `full` up to the end of the recoil stage, then no coil, the magnet's heights and
speeds by energy and its times under the mean of the spring's force. `device.physics.scenes` states their errors.
"""


def simulate(parameters: GunParameters, fidelity: str = "full") -> ShotSummary:
    """The summary of one shot from rest. `ValueError`: no such fidelity.

    >>> shot = simulate(GunParameters(friction_N=1.12))
    >>> shot.status, round(shot.peak_force_N, 2), round(shot.reset_end_s, 3)
    ('home', 35.14, 0.211)
    """
    if fidelity == "full":
        return summary_of(_engine.run(_remembered(parameters)))
    return summary_of(_engine.run(_engine.row(pack(parameters, model_of(fidelity)))))


def model_of(fidelity: str) -> float:
    """The kernel's number of a model. `ValueError`: there is no such one."""
    if fidelity not in MODELS:
        raise ValueError(f"fidelity is {fidelity!r}; it must be one of {', '.join(FIDELITIES)}")
    return MODELS[fidelity]


def interpret(row: Floats) -> list[float]:
    """The kernel's results of one shot, interpreted. Numbers beyond floats make it `not-home`."""
    state, work, found = [0.0] * STATE_SIZE, [0.0] * WORK_SIZE, [0.0] * RESULT_SIZE
    try:
        shoot(row, state, work, found)
    except (ArithmeticError, ValueError):  # what Python raises where compiled code goes on with inf and NaN
        clear(found, RESULT_SIZE, math.nan)
        found[STATUS] = float(NOT_HOME)
    return found


@dataclass(slots=True)
class _Engine:
    """How this process runs the kernel, and on which kind of row."""

    run: Callable[[Any], list[float]]
    row: Callable[[list[float]], Any]
    kind: type


_engine = _Engine(interpret, lambda row: row, list)


def use(run: Callable[[Any], list[float]], row: Callable[[list[float]], Any], kind: type) -> None:
    """From now on the full model runs by `run`, on rows that `row` makes of lists, of this kind."""
    _engine.run, _engine.row, _engine.kind = run, row, kind


def _remembered(parameters: GunParameters) -> Any:
    row = getattr(parameters, "_packed", None)
    if type(row) is not _engine.kind:
        row = _engine.row(pack(parameters))
        object.__setattr__(parameters, "_packed", row)
    return row
