"""Words for a paper: participants, design, analysis, results and software, in the past tense, ready to be copied."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from statistics import fmean, stdev

from analysis.logs.setups import pooled_setups
from analysis.report import apa
from analysis.report.labels import display_name
from analysis.report.section import Section
from analysis.summary.results import DesignSummary, DirectionStatistics, StudyStatistics, WithinStatistics
from analysis.summary.sections.content import EXPERIMENTS, ReportData, has_many
from analysis.summary.sections.exclusion_words import people_left_out, trials_dropped
from analysis.summary.sections.experiments import effect_sentence, pairs_sentence
from device.messages import how_many
from experiments.study.study import Facts

_HOW = (
    "Copy what you need, and add what the logs do not know: {}apparatus, consent. p-values below .001 are given in "
    "full; the APA prints them as p < .001."
)


def manuscript_section(report: ReportData) -> Iterator[Section]:
    """Participants, design, analysis and results of each experiment, then the software."""
    statistics = report.statistics
    quotes = (
        *(text for name, found in statistics.analysed.items() for text in _of_experiment(report, name, found)),
        *(text for name, found in statistics.designs.items() for text in _of_design(report, name, found)),
    )
    if quotes:
        known = any(member.facts and member.facts.known() for member in report.members.values())
        how = _HOW.format("" if known else "ages, sexes and handedness (recoil study DIR --join keeps them), ")
        yield Section(title="For your paper", paragraphs=(how,), quotes=(*quotes, _software(statistics)))


def _of_experiment(report: ReportData, name: str, found: WithinStatistics) -> Iterator[str]:
    title = EXPERIMENTS[name].capitalize()
    people = _people(report, name, found.people, found.participants.codes)
    design = " ".join([_design(report, found), *pooled_setups(report.remarks, name)])
    yield f"{title}, participants and design. {people} {design}"
    if found.anova is not None:
        yield f"{title}, analysis. {_analysis(found)}"
    pairs = pairs_sentence(found, name, full=True, planned=report.planned)
    results = (effect_sentence(found, name, full=True), pairs, _guessing(found))
    yield f"{title}, results. {' '.join(filter(None, results))}"


def _people(report: ReportData, name: str, people: str, codes: Sequence[str]) -> str:
    """How many were analysed, who they were, and what of whom was not, for what reasons."""
    facts = [member.facts for code in codes if (member := report.members.get(code)) and member.facts]
    who = "; ".join(filter(None, [_ages(facts, len(codes)), *_levels(facts, len(codes))]))
    told = f"{people}{f' ({who})' if who else ''} {'was' if len(codes) == 1 else 'were'} analysed."
    analysed = frozenset(codes)
    stopped = _stopped(len(analysed & report.stopped.get(name, frozenset())), len(analysed))
    return " ".join(
        filter(None, [told, people_left_out(report, name, analysed), stopped, trials_dropped(report, name)])
    )


def _stopped(count: int, of: int) -> str:
    """How many of the runs that are analysed did not come to their end.

    >>> _stopped(2, 6)
    'The runs of 2 of the 6 were stopped before their end; what was answered up to there is analysed.'
    """
    if not count:
        return ""
    runs = f"The run of 1 of the {of} was" if count == 1 else f"The runs of {count:,} of the {of:,} were"
    return f"{runs} stopped before {'its' if count == 1 else 'their'} end; what was answered up to there is analysed."


def _ages(facts: Iterable[Facts], n: int) -> str:
    """Mean, SD and range of the ages that the register holds.

    >>> _ages([Facts(age_years=20), Facts(age_years=30), Facts()], 3)
    'age of 2 of them: M = 25.0, SD = 7.1, 20 to 30 years'
    """
    ages = [one.age_years for one in facts if one.age_years is not None]
    if not ages:
        return ""
    of = "age" if len(ages) == n else f"age of {len(ages):,} of them"
    if len(ages) == 1:
        return f"{of}: {ages[0]} years"
    mean, spread = apa.number(fmean(ages), 1), apa.number(stdev(ages), 1)
    return f"{of}: M = {mean}, SD = {spread}, {min(ages)} to {max(ages)} years"


def _levels(facts: Iterable[Facts], n: int) -> Iterator[str]:
    """How many of each sex and handedness, and how many did not say."""
    people = [*facts]
    for name, words in (("sex", _SEXES), ("handedness", _HANDS)):
        counts = Counter(getattr(one, name) for one in people)
        told = [f"{counts[level]:,} {word}" for level, word in words.items() if counts[level]]
        unsaid = n - sum(counts[level] for level in words)
        yield ", ".join([*told, *([f"{unsaid:,} of unknown {name}"] if told and unsaid else [])])


_SEXES = {"female": "female", "male": "male", "other": "of another sex"}
_HANDS = {"right": "right-handed", "left": "left-handed", "both": "ambidextrous"}


def _design(report: ReportData, found: WithinStatistics) -> str:
    named = ", ".join(map(display_name, found.methods))
    methods = f"{how_many(len(found.methods), 'rendering method')} ({named})"
    if not isinstance(found, DirectionStatistics):
        low, high = report.rated_from or (0.0, 10.0)
        rescaled = "" if (low, high) == (0.0, 10.0) else ". Ratings were rescaled linearly to 0 to 10"
        return f"Within participants, each of {methods} was rated from {low:g} to {high:g}{rescaled}."
    return f"{_shots(found, methods)}. The measure was the share of right answers on forward shots."


def _shots(found: DirectionStatistics, methods: str) -> str:
    """What was judged, and how many trials a participant has with a method: the fewest and most if not as many."""
    counts: dict[str, set[int]] = {}
    for tests in found.binomial.values():
        for way, test in tests.items():
            counts.setdefault(way, set()).update(test.fewest_and_most or (test.trials // found.n,))
    if counts and all(len(some) == 1 for some in counts.values()):
        shots = " and ".join(f"{min(some):,} {way}" for way, some in counts.items())
        return f"Within participants, the direction of {shots} shots with each of {methods} was judged"
    told = f"Within participants, the direction of shots with each of {methods} was judged"
    spans = " and ".join(f"{_span(min(some), max(some))} {way}" for way, some in counts.items())
    return f"{told}; {spans} trials of a participant with a method were analysed" if counts else told


def _span(low: int, high: int) -> str:
    """A number, or two.

    >>> _span(10, 10), _span(9, 20)
    ('10', '9 to 20')
    """
    return f"{low:,}" if low == high else f"{low:,} to {high:,}"


def _analysis(found: WithinStatistics) -> str:
    told = (
        "Scores were compared by a one-way repeated-measures ANOVA and by Tukey's HSD tests of all pairs with the "
        "pooled error term of the ANOVA (α = .05). Effect sizes are partial and generalised η², and of pairs d_z, the "
        "mean difference over the SD of the differences."
    )
    if isinstance(found, DirectionStatistics) and found.binomial:
        told += (
            " Correct rates were tested against 50 % by two-sided exact binomial tests over the trials of all "
            "participants."
        )
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


def _of_design(report: ReportData, name: str, found: DesignSummary) -> Iterator[str]:
    from analysis.summary.sections.designs import result_sentences  # noqa: PLC0415 - slow, and of no use without a design

    synthetic = "synthetic " if found.origin.synthetic else ""
    analysed = report.analysed.get(name, ())
    people = _people(report, name, how_many(found.n, f"{synthetic}participant"), analysed)
    protocol = " ".join([*found.protocol, *pooled_setups(report.remarks, name)])
    yield f"{found.title}, participants and design. {people} {protocol}"
    lacking = (
        f"{how_many(len(question.left_out), 'participant')} gave no {question.lacked} to {asked} in some condition, "
        "and stood in no test of it."
        for asked, question in found.questions.items()
        if question.left_out
    )
    title = f"{found.title.rstrip('.?!')}, "  # which the paragraph begins with
    told = (one.removeprefix(title) for one in result_sentences(name, found, exact=True))
    yield f"{found.title}, results. {' '.join([*(one[0].upper() + one[1:] for one in told), *lacking])}"


def _software(statistics: StudyStatistics) -> str:
    """What computed the numbers."""
    versions = dict(statistics.versions or {})
    product = f"Recoil {versions.pop('recoil', '')}".strip()
    python = f"Python {versions.pop('python', '')}".strip()
    others = ", ".join(f"{name} {version}" for name, version in versions.items() if version != "not installed")
    return f"Software. The data were analysed with {product} ({', '.join(filter(None, [python, others]))})."
