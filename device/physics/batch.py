"""The kernel in machine code. The one module that knows the compiler (extra `fast`).

The first use compiles for half a minute and keeps the result beside this file, or in the user's cache; later
processes load it in about a second. No session calls this.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from functools import lru_cache
from importlib.util import find_spec
from types import CodeType, FunctionType
from typing import Any, cast

import numba
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
    KERNEL,
    MODEL,
    NO_INDUCTANCE,
    OPEN,
    RESULT_SIZE,
    STATE_SIZE,
    STATUSES,
    WORK_SIZE,
    pack,
)
from device.physics.shot import shoot
from device.physics.summary import interpret, model_of, use

Rows = NDArray[np.float64]


def _many(rows: Rows, state: Rows, work: Rows, found: Rows) -> None:
    """The results of each row of parameters."""
    for n in range(len(rows)):
        shoot(rows[n], state, work, found[n])


@lru_cache(maxsize=1)
def compiled() -> tuple[Callable[..., None], Callable[..., None]]:
    """`shoot` for one shot, and for rows of them."""
    digest = _digest()
    twins: dict[str, Any] = {}
    spaces: list[dict[str, Any]] = []
    for name, function in (*KERNEL.items(), ("_many", _many)):
        twin, space = _twin(function, f"{name}_{digest}")
        entry = name in ("shoot", "_many")
        # all that is called is copied in: half the time, since a call counts the references to each row;
        # a single shot keeps Python's lock, as all of them share one desk
        twins[name] = numba.njit(error_model="numpy", cache=entry, nogil=name == "_many", forceinline=not entry)(twin)
        spaces.append(space)
    for space in spaces:
        space.update({name: twin for name, twin in twins.items() if name in space})
    return twins["shoot"], twins["_many"]


def _twin(function: Callable[..., object], name: str) -> tuple[FunctionType, dict[str, Any]]:
    """A copy of the function with a name and globals of its own."""
    plain = cast("FunctionType", function)
    space = dict(plain.__globals__)
    twin = FunctionType(plain.__code__, space)
    twin.__qualname__ = name  # the compiler's cache goes by it
    return twin, space


def _digest() -> str:
    """Of the kernel's code and of how it is compiled: the compiler's own cache looks at one file only."""
    codes = (cast("FunctionType", function).__code__ for function in (*KERNEL.values(), compiled.__wrapped__))
    text = "".join(map(_told, codes))
    sizes = f"{RESULT_SIZE} {STATE_SIZE} {WORK_SIZE}"
    return hashlib.sha256((text + sizes).encode()).hexdigest()[:16]


def _told(code: CodeType) -> str:
    """What a piece of code does, as text. Code within it by the same text: as a constant it is told by its address."""
    constants = [_told(one) if isinstance(one, CodeType) else repr(one) for one in code.co_consts]
    return f"{code.co_code.hex()}{constants}{code.co_names}"


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
    from device.physics.batch import compiled  # noqa: PLC0415 - only here is the compiler wanted

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
    from device.physics.batch import compiled  # noqa: PLC0415 - the compiler waits until a batch is asked for

    _, many = compiled()
    return lambda rows, found: many(rows, np.empty(STATE_SIZE), np.empty(WORK_SIZE), found)


def _interpreted_chunk(rows: NDArray[np.float64], found: NDArray[np.float64]) -> None:
    for n, row in enumerate(rows.tolist()):
        found[n] = interpret(row)
