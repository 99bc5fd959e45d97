"""Shots over a full factorial, written block by block as a table.

Numbers that were not reached are missing, statuses are words, units end the names. Where the table comes from stands
in the Parquet file's metadata under the key `recoil`, or beside FILE.csv in FILE.csv.json.

The last parameter named varies fastest. A block is in memory at a time, so a table may be longer than the memory.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import NDArray

from analysis.predict.simulate.request import SimulateRequest
from analysis.predict.simulate.scene import ScenePick, picked, scene_section
from analysis.predict.simulate.shot import PARAMETER_KINDS, check_own, header_of, place_of_origin
from analysis.report.section import Section
from analysis.report.serial import OPTIONAL, as_json
from analysis.report.terminal import Progress, takes_about
from device.parameters import GunParameters
from device.physics import FIDELITIES, ShotBatch, simulate_batch
from device.physics.batch import compiler_note, no_compiler
from device.physics.equations import STATUSES
from experiments.config.door import ConfigError
from experiments.record import storage
from experiments.record.provenance import provenance

Write = Callable[[Mapping[str, NDArray[Any]], ShotBatch], None]
"""Takes the parameters that vary, and their shots."""

NUMBERS = ShotBatch.__slots__[1:]
"""The columns after the parameters and the status."""
_GROUP = 65_536  # rows of a row group
_WORD = pa.dictionary(pa.int8(), pa.string())


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepOrigin:
    """Where a table of shots comes from: it can be made again from this. `vary`: the words that asked for each axis."""

    rows: int
    fidelity: str
    vary: dict[str, str]
    parameters: dict[str, float | str | None]
    provenance: dict[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep(SweepOrigin):
    """A table of shots that was written, and how many of them ended how."""

    table: str
    statuses: Mapping[str, int]
    scene: ScenePick | None = field(default=None, metadata=OPTIONAL)


def check_place(path: Path) -> None:
    """`ConfigError` for a name that says neither Parquet nor CSV, or that a folder or something else's table has."""
    if path.suffix not in (".parquet", ".csv"):
        raise ConfigError(f"--table {path}: must end with .parquet or .csv")
    if path.is_dir():
        raise ConfigError(f"--table {path}: is a folder; name a file")
    check_own("--table", path, _is_own)
    if path.suffix == ".csv":
        place_of_origin("--table", path)


def _is_own(path: Path) -> bool:
    """Whether a file is a table of shots, whatever was varied."""
    if path.suffix == ".csv":
        return header_of(path).endswith(",".join(("status", *NUMBERS)))
    try:
        return b"recoil" in (pyarrow.parquet.read_schema(path).metadata or {})
    except pa.ArrowInvalid:
        return False


@contextmanager
def opened(path: Path, keys: Mapping[str, type], origin: SweepOrigin) -> Iterator[Write]:
    """A table to write to. It is in its place when this ends; if this is left by an error, nothing is."""
    columns = [pa.field(key, _WORD if kind is str else pa.float64()) for key, kind in keys.items()]
    columns += [pa.field("status", _WORD), *(pa.field(name, pa.float64()) for name in NUMBERS)]
    about = as_json(origin).rstrip()
    is_csv = path.suffix == ".csv"
    with _whole(path) as stream:
        schema = pa.schema(columns, metadata={"recoil": about})
        with _csv(stream, schema) if is_csv else _parquet(stream, schema) as write:
            groups = _Groups(schema, write)
            yield groups.add
            groups.flush()
    if is_csv:
        storage.write_whole(place_of_origin("--table", path), about + b"\n")


class _Groups:
    """Gathers blocks until they make a row group."""

    def __init__(self, schema: Any, write: Callable[[Any], None]) -> None:
        self._schema, self._write = schema, write
        self._held: list[Any] = []

    def add(self, arrays: Mapping[str, NDArray[Any]], shots: ShotBatch) -> None:
        """One block."""
        columns = [_words(values) if values.dtype.kind == "U" else pa.array(values) for values in arrays.values()]
        columns.append(pa.DictionaryArray.from_arrays(pa.array(shots.status), list(STATUSES)))
        columns += [pa.array(getattr(shots, name), from_pandas=True) for name in NUMBERS]  # NaN is missing
        self._held.append(pa.table(columns, schema=self._schema))
        if sum(map(len, self._held)) >= _GROUP:
            self.flush()

    def flush(self) -> None:
        """What is held, written."""
        if self._held:
            self._write(pa.concat_tables(self._held))
        self._held = []


