"""What goes into the report of a study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from analysis.logs.reading import Problem
from analysis.paper.published import ComparisonRow
from analysis.paper.recurrence import PatternOdds
from analysis.report.figures.shot import ShotPanel
from analysis.report.section import Section
from analysis.summary.results import StudyStatistics

EXPERIMENTS = {"direction": "direction recognition", "preference": "preference"}


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportData:
    """What a report tells. `comparison` is None without a paper.

    `files` are the logs used; `provenance` is label -> text; `notes` are the assumptions behind the numbers; `extra`
    are finished sections that follow the statistics.
    """

    title: str
    statistics: StudyStatistics
    problems: tuple[Problem, ...] = ()
    comparison: tuple[ComparisonRow, ...] | None = None
    odds: tuple[PatternOdds, ...] = ()
    panels: tuple[ShotPanel, ...] = ()
    files: tuple[Path, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    extra: tuple[Section, ...] = ()
