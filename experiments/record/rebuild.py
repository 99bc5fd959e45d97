"""The table that a journal makes, by the design in its first line, and how it is made again where one stands."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from device.messages import how_many
from experiments.record import design_columns, design_table, replay, storage
from experiments.record.head_design import began_with
from experiments.record.journal import Contents, JournalError, read_journal
from experiments.record.names import misnamed, shots_path, table_beside
from experiments.record.shots_table import SHOTS, shot_rows
from experiments.record.tables import table_bytes
from experiments.session.history import answered


def table(contents: Contents) -> bytes:
    """The CSV that a journal makes. `JournalError` as `began_with`."""
    design = began_with(contents.head)
    rows = design_table.design_rows(contents.plan, replay.history(contents), design)
    return table_bytes(design_columns.columns(design), rows)


def trials_answered(contents: Contents) -> int:
    """How many trials have an answer to each judgement. `JournalError` as `began_with`."""
    return len(answered(replay.history(contents), began_with(contents.head).judgements))


def rows_beyond(content: bytes, made: bytes) -> int:
    r"""How many rows a table holds more of than the one that its journal makes; 0 if they differ in any other way.

    >>> rows_beyond(b"trial,said\n1,yes\n2,no\n", b"trial,said\n1,yes\n2,\n")
    1
    """
    try:
        ours, theirs = ([*csv.reader(io.StringIO(some.decode(), newline=""))] for some in (content, made))
    except (UnicodeDecodeError, csv.Error):
        return 0
    more = len(ours) - len(theirs)  # of shots there are as many rows as there were; of trials, as were planned
    differing = [pair for pair in zip(ours, theirs, strict=False) if pair[0] != pair[1]]
    if more < 0 or not all(_holds_more(*pair, first=i == 0) for i, pair in enumerate(differing)):
        return 0
    return len(differing) + more


def _holds_more(row: Sequence[str], made: Sequence[str], *, first: bool) -> bool:
    """Whether a row says what was made says, and more; of the `first`, a journal may end in the middle of its trial."""
    if len(row) != len(made):
        return False
    more = any(cell and not known for cell, known in zip(row, made, strict=True))
    return more and (first or all(cell == known or not known for cell, known in zip(row, made, strict=True)))


def shots_table(contents: Contents) -> bytes | None:
    """The CSV of what a sensor measured, one row a shot; `None` where there was none."""
    rows = shot_rows(contents.plan, replay.history(contents))
    return table_bytes(SHOTS, rows) if rows else None


def rebuild(path: Path) -> tuple[Path, bytes, Contents]:
    """The table of a journal: where it belongs, its bytes, and what the journal holds.

    `JournalError` as `began_with`, and if it lies under another run's name: whose table would it be?
    """
    contents = read_journal(path)
    if said := misnamed(path, contents.plan):
        raise JournalError(f"{path}: {said}")
    return table_beside(path, began_with(contents.head).table), table(contents), contents


@dataclass(frozen=True, slots=True, kw_only=True)
class RebuiltTable:
    """A table made again: whether it had to be written, and what there is to say."""

    table: Path
    rebuilt: bool
    messages: tuple[str, ...]


def _holds(path: Path, data: bytes) -> bool:
    """Whether there is a plain file with this content; of a device or a pipe nothing is read."""
    try:
        return storage.read(path, len(data) + 1) == data
    except OSError:
        return False


def _kept(table: Path, data: bytes, messages: list[str], *, resumed: bool) -> bool:
    """Whether a table has this content already; else it has now, and what stood there is set aside with a message."""
    if _holds(table, data):
        return True
    if os.path.lexists(table):
        beyond = _rows_beyond(table, data)
        aside = storage.set_aside_file(table)
        messages.append(
            f"{table}: differed from its journal and was set aside as {aside}{_lost(beyond, resumed=resumed)}"
        )
    storage.write_whole(table, data)
    return False


def _rows_beyond(table: Path, data: bytes) -> int:
    """How many rows a table that stands there holds more of; 0 of what is no table of about that size."""
    try:
        return rows_beyond(storage.read(table, 10 * len(data)), data)
    except OSError:
        return 0


def _lost(rows: int, *, resumed: bool) -> str:
    """What is said where the table that was set aside holds more than the one that took its place."""
    if not rows:
        return ""
    said = f"it holds more than the journal in {how_many(rows, 'row')}, which the table made now lacks"
    if rows == 1 and resumed:
        return f"; {said}: a trial that was broken off comes again as a whole, and what it had is in the journal"
    return f"; {said}: if the journal is cut short, put it back whole, and the table that was set aside in its place"


def rebuild_table(path: Path) -> RebuiltTable:
    """The table of a journal, and that of what a sensor measured.

    One that differs from its journal is set aside, not overwritten.
    """
    table, data, contents = rebuild(path)
    messages = [contents.cut_message] if contents.cut_message else []
    resumed = any(record.kind == "resumed" for record in contents.records)
    kept = _kept(table, data, messages, resumed=resumed)
    measured = shots_table(contents)
    if measured is not None:
        _kept(shots_path(path), measured, messages, resumed=resumed)
    return RebuiltTable(table=table, rebuilt=not kept, messages=tuple(messages))
