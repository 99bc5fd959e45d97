"""Logs that hold the same answers twice: rows copied within a log, or one person's under another's code.

A stretch of rows is a double if it is the same in all that was asked, in what was answered and in the response times to
the ms, and would be so by chance less often than once in 10^9. How often that is, a log says itself: of each row
-ln(share of its answer among those to the same question) - ln(share of its time among the log's), summed over the rows
of one copy, must be above ln 10^9 = 20.7. Of answers that follow the ones before or the question before, as those of
people do who press the keys in turn, and of times in equal steps, as made ones are, the shares are those among what
followed, where these surprise less. Stretches of ten rows are looked for wherever they stand; without times, only whole
logs, and logs that are one block, or each row, several times over; of these, all that are so together.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from analysis.logs.measures import MEASURES
from analysis.logs.texts import Block, Coded, rows_of_logs
from analysis.stats.arrays import BoolArray, FloatArray
from experiments.design.config import DesignConfig

STRETCH = 10
"""So many rows with times are looked at together."""
ODDS = 1e9
_OFTEN = (2, 3, 5, 7)
"""So many times over a log may be written; four times is twice two times."""

_Hashes = NDArray[np.uint64]
_MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToldRows:
    """What rows of logs tell, log after log: the logs' `number` and how many `rows` each has.

    `asked` and `answer` are the same number for the same; an answer of 0 is none, and `time_ms` -1.
    """

    number: NDArray[np.int64]
    rows: NDArray[np.int64]
    asked: _Hashes
    answer: _Hashes
    time_ms: NDArray[np.int64]

    @property
    def place(self) -> NDArray[np.intp]:
        """The place of the log that each row is of."""
        return np.repeat(np.arange(len(self.rows)), self.rows)


@dataclass(frozen=True, slots=True, kw_only=True)
class Double:
    """Two logs by number, the same one where it repeats itself; `at` these rows of both, from 1, the same begins.

    `whole`: it does not end before the logs do. `timed`: response times are a part of it.
    """

    first: int
    second: int
    whole: bool
    timed: bool
    at: tuple[int, int] = (1, 1)


def told_by_block(block: Block) -> ToldRows | None:
    """What the rows of trials tell; `None` of ratings, which are too few to tell copies from chance."""
    measure = MEASURES[block.experiment]
    if "response_time_s" not in block.columns or not len(block.log):
        return None
    asked = np.zeros(int(block.rows.sum()), dtype=np.uint64)
    for name in measure.asked:
        asked = asked * _MIX[0] + _hashed(block.columns[name])
    time_s = np.asarray(block.columns["response_time_s"], dtype=np.float64)
    answer = _hashed(block.columns[measure.answer])
    return ToldRows(number=block.log, rows=block.rows, asked=asked, answer=answer, time_ms=_ms(time_s))


def told_by_design(number: int, design: DesignConfig, rows: Sequence[Mapping[str, object]]) -> ToldRows | None:
    """The same of a design's log; `None` where no question has a time."""
    timed = [name for name, question in design.questions.items() if question.named_answers]
    if not timed or not rows:
        return None
    factors = [name for name in rows[0] if name in design.factors]
    times = [row[f"{timed[0]}_time_s"] for row in rows]
    return ToldRows(
        number=np.array([number]),
        rows=np.array([len(rows)]),
        asked=np.array([_hash(repr([row[name] for name in factors])) for row in rows], dtype=np.uint64),
        answer=np.array([_hash(repr([row[name] for name in design.questions])) for row in rows], dtype=np.uint64),
        time_ms=_ms(np.array([np.nan if time is None else time for time in times], dtype=np.float64)),
    )


def _ms(time_s: FloatArray) -> NDArray[np.int64]:
    return np.where(np.isnan(time_s), -1.0, np.rint(time_s * 1000.0)).astype(np.int64)


def _hashed(column: object) -> _Hashes:
    if not isinstance(column, Coded):
        raise TypeError("a column of few values is asked for")
    values = [0 if value is None else _hash(str(value)) for value in column.values]
    return np.array(values, dtype=np.uint64)[column.codes]


@cache
def _hash(text: str) -> int:
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest())


