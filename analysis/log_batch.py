"""Many log files with the same header, checked by every rule at once. Whatever is in doubt is left to `log_rules`.

A file is taken only if the careful reader would take it, with the same values: each distinct cell is parsed by the
careful reader's own function, and of the rules that bind rows together only the plainest way to keep them is known
here (trials in the order 1, 2, 3, ...).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis import log_cells
from analysis.log_cells import Flags, Grid, Integers
from analysis.log_frames import Block, Coded, is_category
from analysis.log_records import records
from analysis.log_rules import BadLogError, Cell, experiment_of, is_code, parse_cell
from experiments import columns
from experiments.columns import Column

_HEADER = re.compile(rb"[A-Za-z0-9_, ]+\r?\n")
_STAND_INS = re.compile(rb"[\x01-\x04]")
_LONG_BYTES = 16
"""Text longer than that is not expected to come again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A file's content, and the participant's code in its name."""

    content: bytes
    code_in_name: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Cells:
    """A parsed column, and the rows whose cell is not surely right."""

    column: Coded | NDArray[Any]
    doubted: Flags

    @property
    def coded(self) -> Coded:
        """The column as numbers of its values; numbers and long text are not coded."""
        if not isinstance(self.column, Coded):
            raise TypeError("this column has no codes")
        return self.column

    def numbers(self) -> Integers:
        """The values as whole numbers, -1 for none."""
        values = [-1 if value is None else value for value in self.coded.values]
        return np.array(values, dtype=np.int64)[self.coded.codes]


def _rows(column: Coded | NDArray[Any], rows: Flags) -> Coded | NDArray[Any]:
    return replace(column, codes=column.codes[rows]) if isinstance(column, Coded) else column[rows]


def read_batch(sources: Sequence[Source]) -> tuple[list[Block], dict[int, str]]:
    """Blocks of the files that surely keep every rule, numbered as in `sources`, and each one's participant."""
    groups: dict[tuple[bytes, bool], list[int]] = {}
    texts = [_plain(source.content) for source in sources]
    for number, (text, quoted) in enumerate(texts):
        if match := _HEADER.match(text):
            groups.setdefault((match[0], quoted), []).append(number)
    blocks: list[Block] = []
    codes: dict[int, str] = {}
    for (header, quoted), numbers in groups.items():
        bodies = [texts[number][0][len(header) :] for number in numbers]
        block, found = _read_group(header, bodies, [sources[n].code_in_name for n in numbers], quoted=quoted)
        if block is not None:
            places = np.array(numbers)
            blocks.append(replace(block, log=places[block.log]))
            codes |= {numbers[place]: code for place, code in found.items()}
    return blocks, codes


def _plain(content: bytes) -> tuple[bytes, bool]:
    """The content without quotes, and whether it had some; nothing if it surely is to be read with care."""
    try:
        if b'"' not in content:
            return (content if content.isascii() or content.decode("utf-8") else b""), False
        if _STAND_INS.search(content):
            return b"", False
        return log_cells.plain(cells for _, cells in records(content)).encode(), True
    except (UnicodeDecodeError, BadLogError):
        return b"", False


def _read_group(
    header: bytes, bodies: Sequence[bytes], codes_in_names: Sequence[str | None], *, quoted: bool
) -> tuple[Block | None, dict[int, str]]:
    line_end = b"\r\n" if header.endswith(b"\r\n") else b"\n"
    names = header.removesuffix(line_end).decode("ascii").split(",")
    try:
        experiment = experiment_of(names, 1)
    except BadLogError:
        return None, {}
    grid, kept = log_cells.grid(bodies, len(names), line_end, quoted=quoted)
    if not kept:
        return None, {}
    table = {column.name: _cells(column, grid, names) for column in columns.TABLES[experiment]}
    codes = _participants(table["participant_id"], grid)
    good = np.array([codes_in_names[number] in (None, codes[place]) for place, number in enumerate(kept)])
    good[grid.text[_doubted(experiment, table, grid)]] = False
    rows = good[grid.text]
    found = {name: cells.column if rows.all() else _rows(cells.column, rows) for name, cells in table.items()}
    block = Block(experiment=experiment, columns=found, log=np.array(kept)[grid.text[rows]])
    return block, {kept[place]: codes[place] for place in np.flatnonzero(good).tolist()}


