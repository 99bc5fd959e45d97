"""`recoil simulate --vary`: shots over a full factorial of parameters, into a table, block by block.

The last parameter named varies fastest. A block is in memory at a time, so a table may be longer than the memory.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.predict.simulate.shot import KINDS
from analysis.predict.simulate.sweep_table import check_place, opened
from analysis.report.terminal import Progress
from device.parameters import GunParameters
from device.physics import FIDELITIES, ShotBatch, simulate_batch
from device.physics.kernel import STATUSES
from experiments.load import ConfigError
from experiments.record.provenance import provenance

MOST_ROWS = 10_000_000
"""Of a table, unless --yes; and of values of one parameter."""
_BLOCK = 65_536  # shots between two words of progress, compiled
_SLOW_BLOCK = 256  # and interpreted, at about a millisecond a shot
_FORMS = "FROM:TO:COUNT, log:FROM:TO:COUNT or A,B,C"


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """One parameter's values, and the words that asked for them."""

    key: str
    words: str
    values: NDArray[Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """A table as it was asked for. `instead` are options that belong to a single shot, `changes` those of --set."""

    gun: GunParameters
    fidelity: str
    vary: Sequence[str]
    changes: Sequence[str]
    table: Path | None
    instead: Sequence[str] = ()
    yes: bool = False


def sweep(asked: Asked, progress: Progress) -> dict[str, Any]:
    """Shoots all of it and writes the table; what it holds. `ConfigError`: what is asked for makes no table."""
    if not asked.vary or asked.table is None:
        raise ConfigError("--vary and --table go together: --vary KEY=FROM:TO:COUNT --table FILE.parquet")
    axes = _axes(asked)
    path, rows = asked.table, math.prod(len(axis.values) for axis in axes)
    _is_sensible(asked, rows)
    check_place(path)
    facts = _facts(asked, axes, rows)
    counts = np.zeros(len(STATUSES), dtype=np.int64)
    with opened(path, {axis.key: KINDS[axis.key] for axis in axes}, facts) as write:
        for arrays, shots in _shoot(asked, axes, rows, progress):
            write(arrays, shots)
            counts += np.bincount(shots.status, minlength=len(STATUSES))
    statuses = {name: int(count) for name, count in zip(STATUSES, counts, strict=True) if count}
    return {"table": str(path), "statuses": statuses} | facts


def _shoot(
    asked: Asked, axes: Sequence[Axis], rows: int, progress: Progress
) -> Iterator[tuple[dict[str, NDArray[Any]], ShotBatch]]:
    """Block by block: the parameters that vary, and the shots."""
    block = _BLOCK if find_spec("numba") else _SLOW_BLOCK
    shape = tuple(len(axis.values) for axis in axes)
    with progress("shots", math.ceil(rows / block)) as done:
        for start in range(0, rows, block):
            end = min(start + block, rows)
            places = np.unravel_index(np.arange(start, end), shape)
            arrays: dict[str, Any] = {axis.key: axis.values[place] for axis, place in zip(axes, places, strict=True)}
            yield arrays, simulate_batch(asked.gun, fidelity=asked.fidelity, **arrays)
            done(f"{end:,} of {rows:,}")


def interpreted_note() -> str | None:
    """What to say where batches are slow."""
    if find_spec("numba"):
        return None
    return 'note: interpreted, about a millisecond a shot; install "recoil[fast]" for microseconds'


def as_text(found: dict[str, Any]) -> str:
    """The table for a person."""
    statuses = ", ".join(f"{name} {count:,}" for name, count in found["statuses"].items())
    varied = "; ".join(f"{key} {words}" for key, words in found["vary"].items())
    return f"Table: {found['table']}, {found['rows']:,} shots ({statuses})\n  varied: {varied}"


def _facts(asked: Asked, axes: Sequence[Axis], rows: int) -> dict[str, Any]:
    """Where the table comes from: it can be made again from this."""
    return {
        "rows": rows,
        "fidelity": asked.fidelity,
        "vary": {axis.key: axis.words for axis in axes},
        "parameters": {key: value for key, value in asdict(asked.gun).items() if key not in {a.key for a in axes}},
        "provenance": provenance(),
    }


def _is_sensible(asked: Asked, rows: int) -> None:
    if asked.instead:
        raise ConfigError(
            f"--vary makes a table of shots; {', '.join(asked.instead)} tells of a single one: drop either"
        )
    if asked.fidelity not in FIDELITIES:
        raise ConfigError(f"--fidelity {asked.fidelity}: must be one of {', '.join(FIDELITIES)}")
    if rows > MOST_ROWS and not asked.yes:
        raise ConfigError(f"--vary asks for {rows:,} shots; more than {MOST_ROWS:,} need --yes")


def _axes(asked: Asked) -> list[Axis]:
    axes = [axis_of(words, asked.gun) for words in asked.vary]
    keys = [axis.key for axis in axes] + [change.partition("=")[0] for change in asked.changes]
    twice = sorted({key for key in keys[: len(axes)] if keys.count(key) > 1})
    if twice:
        raise ConfigError(f"--vary {twice[0]}: is set or varied twice; name it once")
    return axes


def axis_of(words: str, gun: GunParameters) -> Axis:
    """The values that KEY=FROM:TO:COUNT, KEY=log:FROM:TO:COUNT or KEY=A,B,C asks for. `ConfigError`: none do.

    >>> axis_of("friction_N=0.25:0.75:3", GunParameters()).values.tolist()
    [0.25, 0.5, 0.75]
    """
    key, equals, text = words.partition("=")
    if not equals or key not in KINDS:
        raise ConfigError(f"--vary {words}: must be KEY={_FORMS} with a key of {', '.join(KINDS)}")
    values = _range(words, text) if ":" in text else _list(words, text, KINDS[key])
    for value in values.tolist() if KINDS[key] is str else (values.min().item(), values.max().item()):
        try:
            replace(gun, **{key: value})
        except ValueError as error:
            raise ConfigError(f"--vary {words}: {error}") from error
    return Axis(key=key, words=text, values=values)


def _list(words: str, text: str, kind: type[float] | type[str]) -> NDArray[Any]:
    try:
        values = [kind(one.strip()) for one in text.split(",")]
    except ValueError as error:
        raise ConfigError(f"--vary {words}: must be KEY={_FORMS}; {error}") from error
    if len(set(values)) < len(values):
        raise ConfigError(f"--vary {words}: a value stands there twice")
    return np.array(values)


def _range(words: str, text: str) -> NDArray[np.float64]:
    log = text.startswith("log:")
    try:
        first, last, number = text.removeprefix("log:").split(":")
        low, high, count = float(first), float(last), int(number)
    except ValueError as error:
        raise ConfigError(f"--vary {words}: must be KEY={_FORMS}, the count a whole number") from error
    if not 2 <= count <= MOST_ROWS:
        raise ConfigError(f"--vary {words}: COUNT is {count}; it must be 2 to {MOST_ROWS:,}")
    if not (math.isfinite(low) and math.isfinite(high) and low != high):
        raise ConfigError(f"--vary {words}: FROM and TO must be finite and differ")
    if log and not (low > 0 and high > 0):
        raise ConfigError(f"--vary {words}: a logarithmic range has only numbers above 0")
    return np.geomspace(low, high, count) if log else np.linspace(low, high, count)
