"""Error and time of each way to a shot, in runs that take turns, so that what slows the machine slows all alike."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from itertools import repeat
from typing import Any

from device.parameters import DriveOff
from tests.benchmarks.ours import Contender, Ready, one_at_a_time
from tests.benchmarks.problem import Shots, errors

_LEAST_S = 0.02  # a measured stretch is at least as long; the clock's grain is far below
_GIVES_UP = (ArithmeticError, AttributeError, ImportError, LookupError, RuntimeError, TypeError, ValueError)
"""What peers raise when they get nowhere, or have changed since: a row says so and the others go on."""

HOW_TO_GET = {"recoil": "", "numba": "uv pip install --python .venv numba (the extra `fast`)"}
OTHERWISE = "uv pip install --python .venv --group peers"


@dataclass(slots=True, kw_only=True)
class Row:
    """One way at one setting with the coil in one off-state: `measured`, `not installed` or `failed`."""

    drive_off: DriveOff
    family: str
    setting: str
    models: str
    status: str = "measured"
    note: str = ""
    error: float | None = None
    errors: dict[str, float] = field(default_factory=dict)
    us_per_shot: float | None = None
    us_low: float | None = None
    us_high: float | None = None
    times_ours: float | None = None
    first_call_s: float | None = None

    def as_json(self) -> dict[str, Any]:
        """Plain values."""
        return {name: getattr(self, name) for name in self.__slots__}


@dataclass(slots=True, kw_only=True)
class _Runner:
    row: Row
    ready: Ready
    calls: int
    us: list[float] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)


def measure(contenders: Sequence[Contender], shots: Shots, repeats: int, clock: Ready | None = None) -> list[Row]:
    """A row each, in their order. `clock` is ours that they are set against; one shot at a time if none is given."""
    rows, runners = [], []
    for contender in contenders:
        row, runner = _prepared(contender, shots)
        rows.append(row)
        runners += [runner] if runner else []
    clock = clock or one_at_a_time(shots)
    calls = _calls(clock)
    for _ in range(repeats):
        for runner in runners:
            ours = _us(clock, calls)
            runner.us.append(_us(runner.ready, runner.calls))
            runner.ratios.append(runner.us[-1] / ours)
    for runner in runners:
        _conclude(runner)
    return rows


def _prepared(contender: Contender, shots: Shots) -> tuple[Row, _Runner | None]:
    row = Row(drive_off=shots.drive_off, family=contender.family, setting=contender.setting, models=contender.models)
    if contender.package != "recoil" and find_spec(contender.package) is None:
        row.status, row.note = "not installed", HOW_TO_GET.get(contender.package, OTHERWISE)
        return row, None
    start = time.perf_counter()
    try:
        ready = contender.prepare(shots)
        found = ready.found()
        row.first_call_s = time.perf_counter() - start
        row.errors = errors(found, shots.exact)
        row.error = max(row.errors.values())
        if math.isinf(row.error):
            row.status, row.note, row.error, row.errors = "failed", "an output is not a number", None, {}
            return row, None
        return row, _Runner(row=row, ready=ready, calls=_calls(ready))
    except _GIVES_UP as error:
        if not contender.is_peer:
            raise
        row.status, row.note = "failed", f"{type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
        return row, None


def _calls(ready: Ready) -> int:
    """How often to call for a stretch that the clock resolves."""
    ready.run()
    start = time.perf_counter()
    ready.run()
    return max(1, math.ceil(_LEAST_S / max(time.perf_counter() - start, 1e-7)))


def _us(ready: Ready, calls: int) -> float:
    run = ready.run
    start = time.perf_counter()
    for _ in repeat(None, calls):
        run()
    return 1e6 * (time.perf_counter() - start) / (calls * ready.shots)


def _conclude(runner: _Runner) -> None:
    row = runner.row
    row.us_per_shot, row.times_ours = statistics.median(runner.us), statistics.median(runner.ratios)
    row.us_low, row.us_high = min(runner.us), max(runner.us)
