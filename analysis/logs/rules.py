"""The rules that a log table has to keep, each written once, over many logs with the same header at once.

Of each log the first breach is told, with its place. Rules stand in an order: a cell's own, then whose log it is, then
what binds cells of a row, then what binds rows; of the same rule's breaches the one in the first row is told.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from analysis.logs.files import BadLogError
from analysis.logs.frames import Block, Cell, Cells, Coded, chosen
from analysis.logs.texts import TEXT, Texts, TextTable, decimals, few, has_many_values, unguarded
from experiments.record import columns
from experiments.record.columns import Column

Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]

_MEASURES = {"direction": ("response", "correct"), "preference": ("rating",)}
"""Columns without which a table has nothing to analyse, though a cell of them may be empty."""
_CODE = re.compile(r"[A-Za-z0-9]{1,32}")
_INTEGER = re.compile(r"[+-]?[0-9]{1,15}")
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,4})?")
_NO_ROWS: Integers = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """The rows of the logs that keep every rule, and by the logs' numbers each one's participant, or what is wrong."""

    block: Block | None = None
    codes: Mapping[int, str] = field(default_factory=dict)
    faults: Mapping[int, BadLogError] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Parsed:
    """A column's values, and the rows whose text is none that the column may hold."""

    column: Column
    cells: Cells
    wrong: Integers = field(default_factory=lambda: _NO_ROWS)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Table:
    """Rows with their parsed columns, and the row with which each log begins."""

    texts: TextTable
    parsed: Mapping[str, _Parsed]
    first: Integers

    def coded(self, name: str) -> Coded:
        """A column of few values."""
        cells = self.parsed[name].cells
        if not isinstance(cells, Coded):
            raise TypeError(f"column {name!r} has no codes")
        return cells

    def value(self, name: str, row: int) -> Cell:
        """A cell of such a column."""
        found = self.coded(name)
        return found.values[int(found.codes[row])]

    def whole(self, name: str) -> Integers:
        """The values of such a column as whole numbers, -1 for none."""
        values = [-1 if value is None else value for value in self.coded(name).values]
        return np.array(values, dtype=np.int64)[self.coded(name).codes]

    def log(self, row: int) -> int:
        """The place of the log that a row is of."""
        return int(np.searchsorted(self.first, row, side="right")) - 1

    def logs(self, rows: Integers) -> Integers:
        """The place of the log that each row is of."""
        return np.asarray(np.searchsorted(self.first, rows, side="right") - 1)

    def rows_of_log(self, row: int) -> range:
        """The rows of the log that a row is of."""
        log = self.log(row)
        return range(int(self.first[log]), int(self.first[log]) + self.texts.rows[log])

    def line(self, row: int) -> int:
        """The line of its file on which a row starts."""
        return self.texts.lines[self.log(row)][row - self.rows_of_log(row).start]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Breach:
    """Rows that break a rule, and what is to be said of one of them."""

    rows: Integers
    said: Callable[[int], BadLogError]


def check(texts: TextTable, codes_in_names: Mapping[int, str | None]) -> Checked:
    """Check logs with the same header by every rule. `codes_in_names` are those of participants in the files' names."""
    try:
        experiment = experiment_of(texts.header)
        if not sum(texts.rows):
            raise BadLogError("has a header but no rows (rule: one row a planned trial)", 1)
    except BadLogError as bad:
        return Checked(faults=dict.fromkeys(texts.logs, bad))
    rows = np.array(texts.rows, dtype=np.int64)
    parsed = {column.name: _parsed(column, texts, int(rows.sum())) for column in columns.TABLES[experiment]}
    table = _Table(texts=texts, parsed=parsed, first=np.cumsum(rows) - rows)
    faults = _first_faults(table, _rules(experiment, table, codes_in_names))
    good = np.array([place not in faults for place in range(len(rows))], dtype=np.bool_)
    kept = None if good.all() else np.flatnonzero(np.repeat(good, rows))
    return Checked(
        block=Block(
            experiment=experiment,
            columns={name: one.cells if kept is None else chosen(one.cells, kept) for name, one in parsed.items()},
            log=np.array(texts.logs, dtype=np.int64)[good],
            rows=rows[good],
        ),
        codes={texts.logs[at]: str(table.value("participant_id", int(table.first[at]))) for at in np.flatnonzero(good)},
        faults={texts.logs[at]: fault for at, fault in faults.items()},
    )


