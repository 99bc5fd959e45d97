"""Shots in machine code (extra `fast`), many at once or one.

The first use compiles for half a minute and keeps the result beside this file, or in the user's cache; later
processes load it in about a second. No session calls this.
"""

from __future__ import annotations

import hashlib
import pickle
import struct
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from functools import lru_cache, partial
from importlib.util import find_spec
from operator import attrgetter
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, cast, get_type_hints

import numpy as np
from numpy.typing import ArrayLike, NDArray

from device.messages import RecoilError, said_by
from device.parameters import ABOVE_ZERO, GunParameters
from device.physics.equations import (
    CLOSED_FORM,
    FULL,
    INVALID,
    NO_INDUCTANCE,
    ORDER,
    STATUSES,
    Constants,
    ShotResult,
    ShotState,
    StepSeries,
    model_number,
    pack,
)
from device.physics.polynomial import write_out
from device.physics.shot import ShotSummary, interpret, simulate, summary_from

Records = NDArray[Any]
"""Arrays whose fields are those of `Constants`, or of `ShotResult`."""

_KINDS: dict[object, tuple[Any, ...]] = {float: ("f8",), int: ("i8",), bool: ("?",), list[float]: ("f8", (ORDER + 1,))}


def array_kind(kind: type) -> np.dtype[Any]:
    """What machine code has in place of objects of a class of numbers, with the same names."""
    return np.dtype([(name, *_KINDS[hint]) for name, hint in get_type_hints(kind).items()], align=True)


_GUN, _STATE, _SERIES, _RESULT = map(array_kind, (Constants, ShotState, StepSeries, ShotResult))
_LETTERS = {float: "d", int: "q", bool: "?"}
_GUN_BYTES, _RESULT_BYTES = (
    struct.Struct("@" + "".join(_LETTERS[hint] for hint in get_type_hints(kind).values()))
    for kind in (Constants, ShotResult)
)


Functions = dict[FunctionType, Mapping[str, FunctionType]]
"""Functions, each after those that it calls; with these by the names that it calls them."""


def _callees_first(function: FunctionType) -> Functions:
    """A function and all that it needs, as written in its code."""
    write_out(function)
    names = function.__code__.co_names
    called = {name: other for name in names if isinstance(other := function.__globals__.get(name), FunctionType)}
    found: Functions = {}
    for other in called.values():
        found = _callees_first(other) | found
    return found | {function: called}


_ONCE = frozenset(["shoot", "shoot_on", "advance", "coil_step"])
"""Each called in one place, and holding nearly all code: copied in before machine code is made of them, which else is
made, and made fast, of all that code at each of these levels: half of the compiler's time."""
_SELDOM = frozenset(
    [
        "after_event",
        "begin",
        "bernstein_over",
        "conclude",
        "enter_lane",
        "expand_creeping",
        "falling_crossing",
        "falling_roots",
        "expand_slaved",
        "first_crossing",
        "first_crossings",
        "free_arc",
        "goes_on",
        "halve",
        "newton_root",
        "newton_roots",
        "note_end",
        "pass_of_both",
        "pass_of_current",
        "peak_force",
        "powered_arc",
        "rest",
        "roots_of",
        "shoot_side_by_side",
        "slip",
        "slip_on",
        "to_coil",
    ]
)
"""Called seldom or from many places, and long: the compiler may leave them where they are."""


MachineCode = Callable[..., None]
"""`device.physics.lanes.shoot_each` of (guns, results, those to be shot alone, *room)."""


def no_compiler() -> str:
    """Why shots cannot be compiled, and what to do; empty if they can."""
    if find_spec("numba") is None:
        return 'numba is not installed: install "recoil[fast]"'
    try:
        import numba  # noqa: F401, PLC0415 - what is installed may be broken, of another Python, or lack a library
    except Exception as error:  # noqa: BLE001 - whatever a broken library raises
        return f'numba cannot be loaded ({said_by(error)}): install "recoil[fast]" anew'
    return ""


def compiler_note(
    interpreted: str = "about a millisecond a shot; compiled it takes microseconds", made_in: str = "half a minute"
) -> str:
    """What to say before many shots: how they are worked out, and how long it takes until they are compiled."""
    if why := no_compiler():
        return f"note: interpreted, {interpreted}, and {why}"
    return f"note: compiled, which takes about {made_in} the first time on a machine and a second or two later on"


def machine_code() -> MachineCode:
    """The shots of many guns in machine code. `RecoilError`: there is no compiler."""
    from device.physics.lanes import shoot_each  # noqa: PLC0415 - it is for the compiler

    code = compiled(cast("FunctionType", shoot_each))
    call(code, np.empty(0, _GUN), np.empty(0, _RESULT), np.empty(0, np.bool_), *_room())
    return code