def _words(values: NDArray[Any]) -> Any:
    names, places = np.unique(values, return_inverse=True)
    return pa.DictionaryArray.from_arrays(places.astype(np.int8), names.tolist())


@contextmanager
def _parquet(stream: IO[bytes], schema: Any) -> Iterator[Callable[[Any], None]]:
    with pyarrow.parquet.ParquetWriter(stream, schema) as writer:
        yield writer.write_table


@contextmanager
def _csv(stream: IO[bytes], schema: Any) -> Iterator[Callable[[Any], None]]:
    stream.write(",".join(schema.names).encode() + b"\r\n")
    options = pyarrow.csv.WriteOptions(include_header=False, quoting_style="none")

    def write(table: Any) -> None:
        lines = pa.BufferOutputStream()
        pyarrow.csv.write_csv(table, lines, options)
        stream.write(lines.getvalue().to_pybytes().replace(b"\n", b"\r\n"))

    yield write


@contextmanager
def _whole(path: Path) -> Iterator[IO[bytes]]:
    """A file under another name, synced and renamed at the end."""
    storage.make_folder(path.parent)
    part = path.with_name(f".{path.name}.part")
    try:
        part.unlink(missing_ok=True)
        with os.fdopen(storage.create(part), "wb") as stream:
            yield stream
            stream.flush()
            storage.sync(stream.fileno())
        part.replace(path)
    except BaseException as error:
        if isinstance(error, OSError):
            error.filename, error.filename2 = str(path), None  # nobody knows the other name
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise
    storage.sync_folder(path.parent)


MOST_ROWS = 10_000_000
"""Of a table, unless --yes; and of values of one parameter."""
FEW_SHOTS = 500
"""So many shots are interpreted, at about a millisecond each: the compiler's code takes longer to load, and half a
minute to make. Which it is goes by their number and the guns' alone, so the same command writes the same bytes."""
FEW_FAR_SHOTS = 20
"""The same of guns far from the paper's, of which one may take a second."""
_INTERPRETED_S, _COMPILED_S = 1e-3, 7e-6  # of a shot and its row
_FAR = 30.0  # times one of the paper's numbers, or a part of it
_BLOCK = 65_536  # shots between two words of progress, compiled
_SLOW_BLOCK = 64  # and interpreted
_FORMS = "FROM:TO:COUNT, log:FROM:TO:COUNT or A,B,C"


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepAxis:
    """One parameter's values, and the words that asked for them."""

    key: str
    words: str
    values: NDArray[Any]


def sweep(request: SimulateRequest, gun: GunParameters, progress: Progress, tell: Callable[[str], None]) -> Sweep:
    """Shoots all of it and writes the table; what it holds. `ConfigError`: what is asked for makes no table."""
    of_scene = [axis_of(words, gun) for words in request.vary] if request.model.is_of_scene else []
    fidelity, pick = picked(request.model, gun, {axis.key: axis.values for axis in of_scene})
    if not request.vary or request.table is None:
        raise ConfigError("--vary and --table go together: --vary KEY=FROM:TO:COUNT --table FILE.parquet")
    axes = _axes(request, gun)
    path, rows = request.table, math.prod(len(axis.values) for axis in axes)
    _is_sensible(request, fidelity, rows)
    check_place(path)
    interpreted = rows <= few_shots(gun, axes) or bool(no_compiler())
    if not interpreted or rows > FEW_SHOTS:
        tell(compiler_note())
    if words := takes_about(rows * (_INTERPRETED_S if interpreted else _COMPILED_S)):
        tell(words)
    origin = _origin(gun, fidelity, axes, rows)
    counts = np.zeros(len(STATUSES), dtype=np.int64)
    with opened(path, {axis.key: PARAMETER_KINDS[axis.key] for axis in axes}, origin) as write:
        shoot = partial(simulate_batch, gun, fidelity=fidelity, interpreted=interpreted)
        for arrays, shots in _shoot(shoot, axes, _SLOW_BLOCK if interpreted else _BLOCK, progress):
            write(arrays, shots)
            counts += np.bincount(shots.status, minlength=len(STATUSES))
    statuses: dict[str, int] = {name: int(count) for name, count in zip(STATUSES, counts, strict=True) if count}
    known = {one.name: getattr(origin, one.name) for one in fields(SweepOrigin)}
    return Sweep(**known, table=str(path), statuses=statuses, scene=pick)