def _first_faults(table: _Table, rules: Iterator[Sequence[_Breach]]) -> dict[int, BadLogError]:
    """By the places of logs what is wrong first: by the first rules that a log breaks, there in the first row."""
    found: dict[int, BadLogError] = {}
    for breaches in rules:
        which = np.repeat(np.arange(len(breaches)), [one.rows.size for one in breaches])
        rows = np.concatenate([one.rows for one in breaches])
        order = np.argsort(rows, kind="stable")
        logs, firsts = np.unique(table.logs(rows[order]), return_index=True)
        for log, at in zip(logs.tolist(), order[firsts].tolist(), strict=True):
            if log not in found:
                found[log] = breaches[which[at]].said(int(rows[at]))
    return found


def _rules(experiment: str, table: _Table, codes_in_names: Mapping[int, str | None]) -> Iterator[Sequence[_Breach]]:
    """The breaches of each rule, in the order of the rules."""
    wrong = [_Breach(rows=one.wrong, said=partial(_wrong_cell, table, one.column)) for one in table.parsed.values()]
    yield [_ragged(table), *wrong]
    yield from _one_participant(table, codes_in_names)
    if experiment == "direction":
        yield [_wrong_answers(table)]
        yield from _numbered_sessions(table)
    else:
        yield [_off_the_scale(table)]
        yield [_numbered_trials(table, _sessions(table, np.zeros(sum(table.texts.rows), dtype=np.int64)))]


def experiment_of(header: Sequence[str]) -> str:
    """Which table the header is of: the one that shares most columns with it. `BadLogError`: none, or not all of it."""
    shared = {name: len(set(header) & set(columns.names(name))) for name in columns.TABLES}
    experiment = max(shared, key=lambda name: shared[name])
    if shared[experiment] < 4:
        raise BadLogError(
            f"the header {_shown(','.join(header))} is neither a trials nor a ratings table of Recoil "
            "(a log of another experiment or program, or not comma-separated)",
            1,
        )
    for name in header:
        if header.count(name) > 1:
            raise BadLogError(f"column {name!r} stands {header.count(name)} times in the header (rule: once)", 1, name)
    required = [column.name for column in columns.TABLES[experiment] if column.required]
    for name in (*required, *_MEASURES[experiment]):
        if name not in header:
            raise BadLogError(f"column {name!r} is missing (rule: a {experiment} table has it)", 1, name)
    return experiment


def cell_fault(column: Column, text: str) -> str:
    """Why a column may not hold a text; empty if it may."""
    if text == columns.MISSING:
        return "the cell is empty (rule: a value is required)" if column.required else ""
    if column.type == "integer" and not _INTEGER.fullmatch(text):
        return f"{_shown(text)} is not a whole number of at most 15 digits"
    if column.type == "number" and not (_NUMBER.fullmatch(text) and math.isfinite(float(text))):
        return f"{_shown(text)} is not a finite number with a decimal point"
    if column.levels and text not in column.levels:
        return f"{_shown(text)} is not allowed (rule: one of {', '.join(column.levels)})"
    return ""


def cell_value(column: Column, text: str) -> Cell:
    """The value of a text that a column may hold; `None` for an empty one."""
    if text == columns.MISSING:
        return None
    if column.type == "number":
        return float(text)
    if column.type in ("integer", "flag"):
        return int(text)
    return columns.unguard(text) if column.type == "text" else text


def _parsed(column: Column, texts: TextTable, rows: int) -> _Parsed:
    if column.name not in texts.texts:
        return _Parsed(column=column, cells=_empty(column, rows))
    cells = texts.texts[column.name]
    if column.type == "number":
        return _numbers(column, cells)
    if has_many_values(column):
        empty = np.flatnonzero(cells.is_null()) if column.required else _NO_ROWS
        return _Parsed(column=column, cells=unguarded(cells), wrong=empty)
    return _few_values(column, *few(cells))


def _empty(column: Column, rows: int) -> Cells:
    if column.type == "number":
        return np.full(rows, np.nan)
    if has_many_values(column):
        return pa.nulls(rows, TEXT)
    return Coded(codes=np.zeros(rows, dtype=np.int32), values=(None,))


def _few_values(column: Column, codes: NDArray[np.int32], texts: list[str]) -> _Parsed:
    """A column of few values, each parsed once; texts that mean the same get the same code."""
    wrong = np.array([cell_fault(column, text) != "" for text in texts])
    values = [None if bad else cell_value(column, text) for bad, text in zip(wrong, texts, strict=True)]
    places = {value: place for place, value in enumerate(dict.fromkeys(values))}
    if len(places) < len(values):
        codes_of_texts = np.array([places[value] for value in values], dtype=np.int32)
        cells = Coded(codes=codes_of_texts[codes], values=tuple(places))
    else:
        cells = Coded(codes=codes, values=tuple(values))
    return _Parsed(column=column, cells=cells, wrong=np.flatnonzero(wrong[codes]) if wrong.any() else _NO_ROWS)