def call(code: MachineCode, *arguments: Any) -> None:
    """A call of machine code, which may be the first: it is taken from the compiler's cache, or made and put there.

    No cache stands in the way: what is damaged in it (a computer that lost its power) is deleted and made anew, and
    what does not go into it (a full disk) is made anew by the next process.
    """
    try:
        code(*arguments)
    except OSError:  # it is made, and only not kept
        code(*arguments)
    except (pickle.PickleError, EOFError, ValueError, TypeError, AttributeError, ImportError, LookupError):
        stats, name = code.stats, code.__qualname__  # type: ignore[attr-defined] # what the compiler adds
        kept = [*Path(stats.cache_path).glob(f"*.{name}-*")]
        if not kept:
            raise
        for path in kept:
            path.unlink(missing_ok=True)
        code(*arguments)


@lru_cache(maxsize=4)
def compiled(each: FunctionType) -> MachineCode:
    """A function of arrays of records, with all that it calls, in machine code. `RecoilError`: there is no compiler."""
    if why := no_compiler():
        raise RecoilError(f"compiled shots need numba; {why}")
    import numba  # noqa: PLC0415 - the compiler waits until it is asked for

    functions = _callees_first(each)
    twins: dict[FunctionType, Any] = {}
    for function, called in functions.items():
        entry = function is each
        space = function.__globals__ | {name: twins[one] for name, one in called.items()}
        twin = FunctionType(function.__code__, space)
        twin.__qualname__ = f"{function.__name__}_{_digest(functions)}"  # the compiler's cache goes by it
        # what is called is copied in: half the time, since a call counts the references to each array
        seldom = entry or function.__name__ in _SELDOM
        how: dict[str, Any] = {"inline": "always"} if function.__name__ in _ONCE else {"forceinline": not seldom}
        how |= {"no_cpython_wrapper": not entry, "no_cfunc_wrapper": not entry}  # nobody else calls them
        twins[function] = numba.njit(error_model="numpy", cache=entry, nogil=entry, **how)(twin)
    return twins[each]  # type: ignore[no-any-return]


def _digest(functions: Functions) -> str:
    """Of what the functions do, and of what they name: the compiler's own cache looks at one file only."""
    parts = [_text(function.__code__) for function in (*functions, cast("FunctionType", compiled.__wrapped__))]
    for function in functions:
        values = (function.__globals__.get(name) for name in function.__code__.co_names)
        parts += [repr(value) for value in values if isinstance(value, int | float | tuple | np.dtype)]
    parts += [repr(_GUN), repr(_RESULT), Path(__file__).with_name("vectors.py").read_text(encoding="utf-8")]
    return hashlib.sha256("".join(parts).encode()).hexdigest()[:16]


def _text(code: CodeType) -> str:
    """What a piece of code does. Code within it by the same text: its own text would be its address."""
    constants = [_text(one) if isinstance(one, CodeType) else repr(one) for one in code.co_consts]
    return f"{code.co_code.hex()}{constants}{code.co_names}"


_SUMMARY = len(fields(ShotSummary))  # so many of a result's numbers stand in a summary, in its order
_PART = 4096  # shots between two words of progress
_FIELDS = dict(zip((one.name for one in fields(GunParameters)), Constants._fields, strict=False))
_OPTIONS = {"drive_off": ("shorted", "open"), "emf": ("printed", "reciprocal")}  # false and true among the constants
_result_values = attrgetter(*(one.name for one in fields(ShotResult)))
_NOTHING = np.array(_result_values(ShotResult(status=INVALID)), _RESULT)


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

    def summaries(self) -> list[ShotSummary]:
        """The shots one by one; none may be invalid."""
        columns = (getattr(self, name).tolist() for name in self.__slots__)
        return [summary_from(row) for row in zip(*columns, strict=True)]


def simulate_batch(
    gun: GunParameters | None = None,
    *,
    fidelity: str = "full",
    cores: int | None = None,
    progress: Callable[[int], object] | None = None,
    interpreted: bool = False,
    **arrays: ArrayLike,
) -> ShotBatch:
    """The shots of `gun` with the parameters in `arrays` in place of its own, broadcast against each other.

    Compiled where numba can be loaded, unless `interpreted` is asked for, which ends sooner for a few hundred shots.
    `progress` is called after every few thousand shots with their number. `ValueError`: no such parameter or fidelity.
    Numbers that physics has not make their shot `invalid` and no other one.

    >>> simulate_batch(friction_N=[0.21, -1.0, 1.70]).names().tolist()
    ['home', 'invalid', 'stuck']
    """
    gun, model, columns = gun or GunParameters(), model_number(fidelity), _columns(arrays)
    count = next((column.size for column in columns.values()), 1)
    interprets = interpreted or bool(no_compiler())
    shoot = _interpret_each if interprets else partial(_shoot_compiled, machine_code())
    numbers = {name: np.empty(count) for name in ShotBatch.__slots__[1:]}
    found = ShotBatch(status=np.empty(count, np.int8), **numbers)

    def shoot_part(start: int) -> int:
        part = slice(start, min(start + _PART, count))
        guns, valid = _guns(gun, model, {name: column[part] for name, column in columns.items()}, part.stop - start)
        results = _results(shoot, guns, valid)
        for name in ShotBatch.__slots__:
            getattr(found, name)[part] = results[name]
        return len(guns)

    with ThreadPoolExecutor(cores) as pool:  # the compiled code holds no lock
        one_by_one = cores == 1 or count <= _PART  # a thread has nothing of the numbers in its core's own memory
        for shots in (map if one_by_one else pool.map)(shoot_part, range(0, count, _PART)):
            if progress is not None:
                progress(shots)
    return found


