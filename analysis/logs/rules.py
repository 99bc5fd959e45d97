"""The rules a log table has to keep, as pure checks on its rows. The first breach is raised, with its place."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from device.words import RecoilError
from experiments.record import columns
from experiments.record.columns import Column

Cell = str | int | float | None
Row = dict[str, Cell]

_MEASURES = {"direction": ("response", "correct"), "preference": ("rating",)}
"""Columns without which a table has nothing to analyse, though a cell of them may be empty."""
_CODE = re.compile(r"[A-Za-z0-9]{1,32}")
_INTEGER = re.compile(r"[+-]?[0-9]{1,15}")
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,4})?")


class BadLogError(RecoilError):
    """A table that breaks a rule: what, and where. It never leaves the room."""

    def __init__(self, message: str, line: int | None = None, column: str | None = None) -> None:
        super().__init__(message)
        self.message, self.line, self.column = message, line, column


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A checked log table: the experiment, its parsed rows, and the line of the file each row starts on."""

    experiment: str
    rows: tuple[Row, ...]
    lines: tuple[int, ...]


def check_table(records: Sequence[tuple[int, list[str]]], code_in_name: str | None) -> Table:
    """The table in `records` (line number and cells, header first) if it keeps every rule; else `BadLogError`."""
    line, header = records[0]
    experiment = experiment_of(header, line)
    if len(records) == 1:
        raise BadLogError("has a header but no rows (rule: one row a planned trial)", line)
    rows = tuple(_row(experiment, header, number, cells) for number, cells in records[1:])
    table = Table(experiment=experiment, rows=rows, lines=tuple(number for number, _ in records[1:]))
    _check_participant(table, code_in_name)
    if experiment == "direction":
        _check_answers(table)
        _check_sessions(table)
    else:
        _check_ratings(table)
        _check_run("trial", [(row["trial"], number) for row, number in _numbered(table)], "the run")
    return table


def _numbered(table: Table) -> Iterable[tuple[Row, int]]:
    return zip(table.rows, table.lines, strict=True)


def experiment_of(header: list[str], line: int) -> str:
    """Which table the header is of: the one that shares most columns with it."""
    shared = {name: len(set(header) & set(columns.names(name))) for name in columns.TABLES}
    experiment = max(shared, key=lambda name: shared[name])
    if shared[experiment] < 4:
        raise BadLogError(
            f"the header {_shown(','.join(header))} is neither a trials nor a ratings table of Recoil "
            "(a log of another experiment or program, or not comma-separated)",
            line,
        )
    _check_header(experiment, header, line)
    return experiment


def _check_header(experiment: str, header: list[str], line: int) -> None:
    for name in header:
        if header.count(name) > 1:
            raise BadLogError(
                f"column {name!r} stands {header.count(name)} times in the header (rule: once)", line, name
            )
    required = [column.name for column in columns.TABLES[experiment] if column.required]
    for name in (*required, *_MEASURES[experiment]):
        if name not in header:
            raise BadLogError(f"column {name!r} is missing (rule: a {experiment} table has it)", line, name)


def _row(experiment: str, header: list[str], line: int, cells: list[str]) -> Row:
    if len(cells) != len(header):
        raise BadLogError(f"has {len(cells)} fields (rule: {len(header)}, as in the header)", line)
    given = dict(zip(header, cells, strict=True))
    return {
        column.name: parse_cell(column, given.get(column.name, columns.MISSING), line) for column in _of(experiment)
    }


def _of(experiment: str) -> tuple[Column, ...]:
    return columns.TABLES[experiment]


def parse_cell(column: Column, text: str, line: int) -> Cell:
    """The value of a cell, None if it is empty; `BadLogError` if it is none that the column may hold."""
    if text == columns.MISSING:
        if column.required:
            raise BadLogError("the cell is empty (rule: a value is required)", line, column.name)
        return None
    if column.type == "text":
        return columns.unguard(text)
    if column.type == "integer":
        return _integer(column, text, line)
    if column.type == "number":
        return _number(column, text, line)
    return _level(column, text, line)


def _integer(column: Column, text: str, line: int) -> int:
    if not _INTEGER.fullmatch(text):
        raise BadLogError(f"{_shown(text)} is not a whole number of at most 15 digits", line, column.name)
    return int(text)


def _number(column: Column, text: str, line: int) -> float:
    if not _NUMBER.fullmatch(text) or not math.isfinite(float(text)):
        raise BadLogError(f"{_shown(text)} is not a finite number with a decimal point", line, column.name)
    return float(text)


