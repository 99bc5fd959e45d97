"""The appendix of a report that has a paper: published against obtained, the odds of the pattern, the shot."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

from analysis.report import apa
from analysis.report.labels import named
from analysis.report.section import Section, Table
from analysis.summary.sections.content import EXPERIMENTS, ReportData
from analysis.summary.sections.pictures import shot_picture

if TYPE_CHECKING:
    from analysis.paper.paper import ComparisonRow

_LUCK = (
    "One replication is luck. The table says how often each published claim recurred over many simulated replications "
    "of the study, with a 95 % Wilson interval; a claim that recurs in two of three would fail in one of three honest "
    "repetitions."
)


def published_sections(report: ReportData) -> Iterator[Section]:
    """Every published number beside the obtained one; folded, those that no log holds."""
    comparison = report.comparison or ()
    experiments = dict.fromkeys(row.experiment for row in comparison)
    tables = {name: _verdict_table(name, comparison) for name in experiments}
    elsewhere = tuple(table for name, table in tables.items() if _elsewhere(name, comparison))
    obtained = tuple(table for name, table in tables.items() if not _elsewhere(name, comparison))
    if obtained:
        paragraphs = (f"{agreement(comparison)} {_RULE}", *_audited(comparison))
        yield Section(title="Published and obtained", paragraphs=paragraphs, tables=obtained, appendix=True)
    if elsewhere:
        yield Section(title="Published numbers that no log holds", tables=elsewhere, appendix=True, folded=True)


_RULE = "A number agrees if it rounds to the printed digits, a bound or an order if it is true here."


def agreement(comparison: tuple[ComparisonRow, ...]) -> str:
    """How many published numbers agree."""
    counts = Counter(row.verdict for row in comparison)
    predicted, missing = counts["differs as predicted"], counts["not obtained"]
    told = f"{counts['agrees']} published numbers and claims agree, {counts['differs']} differ"
    told += f", {predicted} {'differs' if predicted == 1 else 'differ'} as the audit predicted" if predicted else ""
    return told + (f", {missing} were not obtained." if missing else ".")


def _audited(comparison: tuple[ComparisonRow, ...]) -> tuple[str, ...]:
    """What the audit's column says, where there is one."""
    if not any(row.audit for row in comparison):
        return ()
    return (
        "The audit asks beforehand whether any data could give the published number beside the others. What differs as "
        "predicted is the nearest value that data can have. Numbers that no log holds carry the audit's verdict alone.",
    )


def _elsewhere(experiment: str, comparison: tuple[ComparisonRow, ...]) -> bool:
    """Whether an experiment's rows are of the audit alone."""
    from analysis.paper.paper import AUDITED  # noqa: PLC0415 - of no use without a paper

    return any(row.verdict in AUDITED for row in comparison if row.experiment == experiment)


def _verdict_table(experiment: str, comparison: tuple[ComparisonRow, ...]) -> Table:
    rows = [row for row in comparison if row.experiment == experiment]
    if _elsewhere(experiment, comparison):
        header: tuple[str, ...] = ("Quantity", "Published", "Verdict", "Note")
        cells = [(row.quantity, row.published, row.verdict, row.note) for row in rows]
        return Table(caption="Published numbers, by the audit alone", header=header, rows=tuple(cells))
    header, audited = ("Quantity", "Published", "Obtained", "Verdict"), any(row.audit for row in rows)
    return Table(
        caption=f"{EXPERIMENTS.get(experiment, experiment).capitalize()}, every published number beside the obtained",
        header=(*header, *(("Audit",) if audited else ()), "Note"),
        rows=tuple(
            (
                *(named(row.quantity), row.published or apa.NO_NUMBER, obtained_text(row), row.verdict),
                *((row.audit or apa.NO_NUMBER,) if audited else ()),
                row.note,
            )
            for row in rows
        ),
    )


def obtained_text(row: ComparisonRow) -> str:
    """The obtained number with as many decimals as are printed; two where nothing is printed.

    >>> from analysis.paper.paper import ComparisonRow
    >>> obtained_text(ComparisonRow(experiment="", quantity="", published="55.7 %", obtained=61.43, verdict="differs"))
    '61.4 %'
    """
    if row.obtained is None:
        return apa.NO_NUMBER
    if row.published.startswith("<"):
        return apa.p_cell(row.obtained)
    digits, _, unit = row.published.partition(" ")
    decimals = len(digits.partition(".")[2]) if digits else 2
    return f"{apa.number(row.obtained, decimals)} {unit}".strip()


def odds_section(report: ReportData) -> Iterator[Section]:
    """How often the published pattern recurs, where that was asked for."""
    tables = tuple(
        Table(
            caption=f"{EXPERIMENTS.get(one.experiment, one.experiment).capitalize()}: {one.replications} replications",
            header=("Published claim", "Recurs in", "95 % CI [%]"),
            rows=tuple(
                (named(row.claim), apa.percent(row.share), apa.interval(100.0 * row.ci_low, 100.0 * row.ci_high, 1))
                for row in one.rows
            ),
        )
        for one in report.odds
    )
    assumed = dict.fromkeys(one.assumptions for one in report.odds)
    if tables:
        title = "Odds of the published pattern"
        yield Section(title=title, paragraphs=(_LUCK, *assumed), tables=tables, appendix=True)


def shot_section(report: ReportData) -> Iterator[Section]:
    """The course of one simulated shot."""
    if report.panels:
        picture = shot_picture(report.panels, compared=report.comparison is not None)
        yield Section(title="The shot", pictures=(picture,), appendix=True)
