"""What goes into the report of a study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from analysis.logs.reading import Problem
from analysis.paper.published import Row
from analysis.paper.recurrence import PatternOdds
from analysis.report.figures.shot import ShotPanel
from analysis.report.section import Section

EXPERIMENTS = {"direction": "direction recognition", "preference": "preference"}


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
    odds: tuple[PatternOdds, ...] = ()
    panels: tuple[ShotPanel, ...] = ()
    files: tuple[Path, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    extra: tuple[Section, ...] = ()


def analysed(statistics: Mapping[str, Any], experiment: str) -> int:
    """How many participants of an experiment were complete."""
    return int(statistics.get(experiment, {}).get("n", 0))
