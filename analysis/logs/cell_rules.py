"""What a table of Recoil's is known by, and what each of its cells may hold: the rules that need no other cell."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from analysis.logs.files import BadLogError
from analysis.logs.measures import MEASURES
from analysis.logs.texts import Cell, Texts
from experiments.config.lines import name_fault
from experiments.design.language import NumberScale
from experiments.record import tables
from experiments.record.tables import CLOCK_SET_BACK, Column
from experiments.tasks.questions import on_scale

_INTEGER = re.compile(r"[+-]?[0-9]{1,15}")
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,4})?")


def experiment_of(header: Sequence[str]) -> str:
    """Which table the header is of: the one that shares most columns with it. `BadLogError`: none, or not all of it."""
    shared = {name: len(set(header) & set(tables.names(name))) for name in tables.TABLES}
    experiment = max(shared, key=lambda name: shared[name])
    if shared[experiment] < 4:
        raise BadLogError(
            f"the header {quoted(','.join(header))} is neither a trials nor a ratings table of Recoil "
            "(a log of another experiment or program, or not comma-separated)",
            1,
        )
    for name in header:
        if header.count(name) > 1:
            raise BadLogError(f"column {name!r} stands {header.count(name)} times in the header (rule: once)", 1, name)
    required = [column.name for column in tables.TABLES[experiment] if column.required]
    for name in (*required, *MEASURES[experiment].held):
        if name not in header:
            raise BadLogError(f"column {name!r} is missing (rule: a {experiment} table has it)", 1, name)
    return experiment


def number_in(text: str) -> float | None:
    """The finite number in a text; `None` if it is none, which Python's own reading of `5_04` or `nan` is not.

    >>> number_in("5.04"), number_in("5_04"), number_in("nan")
    (5.04, None, None)
    """
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    return value if math.isfinite(value) else None


def cell_fault(column: Column, text: str) -> str:
    """Why a column may not hold a text; empty if it may."""
    if text == tables.MISSING:
        return "the cell is empty (rule: a value is required)" if column.required else ""
    if column.type == "integer" and not _INTEGER.fullmatch(text):
        return f"{quoted(text)} is not a whole number of at most 15 digits"
    if column.type == "number" and number_in(text) is None:
        return f"{quoted(text)} is not a finite number with a decimal point"
    if column.type in ("integer", "number"):
        return _number_fault(column, text)
    if column.levels and tables.unguard(text) not in column.levels:
        return f"{quoted(text)} is not allowed (rule: one of {', '.join(column.levels)})"
    if column.type == "level" and (fault := name_fault(tables.unguard(text))):
        return f"{quoted(text)} {fault}"
    return ""


def _number_fault(column: Column, text: str) -> str:
    """Why a number may not stand in a column; empty if it may."""
    low = -math.inf if column.least is None else column.least
    high = math.inf if column.most is None else column.most
    if not low <= float(text) <= high:
        rule = f"{low:g} to {high:g}" if math.isfinite(high) else f"at least {low:g}"
        return f"{column.name} {_cut(text)} is out of range (rule: {rule})"
    near = on_scale(float(text), NumberScale(low, high, column.grain))
    if not math.isclose(near, float(text), abs_tol=column.grain * 1e-6):
        return f"{column.name} {_cut(text)} is off the scale's grain (rule: {low:g} to {high:g} by {column.grain:g})"
    return ""


def cell_value(column: Column, text: str) -> Cell:
    """The value of a text that a column may hold; `None` for an empty one."""
    if text == tables.MISSING:
        return None
    if column.type == "number":
        return float(text)
    if column.type in ("integer", "flag"):
        return int(text)
    return tables.unguard(text)


def quoted(text: str) -> str:
    """A text in quotes, cut to what fits into a message."""
    return repr(_cut(text))


def _cut(text: str) -> str:
    return text if len(text) <= 80 else text[:77] + "..."


FEWEST_ALIKE = 10
"""So many times that are all alike were not measured."""


def all_alike(count: int, time_s: float) -> str:
    """What is said of so many equal times."""
    rule = "(rule: times that were measured differ; leave the cells empty where none was measured)"
    return f"all {count} response times are {time_s:g} s {rule}"


def no_date(text: str) -> str:
    """What is said of an onset that is none."""
    return f"{quoted(text)} is no date and time (rule: date and time by ISO 8601, as 2026-11-21T09:00:00Z)"


def too_early(text: str) -> str:
    """What is said of an onset that goes back."""
    rule = f"(rule: later, unless the flag {CLOCK_SET_BACK} says that the clock was set back)"
    return f"{quoted(text)} is earlier than the onset before it {rule}"


def onset_moments(cells: Texts) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Dates and times (ISO 8601, UTC unless they say otherwise) in µs since 1970, -1 for none; and odd rows."""
    try:
        found = cells.cast(pa.timestamp("us", "UTC")).cast(pa.int64())
    except pa.ArrowInvalid:
        return _moments_one_by_one(cells.to_pylist())
    micros = found.fill_null(-1).to_numpy(zero_copy_only=False)
    return micros, np.flatnonzero(micros < -1)


def _moments_one_by_one(cells: Sequence[str | None]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    found = np.full(len(cells), -1, dtype=np.int64)
    odd = []
    for row, cell in enumerate(cells):
        moment = as_moment(cell or "")
        if moment is not None and moment >= _EPOCH:
            found[row] = (moment - _EPOCH) // timedelta(microseconds=1)
        elif cell:
            odd.append(row)
    return found, np.array(odd, dtype=np.int64)


_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def as_moment(text: str) -> datetime | None:
    """A date and time by ISO 8601, UTC unless it says otherwise; `None` if it is none.

    >>> as_moment("2026-11-21T09:00:00Z"), as_moment("yesterday")
    (datetime.datetime(2026, 11, 21, 9, 0, tzinfo=datetime.timezone.utc), None)
    """
    try:
        moment = datetime.fromisoformat(text)
        return moment.astimezone(UTC) if moment.tzinfo else moment.replace(tzinfo=UTC)
    except (ValueError, OverflowError):
        return None
