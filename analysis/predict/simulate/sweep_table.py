"""A table of shots as Parquet or CSV, written block by block under another name and put in its place when whole.

Numbers that were not reached are missing, statuses are words, units end the names. Where the table comes from stands
in the Parquet file's metadata under the key `recoil`, or beside FILE.csv in FILE.csv.json.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import NDArray

from device.physics import ShotBatch
from device.physics.kernel import STATUSES
from experiments.load import ConfigError
from experiments.record import storage

Write = Callable[[Mapping[str, NDArray[Any]], ShotBatch], None]
"""Takes the parameters that vary, and their shots."""

NUMBERS = ShotBatch.__slots__[1:]
"""The columns after the parameters and the status."""
_GROUP = 65_536  # rows of a row group
_WORD = pa.dictionary(pa.int8(), pa.string())


def check_place(path: Path) -> None:
    """`ConfigError` for a name that says neither Parquet nor CSV, or that a folder has."""
    if path.suffix not in (".parquet", ".csv"):
        raise ConfigError(f"--table {path}: must end with .parquet or .csv")
    if path.is_dir():
        raise ConfigError(f"--table {path}: is a folder; name a file")


@contextmanager
def opened(path: Path, keys: Mapping[str, type], facts: Mapping[str, Any]) -> Iterator[Write]:
    """A table to write to. It is in its place when this ends; if this is left by an error, nothing is."""
    columns = [pa.field(key, _WORD if kind is str else pa.float64()) for key, kind in keys.items()]
    columns += [pa.field("status", _WORD), *(pa.field(name, pa.float64()) for name in NUMBERS)]
    about = json.dumps(facts, ensure_ascii=False, indent=1).encode()
    is_csv = path.suffix == ".csv"
    with _whole(path) as stream:
        schema = pa.schema(columns, metadata={"recoil": about})
        with _csv(stream, schema) if is_csv else _parquet(stream, schema) as write:
            groups = _Groups(schema, write)
            yield groups.add
            groups.flush()
    if is_csv:
        storage.write_whole(path.with_name(f"{path.name}.json"), about + b"\n")


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
    part.unlink(missing_ok=True)
    try:
        with os.fdopen(storage.create(part), "wb") as stream:
            yield stream
            stream.flush()
            storage.sync(stream.fileno())
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    storage.sync_folder(path.parent)
