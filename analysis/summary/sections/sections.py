"""A report's sections in their order. A section without data is left out."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from analysis.logs.exclusions import FINISHED
from analysis.logs.files import below, names_below
from analysis.paper.paper import AUDITED, ComparisonRow
from analysis.paper.recurrence import PatternOdds
from analysis.report import apa
from analysis.report.figures.style import named
from analysis.report.page import write_page
from analysis.report.section import LISTED, SHOWN, Section, Table, shortened
from analysis.report.serial import as_json
from analysis.summary.results import DirectionStatistics, Origin
from analysis.summary.sections.content import EXPERIMENTS, ReportData, results_picture, shot_picture, write_figures
from analysis.summary.sections.designs import design_section
from analysis.summary.sections.experiments import direction_section, preference_section
from analysis.summary.sections.people import people_section
from analysis.summary.sections.supplement import supplement_sections
from analysis.summary.sections.trade import trade_section

_HANDS = {
    "participant": "the participant's own hand",
    "experimenter": "the experimenter's hand",
    "synthetic": "synthetic participants",
}
_LUCK = (
    "One replication is luck. The table says how often each published claim recurred over many simulated replications "
    "of the study, with a 95 % Wilson interval; a claim that recurs in two of three would fail in one of three honest "
    "repetitions."
)


def sections(report: ReportData) -> tuple[Section, ...]:
    """All sections that have something to say."""
    statistics = report.statistics
    direction, preference = (statistics.analysed.get(name) for name in EXPERIMENTS)
    found = [
        _analysed(report),
        people_section(report.statistics.participation),
        Section(title="Results at a glance", pictures=(results_picture(statistics),)) if statistics.analysed else None,
        _verdicts(report.comparison) if report.comparison else None,
        *(
            (direction_section(direction), trade_section(direction))
            if isinstance(direction, DirectionStatistics)
            else ()
        ),
        preference_section(preference) if preference is not None else None,
        *(design_section(name, one) for name, one in statistics.designs.items()),
        *supplement_sections(statistics),
        *report.extra,
        _odds(report.odds) if report.odds else None,
        Section(title="The shot", pictures=(shot_picture(report.panels),)) if report.panels else None,
        _left_out(report),
        _provenance(report),
    ]
    return tuple(section for section in found if section is not None)


def _analysed(report: ReportData) -> Section:
    gone = Counter(entry.experiment for entry in report.statistics.excluded if not entry.file)
    rows = tuple(
        (name.capitalize(), f"{found.n:,}", f"{gone[key]:,}")
        for key, name in EXPERIMENTS.items()
        if (found := report.statistics.of(key)) is not None
    )
    rows += tuple((one.title, f"{one.n:,}", apa.NO_NUMBER) for one in report.statistics.designs.values())
    table = Table(caption="Participants", header=("Experiment", "Analysed", "Left out as incomplete"), rows=rows)
    files = f"{len(report.files):,} log files were read. " if report.files else ""
    bad = f"Left out, with the reasons listed below: {len(report.problems)}." if report.problems else ""
    text = (files + bad).strip()
    nothing = () if rows else ("There was nothing to analyse.",)
    origins = tuple(
        _origin(name, origin)
        for name, origin in (
            *((EXPERIMENTS[key], found.origin) for key, found in report.statistics.analysed.items()),
            *((name, found.origin) for name, found in report.statistics.designs.items()),
        )
        if origin.answers
    )
    return Section(
        title="What was analysed",
        paragraphs=(*((text,) if text else ()), *nothing, *origins),
        tables=(table,) if rows else (),
    )


def _origin(name: str, origin: Origin) -> str:
    """Who answered, and on which gun: nobody is to take synthetic participants for people."""
    answers = ", ".join(f"{count} by {_HANDS[hand]}" for hand, count in origin.answers.items())
    names = {gun: "the simulated gun" if gun == "simulated" else f"the gun {gun}" for gun in origin.guns}
    guns = ", ".join(f"{count} on {names[gun]}" for gun, count in origin.guns.items())
    trials = f"; trials {guns}" if guns else ""
    return f"{name.capitalize()}: answers {answers}{trials}."


def _verdicts(comparison: tuple[ComparisonRow, ...]) -> Section:
    experiments = dict.fromkeys(row.experiment for row in comparison)
    return Section(
        title="Published and obtained",
        paragraphs=(_agreement(comparison), *_audited(comparison)),
        tables=tuple(_verdict_table(experiment, comparison) for experiment in experiments),
    )


def _agreement(comparison: tuple[ComparisonRow, ...]) -> str:
    counts = Counter(row.verdict for row in comparison)
    predicted, missing = counts["differs as predicted"], counts["not obtained"]
    told = f"{counts['agrees']} published numbers and claims agree, {counts['differs']} differ"
    told += f", {predicted} {'differs' if predicted == 1 else 'differ'} as the audit predicted" if predicted else ""
    told += f", {missing} were not obtained." if missing else "."
    return told + " A number agrees if it rounds to the printed digits, a bound or an order if it is true here."


def _audited(comparison: tuple[ComparisonRow, ...]) -> tuple[str, ...]:
    """What the audit's column says, where there is one."""
    if not any(row.audit for row in comparison):
        return ()
    return (
        "The audit asks beforehand whether any data could give the published number beside the others. What differs as "
        "predicted is the nearest value that data can have. Numbers that no log holds carry the audit's verdict alone.",
    )


