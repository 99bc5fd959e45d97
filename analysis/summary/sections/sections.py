"""A report's sections in their order: a section is one function, which yields nothing where it has nothing to say."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from analysis.logs.files import name_below, shown_name
from analysis.logs.kinds import OF_KIND, folder_of
from analysis.logs.setups import pooled_setups
from analysis.report.copies import process_copies
from analysis.report.labels import labelled
from analysis.report.page import load_templates, write_page
from analysis.report.section import PageHead, PageNotice, Section, Table, names_in_full, shortened
from analysis.report.serial import as_json
from analysis.report.terminal import Tell, untold
from analysis.summary.results import STATISTICS_FILE
from analysis.summary.sections.content import EXPERIMENTS, ReportData
from analysis.summary.sections.experiments import (
    direction_section,
    effect_sentence,
    everybodys_values,
    pairs_sentence,
    preference_section,
)
from analysis.summary.sections.manuscript import manuscript_section
from analysis.summary.sections.participants import all_left_out, notices, participants_section, shown_root
from analysis.summary.sections.pictures import results_picture, write_figures
from analysis.summary.sections.preregistration import deviations_sections
from analysis.summary.sections.published import agreement, odds_section, published_sections, shot_section
from analysis.summary.sections.quality import quality_section, undefined_numbers
from analysis.summary.sections.supplement import supplement_sections
from analysis.summary.sections.trade import trade_details, trade_sections
from experiments.record import storage


def sections(report: ReportData) -> tuple[Section, ...]:
    """All sections that have something to say."""
    return tuple(section for part in READERS_ORDER for section in part(report))


def _glance(report: ReportData) -> Iterator[Section]:
    """What was found, a paragraph an experiment and question; a paper's numbers are in the appendix."""
    statistics, compared = report.statistics, report.comparison is not None
    paragraphs = (
        *_of_experiments(report),
        *_of_designs(report),
        *(
            (f"Against the paper: {agreement(report.comparison)} They stand in the appendix.",)
            if report.comparison
            else ()
        ),
    )
    pictures = (results_picture(statistics, compared=compared),) if statistics.analysed else ()
    if paragraphs:
        yield Section(title="Results", paragraphs=paragraphs, pictures=pictures)


def _of_experiments(report: ReportData) -> Iterator[str]:
    for name, found in report.statistics.analysed.items():
        pairs = pairs_sentence(found, name, planned=report.planned)
        words = " ".join(filter(None, [effect_sentence(found, name), pairs]))
        yield f"{EXPERIMENTS[name].capitalize()}: {words[:1].lower()}{words[1:]}"
        yield from pooled_setups(report.remarks, name)


def _of_designs(report: ReportData) -> Iterator[str]:
    if not report.statistics.designs:
        return
    from analysis.summary.sections.designs import result_sentences  # noqa: PLC0415 - slow, and of no use without a design

    for name, found in report.statistics.designs.items():
        yield from result_sentences(name, found)
        yield from pooled_setups(report.remarks, name)


def _designs(report: ReportData) -> Iterator[Section]:
    """What was found in designs, if logs are of some."""
    if report.statistics.designs:
        from analysis.summary.sections.designs import sections_of_designs  # noqa: PLC0415 - slow, and of no use without a design

        yield from sections_of_designs(report)


def _finished(report: ReportData) -> Iterator[Section]:
    yield from report.extra


def _delivered(report: ReportData) -> Iterator[Section]:
    """What sensors said of the shots, where there were some."""
    if report.delivered:
        from analysis.summary.sections.delivered import delivered_section  # noqa: PLC0415 - of no use without a sensor

        yield from delivered_section(report)


def _requested(report: ReportData) -> Iterator[Section]:
    """What was asked for, if something was: of many kinds of tests."""
    if report.statistics.requested:
        from analysis.summary.sections.requested import requested_sections  # noqa: PLC0415 - slow, and seldom asked for

        yield from requested_sections(report)


def _provenance(report: ReportData) -> Iterator[Section]:
    pairs = (dict(report.statistics.versions or {}) | dict(report.provenance)).items()
    table = Table(caption="Where the numbers come from", header=("What", "Value"), rows=tuple(pairs))
    if pairs or report.notes:
        yield Section(
            title="Provenance and assumptions", items=report.notes, tables=(table,) if pairs else (), appendix=True
        )


def _log_files(report: ReportData) -> Iterator[Section]:
    if report.files:
        root = shown_root(report)
        listed = shortened(report.files, "log files", lambda file: shown_name(name_below(file, root).as_posix()))
        yield Section(title="Log files", items=listed, appendix=True, folded=True)


def _notices_of_kept_apart(report: ReportData) -> Iterator[PageNotice]:
    """A line on top where the page shows data of other kinds as well."""
    if report.apart:
        others = " and of ".join(OF_KIND[one.statistics.data_kind] for one in report.apart)
        text = f"DATA OF {others.upper()} are shown as well, in sections of their own behind these."
        yield PageNotice(text=text, kind="warning")


def _kept_apart(report: ReportData) -> Iterator[Section]:
    """The sections of data of other kinds, each with its own notices, and figures from folders of their own."""
    for one in report.apart:
        kind = one.statistics.data_kind
        whose = OF_KIND[kind]
        said = f"What follows is of {whose} alone, and kept apart: no number above rests on it."
        yield Section(title=whose.capitalize(), paragraphs=(said, *(notice.text for notice in notices(one))))
        for section in (section for part in READERS_ORDER if part is not manuscript_section for section in part(one)):
            pictures = tuple(replace(shown, stem=f"{folder_of(kind)}/{shown.stem}") for shown in section.pictures)
            yield replace(section, title=f"{whose.capitalize()}: {section.title}", pictures=pictures)


READERS_ORDER: tuple[Callable[[ReportData], Iterator[Section]], ...] = (
    participants_section,
    deviations_sections,
    _glance,
    direction_section,
    preference_section,
    _designs,
    _finished,
    manuscript_section,
    quality_section,
    _delivered,
    supplement_sections,
    _requested,
    trade_sections,
    # what follows is the appendix
    all_left_out,
    everybodys_values,
    trade_details,
    undefined_numbers,
    published_sections,
    odds_section,
    shot_section,
    _provenance,
    _log_files,
    _kept_apart,
)
"""The reader's order: who, what was found, how sure, what else; then what only some readers look up."""


def write_report(
    out: Path, report: ReportData, tell: Tell = untold, meanwhile: Callable[[], object] = lambda: None
) -> None:
    """Write `report.html`, `report.md`, `statistics.json` and `figures/` into `out`, which is made if need be.

    `tell` of "figures" and of "pages". `meanwhile` is done while copies of this process still draw.

    Files of an earlier report there are replaced. The same data give the same bytes.
    """
    storage.make_folder(out)
    methods = [method for one in report.statistics.analysed.values() for method in one.methods]
    head = PageHead(
        notices=(*notices(report), *_notices_of_kept_apart(report)), files=(STATISTICS_FILE, *report.beside)
    )
    with labelled(report.statistics.labels or {}, methods):
        with process_copies():
            write_figures(out / "figures", report)
            for one in report.apart:
                write_figures(out / "figures" / folder_of(one.statistics.data_kind), one)
            meanwhile()
            parts = sections(report)
            load_templates()
        tell("figures")
        write_page(out, report.title, (*parts, *names_in_full()), head)
    storage.write_whole(out / STATISTICS_FILE, as_json(report.statistics))
    tell("pages")
