"""Times that no experiment has: in the wrong unit, longer than to the next stimulus, dates of a clock that was wrong.

Each cell by itself may be; it is the log that cannot. A log that its own journal proves is used all the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from analysis.logs.cell_rules import FEWEST_ALIKE, as_moment, onset_moments
from analysis.logs.rules import Integers
from analysis.logs.texts import Block, Coded
from analysis.stats.arrays import BoolArray, FloatArray
from experiments.design.config import DesignConfig

LONGEST_MEDIAN_S = 60.0
"""Nobody takes longer for half of the answers to what lasts a moment (assumed)."""
EARLIEST = datetime(2000, 1, 1, tzinfo=UTC)
"""Clocks that lost their battery begin before."""
AHEAD = timedelta(days=366)
"""So far ahead of this computer's clock another may be."""
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_SECOND = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogTimes:
    """Rows of logs, one log after the other, each from its `first` row on.

    `time_s`: response times, NaN for none; `own`: a person's own; `onset_us`: onsets in µs since 1970, -1 for none.
    """

    time_s: FloatArray
    own: BoolArray
    onset_us: Integers
    first: Integers

    @property
    def log(self) -> Integers:
        """The place of each row's log."""
        return np.repeat(np.arange(len(self.first)), np.diff(np.append(self.first, len(self.time_s))))

    def rows(self, place: int) -> slice:
        """The rows of a log."""
        end = self.first[place + 1] if place + 1 < len(self.first) else len(self.time_s)
        return slice(int(self.first[place]), int(end))


def doubts_of_block(block: Block) -> dict[int, str]:
    """What is wrong with the times of logs, by their numbers."""
    if not len(block.log) or "response_time_s" not in block.columns:
        return {}
    source, valid = block.columns["response_source"], block.columns["response_time_valid"]
    times = LogTimes(
        time_s=np.asarray(block.columns["response_time_s"], dtype=np.float64),
        own=_is(source, "participant") & _is(valid, 1),
        onset_us=onset_moments(block.columns["onset_utc"])[0],
        first=np.cumsum(block.rows) - block.rows,
    )
    return {int(block.log[place]): said for place, said in doubts(times).items()}


def _is(column: object, value: object) -> BoolArray:
    """Which rows of a column of few values hold one."""
    if not isinstance(column, Coded):
        raise TypeError("a column of few values is asked for")
    return np.array([one == value for one in column.values], dtype=np.bool_)[column.codes]


def doubt_of_design(design: DesignConfig, rows: Sequence[Mapping[str, object]]) -> str:
    """What is wrong with the times of a design's log; empty if nothing is."""
    onsets = [as_moment(str(row["onset_utc"] or "")) for row in rows]
    onset_us = [-1 if one is None else (one - _EPOCH) // timedelta(microseconds=1) for one in onsets]
    for name in (name for name, question in design.questions.items() if question.named_answers):
        times = LogTimes(
            time_s=np.array([np.nan if row[f"{name}_time_s"] is None else row[f"{name}_time_s"] for row in rows]),
            own=np.array([row[f"{name}_source"] == "participant" and row[f"{name}_time_valid"] == 1 for row in rows]),
            onset_us=np.array(onset_us, dtype=np.int64),
            first=np.zeros(1, dtype=np.int64),
        )
        if said := doubts(times).get(0):
            return said
    return ""


def doubts(times: LogTimes) -> dict[int, str]:
    """What is wrong with the times of logs, by their places; of several things the first."""
    found: dict[int, str] = {}
    for rule in (_slow, _alike, _undated, _overlapping):
        for place, said in rule(times):
            found.setdefault(place, said)
    return found


def _slow(times: LogTimes) -> Iterator[tuple[int, str]]:
    slowest = np.fmax.reduceat(times.time_s, times.first)
    for place in np.flatnonzero(slowest > LONGEST_MEDIAN_S).tolist():
        own = times.time_s[times.rows(place)]
        own = own[~np.isnan(own)]
        median = float(np.median(own))
        if own.size >= FEWEST_ALIKE and median > LONGEST_MEDIAN_S:
            rule = f"(rule: at most {LONGEST_MEDIAN_S:g} s; are they ms? A map says so by response_time.unit)"
            yield place, f"the median of {own.size} response times is {median:g} s {rule}"


def _alike(times: LogTimes) -> Iterator[tuple[int, str]]:
    there = times.onset_us >= 0
    counts = np.add.reduceat(there.astype(np.int64), times.first)
    latest = np.maximum.reduceat(times.onset_us, times.first)
    earliest = np.minimum.reduceat(np.where(there, times.onset_us, np.iinfo(np.int64).max), times.first)
    for place in np.flatnonzero((counts >= FEWEST_ALIKE) & (latest == earliest)).tolist():
        rule = "(rule: onsets that were measured differ; a date of the whole session is none: leave it out)"
        yield place, f"all {counts[place]} onsets are {_shown(int(latest[place]))} {rule}"


def _undated(times: LogTimes) -> Iterator[tuple[int, str]]:
    last = (datetime.now(UTC) + AHEAD - _EPOCH) // timedelta(microseconds=1)
    early = (times.onset_us >= 0) & (times.onset_us < (EARLIEST - _EPOCH) // timedelta(microseconds=1))
    rows = np.flatnonzero(early | (times.onset_us > last))
    for place, row in zip(*_first_of_each(times.log[rows], rows), strict=True):
        rule = f"(rule: from {EARLIEST.year} on, and not in the future: the clock that said so was wrong)"
        yield place, f"an onset is {_shown(int(times.onset_us[row]))} {rule}"


def _overlapping(times: LogTimes) -> Iterator[tuple[int, str]]:
    """A person's own answer comes before the next stimulus; onsets in whole minutes are known to a minute only."""
    rows = np.flatnonzero(times.onset_us >= 0)
    if not rows.size:
        return
    log = times.log[rows]
    gap_s = np.diff(times.onset_us[rows]) / _SECOND
    minutes = np.bincount(log, times.onset_us[rows] % (60 * _SECOND) != 0, minlength=len(times.first)) == 0
    bears_s = np.where(minutes, 60.0, 1.0)[log[:-1]]
    answered = times.own[rows[:-1]] & (np.diff(log) == 0) & (gap_s >= 0.0)
    late = np.flatnonzero(answered & (times.time_s[rows[:-1]] > gap_s + bears_s))
    for place, at in zip(*_first_of_each(log[late], late), strict=True):
        time, begun = times.time_s[rows[at]], _shown(int(times.onset_us[rows[at]]))
        rule = "(rule: an answer comes before the next stimulus)"
        yield place, f"a response time is {time:g} s after {begun}, and the next onset {gap_s[at]:g} s after it {rule}"


def _first_of_each(logs: Integers, rows: Integers) -> tuple[list[int], list[int]]:
    """Logs, each once, and the first row of each."""
    places, firsts = np.unique(logs, return_index=True)
    return places.tolist(), rows[firsts].tolist()


def _shown(onset_us: int) -> str:
    return (_EPOCH + timedelta(microseconds=onset_us)).isoformat().replace("+00:00", "Z")
