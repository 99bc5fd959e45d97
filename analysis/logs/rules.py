"""The rules that a log table has to keep, each written once, over many logs with the same header at once.

Of each log the first breach is told, with its place: by the first rule that it breaks, in the first row that does. The
rules of the cells come first, then whose log it is, then what binds the cells of a row, then what binds rows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from analysis.logs.cell_rules import (
    FEWEST_ALIKE,
    all_alike,
    cell_fault,
    cell_value,
    experiment_of,
    no_date,
    onset_moments,
    quoted,
    too_early,
)
from analysis.logs.files import BadLogError
from analysis.logs.texts import (
    Block,
    Cell,
    Cells,
    Coded,
    Texts,
    TextTable,
    chosen,
    decimals,
    few,
    has_many_values,
    unguarded,
)
from analysis.stats.arrays import BoolArray
from experiments.record import tables
from experiments.record.names import is_code
from experiments.record.tables import CLOCK_SET_BACK, REPEATED, Column

Integers = NDArray[np.int64]

_NO_ROWS: Integers = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Log:
    """A log that keeps every rule: the participant's code and the experiment."""

    code: str
    experiment: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Table:
    """Rows with their parsed columns, and the row with which each log begins."""

    texts: TextTable
    cells: Mapping[str, Cells]
    first: Integers

    def coded(self, name: str) -> Coded:
        """A column of few values."""
        cells = self.cells[name]
        if not isinstance(cells, Coded):
            raise TypeError(f"column {name!r} has no codes")
        return cells

    def value(self, name: str, row: int) -> Cell:
        """A cell of such a column."""
        found = self.coded(name)
        return found.values[int(found.codes[row])]

    @property
    def codes(self) -> list[str]:
        """The participant's code in the first row of each log."""
        found = self.coded("participant_id")
        return [str(found.values[code]) for code in found.codes[self.first].tolist()]

    def whole(self, name: str) -> Integers:
        """The values of such a column as whole numbers, -1 for none."""
        values = [-1 if value is None else value for value in self.coded(name).values]
        return np.array(values, dtype=np.int64)[self.coded(name).codes]

    def logs(self, rows: Integers) -> Integers:
        """The place of the log that each row is of."""
        return np.asarray(np.searchsorted(self.first, rows, side="right") - 1)

    def log(self, row: int) -> tuple[int, range]:
        """The place of the log that a row is of, and the log's rows."""
        place = int(self.logs(np.array(row)))
        first = int(self.first[place])
        return place, range(first, first + self.texts.rows[place])

    def fault(self, message: str, row: int, column: str | None) -> BadLogError:
        """What is wrong in a row, with the line on which it starts."""
        place, rows = self.log(row)
        return BadLogError(message, self.texts.lines[place][row - rows.start], column)


_LogRule = tuple[Integers, Callable[[int], BadLogError]]
"""The rows that break a rule, and what is to be said of one of them."""


def check_logs(
    texts: TextTable, codes_in_names: Mapping[int, str | None], *, own: bool = True
) -> tuple[Block, dict[int, Log | BadLogError]]:
    """The rows of those logs of a table that keep every rule, and each log by its number, or what is wrong with it.

    `codes_in_names` are the participants' codes in the names of the logs' files, as far as there are some. Logs of
    other programs, which are not `own`, may count sets through the run, and mix sessions.
    `BadLogError`: what is wrong with all logs of the table, as their header is.
    """
    experiment = experiment_of(texts.header)
    if not sum(texts.rows):
        raise BadLogError("has a header but no rows (rule: one row a planned trial)", 1)
    rows = np.array(texts.rows, dtype=np.int64)
    parsed = {column.name: _parsed(column, texts.column(column.name)) for column in tables.TABLES[experiment]}
    cells = {name: values for name, (values, _) in parsed.items()}
    table = _Table(texts=texts, cells=cells, first=np.cumsum(rows) - rows)
    wrong = np.concatenate([list(texts.ragged), *(odd for _, odd in parsed.values())]).astype(np.int64)
    others = _rules(table, experiment, codes_in_names, own=own)
    rules: list[_LogRule] = [(wrong, partial(_say_cell, table, experiment)), *others]
    faults = _first_faults(table, rules)
    good = np.array([place not in faults for place in range(len(rows))], dtype=np.bool_)
    kept = None if good.all() else np.flatnonzero(np.repeat(good, rows))
    block = Block(
        experiment=experiment,
        columns=cells if kept is None else {name: chosen(values, kept) for name, values in cells.items()},
        log=np.array(texts.logs, dtype=np.int64)[good],
        rows=rows[good],
    )
    logs = (faults.get(place) or Log(code=code, experiment=experiment) for place, code in enumerate(table.codes))
    return block, dict(zip(texts.logs, logs, strict=True))


