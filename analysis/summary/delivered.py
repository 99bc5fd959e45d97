"""What was delivered: the tables of shots beside logs, where runs had a sensor, and how far shots drifted in a run."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.logs.journals import shots_beside
from experiments.delivered.marks import START_SHOTS
from experiments.record.tables import unguard
from experiments.session.remarks import NOT_DELIVERED


@dataclass(frozen=True, slots=True, kw_only=True)
class DeliveredCourse:
    """A run's shots of a method in their order: peak and friction as parts of what was expected, NaN where unknown.

    `numbers` are the places among all shots of the run, from 1; `marks`, and the reasons why, are empty where there is
    none.
    """

    participant: str
    experiment: str
    method: str
    numbers: tuple[int, ...]
    peaks: tuple[float, ...]
    frictions: tuple[float, ...]
    marks: tuple[str, ...]
    reasons: tuple[str, ...]
    friction_expected: bool

    @property
    def undelivered(self) -> int:
        """How many shots were not delivered as they should be."""
        return sum(mark in NOT_DELIVERED for mark in self.marks)

    @property
    def start_unknown(self) -> bool:
        """Whether a slip from the first shot on could not be told, though the method has friction."""
        return self.friction_expected and self.known_frictions < START_SHOTS

    @property
    def known_frictions(self) -> int:
        """Of how many shots the friction is known."""
        return sum(map(math.isfinite, self.frictions))

    @property
    def unmeasured(self) -> int:
        """How many were not measured."""
        return self.marks.count("not-measured")


def drift(parts: Sequence[float]) -> tuple[float, float]:
    """How far a course drifted from its first shot to its last, by a straight line, and its standard error.

    NaN for fewer than three shots that are known.

    >>> drift([1.0, 1.01, 1.02, 1.03])[0]
    0.03
    """
    values = np.array(parts)
    places = np.flatnonzero(np.isfinite(values))
    if len(places) < 3:
        return math.nan, math.nan
    x, y = places - places.mean(), values[places]
    slope = float(x @ y) / float(x @ x)
    rest = y - y.mean() - slope * x
    error = math.sqrt(float(rest @ rest) / (len(y) - 2) / float(x @ x))
    length = float(places[-1] - places[0])
    return round(slope * length, 12), error * length


def delivered_courses(logs: Iterable[Path]) -> tuple[DeliveredCourse, ...]:
    """The courses of the runs whose logs these are, where they had a sensor; a table that is none is passed over."""
    return tuple(course for path in logs for course in _courses(path))


def _courses(log: Path) -> Iterator[DeliveredCourse]:
    try:
        rows = list(csv.DictReader(io.StringIO(shots_beside(log).read_bytes().decode(), newline="")))
        for method in dict.fromkeys(row["method"] for row in rows):
            yield _course([(place, row) for place, row in enumerate(rows, start=1) if row["method"] == method])
    except (
        OSError,
        ValueError,
        KeyError,
        csv.Error,
    ):  # no table of shots: it proves nothing, and no number rests on it
        return


def _course(rows: list[tuple[int, dict[str, str]]]) -> DeliveredCourse:
    _, first = rows[0]
    return DeliveredCourse(
        participant=unguard(first["participant_id"]),
        experiment=unguard(first["experiment"]),
        method=unguard(first["method"]),
        numbers=tuple(place for place, _ in rows),
        peaks=tuple(_part(row, "peak_m_s2") for _, row in rows),
        frictions=tuple(_part(row, "friction_N") for _, row in rows),
        marks=tuple(row["mark"] for _, row in rows),
        reasons=tuple(unguard(row["because"]) for _, row in rows),
        friction_expected=any(row["expected_friction_N"] for _, row in rows),
    )


def _part(row: dict[str, str], name: str) -> float:
    measured, expected = row[f"delivered_{name}"], row[f"expected_{name}"]
    return float(measured) / float(expected) if measured and expected else math.nan
