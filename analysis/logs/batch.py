"""Many log files with the same header, checked by every rule at once. Whatever is in doubt is left to `log_rules`.

A file is taken only if the careful reader would take it, with the same values: each distinct cell is parsed by the
careful reader's own function, and of the rules that bind rows together only the plainest way to keep them is known
here (trials in the order 1, 2, 3, ...).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from analysis.logs import frames as log_cells
from analysis.logs.frames import Block, Cells, Coded, Texts, chosen, is_category
from analysis.logs.rules import BadLogError, Cell, experiment_of, is_code, parse_cell
from experiments.record import columns
from experiments.record.columns import Column

Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

_NO_ROWS: Integers = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Group:
    """Files with the same header: their numbers, contents and rows, and the participants' codes in their names."""

    header: bytes
    quoted: bool
    number: list[int] = field(default_factory=list)
    content: list[bytes] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)
    code_in_name: list[str | None] = field(default_factory=list)

    def part(self, chosen: slice) -> _Group:
        """Some of the files."""
        lists = ("number", "content", "rows", "code_in_name")
        return replace(self, **{name: getattr(self, name)[chosen] for name in lists})


@dataclass(frozen=True, slots=True, kw_only=True)
class _Column:
    """A parsed column, and the rows whose cell is not surely right."""

    cells: Cells
    doubted: Integers

    @property
    def coded(self) -> Coded:
        """The column as numbers of its values; numbers and text are not coded."""
        if not isinstance(self.cells, Coded):
            raise TypeError("this column has no codes")
        return self.cells

    def numbers(self) -> Integers:
        """The values as whole numbers, -1 for none."""
        values = [-1 if value is None else value for value in self.coded.values]
        return np.array(values, dtype=np.int64)[self.coded.codes]


def read_batch(contents: Sequence[bytes], codes_in_names: Sequence[str | None]) -> tuple[list[Block], dict[int, str]]:
    """Blocks of the files that surely keep every rule, numbered as in `contents`, and each one's participant."""
    blocks: list[Block] = []
    codes: dict[int, str] = {}
    for group in _groups(contents, codes_in_names):
        for block, found in _read_group(group):
            blocks.append(block)
            codes |= found
    return blocks, codes


def _groups(contents: Sequence[bytes], codes_in_names: Sequence[str | None]) -> Iterable[_Group]:
    groups: dict[tuple[bytes, bool], _Group] = {}
    for number, (content, code) in enumerate(zip(contents, codes_in_names, strict=True)):
        if layout := log_cells.layout(content):
            header, quoted, rows = layout
            group = groups.get((header, quoted)) or groups.setdefault(
                (header, quoted), _Group(header=header, quoted=quoted)
            )
            group.number.append(number)
            group.content.append(content)
            group.rows.append(rows)
            group.code_in_name.append(code)
    return groups.values()


def _read_group(group: _Group) -> Iterator[tuple[Block, dict[int, str]]]:
    """The files of a group; if not all have rows as they should be, each half by itself."""
    try:
        experiment = experiment_of(log_cells.names_in(group.header), 1)
    except BadLogError:
        return
    many = [column.name for column in columns.TABLES[experiment] if _has_many_values(column)]
    table = log_cells.table(group.header, group.content, sum(group.rows), many, quoted=group.quoted)
    if table is not None:
        yield _checked(experiment, table, group)
    elif len(group.number) > 1:
        half = len(group.number) // 2
        yield from _read_group(group.part(slice(half)))
        yield from _read_group(group.part(slice(half, None)))


def _has_many_values(column: Column) -> bool:
    return column.type == "number" or (column.type == "text" and not is_category(column))


def _checked(experiment: str, table: pa.Table, group: _Group) -> tuple[Block, dict[int, str]]:
    """The rows of the good files, and each one's participant."""
    number, rows = np.array(group.number, dtype=np.int64), np.array(group.rows, dtype=np.int64)
    first = np.cumsum(rows) - rows
    found = {column.name: _parsed_column(column, table) for column in columns.TABLES[experiment]}
    participant = found["participant_id"].coded
    codes = [str(participant.values[code]) for code in participant.codes[first].tolist()]
    good = np.array([given in (None, code) for given, code in zip(group.code_in_name, codes, strict=True)])
    good[np.searchsorted(first, _doubted(experiment, found, first), side="right") - 1] = False
    kept = None if good.all() else np.flatnonzero(np.repeat(good, rows))
    block = Block(
        experiment=experiment,
        columns={name: column.cells if kept is None else chosen(column.cells, kept) for name, column in found.items()},
        log=number[good],
        rows=rows[good],
    )
    return block, {group.number[place]: codes[place] for place in np.flatnonzero(good).tolist()}