def _level(column: Column, text: str, line: int) -> Cell:
    if column.levels and text not in column.levels:
        raise BadLogError(f"{_shown(text)} is not allowed (rule: one of {', '.join(column.levels)})", line, column.name)
    return int(text) if column.type == "flag" else text


def is_code(text: str) -> bool:
    """Whether a text may be a participant's code."""
    return _CODE.fullmatch(text) is not None


def _check_participant(table: Table, code_in_name: str | None) -> None:
    code = str(table.rows[0]["participant_id"])
    first = table.lines[0]
    if not is_code(code):
        raise BadLogError(f"{_shown(code)} is not a code (rule: 1 to 32 letters or digits)", first, "participant_id")
    if code_in_name is not None and code_in_name != code:
        rule = f"the file is named sub-{code_in_name} (rule: one participant a file, the one in its name)"
        raise BadLogError(f"participant {code!r}, but {rule}", first, "participant_id")
    for row, line in _numbered(table):
        if row["participant_id"] != code:
            other = _shown(str(row["participant_id"]))
            raise BadLogError(f"{other} after {code!r} (rule: one participant a file)", line, "participant_id")


def _check_answers(table: Table) -> None:
    for row, line in _numbered(table):
        response, correct = row["response"], row["correct"]
        if (response is None) != (correct is None):
            shown = f"response {_cell_text(response)} with correct {_cell_text(correct)}"
            raise BadLogError(f"{shown} (rule: both or neither are given)", line, "correct")
        if response is not None and correct != int(response == row["direction"]):
            shown = f"correct is {correct}, but the direction was {row['direction']} and the response {response}"
            raise BadLogError(f"{shown} (rule: 1 if they are the same, else 0)", line, "correct")


def _check_ratings(table: Table) -> None:
    for row, line in _numbered(table):
        rating = row["rating"]
        if isinstance(rating, float) and not 0.0 <= rating <= 10.0:
            raise BadLogError(f"rating {rating:g} is out of range (rule: 0 to 10)", line, "rating")


def _check_sessions(table: Table) -> None:
    first_line: dict[Cell, int] = {}
    methods: dict[Cell, Cell] = {}
    for row, line in _numbered(table):
        session, method = row["session"], row["method"]
        first_line.setdefault(session, line)
        if methods.setdefault(session, method) != method:
            shown = f"{method!r} in session {session}, which began with {methods[session]!r}"
            raise BadLogError(f"{shown} (rule: one method a session)", line, "method")
    _check_run("session", list(first_line.items()), "the run")
    for session in first_line:
        trials = [(row["trial"], line) for row, line in _numbered(table) if row["session"] == session]
        _check_run("trial", trials, f"session {session}")


def _check_run(column: str, numbered: list[tuple[Cell, int]], where: str) -> None:
    """`numbered` holds 1..N, each once, in any order."""
    seen: set[Cell] = set()
    last = len(numbered)
    for number, line in numbered:
        if number in seen:
            raise BadLogError(f"{column} {number} stands twice in {where} (rule: 1, 2, 3, ... once each)", line, column)
        seen.add(number)
    missing = next((number for number in range(1, last + 1) if number not in seen), None)
    if missing is not None:
        rule = f"(rule: 1, 2, 3, ... without a gap; found {_shown(', '.join(map(str, sorted(map(_as_int, seen)))))})"
        raise BadLogError(f"{column} {missing} is missing in {where} {rule}", numbered[-1][1], column)


def _as_int(number: Cell) -> int:
    return number if isinstance(number, int) else 0


def _cell_text(cell: Cell) -> str:
    return "empty" if cell is None else repr(cell)


def _shown(text: str) -> str:
    """`text` in quotes, cut to what fits into a message."""
    return repr(text if len(text) <= 80 else text[:77] + "...")


def records(content: bytes) -> list[tuple[int, list[str]]]:
    """The records of an RFC 4180 file, each with the line it starts on."""
    text = _text(content)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    records: list[tuple[int, list[str]]] = []
    start = 1
    try:
        for cells in reader:
            records.append((start, cells))
            start = reader.line_num + 1
    except csv.Error as error:
        raise BadLogError(f"is not comma-separated text by RFC 4180: {error}", start) from error
    if not text.endswith(("\n", "\r")):
        raise BadLogError(
            "the last line has no end (rule: every row ends with a line end; was the file cut off?)", start - 1
        )
    return records


def _text(content: bytes) -> str:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise BadLogError(f"byte 0x{content[error.start]:02x} is not UTF-8 (rule: UTF-8 text)", line) from error
    if not text.strip():
        raise BadLogError("is empty (rule: a header and one row a planned trial)")
    return text
