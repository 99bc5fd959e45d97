"""One shot: interpreted in about half a millisecond, or in microseconds once `device.physics.batch.warm` was called."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from device.parameters import GunParameters
from device.physics.kernel import Floats, clear
from device.physics.layout import (
    BALLISTIC,
    CLOSED_FORM,
    FULL,
    NO_INDUCTANCE,
    NOT_HOME,
    RESULT_SIZE,
    STATE_SIZE,
    STATUS,
    WORK_SIZE,
    pack,
)
from device.physics.results import ShotSummary, summary_of
from device.physics.shot import shoot

MODELS = {"full": FULL, "no-inductance": NO_INDUCTANCE, "closed-form": CLOSED_FORM, "ballistic": BALLISTIC}
FIDELITIES = tuple(MODELS)
"""The models on offer, the best first.

`full`: equations (1) to (3) as they stand. `no-inductance`: L = 0. `closed-form`: no back-EMF either, so the current
is that of the pulse. `ballistic`: `full` up to the end of the recoil stage, then no coil, the magnet's heights and
speeds by energy and its times under the mean of the spring's force. `device.physics.tiers` states their errors.
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
