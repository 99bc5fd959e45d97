"""The results in sentences, and the picture of them."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.report.section import Section
from analysis.summary.sections.content import EXPERIMENTS, ReportData
from analysis.summary.sections.designs import result_sentences
from analysis.summary.sections.experiments import effect_sentence, pairs_sentence
from analysis.summary.sections.pictures import results_picture
from analysis.summary.sections.published import agreement


def glance_section(report: ReportData) -> Iterator[Section]:
    """What was found, a paragraph an experiment and question; a paper's numbers are in the appendix."""
    statistics, compared = report.statistics, report.comparison is not None
    paragraphs = (
        *_of_experiments(report),
        *(text for name, one in statistics.designs.items() for text in result_sentences(name, one)),
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