def _first_faults(table: _Table, rules: Iterable[_LogRule]) -> dict[int, BadLogError]:
    """By the places of logs what is wrong first: by the first rule that a log breaks, in the first row that does."""
    found: dict[int, BadLogError] = {}
    for rows, said in rules:
        rows_in_order = np.sort(rows)
        logs, firsts = np.unique(table.logs(rows_in_order), return_index=True)
        for log, row in zip(logs.tolist(), rows_in_order[firsts].tolist(), strict=True):
            if log not in found:
                found[log] = said(row)
    return found


def _rules(
    table: _Table, experiment: str, codes_in_names: Mapping[int, str | None], *, own: bool
) -> Iterator[_LogRule]:
    """The rules that bind cells together, in their order."""
    yield _one_participant(table, codes_in_names)
    if tables.is_rated(experiment):
        found = _sessions(table, np.zeros(sum(table.texts.rows), dtype=np.int64))
        yield _numbered_trials(table, found)
    else:
        found = _sessions(table, table.whole("session"))
        yield _right_answers(table)
        yield from _numbered_sessions(table, found)
        yield _numbered_sets(table, found, own=own)
        yield _measured_times(table)
    yield _in_order(table, found, own=own)
    yield from _onsets(table)


def _parsed(column: Column, texts: Texts) -> tuple[Cells, Integers]:
    """A column's values, and the rows whose text is none that it may hold."""
    if column.type == "number":
        return _numbers(column, texts)
    if has_many_values(column):
        return unguarded(texts), np.flatnonzero(texts.is_null()) if column.required else _NO_ROWS
    return _few_values(column, *few(texts))


def _few_values(column: Column, codes: NDArray[np.int32], texts: list[str]) -> tuple[Cells, Integers]:
    """A column of few values, each parsed once; texts that mean the same get the same code."""
    wrong = np.array([cell_fault(column, text) != "" for text in texts])
    values = [None if bad else cell_value(column, text) for bad, text in zip(wrong, texts, strict=True)]
    places = {value: place for place, value in enumerate(dict.fromkeys(values))}
    if len(places) < len(values):
        codes_of_texts = np.array([places[value] for value in values], dtype=np.int32)
        return Coded(codes=codes_of_texts[codes], values=tuple(places)), np.flatnonzero(wrong[codes])
    return Coded(codes=codes, values=tuple(values)), np.flatnonzero(wrong[codes]) if wrong.any() else _NO_ROWS


def _numbers(column: Column, texts: Texts) -> tuple[Cells, Integers]:
    numbers, odd = decimals(texts)
    if column.most is not None and (beyond := numbers > column.most).any():
        odd = np.append(odd, np.flatnonzero(beyond))
    if not odd.size:
        return numbers, odd
    cells = texts.take(pa.array(odd)).to_pylist()
    wrong = np.array([cell_fault(column, cell) != "" for cell in cells])
    numbers = numbers.copy()
    numbers[odd[~wrong]] = [float(cell) for cell, bad in zip(cells, wrong, strict=True) if not bad]
    return numbers, odd[wrong]


def _say_cell(table: _Table, experiment: str, row: int) -> BadLogError:
    """The first cell of a row that its column may not hold, or how many there are."""
    if row in table.texts.ragged:
        rule = f"(rule: {len(table.texts.header)}, as in the header)"
        return table.fault(f"has {table.texts.ragged[row]} fields {rule}", row, None)
    texts = ((column, table.texts.column(column.name)[row].as_py()) for column in tables.TABLES[experiment])
    faults = ((column.name, cell_fault(column, text or tables.MISSING)) for column, text in texts)
    name, message = next((name, message) for name, message in faults if message)
    return table.fault(message, row, name)


