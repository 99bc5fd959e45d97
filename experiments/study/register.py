"""The register of a results folder: who joined with which facts, is excluded, left, had a run set aside, and why.

Codes only, never names. `participants.jsonl` is written and read like a journal: one JSON object a line, appended and
synced record by record, each with its number, the date and time, and the hash of the line before it. A later `joined`
record of a code corrects the facts of an earlier one; nothing is ever taken away.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, ConfigDict, Field, StringConstraints, TypeAdapter, ValidationError

from experiments.clock import Clock
from experiments.config.door import Model, Text
from experiments.config.findings import CODE
from experiments.config.setup import canonical_json
from experiments.record import storage
from experiments.record.journal import JournalError, link_of
from experiments.record.lines import LineError, check_chain, parsed_line
from experiments.record.names import twin_text
from experiments.study.study import Facts, Member

REGISTER_FILE = "participants.jsonl"
MAX_REASON = 200
_DAMAGED = "the register was changed or damaged: restore it from a copy, or rename it and enter the participants anew"
_PATIENCE_S = 5.0
"""So long a register that another console holds is waited for: it is held for one record only."""


class RegisterError(JournalError):
    """A register that cannot be written or trusted, or a record that breaks a rule."""


def _plain(text: str) -> str:
    if not text.strip() or not text.isprintable():
        raise ValueError("must say why, in one line of printable characters")
    return text


_Code = Annotated[str, StringConstraints(pattern=f"^{CODE}$")]
_Reason = Annotated[str, Field(max_length=MAX_REASON), AfterValidator(_plain)]


class Joined(Model):
    """Someone takes part, or their facts are corrected."""

    kind: Literal["joined"] = "joined"
    participant_id: _Code
    facts: Facts


class Excluded(Model):
    """Someone does not count: their row of the balancing square is free again, their logs are left out."""

    kind: Literal["excluded"] = "excluded"
    participant_id: _Code
    reason: _Reason


class Departed(Model):
    """Someone comes no more, or a code was mistyped and nobody's: what was done under it still counts."""

    kind: Literal["left"] = "left"
    participant_id: _Code
    reason: _Reason


class Readmitted(Model):
    """Someone who was excluded, or had left, counts again."""

    kind: Literal["readmitted"] = "readmitted"
    participant_id: _Code
    reason: _Reason


class SetAside(Model):
    """An unfinished run was set aside, to be started anew: of which experiment, and why."""

    kind: Literal["set-aside"] = "set-aside"
    participant_id: _Code
    experiment: Text
    reason: _Reason


RegisterEntry = Joined | Excluded | Departed | Readmitted | SetAside
_REASON: TypeAdapter[str] = TypeAdapter(_Reason)
_ENTRY: TypeAdapter[RegisterEntry] = TypeAdapter(
    Annotated[RegisterEntry, Field(discriminator="kind")], config=ConfigDict(defer_build=True)
)


def entry(kind: str, participant_id: str, **body: object) -> RegisterEntry:
    """A record to append. `RegisterError` names key, value and rule.

    >>> entry("excluded", "P03", reason="left-handed").kind
    'excluded'
    """
    return _checked({"kind": kind, "participant_id": participant_id, **body})


def check_reason(text: str) -> None:
    """`RegisterError` unless a text is fit as a reason."""
    try:
        _REASON.validate_python(text)
    except ValidationError as error:
        raise RegisterError(f"reason {text!r}: {error.errors()[0]['msg'].removeprefix('Value error, ')}") from error


def _checked(values: Mapping[str, object]) -> RegisterEntry:
    try:
        return _ENTRY.validate_python(values)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"][1:]) or "kind"
        shown = repr(first["input"])
        shown = shown if len(shown) <= 60 else f"{shown[:60]}..."
        raise RegisterError(f"{key} = {shown}: {first['msg'].removeprefix('Value error, ')}") from error


@dataclass(frozen=True, slots=True, kw_only=True)
class Register:
    """What a register holds up to its end, or up to the first line that cannot be trusted, which `problem` names.

    A last line without a newline was never acknowledged and is ignored. `members` are by code.
    """

    path: Path
    entries: tuple[tuple[str, RegisterEntry], ...] = ()
    whole_bytes: int = 0
    link: str = ""
    problem: str = ""

    @property
    def members(self) -> dict[str, Member]:
        """The state of every code, as the records in their order leave it."""
        found: dict[str, Member] = {}
        for utc, one in self.entries:
            before = found.get(one.participant_id, Member(participant_id=one.participant_id))
            found[one.participant_id] = _after(before, utc, one)
        return found

    def trusted(self) -> dict[str, Member]:
        """As `members`. `RegisterError` if the register cannot be trusted: someone might be missing."""
        _refuse_problem(self)
        return self.members

    def excluded(self) -> dict[str, str]:
        """Who is excluded, with the reason. `RegisterError` as of `trusted`."""
        return {code: member.excluded for code, member in self.trusted().items() if member.excluded is not None}


