"""The rules that bind rows once more, row after row: what the checks over arrays are held to."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise

from analysis.logs.cell_rules import as_moment, cell_fault, cell_value, experiment_of
from analysis.logs.files import BadLogError
from experiments.record import tables

Cell = str | int | float | None
Row = dict[str, Cell]


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A checked log table: the experiment, its parsed rows, and the line of the file each row starts on."""

    experiment: str
    rows: tuple[Row, ...]
    lines: tuple[int, ...]


def check_table(records: Sequence[tuple[int, list[str]]], code_in_name: str | None) -> Table:
    """The table in `records` (line number and cells, header first) if it keeps every rule; else `BadLogError`."""
    line, header = records[0]
    experiment = experiment_of(header)
    if len(records) == 1:
        raise BadLogError("has a header but no rows (rule: one row a planned trial)", line)
    rows = tuple(_row(experiment, header, number, cells) for number, cells in records[1:])
    table = Table(experiment=experiment, rows=rows, lines=tuple(number for number, _ in records[1:]))
    _check_participant(table, code_in_name)
    if experiment == "direction":
        _check_answers(table)
        _check_sessions(table)
        _check_sets(table)
        _check_times(table)
    else:
        _check_run("trial", [(row["trial"], number) for row, number in _numbered(table)], "the run")
    _check_order(table)
    _check_onsets(table)
    return table


def _numbered(table: Table) -> Iterable[tuple[Row, int]]:
    return zip(table.rows, table.lines, strict=True)


def _row(experiment: str, header: list[str], line: int, cells: list[str]) -> Row:
    if len(cells) != len(header):
        raise BadLogError(f"has {len(cells)} fields (rule: {len(header)}, as in the header)", line)
    given = dict(zip(header, cells, strict=True))
    row: Row = {}
    for column in tables.TABLES[experiment]:
        text = given.get(column.name, tables.MISSING)
        if fault := cell_fault(column, text):
            raise BadLogError(fault, line, column.name)
        row[column.name] = cell_value(column, text)
    return row


def _check_participant(table: Table, code_in_name: str | None) -> None:
    code = str(table.rows[0]["participant_id"])
    first = table.lines[0]
    if not re.fullmatch("[A-Za-z0-9]{1,32}", code):
        raise BadLogError(
            f"{_shown(code)} is not a code (rule: 1 to 32 letters or digits, A-Z, a-z, 0-9)", first, "participant_id"
        )
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


def _in_sessions(table: Table) -> list[tuple[Row, int]]:
    return sorted(_numbered(table), key=lambda one: (_as_int(one[0].get("session")), _as_int(one[0]["trial"])))


def _check_sets(table: Table) -> None:
    before: dict[Cell, int] = {}
    wrong = []
    for row, line in _in_sessions(table):
        step = _as_int(row["set"]) - before.get(row["session"], 0)
        if step not in (0, 1) or (row["session"] not in before and step != 1):
            wrong.append((line, row))
        before[row["session"]] = _as_int(row["set"])
    for line, row in sorted(wrong, key=lambda one: one[0])[:1]:
        where = f"set {row['set']} at trial {row['trial']} of session {row['session']}"
        raise BadLogError(f"{where} (rule: sets 1, 2, 3, ... one after the other)", line, "set")


def _check_times(table: Table) -> None:
    times = [row["response_time_s"] for row in table.rows if row["response_time_s"] is not None]
    if len(times) >= 10 and len(set(times)) == 1:
        rule = "(rule: times that were measured differ; leave the cells empty where none was measured)"
        raise BadLogError(
            f"all {len(times)} response times are {times[0]:g} s {rule}", table.lines[0], "response_time_s"
        )


def _check_order(table: Table) -> None:
    places = {id(row): place for place, row in enumerate(table.rows)}
    rows = _in_sessions(table)
    behind = [(line, row) for (row, line), (later, _) in pairwise(rows) if places[id(row)] > places[id(later)]]
    for line, row in sorted(behind, key=lambda one: one[0])[:1]:
        where = f"trial {row['trial']}" + (f" of session {row['session']}" if "session" in row else "")
        raise BadLogError(f"{where} stands behind a later one (rule: rows in the order of the run)", line, "trial")


def _check_onsets(table: Table) -> None:
    onsets = [(str(row["onset_utc"]), line, row) for row, line in _numbered(table) if row["onset_utc"] is not None]
    for text, line, _ in onsets:
        if as_moment(text) is None:
            rule = "(rule: date and time by ISO 8601, as 2026-11-21T09:00:00Z)"
            raise BadLogError(f"{_shown(text)} is no date and time {rule}", line, "onset_utc")
    before = ""
    for text, line, row in onsets:
        flags = str(row["flags"]).split()
        if before and _moment(text) < _moment(before) and "clock-set-back" not in flags:
            rule = "(rule: later, unless the flag clock-set-back says that the clock was set back)"
            raise BadLogError(f"{_shown(text)} is earlier than the onset before it {rule}", line, "onset_utc")
        before = before if "repeated" in flags else text


def _moment(text: str) -> datetime:
    found = as_moment(text)
    assert found is not None
    return found


def _as_int(number: Cell) -> int:
    return number if isinstance(number, int) else 0


def _cell_text(cell: Cell) -> str:
    return "empty" if cell is None else repr(cell)


def _shown(text: str) -> str:
    """`text` in quotes, cut to what fits into a message."""
    return repr(text if len(text) <= 80 else text[:77] + "...")