@lru_cache(maxsize=1)
def simulator() -> Callable[..., ShotSummary]:
    """`simulate`, in machine code where there is a compiler; for one thread."""
    return simulate if no_compiler() else compiled_simulator()


def compiled_simulator() -> Callable[..., ShotSummary]:
    """`simulate` in machine code: microseconds a shot, once the compiler has had its half a minute or its second.

    It holds room for one shot, so each thread needs one of its own. `RecoilError`: there is no compiler.
    """
    shoot_each, gun, result = machine_code(), bytearray(_GUN.itemsize), bytearray(_RESULT.itemsize)
    guns, results = np.frombuffer(gun, _GUN), np.frombuffer(result, _RESULT)
    alone, room = np.ones(1, dtype=np.bool_), _room()

    def simulate(parameters: GunParameters, fidelity: str = "full") -> ShotSummary:
        """As `device.physics.simulate`."""
        _GUN_BYTES.pack_into(gun, 0, *pack(parameters, model_number(fidelity)))
        shoot_each(guns, results, alone, *room)
        return summary_from(_RESULT_BYTES.unpack_from(result)[:_SUMMARY])

    return simulate


def _columns(arrays: Mapping[str, ArrayLike]) -> dict[str, NDArray[Any]]:
    """The parameters in `arrays`, all of one length."""
    unknown = sorted(set(arrays) - set(_FIELDS))
    if unknown:
        raise ValueError(f"no such parameter: {', '.join(unknown)}; known are {', '.join(_FIELDS)}")
    return dict(zip(arrays, map(np.ravel, np.broadcast_arrays(*map(np.asarray, arrays.values()))), strict=True))


def _guns(
    gun: GunParameters, model: int, columns: Mapping[str, NDArray[Any]], count: int
) -> tuple[Records, NDArray[np.bool_]]:
    """The constants of each gun, and which of them are guns."""
    guns = np.repeat(np.array([tuple(pack(gun))], _GUN), count)
    valid = np.ones(count, dtype=np.bool_)
    for name, column in columns.items():
        valid &= _is_allowed(name, column)
        guns[_FIELDS[name]] = column == _OPTIONS[name][1] if name in _OPTIONS else column.astype(np.float64)
    if gun.return_friction_N is None and "return_friction_N" not in columns:
        guns["friction_back"] = guns["friction_out"]
    _reduce(guns, model)
    return guns, valid


def _is_allowed(name: str, column: NDArray[Any]) -> NDArray[np.bool_]:
    """The rule of `GunParameters`, for many values."""
    if name in _OPTIONS:
        return np.isin(column, _OPTIONS[name])
    above = column > 0 if name in ABOVE_ZERO else column >= 0
    return np.asarray(np.isfinite(column) & above)


def _reduce(guns: Records, model: int) -> None:
    """What a reduced model leaves out of the constants, as `pack` does."""
    guns["model"] = model
    if model in (NO_INDUCTANCE, CLOSED_FORM):
        guns["inductance"] = 0.0
    if model == CLOSED_FORM:
        guns["back_emf"], guns["opens"] = 0.0, True


def _results(shoot: Callable[[Records, Records], None], guns: Records, valid: NDArray[np.bool_]) -> Records:
    """The results of these guns' shots; nothing, where there is no gun."""
    results = np.full(len(guns), _NOTHING)
    if valid.all():
        shoot(guns, results)
    else:
        among = results[valid]
        shoot(guns[valid], among)
        results[valid] = among
    return results


def _shoot_compiled(code: MachineCode, guns: Records, results: Records) -> None:
    code(guns, results, (guns["model"] != FULL) | (guns["inductance"] == 0.0), *_room())


def _room() -> tuple[NDArray[np.float64], Records, Records]:
    """The lanes' rows, at a whole multiple of a register's bytes, a state for each lane, and series for one shot."""
    from device.physics.lanes import LANE_ROWS  # noqa: PLC0415 - it is for the compiler
    from device.physics.vectors import LANES  # noqa: PLC0415 - so is it

    numbers = np.zeros((LANE_ROWS + 1) * LANES)
    start = -numbers.ctypes.data // numbers.itemsize % LANES
    rows = numbers[start : start + LANE_ROWS * LANES].reshape(LANE_ROWS, LANES)
    return rows, np.empty(LANES, _STATE), np.empty(1, _SERIES)


def _interpret_each(guns: Records, results: Records) -> None:
    for n, constants in enumerate(guns.tolist()):
        results[n] = _result_values(interpret(Constants(*constants)))
