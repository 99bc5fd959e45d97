"""What one shot comes to: its summary, and its course over time."""

# ruff: noqa: PLR0124 - NaN is what does not equal itself, and this runs a million times a minute

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Literal

import numpy as np
from numpy.typing import NDArray

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
