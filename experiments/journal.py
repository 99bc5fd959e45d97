"""The journal of a run: append-only, synced record by record. It is the truth; every table is made from it.

One JSON object a line. The first record holds the whole plan, the resolved setup and where they came from. Every record
has its number `n`, its `kind`, monotonic and UTC time, and when the record before it was on the disk (`synced_s`).
"""

from __future__ import annotations

import json
import os
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Self, get_args

from experiments import storage
from experiments.canonical import canonical_json
from experiments.clock import Clock

Kind = Literal["run", "step", "outcome", "resumed", "stopped", "finished"]
_KINDS = get_args(Kind)


class JournalError(Exception):
    """A journal that cannot be written or read; the message says what is safe."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """What a journal holds: its whole records, their length in bytes, and what stands behind them cut off."""

    path: Path
    records: tuple[dict[str, Any], ...]
    whole_bytes: int
    cut_bytes: int

    @property
    def header(self) -> dict[str, Any]:
        """The first record: plan, setup, provenance."""
        return self.records[0]

    @property
    def finished(self) -> bool:
        """Whether the run came to its end."""
        return bool(self.records[-1]["kind"] == "finished")

    @property
    def cut_message(self) -> str | None:
        """One clear sentence if the last record is cut off, else nothing."""
        if not self.cut_bytes:
            return None
        return (
            f"{self.path}: line {len(self.records) + 1} is cut off after {self.cut_bytes} bytes and was never "
            f"acknowledged; everything up to record {self.records[-1]['n']} is read"
        )


class Journal:
    """A journal open for writing. Each `append` returns when the record is on the disk, or raises `JournalError`.

    A thread of its own writes, so that an interrupt, which reaches the main thread alone, never hits half a record.
    """

    def __init__(self, path: Path, descriptor: int, clock: Clock, *, count: int, length: int) -> None:
        self.path = path
        self._descriptor = descriptor
        self._clock = clock
        self._count = count
        self._length = length
        self._synced_s: float | None = None
        self._writer = ThreadPoolExecutor(max_workers=1, thread_name_prefix="journal")

    @classmethod
    def create(cls, path: Path, clock: Clock) -> Self:
        """A new journal; its name is on the disk when this returns."""
        try:
            descriptor = storage.create(path)
        except OSError as error:
            raise JournalError(f"{path}: cannot be created ({error.strerror}); nothing was recorded") from error
        return cls(path, _held(path, descriptor), clock, count=0, length=0)

    @classmethod
    def reopen(cls, contents: Contents, clock: Clock) -> Self:
        """A journal to go on with: what was cut off, and so never acknowledged, is taken away first."""
        descriptor = _held(contents.path, storage.reopen(contents.path))
        os.ftruncate(descriptor, contents.whole_bytes)
        return cls(contents.path, descriptor, clock, count=len(contents.records), length=contents.whole_bytes)

    def append(self, kind: Kind, **body: object) -> None:
        """Write one record and return when it is on the disk."""
        self.submit(kind, **body).result()

    def submit(self, kind: Kind, **body: object) -> Future[None]:
        """Have one record written after those submitted before; the result is there when it is on the disk."""
        times = {"monotonic_s": self._clock.now(), "utc": self._clock.utc()}
        return self._writer.submit(self._write, {"kind": kind, **times, **body})

    def _write(self, record: dict[str, object]) -> None:
        line = canonical_json({"n": self._count, "synced_s": self._synced_s, **record}) + b"\n"
        try:
            storage.write_all(self._descriptor, line)
            storage.sync(self._descriptor)
        except OSError as error:
            self._take_back()
            raise JournalError(
                f"{self.path}: record {self._count} cannot be written ({error.strerror}); "
                f"everything up to record {self._count - 1} is safe on the disk"
            ) from error
        self._synced_s = self._clock.now()
        self._count += 1
        self._length += len(line)

    def _take_back(self) -> None:
        """Remove a record that was not acknowledged, so that the journal ends with a whole one."""
        with suppress(OSError):  # readers leave out what is cut off, so a rest of it does no harm
            os.ftruncate(self._descriptor, self._length)

    def close(self) -> None:
        """Let go of the file, after what was submitted."""
        self._writer.shutdown()
        os.close(self._descriptor)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _held(path: Path, descriptor: int) -> int:
    if not storage.hold(descriptor):
        os.close(descriptor)
        raise JournalError(f"{path}: another run holds this journal; close that one first")
    return descriptor


def read(path: Path) -> Contents:
    """Every whole record of a journal. A record is whole if its line has its end; the rest is counted, not read.

    `JournalError` names file, line and rule if there is no whole record, or if one was changed by hand.
    """
    data = _bytes(path)
    whole_bytes = data.rfind(b"\n") + 1
    lines = data[:whole_bytes].splitlines()
    _check_head(path, lines)
    records = tuple(_record(path, number, line) for number, line in enumerate(lines))
    return Contents(path=path, records=records, whole_bytes=whole_bytes, cut_bytes=len(data) - whole_bytes)


def head(path: Path) -> dict[str, Any]:
    """The first record of a journal: plan, setup, provenance."""
    first = _bytes(path).split(b"\n", 1)
    return _check_head(path, first[:-1])


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise JournalError(f"{path}: cannot be read ({error.strerror})") from error


def _check_head(path: Path, lines: list[bytes]) -> dict[str, Any]:
    if not lines:
        raise JournalError(f"{path}: line 1: no whole record, so nothing was acknowledged; --fresh sets the file aside")
    first = _record(path, 0, lines[0])
    if first["kind"] != "run" or not {"plan", "setup", "setup_sha256"} <= first.keys():
        raise JournalError(f"{path}: line 1: not the head of a journal (kind `run` with `plan` and `setup`)")
    return first


def _record(path: Path, number: int, line: bytes) -> dict[str, Any]:
    place = f"{path}: line {number + 1}"
    try:
        value = json.loads(line)
    except ValueError as error:
        raise JournalError(f"{place}: not a JSON record ({error}); the journal was changed or damaged") from error
    if not isinstance(value, dict) or value.get("kind") not in _KINDS:
        raise JournalError(f"{place}: kind must be one of {', '.join(_KINDS)}; the journal was changed or damaged")
    if value.get("n") != number:
        raise JournalError(f"{place}: record number is {value.get('n')!r}, must be {number}; a line was lost or added")
    return value