def _one_participant(table: _Table, names: Mapping[int, str | None]) -> _LogRule:
    """One participant a file, with a code that is one, and that of the file's name."""
    column = table.coded("participant_id")
    own = column.codes[table.first]
    named = [names.get(log) for log in table.texts.logs]
    both = zip(table.codes, named, strict=True)
    unfit = [not is_code(code) or name not in (None, code) for code, name in both]
    others = np.flatnonzero(column.codes != np.repeat(own, table.texts.rows))
    return np.append(table.first[np.array(unfit)], others), partial(_say_participant, table, names)


def _say_participant(table: _Table, names: Mapping[int, str | None], row: int) -> BadLogError:
    place, rows = table.log(row)
    code, own = (str(table.value("participant_id", one)) for one in (row, rows.start))
    if code != own:
        message = f"{quoted(code)} after {own!r} (rule: one participant a file)"
    elif not is_code(code):
        message = f"{quoted(code)} is not a code (rule: 1 to 32 letters or digits, A-Z, a-z, 0-9)"
    else:
        rule = f"sub-{names[table.texts.logs[place]]} (rule: one participant a file, the one in its name)"
        message = f"participant {code!r}, but the file is named {rule}"
    return table.fault(message, row, "participant_id")


def _right_answers(table: _Table) -> _LogRule:
    """`correct` says whether the response is the direction."""
    direction, response = table.coded("direction"), table.coded("response")
    due = np.array(
        [[-1 if given is None else int(given == shown) for given in response.values] for shown in direction.values]
    )
    wrong = np.flatnonzero(due[direction.codes, response.codes] != table.whole("correct"))
    return wrong, partial(_say_answer, table)


def _say_answer(table: _Table, row: int) -> BadLogError:
    direction, response, correct = (table.value(name, row) for name in ("direction", "response", "correct"))
    if response is None or correct is None:
        given, so = ("empty" if one is None else repr(one) for one in (response, correct))
        message = f"response {given} with correct {so} (rule: both or neither are given)"
    else:
        shown = f"correct is {correct}, but the direction was {direction} and the response {response}"
        message = f"{shown} (rule: 1 if they are the same, else 0)"
    return table.fault(message, row, "correct")


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


def _begins(changes: BoolArray) -> Integers:
    """Where runs begin, from whether each but the first begins one."""
    return np.append(0, np.flatnonzero(changes) + 1)


def _miscounted(numbers: Integers, begins: Integers) -> Integers:
    """The runs of sorted numbers that are not 1, 2, 3, ..., by their places."""
    run = np.repeat(np.arange(len(begins)), np.diff(np.append(begins, len(numbers))))
    return np.unique(run[numbers != np.arange(1, len(numbers) + 1) - begins[run]])


def _numbered_sessions(table: _Table, found: _Sessions) -> Iterator[_LogRule]:
    """One method a session; sessions 1, 2, 3, ... in a log, and trials 1, 2, 3, ... in a session."""
    method = table.coded("method").codes
    first = np.repeat(found.first, np.diff(np.append(found.begins, len(found.order))))
    yield found.order[method[found.order] != method[first]], partial(_say_method, table, found)
    logs = _begins(np.diff(table.logs(found.first)) != 0)
    yield found.first[logs[_miscounted(found.session[found.first], logs)]], partial(_say_session, table, found)
    yield _numbered_trials(table, found)


def _numbered_trials(table: _Table, found: _Sessions) -> _LogRule:
    """The trials of a session are 1, 2, 3, ...; of one where they are not, the first row stands for all."""
    return found.first[_miscounted(found.trial[found.order], found.begins)], partial(_say_trial, table, found)


def _say_method(table: _Table, found: _Sessions, row: int) -> BadLogError:
    first = _rows_of_session(table, found, row)[0]
    shown = f"{table.value('method', row)!r} in session {found.session[row]}"
    rule = f"which began with {table.value('method', first)!r} (rule: one method a session)"
    return table.fault(f"{shown}, {rule}", row, "method")


def _say_session(table: _Table, found: _Sessions, row: int) -> BadLogError:
    firsts: dict[int, int] = {}
    for one in table.log(row)[1]:
        firsts.setdefault(int(found.session[one]), one)
    return _miscount(table, "session", firsts, list(firsts.values()), "the run")


