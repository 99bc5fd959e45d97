"""Whether a study was frozen beforehand, and everything that it did otherwise."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.report import apa
from analysis.report.section import Section, Table
from analysis.summary.deviations import Deviation, StudyDeviations
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.participants import how_many
from experiments.study.preregistration import plain_value


def deviations_sections(report: ReportData) -> Iterator[Section]:
    """A section a study that was frozen; nothing of the others."""
    found = report.statistics.preregistration or ()
    for one in found:
        whose = f": {one.study}" if len(found) > 1 else ""
        yield Section(
            title=f"Deviations from the preregistration{whose}",
            paragraphs=(f"{_frozen(one)} {_count(one)}",),
            tables=(_table(one.deviations),) if one.deviations else (),
        )


def _frozen(one: StudyDeviations) -> str:
    if not one.preregistrations:
        return "No preregistration can be trusted."
    told = [f"preregistration {its.number} of {its.written_utc} (SHA-256 {its.sha256})" for its in one.preregistrations]
    return f"The study was frozen: {'; '.join(told)}."


def _count(one: StudyDeviations) -> str:
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