def _parsed_column(column: Column, table: pa.Table) -> _Column:
    if column.name not in table.column_names:
        return _coded(column, np.zeros(table.num_rows, dtype=np.int32), [columns.MISSING])
    cells = table.column(column.name).chunk(0)
    if column.type == "number":
        return _numbers(column, cells)
    if _has_many_values(column):
        empty = np.flatnonzero(cells.is_null()) if column.required else _NO_ROWS
        return _Column(cells=log_cells.unguarded(cells), doubted=empty)
    return _coded(column, *log_cells.few(cells))


def _coded(column: Column, codes: NDArray[np.int32], texts: list[str]) -> _Column:
    """A column of few values, each parsed once."""
    parsed = [_parsed(column, text) for text in texts]
    doubtful = np.array([doubt for _, doubt in parsed])
    values = tuple(value for value, _ in parsed)
    return _Column(cells=Coded(codes=codes, values=values), doubted=np.flatnonzero(doubtful[codes]))


def _parsed(column: Column, cell: str) -> tuple[Cell, bool]:
    """The value of a cell, and whether it is doubtful: then the careful reader is to say what is wrong."""
    try:
        value = parse_cell(column, cell, 1)
    except BadLogError:
        return None, True
    if column.name == "participant_id" and not is_code(cell):  # it might be another cell's code, but guarded
        return None, True
    return value, False


def _numbers(column: Column, cells: Texts) -> _Column:
    numbers, odd = log_cells.decimals(cells)
    if not odd.size:
        return _Column(cells=numbers, doubted=odd)
    numbers = numbers.copy()
    parsed = [_parsed(column, cell) for cell in cells.take(pa.array(odd)).to_pylist()]
    numbers[odd] = [np.nan if value is None else value for value, _ in parsed]
    return _Column(cells=numbers, doubted=odd[[doubt for _, doubt in parsed]])


def _doubted(experiment: str, table: Mapping[str, _Column], first: Integers) -> Integers:
    """The rows that may break a rule, alone or with the row before. `first` is each file's first row."""
    trial = table["trial"].numbers()
    begins = np.zeros(len(trial), dtype=np.bool_)
    begins[first] = True
    off = ~begins & _changes(table["participant_id"].coded.codes)
    if experiment == "direction":
        off |= _wrong_answers(table) | ~_in_order(table, trial, begins)
    else:
        rating = np.asarray(table["rating"].cells, dtype=np.float64)
        off |= (rating < 0.0) | (rating > 10.0) | (trial != np.where(begins, 1, _before(trial) + 1))
    return np.concatenate([np.flatnonzero(off), *(column.doubted for column in table.values())])


def _wrong_answers(table: Mapping[str, _Column]) -> Flags:
    """Rows where `correct` does not say whether the response is the direction."""
    direction, response = table["direction"].coded, table["response"].coded
    due = np.array(
        [[-1 if given is None else int(given == shown) for given in response.values] for shown in direction.values]
    )
    return np.asarray(due[direction.codes, response.codes] != table["correct"].numbers())


def _in_order(table: Mapping[str, _Column], trial: Integers, begins: Flags) -> Flags:
    """Rows that begin a session with trial 1, or go on with the next trial of the same method."""
    session = table["session"].numbers()
    goes_on = (session == _before(session)) & (trial == _before(trial) + 1) & ~_changes(table["method"].coded.codes)
    first = (trial == 1) & (session == np.where(begins, 1, _before(session) + 1))
    return np.asarray(np.where(begins, first, first | goes_on))


def _before(numbers: NDArray[Any]) -> NDArray[Any]:
    return np.concatenate([numbers[:1], numbers[:-1]])


def _changes(codes: NDArray[Any]) -> Flags:
    return np.asarray(codes != _before(codes))