def _numbers(column: Column, texts: Texts) -> _Parsed:
    numbers, odd = decimals(texts)
    if not odd.size:
        return _Parsed(column=column, cells=numbers)
    cells = texts.take(pa.array(odd)).to_pylist()
    wrong = np.array([cell_fault(column, cell) != "" for cell in cells])
    numbers = numbers.copy()
    numbers[odd[~wrong]] = [float(cell) for cell, bad in zip(cells, wrong, strict=True) if not bad]
    return _Parsed(column=column, cells=numbers, wrong=odd[wrong])


def _ragged(table: _Table) -> _Breach:
    """Rows that have not as many fields as the header."""
    return _Breach(rows=np.array(sorted(table.texts.ragged), dtype=np.int64), said=partial(_say_ragged, table))


def _say_ragged(table: _Table, row: int) -> BadLogError:
    rule = f"(rule: {len(table.texts.header)}, as in the header)"
    return BadLogError(f"has {table.texts.ragged[row]} fields {rule}", table.line(row))


def _wrong_cell(table: _Table, column: Column, row: int) -> BadLogError:
    text = table.texts.texts[column.name][row].as_py() or columns.MISSING
    return BadLogError(cell_fault(column, text), table.line(row), column.name)


def _one_participant(table: _Table, names: Mapping[int, str | None]) -> Iterator[Sequence[_Breach]]:
    """One participant a file, with a code that is one, and that of the file's name."""
    column = table.coded("participant_id")
    own = column.codes[table.first]
    codes = [str(column.values[code]) for code in own.tolist()]
    no_code = np.array([_CODE.fullmatch(code) is None for code in codes])
    yield [_Breach(rows=table.first[no_code], said=partial(_say_no_code, table))]
    named = [names.get(log) for log in table.texts.logs]
    other_name = np.array([name not in (None, code) for name, code in zip(named, codes, strict=True)])
    yield [_Breach(rows=table.first[other_name], said=partial(_say_other_name, table, names))]
    others = np.flatnonzero(column.codes != np.repeat(own, table.texts.rows))
    yield [_Breach(rows=others, said=partial(_say_another, table))]


def _say_no_code(table: _Table, row: int) -> BadLogError:
    shown = _shown(str(table.value("participant_id", row)))
    return BadLogError(f"{shown} is not a code (rule: 1 to 32 letters or digits)", table.line(row), "participant_id")


def _say_other_name(table: _Table, names: Mapping[int, str | None], row: int) -> BadLogError:
    name = names[table.texts.logs[table.log(row)]]
    rule = f"the file is named sub-{name} (rule: one participant a file, the one in its name)"
    message = f"participant {table.value('participant_id', row)!r}, but {rule}"
    return BadLogError(message, table.line(row), "participant_id")


def _say_another(table: _Table, row: int) -> BadLogError:
    own = table.value("participant_id", table.rows_of_log(row).start)
    other = _shown(str(table.value("participant_id", row)))
    return BadLogError(f"{other} after {own!r} (rule: one participant a file)", table.line(row), "participant_id")


def _wrong_answers(table: _Table) -> _Breach:
    """Rows where `correct` does not say whether the response is the direction."""
    direction, response = table.coded("direction"), table.coded("response")
    due = np.array(
        [[-1 if given is None else int(given == shown) for given in response.values] for shown in direction.values]
    )
    wrong = np.flatnonzero(due[direction.codes, response.codes] != table.whole("correct"))
    return _Breach(rows=wrong, said=partial(_say_wrong_answer, table))


def _say_wrong_answer(table: _Table, row: int) -> BadLogError:
    direction, response, correct = (table.value(name, row) for name in ("direction", "response", "correct"))
    if response is None or correct is None:
        given, so = ("empty" if one is None else repr(one) for one in (response, correct))
        message = f"response {given} with correct {so} (rule: both or neither are given)"
    else:
        shown = f"correct is {correct}, but the direction was {direction} and the response {response}"
        message = f"{shown} (rule: 1 if they are the same, else 0)"
    return BadLogError(message, table.line(row), "correct")


def _off_the_scale(table: _Table) -> _Breach:
    """Ratings that are not 0 to 10."""
    rating = np.asarray(table.parsed["rating"].cells, dtype=np.float64)
    return _Breach(rows=np.flatnonzero((rating < 0.0) | (rating > 10.0)), said=partial(_say_rating, table, rating))


