"""Logs that Recoil did not write, by a column map, as records of Recoil's own tables: the same rules check them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from analysis.logs.column_map import ColumnMap, Skip
from analysis.logs.rules import BadLogError, Table, check_table
from experiments.record import columns

_Row = dict[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class MappedLog:
    """One participant's log in a file, or why it breaks a rule; the study if the map knows it."""

    study: str | None
    code: str
    table: Table | BadLogError


@dataclass(frozen=True, slots=True, kw_only=True)
class _Line:
    number: int
    cells: _Row


def read_mapped(content: bytes, file_name: str, mapping: ColumnMap) -> list[MappedLog]:
    """The logs in a file, one a participant and study, checked by every rule; `BadLogError` if it is no such table."""
    lines = _wanted(_lines(content, mapping), mapping)
    people: dict[tuple[str | None, str], list[_Line]] = {}
    for line in lines:
        study = line.cells[mapping.columns.study] if mapping.columns.study else None
        people.setdefault((study, _participant(line, file_name, mapping)), []).append(line)
    if not people:
        raise BadLogError("has no row left to read (rule: at least one that `skip` does not leave out)")
    return [
        MappedLog(study=study, code=code, table=_table_or_fault(code, group, mapping))
        for (study, code), group in people.items()
    ]


def is_recoils(content: bytes) -> bool:
    """Whether a file has the header of one of Recoil's own tables, so that no map is needed."""
    header = set(content.partition(b"\n")[0].decode("utf-8-sig", errors="replace").strip().split(","))
    return any({one.name for one in table if one.required} <= header for table in columns.TABLES.values())


def _table_or_fault(code: str, lines: Sequence[_Line], mapping: ColumnMap) -> Table | BadLogError:
    try:
        return _table(code, lines, mapping)
    except BadLogError as bad:
        return bad


def _lines(content: bytes, mapping: ColumnMap) -> Iterator[_Line]:
    try:
        text = content.decode(mapping.text.encoding)
    except UnicodeDecodeError as error:
        rule = f"(rule: {mapping.text.encoding} text, as the map says)"
        raise BadLogError(
            f"byte 0x{content[error.start]:02x} is not {mapping.text.encoding} {rule}",
            content[: error.start].count(b"\n") + 1,
        ) from error
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=mapping.text.delimiter, strict=True)
    start = 1
    try:
        header = next(reader, [])
        _check_header(header, mapping)
        start = reader.line_num + 1
        for cells in reader:
            if any(cells):
                yield _Line(number=start, cells=_cells(header, cells, start, mapping))
            start = reader.line_num + 1
    except csv.Error as error:
        raise BadLogError(f"is not separated text: {error}", start) from error


def _cells(header: list[str], cells: list[str], line: int, mapping: ColumnMap) -> _Row:
    if len(cells) != len(header):
        raise BadLogError(f"has {len(cells)} fields (rule: {len(header)}, as in the header)", line)
    return {
        name: columns.MISSING if cell.strip() in mapping.text.missing else cell.strip()
        for name, cell in zip(header, cells, strict=True)
    }


def _check_header(header: list[str], mapping: ColumnMap) -> None:
    named = [*mapping.columns.model_dump(exclude_none=True).values(), *(skip.column for skip in mapping.skip)]
    for name in filter(None, [mapping.participant.column, *named]):
        if name not in header:
            raise BadLogError(f"column {name!r} is missing (rule: the map names it)", 1, name)
        if header.count(name) > 1:
            raise BadLogError(f"column {name!r} stands {header.count(name)} times in the header (rule: once)", 1, name)


def _wanted(lines: Iterator[_Line], mapping: ColumnMap) -> list[_Line]:
    return [line for line in lines if not any(_skips(skip, line.cells[skip.column]) for skip in mapping.skip)]


def _skips(skip: Skip, cell: str) -> bool:
    return cell in skip.values or (skip.empty and cell == columns.MISSING)


def _participant(line: _Line, file_name: str, mapping: ColumnMap) -> str:
    if mapping.participant.column is not None:
        code = line.cells[mapping.participant.column]
    else:
        match = re.search(mapping.participant.file_name or "", file_name)
        if match is None or match[1] is None:
            rule = f"(rule: participant.file_name = {mapping.participant.file_name!r} finds it)"
            raise BadLogError(f"the name has no participant's code {rule}")
        code = match[1]
    return mapping.values.participant.get(code, code)


