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
from analysis.logs.texts import Block, Coded
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
    def row(self) -> _Hashes:
        """A number for each row: the same for the same."""
        found: _Hashes = self.asked * _MIX[0] + self.answer * _MIX[1] + self.time_ms.astype(np.uint64) * _MIX[2]
        return found

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
    told = _chosen([*some], set(numbers))
    if told is None:
        return []
    found: dict[int, Double] = {}
    slices = _slices(told)
    for double in (*_written_often(told, slices), *_alike(told, slices), *_stretches(told, slices)):
        found.setdefault(double.second, double)
    return [found[number] for number in sorted(found)]


def _chosen(some: Sequence[ToldRows], numbers: set[int]) -> ToldRows | None:
    """All these logs together, in the order of their numbers."""
    if not some:
        return None
    number, rows = (np.concatenate([getattr(one, name) for one in some]) for name in ("number", "rows"))
    first = np.cumsum(rows) - rows
    order = np.array([at for at in np.argsort(number).tolist() if int(number[at]) in numbers], dtype=np.intp)
    if not order.size:
        return None
    at = np.concatenate([np.arange(first[one], first[one] + rows[one]) for one in order.tolist()])
    cells = {name: np.concatenate([getattr(one, name) for one in some])[at] for name in ("asked", "answer", "time_ms")}
    return ToldRows(number=number[order], rows=rows[order], **cells)


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


def _slices(told: ToldRows) -> list[slice]:
    ends = np.cumsum(told.rows).tolist()
    return [slice(end - count, end) for end, count in zip(ends, told.rows.tolist(), strict=True)]


def _written_often(told: ToldRows, slices: Sequence[slice]) -> Iterator[Double]:
    """Logs that are one block several times over, or each row; those in the same way are judged together."""
    by_way: dict[tuple[int, bool], list[tuple[float, Double]]] = {}
    row = told.row
    for number, rows in zip(told.number.tolist(), slices, strict=True):
        way = _way(row[rows])
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


def _alike(told: ToldRows, slices: Sequence[slice]) -> Iterator[Double]:
    """Whole logs that are the same."""
    row, first = told.row, dict[bytes, int]()
    for place, rows in enumerate(slices):
        before = first.setdefault(row[rows].tobytes(), place)
        if before != place and _is_rare(told, rows, rows):
            one, other = int(told.number[before]), int(told.number[place])
            yield Double(first=one, second=other, whole=True, timed=_timed(told, rows))


def _stretches(told: ToldRows, slices: Sequence[slice]) -> Iterator[Double]:
    """Stretches of rows with times that stand anywhere else as well."""
    starts, hashes = _windows(told)
    order = np.argsort(hashes, kind="stable")
    new = np.append(True, np.diff(hashes[order]) != 0)[: order.size]
    leads = starts[order][np.flatnonzero(new)[np.cumsum(new) - 1]]
    copies = np.flatnonzero(~new)
    pairs = np.stack([leads[copies], starts[order][copies]], axis=1)
    place = told.place
    begins, seen = np.cumsum(told.rows) - told.rows, set[tuple[int, int]]()
    for one, other in pairs[np.argsort(pairs[:, 1], kind="stable")].tolist():
        both = int(place[one]), int(place[other])
        if both not in seen and _is_rare(told, slices[both[1]], slice(other, other + STRETCH)):
            seen.add(both)
            at = one - int(begins[both[0]]) + 1, other - int(begins[both[1]]) + 1
            yield Double(
                first=int(told.number[both[0]]), second=int(told.number[both[1]]), whole=False, timed=True, at=at
            )


def _windows(told: ToldRows) -> tuple[NDArray[np.intp], _Hashes]:
    """Where stretches of answered rows with times begin, and a number for what each tells."""
    full: BoolArray = (told.time_ms >= 0) & (told.answer != 0)
    count = len(full) - STRETCH + 1
    if count < 1:
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.uint64)
    before, place, row = np.append(0, np.cumsum(full)), told.place, told.row
    good = (before[STRETCH:] - before[:-STRETCH] == STRETCH) & (place[:count] == place[STRETCH - 1 :])
    starts = np.flatnonzero(good)
    hashes = np.zeros(starts.size, dtype=np.uint64)
    for step in range(STRETCH):
        hashes = hashes * _MIX[0] + (row[starts + step] ^ (row[starts + step] >> np.uint64(29)))
    return starts, hashes
