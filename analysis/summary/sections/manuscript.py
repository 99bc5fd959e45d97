"""Words for a paper: participants, design, analysis, results and software, in the past tense, ready to be copied."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from analysis.report import apa
from analysis.report.labels import display_name
from analysis.report.section import Section
from analysis.summary.results import DesignSummary, DirectionStatistics, StudyStatistics, WithinStatistics
from analysis.summary.sections.content import EXPERIMENTS, ReportData, has_many
from analysis.summary.sections.designs import result_sentences
from analysis.summary.sections.experiments import effect_sentence, pairs_sentence
from analysis.summary.sections.participants import how_many

_HOW = (
    "Copy what you need, and add what the logs do not know: ages, sexes and handedness (recoil study lists them), "
    "apparatus, consent. p-values below .001 are given in full; the APA prints them as p < .001."
)
_REASONS = 5
"""So many reasons of exclusion are told."""


def manuscript_section(report: ReportData) -> Iterator[Section]:
    """Participants, design, analysis and results of each experiment, then the software."""
    statistics = report.statistics
    quotes = (
        *(text for name, found in statistics.analysed.items() for text in _of_experiment(statistics, name, found)),
        *(text for name, found in statistics.designs.items() for text in _of_design(statistics, name, found)),
    )
    if quotes:
        yield Section(title="For your paper", paragraphs=(_HOW,), quotes=(*quotes, _software(statistics)))


def _of_experiment(statistics: StudyStatistics, name: str, found: WithinStatistics) -> Iterator[str]:
    title = EXPERIMENTS[name].capitalize()
    people = _people(statistics, name, found.n, found.people)
    yield f"{title}, participants and design. {people} {_design(found)}"
    if found.anova is not None:
        yield f"{title}, analysis. {_analysis(found)}"
    results = (effect_sentence(found, name, full=True), pairs_sentence(found, name, full=True), _guessing(found))
    yield f"{title}, results. {' '.join(filter(None, results))}"


def _people(statistics: StudyStatistics, name: str, n: int, people: str) -> str:
    """How many were analysed, and how many not, for what reasons."""
    gone = Counter(entry.rule or entry.reason for entry in statistics.excluded if entry.experiment == name)
    told = f"{people} {'was' if n == 1 else 'were'} analysed"
    if not gone:
        return f"{told}; nobody was left out."
    reasons = "; ".join(f"{count:,} by “{reason}”" for reason, count in gone.most_common(_REASONS))
    rest = "; the report lists the other reasons" if len(gone) > _REASONS else ""
    total = how_many(gone.total(), "further participant")
    return f"{told}; {total} {'was' if gone.total() == 1 else 'were'} left out ({reasons}{rest})."


def _design(found: WithinStatistics) -> str:
    methods = f"{len(found.methods)} rendering methods ({', '.join(map(display_name, found.methods))})"
    if not isinstance(found, DirectionStatistics):
        return f"Within participants, each of {methods} was rated from 0 to 10."
    return (
        f"Within participants, the direction of {_shots(found)} each of {methods} was judged. The measure was the "
        "share of right answers on forward shots."
    )


def _shots(found: DirectionStatistics) -> str:
    """How many trials each participant had with a method, if all had as many."""
    each = {tuple((way, test.trials / found.n) for way, test in tests.items()) for tests in found.binomial.values()}
    if len(each) != 1:
        return "single shots with"
    return f"{' and '.join(f'{count:g} {way}' for way, count in each.pop())} shots with"


def _analysis(found: WithinStatistics) -> str:
    told = (
        "Scores were compared by a one-way repeated-measures ANOVA and by Tukey's HSD tests of all pairs with the "
        "pooled error term of the ANOVA (α = .05). Effect sizes are partial and generalised η², and of pairs d_z, the "
        "mean difference over the SD of the differences."
    )
    if isinstance(found, DirectionStatistics) and found.binomial:
        told += " Correct rates were tested against 50 % by exact binomial tests over the trials of all participants."
    return told


def _guessing(found: WithinStatistics) -> str:
    if not isinstance(found, DirectionStatistics):
        return ""
    if has_many(found):
        return ""
    tests = "; ".join(
        f"{display_name(method)} {way} {apa.percent(test.estimate)} ({test.successes:,} of {test.trials:,}), "
        f"{apa.p_value(test.p, exact=True)}"
        for method, ways in found.binomial.items()
        for way, test in ways.items()
    )
    return f"Against guessing: {tests}." if tests else ""


def _of_design(statistics: StudyStatistics, name: str, found: DesignSummary) -> Iterator[str]:
    synthetic = "synthetic " if found.origin.synthetic else ""
    people = _people(statistics, name, found.n, how_many(found.n, f"{synthetic}participant"))
    yield f"{found.title}, participants and design. {people} {' '.join(found.protocol)}"
    lacking = (
        f"{how_many(len(question.left_out), 'participant')} lacked a condition of {asked} and stood in no test of it."
        for asked, question in found.questions.items()
        if question.left_out
    )
    yield f"{found.title}, results. {' '.join([*result_sentences(name, found, exact=True), *lacking])}"


def _software(statistics: StudyStatistics) -> str:
    """What computed the numbers."""
    versions = dict(statistics.versions or {})
    product = f"Recoil {versions.pop('recoil', '')}".strip()
    python = f"Python {versions.pop('python', '')}".strip()
    others = ", ".join(f"{name} {version}" for name, version in versions.items() if version != "not installed")
    return f"Software. The data were analysed with {product} ({', '.join(filter(None, [python, others]))})."