def _table(code: str, lines: Sequence[_Line], mapping: ColumnMap) -> Table:
    header = columns.names(mapping.experiment)
    make = _trial if mapping.experiment == "direction" else _rating
    rows = [make(line, mapping) | _common(code, line, mapping) for line in lines]
    _number(rows, mapping)
    records: list[tuple[int, list[str]]] = [(1, header)]
    records += [
        (line.number, [row.get(name, columns.MISSING) for name in header])
        for line, row in zip(lines, rows, strict=True)
    ]
    return check_table(records, None)


def _common(code: str, line: _Line, mapping: ColumnMap) -> _Row:
    named = mapping.columns.model_dump(exclude_none=True)
    row: _Row = {name: line.cells[named[name]] for name in ("session", "set", "trial") if name in named}
    texts: _Row = {
        name: columns.guard(line.cells[named[name]]) for name in ("flags", "note", "comment") if name in named
    }
    row |= texts
    method = line.cells[mapping.columns.method]
    return row | {
        "participant_id": code,
        "experiment": mapping.experiment,
        "method": mapping.values.method.get(method, method),
        "gun": mapping.gun,
    }


def _trial(line: _Line, mapping: ColumnMap) -> _Row:
    direction = _translated(line, "direction", mapping)
    response = _translated(line, "response", mapping)
    time = _seconds(line, mapping)
    return {
        "direction": direction,
        "response": response,
        "correct": str(int(response == direction)) if response else columns.MISSING,
        "response_time_s": time,
        "response_source": mapping.response_source if response else columns.MISSING,
        "response_time_valid": _valid(mapping) if time else columns.MISSING,
        "instruction": _instruction(line, mapping),
    }


def _valid(mapping: ColumnMap) -> str:
    """Whether a time is the answerer's own."""
    return str(int(mapping.response_source != "experimenter"))


def _instruction(line: _Line, mapping: ColumnMap) -> str:
    """The instruction; one that the map does not name keeps its name."""
    cell = line.cells[mapping.columns.instruction] if mapping.columns.instruction else columns.MISSING
    return mapping.values.instruction.get(cell, cell)


def _rating(line: _Line, mapping: ColumnMap) -> _Row:
    cell = line.cells[str(mapping.columns.rating)].replace(mapping.text.decimal, ".")
    if mapping.rating is not None and (value := _number_in(cell)) is not None:
        scale = mapping.rating
        if not scale.scale_min <= value <= scale.scale_max:
            rule = f"(rule: {scale.scale_min:g} to {scale.scale_max:g}, as the map says)"
            raise BadLogError(f"rating {cell} is out of range {rule}", line.number, mapping.columns.rating)
        cell = repr(10.0 * (value - scale.scale_min) / (scale.scale_max - scale.scale_min))
    return {"rating": cell, "rating_by": mapping.response_source if cell else columns.MISSING}


def _translated(line: _Line, name: str, mapping: ColumnMap) -> str:
    """What a cell of the column means; `BadLogError` if the map does not say."""
    column, known = getattr(mapping.columns, name), getattr(mapping.values, name)
    cell = line.cells[column]
    if cell == columns.MISSING or cell in known or cell in ("forward", "backward"):
        return str(known.get(cell, cell))
    rule = f"(rule: one of {', '.join([*known, 'forward', 'backward'])}; values.{name} says what they mean)"
    raise BadLogError(f"{cell!r} is not allowed {rule}", line.number, column)


def _seconds(line: _Line, mapping: ColumnMap) -> str:
    if mapping.columns.response_time is None or mapping.response_time is None:
        return columns.MISSING
    cell = line.cells[mapping.columns.response_time].replace(mapping.text.decimal, ".")
    value = _number_in(cell)
    return repr(value / 1000.0) if value is not None and mapping.response_time.unit == "ms" else cell


def _number_in(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None  # the rules say what is wrong with it


def _number(rows: list[_Row], mapping: ColumnMap) -> None:
    """Sessions by method, sets and trials in the order of rows, where the map names no column for them."""
    methods: dict[str, int] = {}
    counts: dict[str, int] = {}
    for row in rows:
        session = row.setdefault("session", str(methods.setdefault(row["method"], len(methods) + 1)))
        block = session if mapping.experiment == "direction" else ""
        counts[block] = counts.get(block, 0) + 1
        row.setdefault("trial", str(counts[block]))
        row.setdefault("set", "1")
