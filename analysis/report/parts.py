"""The parts a report is made of, and what goes into it. The templates know these and nothing of the statistics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from analysis.logs.reading import Problem
from analysis.paper.odds import Odds
from analysis.paper.published import Row
from analysis.report.figures import ShotPanel

EXPERIMENTS = {"direction": "direction recognition", "preference": "preference"}
LISTED = 100
"""A list longer than this is cut: a page of ten thousand rows is read by nobody, and opens slowly."""
SHOWN = 50
"""So many of it are left."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportData:
    """What a report tells. `statistics` is the content of `statistics.json`; `comparison` None without a paper.

    `files` are the logs used; `provenance` is label -> text; `notes` are the assumptions behind the numbers; `extra`
    are finished sections that follow the statistics.
    """

    title: str
    statistics: Mapping[str, Any]
    problems: tuple[Problem, ...] = ()
    comparison: tuple[Row, ...] | None = None
    odds: tuple[Odds, ...] = ()
    panels: tuple[ShotPanel, ...] = ()
    files: tuple[Path, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    extra: tuple[Section, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table of finished text."""

    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A figure: `stem` is its file under `figures/` without the ending."""

    stem: str
    caption: str
    alt: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A heading with paragraphs, then pictures, tables and a list, each of which may be empty."""

    title: str
    paragraphs: tuple[str, ...] = ()
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()
    items: tuple[str, ...] = ()


def analysed(statistics: Mapping[str, Any], experiment: str) -> int:
    """How many participants of an experiment were complete."""
    return int(statistics.get(experiment, {}).get("n", 0))


def shortened(items: Sequence[str], noun: str) -> tuple[str, ...]:
    """All `items`, or the first 50 of more than 100 and how many more there are.

    >>> shortened(["a", "b"], "files"), shortened(["a"] * 10_000, "files")[-1]
    (('a', 'b'), 'and 9,950 more files')
    """
    if len(items) <= LISTED:
        return tuple(items)
    return (*items[:SHOWN], f"and {len(items) - SHOWN:,} more {noun}")
