"""The journal of a run: append-only, synced record by record. It is the truth; every table is made from it.

One JSON object a line. The first record holds the whole plan, the resolved setup and where they came from. Every record
has its number `n`, its `kind`, monotonic and UTC time, when the record before it was on the disk (`synced_s`), and the
hash of that record's line (`link_of`): a record changed by hand breaks the chain.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Literal, Self, TypeVar, get_args

from pydantic import TypeAdapter, ValidationError

from device.messages import RecoilError
from device.words import Identity
from experiments.clock import Clock
from experiments.config.setup import sha256
from experiments.design.plan import Plan
from experiments.record import storage
from experiments.record.lines import LineError, check_chain, parsed_line

ParticipantKind = Literal["person", "synthetic"]
"""Who does a run."""
Kind = Literal["run", "step", "outcome", "shot", "remark", "measured", "resumed", "stopped", "finished"]
_KINDS = get_args(Kind)
ENDING = storage.JOURNAL_ENDING
"""How the name of every journal ends."""
MOST_LINE, MOST_BYTES = 1 << 26, 1 << 29
"""No record is longer, and no journal: a run of ten thousand trials writes some ten million bytes."""
_NOTHING = "nothing was recorded"
_PATIENCE_S = 0.5
"""How long a journal is tried that somebody may only be looking at."""


class JournalError(RecoilError):
    """A journal that cannot be written or read; the message says what is safe.

    `shown` is for people who must see no answer: place and what is said, with … for a `value` that was found in the
    journal. It is empty where no place is named by itself: then the message may have such a value anywhere.
    """

    def __init__(self, said: str, *, at: Path | str = "", value: str = "") -> None:
        super().__init__(f"{at}: {said.replace('…', value)}" if at else said)
        self.shown = f"{at}: {said}" if at else ""


class JournalGone(JournalError):  # noqa: N818 - what is so, not what went wrong
    """A journal that was deleted or moved while it was written; the message says where it is now, if anywhere."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """A line of a journal after its first: when it was written, and what it holds.

    `body` is a step, outcome, shot, remark or a sensor's word as JSON, which their own types read. `shown_s` of an
    outcome is when the console had painted its step, `reason` of a stop is why, `halted` that it was an emergency stop,
    `clock` and `gun` of a beginning or a resumption are which, `noise`, `participant_screen` and `participant_keys`
    whether the participant was to have them; else they are empty.
    """

    n: int
    kind: Kind
    utc: str
    monotonic_s: float
    synced_s: float | None = None
    body: object = None
    shown_s: float | None = None
    reason: str = ""
    halted: bool = False
    clock: str = ""
    gun: Identity | None = None
    noise: bool = False
    participant_screen: bool = False
    participant_keys: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownLanguage:
    """The language of a run that was not in English: its messages, and what it has for the design's texts.

    `checked_by` is empty where no native speaker has checked the catalogue.
    """

    code: str
    name: str
    checked_by: str
    messages: dict[str, str]
    texts: dict[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Head(Record):
    """The first line of a journal: the frozen plan, and the resolved setup as JSON, with their hashes.

    `laws_json`: how synthetic people answer the design, `None` where nothing says so. `participant`: who was to do it.
    `preregistration_sha256`: empty where nothing was frozen. `language`: `None` is English. `provenance`: versions.
    """

    path: Path
    plan_json: object
    plan_sha256: str
    setup_json: object
    setup_sha256: str
    laws_json: object = None
    participant: ParticipantKind = "person"
    preregistration_sha256: str = ""
    language: ShownLanguage | None = None
    provenance: dict[str, str] = field(default_factory=dict)

    @property
    def plan(self) -> Plan:
        """The plan. `JournalError` if this version of Recoil knows no such plan."""
        try:
            return Plan.from_record(self.plan_json)
        except ValidationError as error:
            raise JournalError("no plan of this version of Recoil", at=f"{self.path}: line 1") from error


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """What a journal holds: its whole records, their length in bytes and hash, and what stands behind them cut off."""

    path: Path
    head: Head
    records: tuple[Record, ...]
    whole_bytes: int
    cut_bytes: int
    link: str
    sha256: str

    @property
    def plan(self) -> Plan:
        """The plan of the run. `JournalError` if this version of Recoil knows no such plan."""
        return self.head.plan

    @property
    def finished(self) -> bool:
        """Whether the run came to its end."""
        return self.records[-1].kind == "finished"

    @property
    def cut_message(self) -> str | None:
        """One clear sentence if the last record is cut off, else nothing."""
        if not self.cut_bytes:
            return None
        return (
            f"{self.path}: line {len(self.records) + 1} is cut off after {self.cut_bytes} bytes and was never "
            f"acknowledged; everything up to record {self.records[-1].n} is read"
        )


class Journal:
    """A journal open for writing. Each `append` returns when the record is on the disk, or raises `JournalError`.

    A thread of its own writes, so that an interrupt, which reaches the main thread alone, never hits half a record.
    Where `each` record is not synced, as nobody's answers are in it, all are when it is closed.
    """

    def __init__(
        self, path: Path, descriptor: int, clock: Clock, before: Contents | None = None, *, each: bool = True
    ) -> None:
        self.path = path
        self._descriptor = descriptor
        self._clock = clock
        self._count = len(before.records) if before else 0
        self._length = before.whole_bytes if before else 0
        self._link = before.link if before else ""
        self._synced_s: float | None = None
        self._each = each
        self._gone = ""
        self._writer = ThreadPoolExecutor(max_workers=1, thread_name_prefix="journal")

    @classmethod
    def create(cls, path: Path, clock: Clock, *, each: bool = True) -> Self:
        """A new journal; its name is on the disk when this returns."""
        try:
            descriptor = storage.create(path)
        except OSError as error:
            raise JournalError(f"{path}: cannot be created ({error.strerror}); {_NOTHING}") from error
        return cls(path, _held(path, descriptor), clock, each=each)

    @classmethod
    def reopen(cls, contents: Contents, clock: Clock, *, each: bool = True) -> Self:
        """A journal to go on with: what was cut off, and so never acknowledged, is taken away first.

        `JournalError` if another run holds it, or wrote to it since `contents` was read.
        """
        descriptor = hold_journal(contents.path)
        try:
            if os.fstat(descriptor).st_size != contents.whole_bytes + contents.cut_bytes:
                raise JournalError(f"{contents.path}: another run wrote to it just now; look again and start anew")
            os.ftruncate(descriptor, contents.whole_bytes)
        except BaseException:
            os.close(descriptor)
            raise
        return cls(contents.path, descriptor, clock, contents, each=each)

    def append(self, kind: Kind, **body: object) -> None:
        """Write one record and return when it is on the disk."""
        self.submit(kind, **body).result()

    def submit(self, kind: Kind, **body: object) -> Future[None]:
        """Have one record written after those submitted before; the result is there when it is on the disk."""
        return self.submit_together(kind, [body])

    def submit_together(self, kind: Kind, bodies: Iterable[Mapping[str, object]]) -> Future[None]:
        """Have records written as `submit` does: if one of them is refused, none is there."""
        times = {"monotonic_s": self._clock.now(), "utc": self._clock.utc()}
        return self._writer.submit(self._write, [{"kind": kind, **times, **body} for body in bodies])

    def catch_up(self) -> None:
        """Return when all that was submitted is written, or was refused, of which whoever submitted it is told."""
        self._writer.submit(_nothing_more).result()

    def read_back(self) -> Contents:
        """What is on the disk, held against all that was written. `JournalError` if it is anything else."""
        self.catch_up()
        contents = read_journal(self.path)
        if contents.link != self._link:  # each record has the hash of the one before: the last one proves them all
            raise JournalError(
                f"{self.path}: holds {len(contents.records)} records, and not the {self._count} that were written, so "
                "something else changed it; copy it away as it is, and look at the disk before the next run"
            )
        return contents

    def _write(self, records: Sequence[dict[str, object]]) -> None:
        if self._gone:  # what stands written again is whole: nothing more goes where nobody finds it
            raise JournalGone(self._gone)
        try:
            lines = self._lines(records)
            storage.write_all(self._descriptor, b"".join(lines))
            if self._each:
                storage.sync(self._descriptor)
        except (OSError, ValueError) as error:
            self._take_back()
            reason = error.strerror if isinstance(error, OSError) else error
            safe = f"everything up to record {self._count - 1} is safe on the disk" if self._count else _NOTHING
            if getattr(error, "errno", None) in storage.DISK_FULL:
                safe += "; free some space there, then resume the run"
            raise JournalError(f"{self.path}: record {self._count} cannot be written ({reason}); {safe}") from error
        self._synced_s = self._clock.now() if self._each else None
        self._count += len(lines)
        self._length += sum(map(len, lines))
        self._link = link_of(lines[-1])
        if not storage.is_at(self._descriptor, self.path):
            self._gone = self._rescue()
            raise JournalGone(self._gone)

    def _lines(self, records: Sequence[dict[str, object]]) -> list[bytes]:
        """Records that are written together as lines, each of which follows from the one before."""
        lines, link, synced_s = list[bytes](), self._link, self._synced_s
        for n, record in enumerate(records, start=self._count):
            lines.append(record_line({"n": n, "link": link, "synced_s": synced_s, **record}))
            link, synced_s = link_of(lines[-1]), None
        return lines

    def _rescue(self) -> str:
        """Write a journal again that was deleted, from what is open; where it is now, and what to do."""
        what, upto = f"{self.path}: the journal", f"Everything up to record {self._count - 1} is"
        moved = storage.moved_to(self._descriptor)
        if moved is not None:
            return f"{what} was moved to {moved} during the run. {upto} there; resume it there"
        unseen, lost = storage.why_not_seen(self.path), "was deleted during the run"
        if unseen is not None:
            lost = f"cannot be looked at any more ({unseen.strerror})"
        if isinstance(unseen, PermissionError):  # it lies there untouched: a copy would only spread it
            return f"{what} {lost}. {upto} in it; open the folders above it again, then resume the run"
        data = storage.read_open(self._descriptor, self._length)
        for path in (self.path, Path.cwd() / self.path.name, Path.home() / self.path.name):
            if storage.written_again(path, data):
                how = "resume the run" if path == self.path else f"put it back as {self.path}, then resume"
                return f"{what} {lost}. {upto} written again to {path}; {how}"
        return f"{what} {lost}, and cannot be written anywhere else: this run is lost"

    def _take_back(self) -> None:
        """Remove a record that was not acknowledged, so that the journal ends with a whole one."""
        with suppress(OSError):  # readers leave out what is cut off, so a rest of it does no harm
            os.ftruncate(self._descriptor, self._length)

    def close(self) -> None:
        """Let go of the file, after what was submitted."""
        self._writer.shutdown()
        try:
            if not self._each:
                with storage.errors_name(self.path):
                    storage.sync(self._descriptor)
        finally:
            os.close(self._descriptor)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _nothing_more() -> None:
    """What is written last."""


def hold_journal(path: Path) -> int:
    """An existing journal opened for this process alone. `JournalError` if it is gone or another run holds it."""
    try:
        descriptor = storage.reopen(path)
    except OSError as error:
        raise JournalError(f"{path}: cannot be opened ({error.strerror})") from error
    return _held(path, descriptor)


def _held(path: Path, descriptor: int) -> int:
    if not storage.hold(descriptor, _PATIENCE_S):
        os.close(descriptor)
        raise JournalError(f"{path}: another run holds this journal; close that one first")
    return descriptor


def record_line(record: Mapping[str, object]) -> bytes:
    """A record as JSON with its keys as they stand, so that the order of a design's factors is kept; no NaN."""
    return json.dumps(record, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode() + b"\n"


def link_of(line: bytes) -> str:
    """What the next record says of a line: the first 16 digits of its SHA-256."""
    return hashlib.sha256(line.rstrip(b"\r\n")).hexdigest()[:16]


def read_journal(path: Path) -> Contents:
    """Every whole record of a journal. A record is whole if its line has its end; the rest is counted, not read.

    `JournalError` names file, line and rule if there is no whole record, or if one was changed by hand.
    """
    contents = begun(path)
    if contents is None:
        raise JournalError(f"{path}: {_nothing(path)}")
    return contents


def _nothing(path: Path) -> str:
    """What there is to say of a file without a whole line."""
    if path.name.endswith(ENDING):
        return "line 1: no whole record, so nothing was acknowledged"
    return f"is empty, or no text; it is no journal (rule: a file sub-CODE_task-EXPERIMENT{ENDING} that a run wrote)"


def begun(path: Path) -> Contents | None:
    """What a journal holds; `None` if the run was killed before anything was acknowledged. Raises as `read_journal`."""
    return contents_of(path, journal_bytes(path))


def head(path: Path) -> Head | None:
    """The first record of a journal; `None` if the run was killed before it was whole. Raises as `read_journal`."""
    return head_of(path, _first_bytes(path, MOST_LINE))


def journal_bytes(path: Path) -> bytes:
    """The bytes of a journal. `JournalError` if there are none to be had."""
    data = _first_bytes(path, MOST_BYTES)
    if len(data) == MOST_BYTES:
        raise JournalError(f"{path}: is longer than any run writes ({MOST_BYTES >> 20} MiB); it was changed")
    return data


def _first_bytes(path: Path, most: int) -> bytes:
    try:
        return storage.read(path, most)
    except OSError as error:
        raise JournalError(f"{path}: cannot be read ({error.strerror})") from error


def contents_of(path: Path, data: bytes) -> Contents | None:
    """What the bytes of a journal hold; `None` if there is no whole record. Raises as `read_journal`."""
    whole_bytes = data.rfind(b"\n") + 1
    lines = data[:whole_bytes].split(b"\n")[:-1]
    first = head_of(path, data)
    if first is None:
        return None
    links = [*map(link_of, lines)]
    others = (record_of(path, number, line, links[number - 1]) for number, line in enumerate(lines[1:], start=1))
    return Contents(
        path=path,
        head=first,
        records=(first, *others),
        whole_bytes=whole_bytes,
        cut_bytes=len(data) - whole_bytes,
        link=links[-1],
        sha256=hashlib.sha256(data[:whole_bytes]).hexdigest(),
    )


def head_of(path: Path, data: bytes) -> Head | None:
    """The first record in the bytes of a journal; `None` if it is not whole. `JournalError` if it is none."""
    line, end, _ = data.partition(b"\n")
    if not end:
        return None
    if not path.name.endswith(ENDING) and not line.startswith(b"{"):
        raise JournalError(f"is no journal (rule: a file sub-CODE_task-EXPERIMENT{ENDING} that a run wrote)", at=path)
    at, value = f"{path}: line 1", _values(path, 0, line, "")
    if value["kind"] != "run" or not {"plan", "setup"} <= value.keys():
        raise JournalError("not the head of a journal (kind `run` with `plan` and `setup`)", at=at)
    for part in ("plan", "setup"):
        if sha256(value[part]) != value.get(f"{part}_sha256"):
            raise JournalError(f"{part} does not have the hash {part}_sha256; it was changed", at=at)
    of_head = {"path": path, "plan_json": value["plan"], "setup_json": value["setup"], "laws_json": value.get("laws")}
    found: Head = read_as(_reader(Head), value | of_head, at)
    return found


def record_of(path: Path, number: int, line: bytes, before: str) -> Record:
    """The record on a line after the first; it follows from the line before. `JournalError` if it does not."""
    found: Record = read_as(_reader(Record), _values(path, number, line, before), f"{path}: line {number + 1}")
    return found


Typed = TypeVar("Typed")


@cache
def _reader(kind: type[Typed]) -> TypeAdapter[Typed]:
    return TypeAdapter(kind)


def read_as(kind: TypeAdapter[Typed], value: object, place: str) -> Typed:
    """JSON of a journal as the type that it was written from. `JournalError` names the place and what is wrong."""
    try:
        return kind.validate_python(value)
    except ValidationError as error:
        first = error.errors()[0]
        found = filter(None, (".".join(str(part) for part in first["loc"]), first["msg"]))
        raise JournalError("…; the record was changed", at=place, value=": ".join(found)) from error


def _values(path: Path, number: int, line: bytes, before: str) -> dict[str, object]:
    try:
        value = parsed_line(line)
        if value.get("kind") not in _KINDS:
            raise LineError(f"kind must be one of {', '.join(_KINDS)}; it was changed or damaged")
        check_chain(value, number, before)
    except LineError as error:
        raise JournalError(error.said, at=f"{path}: line {number + 1}", value=error.value) from error
    return value
