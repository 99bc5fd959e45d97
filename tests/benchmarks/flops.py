"""How many floating point operations a shot takes, and how fast this machine can do them: the bound of any program.

The interpreted kernel runs on floats that count. Additions, subtractions, multiplications and divisions count one
each; the few elementary functions a shot, comparisons and signs count nothing.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from device.parameters import GunParameters
from device.physics.equations import Constants, model_number, pack
from device.physics.shot import interpret

_KINDS = {"add": "additions", "sub": "additions", "mul": "multiplications", "truediv": "divisions"}

_RATE_PROGRAM = """
import time
import numpy as np
n = 768
a, b = np.full((n, n), 0.5), np.full((n, n), 0.25)
a @ b
best = np.inf
for _ in range(8):
    start = time.perf_counter()
    a @ b
    best = min(best, time.perf_counter() - start)
print(2.0 * n**3 / best)
"""
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def operations(asked: Sequence[GunParameters], fidelity: str = "full") -> dict[str, float]:
    """By kind, the operations of one shot: the mean of these guns."""
    number, tally = counting_floats()
    for gun in asked:
        constants = pack(gun, model_number(fidelity))
        interpret(Constants(*(number(value) if type(value) is float else value for value in constants)))
    return {kind: tally[kind] / len(asked) for kind in dict.fromkeys(_KINDS.values())}


def counting_floats() -> tuple[type[float], Counter[str]]:
    """A kind of float whose arithmetic gives its own kind, and the tally it keeps."""
    tally: Counter[str] = Counter()
    space: dict[str, Any] = {"__slots__": ()}
    for name, kind in _KINDS.items():
        for method in (f"__{name}__", f"__r{name}__"):
            space[method] = _counted(getattr(float, method), kind, tally, lambda: number)
    for method in ("__neg__", "__abs__", "__pos__"):
        space[method] = _kept(getattr(float, method), lambda: number)
    number: type[float] = type("CountingFloat", (float,), space)
    return number, tally


def _counted(plain: Callable[..., Any], kind: str, tally: Counter[str], number: Callable[[], type[float]]) -> Any:
    def operate(self: float, other: object) -> Any:
        result = plain(self, other)
        if result is NotImplemented:
            return result
        tally[kind] += 1
        return number()(result)

    return operate


def _kept(plain: Callable[[float], float], number: Callable[[], type[float]]) -> Any:
    return lambda self: number()(plain(self))


def flop_rate() -> float:
    """Operations a second of one core: a product of matrices in numpy's BLAS on one thread, the best of eight."""
    told = subprocess.run(
        [sys.executable, "-c", _RATE_PROGRAM],
        env=os.environ | dict.fromkeys(_ONE_THREAD, "1"),
        capture_output=True,
        text=True,
        check=True,
    )
    return float(told.stdout)
