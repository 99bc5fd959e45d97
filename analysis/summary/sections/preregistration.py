"""Whether a study was frozen beforehand, and everything that it did otherwise."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.report import apa
from analysis.report.section import Section, Table
from analysis.summary.deviations import Deviation, FrozenAs, StudyDeviations
from analysis.summary.sections.content import ReportData
from device.messages import how_many
from experiments.study.changes import plain_value


def deviations_sections(report: ReportData) -> Iterator[Section]:
    """A section a study that was frozen; nothing of the others."""
    found = report.statistics.preregistration or ()
    for one in found:
        whose = f": {one.study}" if len(found) > 1 else ""
        yield Section(
            title=f"Deviations from the preregistration{whose}",
            paragraphs=(*map(_frozen, one.preregistrations), _count(one)),
            tables=(_table(one.deviations),) if one.deviations else (),
        )


def _frozen(one: FrozenAs) -> str:
    begun = f"{how_many(one.begun, 'run')} of people had begun" if one.begun else "no run of a person had begun"
    day, time = one.written_utc[:10], one.written_utc[11:16]
    why = f" Reason: {one.reason}." if one.reason else " No reason was given." if one.number > 1 else ""
    what = "The study was frozen" if one.number == 1 else "It was amended"
    return f"{what} on {day}, {time} UTC, when {begun}: preregistration {one.number}, SHA-256 {one.sha256}.{why}"


def _count(one: StudyDeviations) -> str:
    if not one.preregistrations:
        return "There is no preregistration that can be trusted, so nothing can be held against it."
    if not one.deviations:
        return "No deviation."
    return f"{how_many(len(one.deviations), 'deviation')}, each in a row below."


def _table(found: tuple[Deviation, ...]) -> Table:
    return Table(
        caption="Deviations from the preregistration",
        header=("Kind", "What", "Frozen", "Instead", "Who"),
        rows=tuple((one.kind, one.what, *_values(one), ", ".join(one.who)) for one in found),
    )


def _values(one: Deviation) -> tuple[str, str]:
    """Both values; where what is said has none, neither."""
    if one.frozen is None and one.instead is None:
        return apa.NO_NUMBER, apa.NO_NUMBER
    return plain_value(one.frozen), plain_value(one.instead)