def few_shots(gun: GunParameters, axes: Sequence[SweepAxis]) -> int:
    """So many shots of these guns are interpreted."""
    varied = {axis.key: axis.values for axis in axes}
    paper = GunParameters()
    for one in fields(gun):
        usual, values = getattr(paper, one.name), np.atleast_1d(varied.get(one.name, getattr(gun, one.name)))
        if isinstance(usual, float) and np.any((values > _FAR * usual) | ((values < usual / _FAR) & (values > 0.0))):
            return FEW_FAR_SHOTS
    return FEW_SHOTS


def _shoot(
    shoot: Callable[..., ShotBatch], axes: Sequence[SweepAxis], block: int, progress: Progress
) -> Iterator[tuple[dict[str, NDArray[Any]], ShotBatch]]:
    """Block by block: the parameters that vary, and the shots."""
    shape = tuple(len(axis.values) for axis in axes)
    rows = math.prod(shape)
    with progress("shots", math.ceil(rows / block)) as done:
        for start in range(0, rows, block):
            end = min(start + block, rows)
            places = np.unravel_index(np.arange(start, end), shape)
            arrays: dict[str, Any] = {axis.key: axis.values[place] for axis, place in zip(axes, places, strict=True)}
            yield arrays, shoot(**arrays)
            done(f"{end:,} of {rows:,}")


def table_sections(found: Sweep) -> tuple[Section, ...]:
    """The table in words, the pick of a scene before it."""
    statuses = ", ".join(f"{name} {count:,}" for name, count in found.statuses.items())
    varied = "; ".join(f"{key} {words}" for key, words in found.vary.items())
    table = Section(title=f"Table: {found.table}, {found.rows:,} shots ({statuses})", items=(f"varied: {varied}",))
    return (table,) if found.scene is None else (scene_section(found.scene), table)


def _origin(gun: GunParameters, fidelity: str, axes: Sequence[SweepAxis], rows: int) -> SweepOrigin:
    varied = {axis.key: axis.words for axis in axes}
    return SweepOrigin(
        rows=rows,
        fidelity=fidelity,
        vary=varied,
        parameters={key: value for key, value in asdict(gun).items() if key not in varied},
        provenance=provenance(),
    )


def _is_sensible(request: SimulateRequest, fidelity: str, rows: int) -> None:
    if instead := request.of_files + request.of_one_shot:
        raise ConfigError(f"--vary makes a table of shots; {', '.join(instead)} tells of a single one: drop either")
    if fidelity not in FIDELITIES:
        raise ConfigError(f"--fidelity {fidelity}: must be one of {', '.join(FIDELITIES)}")
    if rows > MOST_ROWS and not request.yes:
        raise ConfigError(f"--vary asks for {rows:,} shots; more than {MOST_ROWS:,} need --yes")


def _axes(request: SimulateRequest, gun: GunParameters) -> list[SweepAxis]:
    axes = [axis_of(words, gun) for words in request.vary]
    keys = [axis.key for axis in axes] + [change.partition("=")[0] for change in request.changes]
    twice = sorted({key for key in keys[: len(axes)] if keys.count(key) > 1})
    if twice:
        raise ConfigError(f"--vary {twice[0]}: is set or varied twice; name it once")
    return axes


def axis_of(words: str, gun: GunParameters) -> SweepAxis:
    """The values that KEY=FROM:TO:COUNT, KEY=log:FROM:TO:COUNT or KEY=A,B,C asks for. `ConfigError`: none do.

    >>> axis_of("friction_N=0.25:0.75:3", GunParameters()).values.tolist()
    [0.25, 0.5, 0.75]
    """
    key, equals, text = words.partition("=")
    if not equals or key not in PARAMETER_KINDS:
        raise ConfigError(f"--vary {words}: must be KEY={_FORMS} with a key of {', '.join(PARAMETER_KINDS)}")
    values = _range(words, text) if ":" in text else _list(words, text, PARAMETER_KINDS[key])
    for value in values.tolist() if PARAMETER_KINDS[key] is str else (values.min().item(), values.max().item()):
        try:
            replace(gun, **{key: value})
        except ValueError as error:
            raise ConfigError(f"--vary {words}: {error}") from error
    return SweepAxis(key=key, words=text, values=values)


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