def _say_trial(table: _Table, found: _Sessions, row: int) -> BadLogError:
    rows = _rows_of_session(table, found, row)
    session = found.session[row]  # 0 where a table has no sessions; where it has, 0 is refused before
    where = f"session {session}" if session else "the run"
    return _miscount(table, "trial", found.trial[rows].tolist(), rows, where)


def _rows_of_session(table: _Table, found: _Sessions, row: int) -> list[int]:
    return [one for one in table.log(row)[1] if found.session[one] == found.session[row]]


def _miscount(table: _Table, column: str, numbers: Iterable[int], rows: Sequence[int], where: str) -> BadLogError:
    """What is wrong with numbers that are not 1, 2, 3, ..., each once, in any order."""
    seen: set[int] = set()
    for number, row in zip(numbers, rows, strict=True):
        if number in seen:
            return table.fault(f"{column} {number} stands twice in {where} (rule: 1, 2, 3, ... once each)", row, column)
        seen.add(number)
    missing = next(number for number in range(1, len(rows) + 1) if number not in seen)
    rule = f"(rule: 1, 2, 3, ... without a gap; found {quoted(', '.join(map(str, sorted(seen))))})"
    return table.fault(f"{column} {missing} is missing in {where} {rule}", rows[-1], column)


def _numbered_sets(table: _Table, found: _Sessions, *, own: bool) -> _LogRule:
    """The sets of a session are 1, 2, 3, ... one after the other; of other programs they only never go back."""
    numbers = table.whole("set")[found.order]
    step = np.diff(numbers, prepend=0)
    step[found.begins] = numbers[found.begins] if own else 0
    wrong = (step < 0) | (step > 1) if own else step < 0

    def said(row: int) -> BadLogError:
        where = f"set {table.value('set', row)} at trial {table.value('trial', row)} of session {found.session[row]}"
        return table.fault(f"{where} (rule: sets 1, 2, 3, ... one after the other)", row, "set")

    return found.order[wrong], said


def _measured_times(table: _Table) -> _LogRule:
    """Measured times differ."""
    time_s = np.asarray(table.cells["response_time_s"], dtype=np.float64)
    counts = np.add.reduceat((~np.isnan(time_s)).astype(np.int64), table.first)
    alike = np.fmin.reduceat(time_s, table.first) == np.fmax.reduceat(time_s, table.first)

    def said(row: int) -> BadLogError:
        place = int(table.logs(np.array(row)))
        time = float(np.nanmax(time_s[row : row + table.texts.rows[place]]))
        return table.fault(all_alike(int(counts[place]), time), row, "response_time_s")

    return table.first[alike & (counts >= FEWEST_ALIKE)], said


def _in_order(table: _Table, found: _Sessions, *, own: bool) -> _LogRule:
    """Rows stand in the order of presentation; of other programs within each session."""
    back = np.diff(found.order, append=np.iinfo(np.int64).max) < 0
    back[found.begins[1:] - 1] &= own

    def said(row: int) -> BadLogError:
        where = f"trial {table.value('trial', row)}"
        where += f" of session {found.session[row]}" if found.session[row] else ""
        return table.fault(f"{where} stands behind a later one (rule: rows in the order of the run)", row, "trial")

    return found.order[back], said


def _onsets(table: _Table) -> Iterator[_LogRule]:
    """Onsets are dates and times, and do not go back but where the log says that the clock was set back.

    As in `went_back`: what comes behind a trial that was repeated is compared with the one before that.
    """
    found, none = onset_moments(table.texts.column("onset_utc"))
    rows = np.flatnonzero(found >= 0)
    codes, flags = few(table.texts.column("flags").dictionary_encode())
    again = np.array([REPEATED in some.split() for some in flags], dtype=bool)[codes[rows]]
    last = np.maximum.accumulate(np.where(again, -1, np.arange(rows.size)))
    before = np.concatenate([[-1], last[:-1]])[: rows.size]
    log = table.logs(rows)
    earlier = rows[(before >= 0) & (found[rows] < found[rows[before]]) & (log == log[before])]
    unsaid = [row for row in earlier.tolist() if CLOCK_SET_BACK not in flags[codes[row]].split()]

    def say(rule: Callable[[str], str], row: int) -> BadLogError:
        return table.fault(rule(table.texts.column("onset_utc")[row].as_py()), row, "onset_utc")

    yield none, partial(say, no_date)
    yield np.array(unsaid, dtype=np.int64), partial(say, too_early)
