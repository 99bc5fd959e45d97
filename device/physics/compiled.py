"""The kernel in machine code. The one module that knows the compiler (extra `fast`).

The first use compiles for half a minute and keeps the result beside this file, or in the user's cache; later
processes load it in about a second. No session calls this.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import lru_cache
from types import CodeType, FunctionType
from typing import Any, cast

import numba
import numpy as np
from numpy.typing import NDArray

from device.physics.kernel import KERNEL, RESULT_SIZE, STATE_SIZE, WORK_SIZE
from device.physics.shot import shoot

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