def doubles_among(some: Iterable[ToldRows], numbers: Iterable[int]) -> list[Double]:
    """The doubles among logs of one experiment with these numbers; each log once, with the first that it is like."""
    every = _chosen([*some], numbers)
    if every is None:
        return []
    found: dict[int, Double] = {}
    for double in (*_written_often(every), *_alike(every), *_stretches(every)):
        found.setdefault(double.second, double)
    return [found[number] for number in sorted(found)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Together:
    """What logs tell, where each begins, and a number for each row: the same for the same."""

    told: ToldRows
    begins: NDArray[np.int64]
    row: _Hashes

    def rows(self, place: int) -> slice:
        """The rows of the log at a place."""
        begin = int(self.begins[place])
        return slice(begin, begin + int(self.told.rows[place]))


def _chosen(some: Sequence[ToldRows], numbers: Iterable[int]) -> _Together | None:
    """All these logs together, in the order of their numbers."""
    if not some:
        return None
    number, rows = (np.concatenate([getattr(one, name) for one in some]) for name in ("number", "rows"))
    order = np.argsort(number)
    order = order[np.isin(number[order], np.fromiter(numbers, dtype=np.int64))]
    if not order.size:
        return None
    at = rows_of_logs(order, rows)
    cells = {name: np.concatenate([getattr(one, name) for one in some])[at] for name in ("asked", "answer", "time_ms")}
    told = ToldRows(number=number[order], rows=rows[order], **cells)
    row = told.asked * _MIX[0] + told.answer * _MIX[1] + told.time_ms.astype(np.uint64) * _MIX[2]
    return _Together(told=told, begins=np.cumsum(told.rows) - told.rows, row=row)


def _surprise(told: ToldRows, rows: slice, copied: slice) -> float:
    """How much `copied` rows surprise in nats, by what all `rows` of their log hold."""
    within = slice(copied.start - rows.start, copied.stop - rows.start)
    answers = _of_answers(told.asked[rows], told.answer[rows])
    times = _of_times(told.time_ms[rows])
    return sum(min(float(nats[within].sum()) for nats in ways) for ways in (answers, times))


def _of_answers(asked: _Hashes, answer: _Hashes) -> tuple[FloatArray, ...]:
    """The surprise of each answer, given what a person may go by: the question, the last answers, the last question."""
    one, two, three = (_earlier(answer, rows) for rows in (1, 2, 3))
    last, new = _last_to_same(asked, answer)
    plain = _surprise_within(asked, answer)
    after = np.where(new, plain, _surprise_within(asked * _MIX[0] + last * _MIX[2], answer))
    pair = one * _MIX[0] + two * _MIX[2]
    contexts = (one, pair, pair * _MIX[0] + three * _MIX[2], _earlier(asked, 1))
    return plain, after, *(_surprise_within(context, answer) for context in contexts)


def _surprise_within(context: _Hashes, answer: _Hashes) -> FloatArray:
    return -np.log(_count(context * _MIX[0] + answer * _MIX[1]) / _count(context))


def _earlier(values: _Hashes, rows: int) -> _Hashes:
    """What stood so many rows before; 0 where nothing did."""
    return np.append(np.zeros(rows, dtype=np.uint64), values)[: len(values)]


def _last_to_same(asked: _Hashes, answer: _Hashes) -> tuple[_Hashes, BoolArray]:
    """The answer before to the same question, and where there is none: it was asked for the first time."""
    order = np.argsort(asked, kind="stable")
    first = np.append(True, np.diff(asked[order]) != 0)[: len(asked)]
    last, new = np.empty_like(answer), np.empty(len(asked), dtype=np.bool_)
    last[order], new[order] = np.where(first, np.uint64(1), _earlier(answer[order], 1)), first
    return last, new


def _of_times(time_ms: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """The surprise of each time among the log's, and of its step from the time before; none where there is no time."""
    there, steps = time_ms >= 0, np.diff(time_ms, prepend=time_ms[:1])
    count = max(1, int(np.count_nonzero(there)))
    plain, step = (np.where(there, -np.log(np.minimum(1.0, _count(some) / count)), 0.0) for some in (time_ms, steps))
    return plain, step


def _count(values: _Hashes | NDArray[np.int64]) -> FloatArray:
    """How often each value is there."""
    _, places, counts = np.unique(values, return_inverse=True, return_counts=True)
    return counts[places].astype(np.float64)


def _is_rare(told: ToldRows, rows: slice, copied: slice) -> bool:
    return _surprise(told, rows, copied) > math.log(ODDS)


def _several_times(values: _Hashes) -> BoolArray:
    """Which values are there more than once; sorted bare, as nearly always none is."""
    in_order = np.sort(values)
    found: BoolArray = np.isin(values, np.unique(in_order[1:][in_order[1:] == in_order[:-1]]))
    return found


def _written_often(every: _Together) -> Iterator[Double]:
    """Logs that are one block several times over, or each row; those in the same way are judged together."""
    by_way: dict[tuple[int, bool], list[tuple[float, Double]]] = {}
    told = every.told
    for place in np.flatnonzero(_begins_again(every)).tolist():
        rows, number = every.rows(place), int(told.number[place])
        way = _way(every.row[rows])
        if way is not None:
            often, blocks = way
            part = (rows.stop - rows.start) // often
            copied = slice(rows.start, rows.start + part) if blocks else rows
            surprise = _surprise(told, rows, copied) * (often - 1) / (1 if blocks else often)
            at = 1, part + 1 if blocks else 2
            double = Double(first=number, second=number, whole=True, timed=_timed(told, rows), at=at)
            by_way.setdefault(way, []).append((surprise, double))
    for some in by_way.values():
        if sum(surprise for surprise, _ in some) > math.log(ODDS):
            yield from (double for _, double in some)


def _begins_again(every: _Together) -> BoolArray:
    """The logs whose first row is their second too, or begins a later part; all that are written often are of these."""
    rows, first = every.told.rows, every.row[every.begins]
    found: BoolArray = first == every.row[every.begins + (rows > 1)]
    for often in _OFTEN:
        found |= first == every.row[every.begins + rows // often]
    return found


def _way(row: _Hashes) -> tuple[int, bool] | None:
    """How often a log is written over, and whether block after block or each row; `None` if once."""
    for often in (one for one in _OFTEN if len(row) % one == 0):
        part = len(row) // often
        if row[0] == row[part] and (row.reshape(often, part) == row[:part]).all():
            return often, True
        if row[0] == row[1] and (row.reshape(part, often) == row[::often, None]).all():
            return often, False
    return None


def _timed(told: ToldRows, rows: slice) -> bool:
    return bool((told.time_ms[rows] >= 0).any())


def _alike(every: _Together) -> Iterator[Double]:
    """Whole logs that are the same."""
    first = dict[bytes, int]()
    told = every.told
    for place in np.flatnonzero(_several_times(np.add.reduceat(every.row, every.begins))).tolist():
        rows = every.rows(place)
        before = first.setdefault(every.row[rows].tobytes(), place)
        if before != place and _is_rare(told, rows, rows):
            one, other = int(told.number[before]), int(told.number[place])
            yield Double(first=one, second=other, whole=True, timed=_timed(told, rows))


def _stretches(every: _Together) -> Iterator[Double]:
    """Stretches of rows with times that stand anywhere else as well."""
    seen, told = set[tuple[int, int]](), every.told
    pairs = _same_windows(every)
    places = np.searchsorted(every.begins, pairs, side="right") - 1
    for rows, both in zip(pairs.tolist(), map(tuple, places.tolist()), strict=True):
        if both not in seen and _is_rare(told, every.rows(both[1]), slice(rows[1], rows[1] + STRETCH)):
            seen.add(both)
            one, other = (row - int(every.begins[place]) + 1 for row, place in zip(rows, both, strict=True))
            first, second = (int(told.number[place]) for place in both)
            yield Double(first=first, second=second, whole=False, timed=True, at=(one, other))


def _same_windows(every: _Together) -> NDArray[np.intp]:
    """Rows at which the same stretch begins: the first of all, and each later one, in the order of these."""
    starts, hashes = _windows(every)
    again = _several_times(hashes)
    starts, hashes = starts[again], hashes[again]
    _, first, of = np.unique(hashes, return_index=True, return_inverse=True)
    later = starts[first[of]] != starts
    return np.stack([starts[first[of]][later], starts[later]], axis=1)


def _windows(every: _Together) -> tuple[NDArray[np.intp], _Hashes]:
    """Where stretches of answered rows with times begin, and a number for what each tells."""
    count = len(every.row) - STRETCH + 1
    if count < 1:
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.uint64)
    before = np.append(0, np.cumsum((every.told.time_ms >= 0) & (every.told.answer != 0)))
    place = every.told.place
    good = (before[STRETCH:] - before[:-STRETCH] == STRETCH) & (place[:count] == place[STRETCH - 1 :])
    starts = np.flatnonzero(good)
    return starts, _rolled(every.row ^ (every.row >> np.uint64(29)), STRETCH)[starts]


def _rolled(row: _Hashes, count: int) -> _Hashes:
    """Of each `count` rows in a row the polynomial that they are the coefficients of; a half is made once for both."""
    if count == 1:
        return row
    half = _rolled(row, count // 2)
    step = count // 2
    both = half[:-step] * np.uint64(pow(int(_MIX[0]), step, 1 << 64)) + half[step:]
    return both[:-1] * _MIX[0] + row[count - 1 :] if count % 2 else both