def _verdict_table(experiment: str, comparison: tuple[ComparisonRow, ...]) -> Table:
    rows = [row for row in comparison if row.experiment == experiment]
    if any(row.verdict in AUDITED for row in rows):
        header: tuple[str, ...] = ("Quantity", "Published", "Verdict", "Note")
        cells = [(row.quantity, row.published, row.verdict, row.note) for row in rows]
        return Table(caption="Published numbers that no log holds, by the audit", header=header, rows=tuple(cells))
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


def _odds(odds: tuple[PatternOdds, ...]) -> Section:
    tables = tuple(
        Table(
            caption=f"{EXPERIMENTS.get(one.experiment, one.experiment).capitalize()}: {one.replications} replications",
            header=("Published claim", "Recurs in", "95 % CI [%]"),
            rows=tuple(
                (named(row.claim), apa.percent(row.share), apa.interval(100.0 * row.ci_low, 100.0 * row.ci_high, 1))
                for row in one.rows
            ),
        )
        for one in odds
    )
    assumed = dict.fromkeys(one.assumptions for one in odds)
    return Section(title="Odds of the published pattern", paragraphs=(_LUCK, *assumed), tables=tables)


def _left_out(report: ReportData) -> Section | None:
    excluded = tuple(
        f"Participant {entry.participant} in {EXPERIMENTS.get(entry.experiment, entry.experiment)}: {entry.reason}. "
        f"Rule: {entry.rule}; remedy: {entry.remedy}."
        for entry in report.statistics.excluded
        if not entry.file or entry.rule == FINISHED
    )
    names = _short_names(report)
    problems = tuple(below(problem, names[problem.file].parent) for problem in report.problems)
    remarks = tuple(f"Used, but: {below(remark, names[remark.file].parent)}." for remark in report.remarks)
    warnings = tuple(f"Warning: {warning}." for warning in report.statistics.warnings)
    items = (
        *shortened(excluded, "exclusions"),
        *shortened(problems, "problems"),
        *shortened(remarks, "remarks"),
        *shortened(warnings, "warnings"),
    )
    return Section(title="Exclusions and problems", items=items) if items else None


def _short_names(report: ReportData) -> dict[Path, Path]:
    return names_below([*report.files, *(one.file for one in (*report.problems, *report.remarks))])


def _provenance(report: ReportData) -> Section | None:
    pairs = [*report.provenance.items(), *(report.statistics.versions or {}).items()]
    rows = [*dict.fromkeys(pairs), *_file_rows(report)]
    if not rows and not report.notes:
        return None
    table = Table(caption="Where the numbers come from", header=("What", "Value"), rows=tuple(rows))
    return Section(title="Provenance and assumptions", items=report.notes, tables=(table,) if rows else ())


def _file_rows(report: ReportData) -> list[tuple[str, str]]:
    names = _short_names(report)
    shown = report.files if len(report.files) <= LISTED else report.files[:SHOWN]
    rows = [("log file", names[file].as_posix()) for file in shown]
    rest = len(report.files) - len(shown)
    return [*rows, ("log files", f"and {rest:,} more")] if rest else rows


def write_report(out: Path, report: ReportData) -> None:
    """Write `report.html`, `report.md`, `statistics.json` and `figures/` into `out`, which is made if need be.

    Files of an earlier report there are replaced. The same data give the same bytes.
    """
    out.mkdir(parents=True, exist_ok=True)
    write_figures(out / "figures", report)
    write_page(out, report.title, sections(report))
    (out / "statistics.json").write_bytes(as_json(report.statistics))
