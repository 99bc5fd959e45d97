"""How good the data are: times, ends of the scale, outliers, dropped trials, and assumptions that do not hold."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from analysis.report.labels import display_name, named
from analysis.report.section import Section, Table, shortened
from analysis.stats.cells import ByParticipant
from analysis.stats.diagnostics import OUTLIER_RULE
from analysis.summary.results import DirectionStatistics, WithinStatistics
from analysis.summary.sections.content import EXPERIMENTS, ReportData
from analysis.summary.summary import UNDEFINED
from analysis.times.own_trials import ResponseTimes
from device.messages import first_few, how_many


def quality_section(report: ReportData) -> Iterator[Section]:
    """What a reader has to know of the data before believing the tests."""
    statistics = report.statistics
    of = f" of {EXPERIMENTS['direction']}" if statistics.designs else ""  # which may have times as well
    times = () if statistics.direction is None else (_times_sentence(statistics.direction.response_times, of),)
    tables = tuple(table for table in (_ends(report),) if table.rows)
    told = (*_warnings(report), *_of_answers(statistics.direction), *report.dropped, *_of_designs(report))
    items = shortened([*told], "warnings")
    if statistics.analysed or items:
        yield Section(title="Data quality", paragraphs=times, tables=tables, items=items)


def _of_designs(report: ReportData) -> Iterator[str]:
    """Who lacks a condition of a design."""
    if not report.statistics.designs:
        return
    from analysis.summary.sections.designs import lacking_conditions  # noqa: PLC0415 - slow, and of no use without a design

    for one in report.statistics.designs.values():
        yield from (f"{one.title}: {text}" for text in lacking_conditions(one))


def _warnings(report: ReportData) -> Iterator[str]:
    """Those of the statistics, and assumptions that do not hold without changing which number to read."""
    for warning in report.statistics.warnings:
        if UNDEFINED not in warning:
            yield f"Warning: {named(warning)}."
    for name, found in report.statistics.analysed.items():
        for entry in found.assumptions:
            if entry.warning and not entry.serious:
                yield f"{EXPERIMENTS[name].capitalize()}: {named(entry.warning)}."


def _of_answers(found: DirectionStatistics | None) -> Iterator[str]:
    """Who said the same to whatever was shot, was always wrong, or had more or fewer trials than others; all kept."""
    if found is None:
        return
    title = EXPERIMENTS["direction"].capitalize()
    for words, forward, backward in (("said forward", 1.0, 0.0), ("said backward", 0.0, 1.0), ("were wrong", 0.0, 0.0)):
        who = _people_with(found, forward, backward)
        if who:
            yield f"{title}: participants who {words} in every trial (kept): {_some(who)}."
    uneven = [
        f"{display_name(method)} {way} {test.fewest_and_most[0]:,} to {test.fewest_and_most[1]:,}"
        for method, tests in found.binomial.items()
        for way, test in tests.items()
        if test.fewest_and_most
    ]
    if uneven:
        yield f"{title}: not everybody has as many trials, and each score counts alike: {_some(uneven)}."


def _people_with(found: DirectionStatistics, forward: float, backward: float) -> list[str]:
    """The participants with these correct rates on forward and on backward shots, whatever the method."""
    on_backward = set(_who_has(found.backward.participants, backward))
    return [code for code in _who_has(found.participants, forward) if code in on_backward]


def _who_has(people: ByParticipant, rate: float) -> list[str]:
    """The participants with the same rate for every method."""
    alike = (people.array == rate).all(axis=1).tolist()
    return [code for code, yes in zip(people.codes, alike, strict=True) if yes]


def undefined_numbers(report: ReportData) -> Iterator[Section]:
    """The appendix' list of the numbers that data like these do not define."""
    found = [warning for warning in report.statistics.warnings if UNDEFINED in warning]
    if found:
        listed = shortened([f"{warning}." for warning in found], "numbers")
        yield Section(title="Numbers that are undefined here", items=listed, appendix=True, folded=True)


def _times_sentence(times: ResponseTimes, of: str) -> str:
    """How many response times there are, `of` what, and which are none."""
    left_out = (
        f"None in {how_many(times.left_out, 'answered trial')}: there is no time in the log, or it is 0, or the answer "
        "was entered or corrected by the experimenter, whose hand tells nothing of the participant's time."
    )
    if not times.n:
        return f"There is no valid response time{of}, and so no figure of them. {left_out}"
    return f"There are {times.n:,} valid response times{of}.{' ' + left_out if times.left_out else ''}"


def _ends(report: ReportData) -> Table:
    rows = tuple(row for name, one in report.statistics.analysed.items() for row in _ends_rows(EXPERIMENTS[name], one))
    return Table(
        caption=f"Participants whose score lies at an end of the scale, and outliers. {OUTLIER_RULE}",
        header=("Experiment", "Method", "At the floor", "At the ceiling", "Outliers"),
        rows=rows,
    )


def _ends_rows(name: str, found: WithinStatistics) -> Iterator[tuple[str, ...]]:
    if found.supplement is None:
        return
    diagnostics = found.supplement.diagnostics
    for method in found.methods:
        yield (
            name.capitalize(),
            display_name(method),
            str(diagnostics.floor[method]),
            str(diagnostics.ceiling[method]),
            _some(o.participant for o in diagnostics.outliers.found if o.method == method),
        )


def _some(codes: Iterable[str]) -> str:
    """The first few codes, and how many more there are."""
    return first_few(list(codes), 10) or "none"
