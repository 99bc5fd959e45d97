"""What came of a reproduction: statistics, every published number beside what was obtained, and the report.

The odds are over participants of the same config, whose logs are not written.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.logs.reading import Logs, read_logs
from analysis.paper.audit.claims import AuditFinding
from analysis.paper.audit.page import ATTENTION, ELSEWHERE, cut, other_rows, predictions
from analysis.paper.paper import ComparisonRow
from analysis.paper.recurrence import PatternOdds
from analysis.predict.reproduction.people import drawn_studies, missing_methods, published_of, table_name
from analysis.predict.reproduction.study import ReproducedStudy
from analysis.predict.simulate.panels import shot_panel, smooth_trace
from analysis.predict.synthetic_studies import pattern_odds
from analysis.report import placing
from analysis.report.terminal import Tell
from analysis.summary.comparison import compare
from analysis.summary.results import STATISTICS_FILE, StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.published import obtained_text
from analysis.summary.sections.sections import write_report
from analysis.summary.summary import summarize
from device.parameters import GunParameters
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.record.provenance import provenance


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduced:
    """The statistics of a reproduction, and every published number beside what was obtained."""

    statistics: StudyStatistics
    comparison: tuple[ComparisonRow, ...]


def report_of_runs(study: ReproducedStudy, findings: Sequence[AuditFinding], out: Path, tell: Tell) -> Reproduced:
    """Statistics, comparison and report of the logs in `out`; `findings`: the audit of the published numbers."""
    logs = read_logs([out / "logs"])
    statistics = summarize(logs, fits=True)
    tell("statistics")
    odds = tuple(_odds(study))
    tell("odds of the published pattern")
    comparison = tuple(_compared(study, findings, statistics))
    with placing.results_in(out, STATISTICS_FILE) as part:
        write_report(part, _report(study, logs, statistics, odds, comparison))
    tell("report")
    return Reproduced(statistics=statistics, comparison=comparison)


def comparison_text(comparison: tuple[ComparisonRow, ...]) -> str:
    """Every published number with its verdict, for the terminal."""
    if not comparison:
        return "No published numbers to compare with."
    rows = [("verdict", "published", "obtained", "number"), *map(_cells, comparison)]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    lines = ["  ".join([*map(str.ljust, row, widths), row[3]]) for row in rows]
    notes = [f"{row.quantity}, published {row.published}: {row.note}" for row in comparison if _remarkable(row)]
    return "\n".join([*lines, *([""] if notes else []), *notes])


def _cells(row: ComparisonRow) -> tuple[str, str, str, str]:
    apart = row.experiment == ELSEWHERE
    name = row.quantity if apart else f"{row.experiment}: {row.quantity}"
    return row.verdict, cut(row.published, 20), "" if apart else obtained_text(row), cut(name, 72)


def _remarkable(row: ComparisonRow) -> bool:
    """Does the verdict call for its reason?"""
    return bool(row.note) and row.verdict in {"differs", "differs as predicted", *ATTENTION}


def _compared(
    study: ReproducedStudy, findings: Sequence[AuditFinding], statistics: StudyStatistics
) -> Iterator[ComparisonRow]:
    """Every published number: those that logs hold beside the obtained, the others with the audit's verdict."""
    if study.paper is not None:
        yield from compare(statistics, study.paper, predictions(findings))
        yield from other_rows(findings)


def _odds(study: ReproducedStudy) -> Iterator[PatternOdds]:
    if study.paper is None or not study.config.replications:
        return
    for setup in study.setups:
        studies = drawn_studies(setup)
        published = None if studies is None else published_of(studies, study.paper)
        if studies is not None and published is not None and not missing_methods(studies, published):
            yield pattern_odds(studies, published, study.config.replications, study.seed)


def _report(
    study: ReproducedStudy,
    logs: Logs,
    statistics: StudyStatistics,
    odds: tuple[PatternOdds, ...],
    comparison: tuple[ComparisonRow, ...],
) -> ReportData:
    people = "synthetic, reconstructed from the published numbers" if study.reconstructed else "synthetic"
    return ReportData(
        title=study.config.title,
        statistics=statistics,
        problems=logs.problems,
        comparison=comparison or None,
        odds=odds,
        panels=tuple(_panels(study.setups[0])),
        files=logs.files,
        provenance=provenance() | {"seed": str(study.seed), "participants": people, "gun": "simulated"},
        beside=tuple(table_name(setup) for setup in study.answering) if study.reconstructed else (),
        notes=tuple(_notes(study)),
        reconstructed=study.reconstructed,
    )


def _panels(setup: Setup[DesignConfig]) -> Iterator[Any]:
    for method in setup.config.methods:
        parameters = setup.gun.rendering(method)
        if isinstance(parameters, GunParameters):
            label = setup.gun.methods[method].label
            title = f"{label} (friction {parameters.friction_N:g} N)"
            yield shot_panel(title, smooth_trace(parameters), parameters.contact_depth_m)


def _notes(study: ReproducedStudy) -> Iterator[str]:
    """What the numbers rest on beyond the paper."""
    yield from study.notes
    yield from _without_odds(study)
    gun = study.setups[0].gun
    coil = gun.coil
    open_there, beyond = ("; the paper leaves both open", ", not in the paper") if study.paper else ("", "")
    yield f"The coil after the pulse is {coil.drive_off}, its back-EMF is {coil.emf}{open_there}."
    for setup in study.setups:
        if setup.config.assumed:
            yield f"Assumed or fitted for {setup.config.experiment}{beyond}: {', '.join(setup.config.assumed)}."
    if gun.assumed:
        yield f"Assumed for the gun{beyond}: {', '.join(gun.assumed)}."


def _without_odds(study: ReproducedStudy) -> Iterator[str]:
    for setup in study.setups if study.paper else ():
        studies = drawn_studies(setup)
        missing = (
            []
            if studies is None or study.paper is None
            else missing_methods(studies, published_of(studies, study.paper))
        )
        if missing:
            name, methods = setup.config.design, ", ".join(missing)
            yield f"No odds of the published pattern of {name}: the study has no {methods}, which its claims are about."