def _cells(column: Column, grid: Grid, names: list[str]) -> _Cells:
    count = len(grid.text)
    if column.name not in names:
        return _coded(column, np.zeros(count, dtype=np.int64), [columns.MISSING])
    place = names.index(column.name)
    if column.type == "number":
        return _decimals(column, grid, place)
    if column.type == "text" and not is_category(column) and int(grid.lengths[place].max()) > _LONG_BYTES:
        return _long_text(column, grid, place)
    return _coded(column, *log_cells.distinct(grid, place))


def _coded(column: Column, codes: Integers, cells: list[str]) -> _Cells:
    """A column of few values, each parsed once."""
    parsed = [_parsed(column, cell) for cell in cells]
    values = tuple(value for value, _ in parsed)
    doubted = np.array([doubt for _, doubt in parsed])[codes]
    return _Cells(column=Coded(codes=codes, values=values), doubted=doubted)


def _parsed(column: Column, cell: str) -> tuple[Cell, bool]:
    """The value of a cell, and whether it is doubtful: then the careful reader is to say what is wrong."""
    try:
        value = parse_cell(column, cell, 1)
    except BadLogError:
        return None, True
    if column.name == "participant_id" and not is_code(cell):  # it might be another cell's code, but guarded
        return None, True
    return value, False


def _decimals(column: Column, grid: Grid, place: int) -> _Cells:
    numbers, odd = log_cells.decimals(grid, place)
    rows = np.flatnonzero(odd)
    doubted = np.zeros(len(odd), dtype=np.bool_)
    for row, cell in zip(rows.tolist(), log_cells.cells(grid, place, rows), strict=True):
        value, doubted[row] = _parsed(column, cell)
        numbers[row] = np.nan if value is None else value
    return _Cells(column=numbers, doubted=doubted)


def _long_text(column: Column, grid: Grid, place: int) -> _Cells:
    """A column of text that differs from row to row."""
    lengths = grid.lengths[place]
    rows = np.flatnonzero(lengths)
    texts = np.full(len(lengths), None, dtype=object)
    cells = log_cells.cells(grid, place, rows)
    guarded = (grid.data[grid.starts[place, rows]] == ord("'")).any()
    texts[rows] = [columns.unguard(cell) for cell in cells] if guarded else cells
    doubted = (lengths == 0) & column.required
    return _Cells(column=texts, doubted=doubted)


def _participants(cells: _Cells, grid: Grid) -> list[str]:
    """The participant in the first row of each file."""
    first = np.flatnonzero(np.diff(grid.text, prepend=-1))
    return [str(cells.coded.values[code]) for code in cells.coded.codes[first].tolist()]


def _doubted(experiment: str, table: dict[str, _Cells], grid: Grid) -> Flags:
    """The rows that may break a rule, alone or with the row before."""
    doubted = np.logical_or.reduce([cells.doubted for cells in table.values()])
    begins = np.diff(grid.text, prepend=-1) > 0
    doubted |= ~begins & _changes(table["participant_id"].coded.codes)
    trial = table["trial"].numbers()
    if experiment == "direction":
        return np.asarray(doubted | _wrong_answers(table) | ~_in_order(table, trial, begins))
    rating = np.asarray(table["rating"].column, dtype=np.float64)
    off = (rating < 0.0) | (rating > 10.0) | (trial != np.where(begins, 1, _before(trial) + 1))
    return np.asarray(doubted | off)


def _wrong_answers(table: dict[str, _Cells]) -> Flags:
    """Rows where `correct` does not say whether the response is the direction."""
    direction, response = table["direction"].coded, table["response"].coded
    due = np.array(
        [[-1 if given is None else int(given == shown) for given in response.values] for shown in direction.values]
    )
    return np.asarray(due[direction.codes, response.codes] != table["correct"].numbers())


def _in_order(table: dict[str, _Cells], trial: Integers, begins: Flags) -> Flags:
    """Rows that begin a session with trial 1, or go on with the next trial of the same method."""
    session = table["session"].numbers()
    goes_on = (session == _before(session)) & (trial == _before(trial) + 1) & ~_changes(table["method"].coded.codes)
    first = (trial == 1) & (session == np.where(begins, 1, _before(session) + 1))
    return np.asarray(np.where(begins, first, first | goes_on))


def _before(numbers: Integers) -> Integers:
    return np.concatenate([numbers[:1], numbers[:-1]])


def _changes(codes: Integers) -> Flags:
    return np.asarray(codes != _before(codes))