def _after(before: Member, utc: str, one: RegisterEntry) -> Member:
    if isinstance(one, Joined):
        return replace(before, facts=one.facts, joined_utc=before.joined_utc or utc)
    if isinstance(one, SetAside):
        return before
    if isinstance(one, Departed):
        return replace(before, left=one.reason)
    if isinstance(one, Excluded):
        return replace(before, excluded=one.reason)
    return replace(before, excluded=None, left=None)


def read_register(results: Path) -> Register:
    """The register of a results folder, as far as it can be trusted; an empty one if there is none."""
    path = results / REGISTER_FILE
    try:
        data = storage.read_whole(path)
    except (FileNotFoundError, NotADirectoryError):
        return Register(path=path)
    except OSError as error:
        return Register(path=path, problem=f"{path}: cannot be read ({error.strerror})")
    found = Register(path=path)
    for number, line in enumerate(data[: data.rfind(b"\n") + 1].split(b"\n")[:-1]):
        try:
            found = _with_line(found, number, line)
        except (JournalError, LineError) as error:
            return replace(found, problem=f"{path}: line {number + 1}: {error}; {_DAMAGED}")
    return found


def _with_line(before: Register, number: int, line: bytes) -> Register:
    values = parsed_line(line)
    check_chain(values, number, before.link)
    utc = values.get("utc")
    if not isinstance(utc, str):
        raise RegisterError(f"utc = {utc!r}: must be the date and time of the record")
    body = {key: value for key, value in values.items() if key not in ("n", "link", "utc")}
    entries = (*before.entries, (utc, _checked(body)))
    return replace(before, entries=entries, whole_bytes=before.whole_bytes + len(line) + 1, link=link_of(line))


def _refuse_problem(register: Register) -> None:
    if register.problem:
        raise RegisterError(register.problem)


def append(results: Path, one: RegisterEntry, clock: Clock) -> None:
    """Add a record and return when it is on the disk. `RegisterError` if it cannot be: then nothing was added.

    Nor is it if somebody joins whom another console has taken in with the same facts meanwhile.
    """
    path = results / REGISTER_FILE
    with _held(path) as descriptor:
        before = read_register(results)
        _refuse_problem(before)
        _refuse_twin(before, one)
        if _is_known(before, one):
            return
        os.ftruncate(descriptor, before.whole_bytes)  # what was cut off was never acknowledged
        head = {"n": len(before.entries), "link": before.link, "utc": clock.utc()}
        _write(path, descriptor, canonical_json(head | one.model_dump(mode="json")) + b"\n", before.whole_bytes)


def _refuse_twin(before: Register, one: RegisterEntry) -> None:
    if said := twin_text(one.participant_id, before.members, before.path):
        raise RegisterError(said)


def _is_known(before: Register, one: RegisterEntry) -> bool:
    member = before.members.get(one.participant_id)
    return isinstance(one, Joined) and member is not None and member.facts == one.facts


def _write(path: Path, descriptor: int, line: bytes, length: int) -> None:
    try:
        storage.write_all(descriptor, line)
        storage.sync(descriptor)
    except OSError as error:
        with suppress(OSError):  # readers leave out what is cut off
            os.ftruncate(descriptor, length)
        raise RegisterError(f"{path}: cannot be written ({error.strerror}); nothing was added") from error


@contextmanager
def _held(path: Path) -> Iterator[int]:
    """The register open for appending, for this process alone. Consoles hold it for one record, so waiting is short."""
    try:
        storage.make_folder(path.parent)
        descriptor = _opened(path)
    except OSError as error:
        raise RegisterError(f"{path}: cannot be opened ({error.strerror}); nothing was added") from error
    try:
        if not storage.hold(descriptor, _PATIENCE_S):
            raise RegisterError(f"{path}: another program has held it for {_PATIENCE_S:g} s; close that one first")
        yield descriptor
    finally:
        os.close(descriptor)


def _opened(path: Path) -> int:
    with suppress(FileExistsError):
        return storage.create(path)
    return storage.reopen(path)
