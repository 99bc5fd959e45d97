"""The parts a report is made of, and what goes into it. The templates know these and nothing of the statistics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from analysis.figures import ShotPanel
from analysis.logs import Problem
from analysis.odds import Odds
from analysis.published import Row


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportData:
    """What a report tells. `statistics` is the content of `statistics.json`; `comparison` None without a paper.

    `files` are the logs used; `provenance` is label -> text; `notes` are the assumptions behind the numbers.
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