def _say_rating(table: _Table, rating: NDArray[np.float64], row: int) -> BadLogError:
    return BadLogError(f"rating {rating[row]:g} is out of range (rule: 0 to 10)", table.line(row), "rating")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Sessions:
    """Rows in the order of log, session and trial; where there each session of a log begins, and its first row."""

    session: Integers
    trial: Integers
    order: Integers
    begins: Integers
    first: Integers


def _sessions(table: _Table, session: Integers) -> _Sessions:
    trial, log = table.whole("trial"), np.repeat(np.arange(len(table.first)), table.texts.rows)
    order = np.lexsort((trial, session, log))
    begins = _begins((np.diff(log[order]) != 0) | (np.diff(session[order]) != 0))
    return _Sessions(session=session, trial=trial, order=order, begins=begins, first=np.minimum.reduceat(order, begins))


def _begins(changes: Flags) -> Integers:
    """Where runs begin, from whether each but the first begins one."""
    return np.append(0, np.flatnonzero(changes) + 1)


def _miscounted(numbers: Integers, begins: Integers) -> Integers:
    """The runs of sorted numbers that are not 1, 2, 3, ..., by their places."""
    run = np.repeat(np.arange(len(begins)), np.diff(np.append(begins, len(numbers))))
    return np.unique(run[numbers != np.arange(1, len(numbers) + 1) - begins[run]])


def _numbered_sessions(table: _Table) -> Iterator[Sequence[_Breach]]:
    """One method a session; sessions 1, 2, 3, ... in a log, and trials 1, 2, 3, ... in a session, in any order."""
    found = _sessions(table, table.whole("session"))
    method = table.coded("method").codes
    first = np.repeat(found.first, np.diff(np.append(found.begins, len(found.order))))
    others = found.order[method[found.order] != method[first]]
    yield [_Breach(rows=others, said=partial(_say_method, table, found))]
    logs = _begins(np.diff(table.logs(found.first)) != 0)
    rows = found.first[logs[_miscounted(found.session[found.first], logs)]]
    yield [_Breach(rows=rows, said=partial(_say_session, table, found))]
    yield [_numbered_trials(table, found)]


def _numbered_trials(table: _Table, found: _Sessions) -> _Breach:
    """The first rows of sessions whose trials are not 1, 2, 3, ..."""
    wrong = _miscounted(found.trial[found.order], found.begins)
    return _Breach(rows=found.first[wrong], said=partial(_say_trial, table, found))


def _say_method(table: _Table, found: _Sessions, row: int) -> BadLogError:
    session = found.session[row]
    first = next(one for one in table.rows_of_log(row) if found.session[one] == session)
    shown = f"{table.value('method', row)!r} in session {session}, which began with {table.value('method', first)!r}"
    return BadLogError(f"{shown} (rule: one method a session)", table.line(row), "method")


def _say_session(table: _Table, found: _Sessions, row: int) -> BadLogError:
    firsts: dict[int, int] = {}
    for one in table.rows_of_log(row):
        firsts.setdefault(int(found.session[one]), one)
    return _miscount(table, "session", list(firsts), list(firsts.values()), "the run")


def _say_trial(table: _Table, found: _Sessions, row: int) -> BadLogError:
    session = found.session[row]  # 0 where a table has no sessions; where it has, 0 is refused before
    rows = [one for one in table.rows_of_log(row) if found.session[one] == session]
    where = f"session {session}" if session else "the run"
    return _miscount(table, "trial", found.trial[rows].tolist(), rows, where)


def _miscount(table: _Table, column: str, numbers: Sequence[int], rows: Sequence[int], where: str) -> BadLogError:
    """What is wrong with numbers that are not 1, 2, 3, ..., each once, in any order."""
    seen: set[int] = set()
    for number, row in zip(numbers, rows, strict=True):
        if number in seen:
            rule = "(rule: 1, 2, 3, ... once each)"
            return BadLogError(f"{column} {number} stands twice in {where} {rule}", table.line(row), column)
        seen.add(number)
    missing = next(number for number in range(1, len(numbers) + 1) if number not in seen)
    rule = f"(rule: 1, 2, 3, ... without a gap; found {_shown(', '.join(map(str, sorted(seen))))})"
    return BadLogError(f"{column} {missing} is missing in {where} {rule}", table.line(rows[-1]), column)


def _shown(text: str) -> str:
    """`text` in quotes, cut to what fits into a message."""
    return repr(text if len(text) <= 80 else text[:77] + "...")
