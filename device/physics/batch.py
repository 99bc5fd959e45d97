"""Shots by the hundred thousand: arrays of parameters in, arrays of results out, compiled, on all cores."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from device.parameters import ABOVE_ZERO, GunParameters
from device.physics.kernel import (
    BACK_EMF,
    CLOSED_FORM,
    FRICTION_BACK,
    FRICTION_OUT,
    INDUCTANCE,
    INVALID,
    MODEL,
    NO_INDUCTANCE,
    OPEN,
    RESULT_SIZE,
    STATE_SIZE,
    STATUSES,
    WORK_SIZE,
    pack,
)
from device.physics.summary import interpret, model_of, use

_CHUNK = 4096  # shots between two words of progress
_FIELDS = tuple(field.name for field in fields(GunParameters))
_OPTIONS = {"drive_off": ("shorted", "open"), "emf": ("printed", "reciprocal")}  # 0 and 1 in the kernel's row
_PLACES = {name: place + (place > FRICTION_OUT) for place, name in enumerate(_FIELDS)} | {
    "return_friction_N": FRICTION_BACK
}
"""Where the kernel's row holds each parameter."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShotBatch:
    """The results of many shots, arrays of one length, as in `ShotSummary`; what was not reached is NaN.

    `status` counts in `STATUSES`: home, no-break-away, stuck, not-home, invalid (parameters that physics has not).
    """

    status: NDArray[np.int8]
    peak_force_N: NDArray[np.float64]
    recoil_end_s: NDArray[np.float64]
    recoil_impulse_Ns: NDArray[np.float64]
    firing_end_s: NDArray[np.float64]
    max_displacement_m: NDArray[np.float64]
    reset_end_s: NDArray[np.float64]
    impact_speed_m_s: NDArray[np.float64]
    collision_force_N: NDArray[np.float64]

    def names(self) -> NDArray[np.str_]:
        """The statuses in words."""
        return np.array(STATUSES)[self.status]


def warm() -> bool:
    """Compiles the kernel or loads it, half a minute or one second, for `simulate` too. False without the compiler."""
    if find_spec("numba") is None:
        return False
    from device.physics.compiled import compiled  # noqa: PLC0415 - only here is the compiler wanted

    one, _ = compiled()
    state, work, found = np.empty(STATE_SIZE), np.empty(WORK_SIZE), np.empty(RESULT_SIZE)

    def run(row: NDArray[np.float64]) -> list[float]:
        one(row, state, work, found)
        return found.tolist()

    use(run, np.array, np.ndarray)
    return True


def simulate_batch(
    gun: GunParameters | None = None,
    *,
    fidelity: str = "full",
    cores: int | None = None,
    progress: Callable[[int], object] | None = None,
    **arrays: ArrayLike,
) -> ShotBatch:
    """The shots of `gun` with the parameters in `arrays` in place of its own, broadcast against each other.

    `progress` is told after every few thousand shots how many they were. `ValueError`: no such parameter or fidelity.
    Numbers that physics has not make their shot `invalid` and no other one.

    >>> simulate_batch(friction_N=[0.21, -1.0, 1.70]).names().tolist()
    ['home', 'invalid', 'stuck']
    """
    rows, valid = _rows(gun or GunParameters(), fidelity, arrays)
    found = np.empty((len(rows), RESULT_SIZE))
    progress = progress or (lambda _count: None)
    if valid.all():
        _run(rows, found, cores, progress)
    else:
        found[:], found[:, 0] = np.nan, INVALID
        among = np.empty((int(valid.sum()), RESULT_SIZE))
        _run(rows[valid], among, cores, progress)
        found[valid] = among
    numbers = {name: np.ascontiguousarray(found[:, n]) for n, name in enumerate(ShotBatch.__slots__[1:], start=1)}
    return ShotBatch(status=found[:, 0].astype(np.int8), **numbers)


def _rows(
    gun: GunParameters, fidelity: str, arrays: dict[str, ArrayLike]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The kernel's rows, and which of them are guns."""
    unknown = sorted(set(arrays) - set(_FIELDS))
    if unknown:
        raise ValueError(f"no such parameter: {', '.join(unknown)}; known are {', '.join(_FIELDS)}")
    columns = [np.ravel(column) for column in np.broadcast_arrays(*map(np.asarray, arrays.values()))]
    rows = np.tile(np.array(pack(gun)), (columns[0].size if columns else 1, 1))
    valid = np.ones(len(rows), dtype=np.bool_)
    for name, column in zip(arrays, columns, strict=True):
        valid &= _is_allowed(name, column)
        numbers = column == _OPTIONS[name][1] if name in _OPTIONS else column
        rows[:, _PLACES[name]] = numbers.astype(np.float64)
    if gun.return_friction_N is None and "return_friction_N" not in arrays:
        rows[:, FRICTION_BACK] = rows[:, FRICTION_OUT]
    _reduce(rows, model_of(fidelity))
    return rows, valid


def _is_allowed(name: str, column: NDArray[Any]) -> NDArray[np.bool_]:
    """The rule of `GunParameters`, for many values."""
    if name in _OPTIONS:
        return np.isin(column, _OPTIONS[name])
    above = column > 0 if name in ABOVE_ZERO else column >= 0
    return np.asarray(np.isfinite(column) & above)


def _reduce(rows: NDArray[np.float64], model: float) -> None:
    """What a reduced model leaves out of the rows, as `pack` does."""
    rows[:, MODEL] = model
    if model in (NO_INDUCTANCE, CLOSED_FORM):
        rows[:, INDUCTANCE] = 0.0
    if model == CLOSED_FORM:
        rows[:, BACK_EMF], rows[:, OPEN] = 0.0, 1.0


def _run(
    rows: NDArray[np.float64], found: NDArray[np.float64], cores: int | None, progress: Callable[[int], object]
) -> None:
    run = _compiled_chunk() if find_spec("numba") else _interpreted_chunk

    def one(start: int) -> int:
        chunk = slice(start, start + _CHUNK)
        run(rows[chunk], found[chunk])
        return len(rows[chunk])

    with ThreadPoolExecutor(cores) as pool:  # the compiled kernel holds no lock
        for count in pool.map(one, range(0, len(rows), _CHUNK)):
            progress(count)


def _compiled_chunk() -> Callable[[NDArray[np.float64], NDArray[np.float64]], None]:
    from device.physics.compiled import compiled  # noqa: PLC0415 - the compiler waits until a batch is asked for

    _, many = compiled()
    return lambda rows, found: many(rows, np.empty(STATE_SIZE), np.empty(WORK_SIZE), found)


def _interpreted_chunk(rows: NDArray[np.float64], found: NDArray[np.float64]) -> None:
    for n, row in enumerate(rows.tolist()):
        found[n] = interpret(row)
