"""A design in a report: what was found, in sentences; a picture; what each condition gave, and what differs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from analysis.logs.setups import pooled_setups
from analysis.report import apa
from analysis.report.labels import display_name
from analysis.report.section import Picture, Section, Table
from analysis.stats.corrections import SIGNIFICANT
from analysis.summary.question_results import ConditionSummary, DesignTest, QuestionSummary
from analysis.summary.results import DesignSummary
from analysis.summary.sections.content import NOT_CORRECTED, TWO_PEOPLE, ReportData, condition_words, effect_words
from analysis.summary.sections.pairs import pair_sections, pair_sentences
from analysis.summary.sections.pictures import figure_of
from analysis.summary.sections.shown_trades import instruction_sentences
from analysis.summary.sections.thresholds import threshold_sections, threshold_sentences
from device.messages import first_few, how_many
from experiments.design.language import Level, shown_level
from experiments.design.methods_section import factor_words, joined_by_and

_TESTS = {
    "anova": "ANOVA, F",
    "tukey": "Tukey, q",
    "friedman": "Friedman, χ²",
    "exponent": "exponent",
    "d_prime": "d′, pooled",
    "criterion": "criterion c, pooled",
    "d_prime_mean": "d′, mean of participants",
    "preferred": "preferred",
}
"""What a test is called, with the letter of its statistic."""
_SENSITIVITY = frozenset(["d_prime", "criterion", "d_prime_mean"])
_ESTIMATES = _SENSITIVITY | {"preferred"}
_LESS, _MINUS = " – ", " − "
"""Between the levels of a pair: in the file, and in print."""
_TOLD = 6
"""So many conditions or pairs are told in a sentence; more are in the table."""


def sections_of_designs(report: ReportData) -> Iterator[Section]:
    """Each design's section, and those of its psychometric functions."""
    for name, found in report.statistics.designs.items():
        section = _design_section(name, found)
        yield replace(section, paragraphs=(*section.paragraphs, *pooled_setups(report.remarks, name)))
        yield from threshold_sections(name, found)
        yield from pair_sections(name, found)


def _design_section(name: str, found: DesignSummary) -> Section:
    return Section(
        title=found.title or name.capitalize(),
        paragraphs=(_factors(found), *_held(found), *_assumed(found), *_words(found)),
        pictures=(_picture(name, found),) if any(question.drawn for question in found.questions.values()) else (),
        tables=tuple(table for asked, question in found.questions.items() for table in _tables(found, asked, question)),
    )


_PLANNED = (
    "planned are those that the analysis fixes for a design before it sees any data; whoever registered another test "
    "reports that"
)


_POOLED = "pooled is what is of all participants' answers together"


def _standing(question: QuestionSummary, test: DesignTest) -> str:
    """Whether a test was planned; a dash for an estimate."""
    if test.name in _ESTIMATES:
        return apa.NO_NUMBER
    planned = {"friedman"} if question.kind == "ranking" else {"anova", "tukey"}
    return "planned" if test.name in planned else "further"


def result_sentences(name: str, found: DesignSummary, *, exact: bool = False) -> Iterator[str]:
    """What a design gave, a paragraph a question; `exact`: with p-values in full."""
    everybody = how_many(found.n, "synthetic participant" if found.origin.synthetic else "participant")
    for asked, question in found.questions.items():
        people = everybody + (f", {found.n - len(question.left_out):,} in its tests" if question.left_out else "")
        if question.cells:
            tests = [*_tests_words(found, question, exact=exact)]
            few = [TWO_PEOPLE] if found.n == 2 and tests else []
            fitted = [*threshold_sentences(found, question), *pair_sentences(found, question)]
            cells = [] if question.held and fitted else [_cells_words(found, question)]
            told = " ".join([*cells, *tests, *few, *fitted, *instruction_sentences(found, question)])
            yield f"{(found.title or name.capitalize()).rstrip('.?!')}, {asked} ({people}): {told}"


def _cells_words(found: DesignSummary, question: QuestionSummary) -> str:
    if question.detected and (rejected := [cell for cell in question.cells if cell.catch]):
        hits = replace(question, cells=tuple(cell for cell in question.cells if not cell.catch))
        told = "; ".join(f"{_condition(found, one)}: {_mean_and_spread(question, one)}" for one in rejected)
        return " ".join([*([_spread_words(found, hits)] if hits.cells else []), f"Correct rejections, {told}."])
    return _spread_words(found, question)


def _spread_words(found: DesignSummary, question: QuestionSummary) -> str:
    """Each condition's mean in a sentence, or of many the lowest and the highest."""
    cells = question.preferred or question.cells
    shown = [f"{_condition(found, cell)}: {_mean_and_spread(question, cell)}" for cell in cells]
    if len(shown) > _TOLD:
        known = [cell for cell in cells if _shown(cell) is not None] or cells
        ends = sorted(known, key=lambda cell: _shown(cell) or 0.0)
        low, high = (f"{_mean_and_spread(question, cell)} ({_condition(found, cell)})" for cell in (ends[0], ends[-1]))
        return f"{_mean_word(question)} of {len(cells)} conditions went from {low} to {high}."
    opening = "" if question.kind == "rating" else f"{_mean_word(question)}, "
    return f"{opening}{'; '.join(shown)}."


def _mean_word(question: QuestionSummary) -> str:
    if any(cell.right is not None for cell in question.cells):
        return "hits" if question.detected else "right answers"
    if question.preferred:
        return f"chosen, in the mean over people{_tie(question)}"
    words = {"number": "geometric means", "ranking": "mean ranks"}
    if question.counted:
        return f"share of {question.label(question.counted)}{_tie(question)}"
    return words.get(question.kind, "means")


def _tie(question: QuestionSummary) -> str:
    """How a third answer of a pair, a tie, counts for the two; empty where there is none."""
    return ", a tie as half" if question.pairs is not None and len(question.cells[0].answers or ()) > 2 else ""


def _mean_and_spread(question: QuestionSummary, cell: ConditionSummary) -> str:
    if cell.right is not None:
        return f"{_mean(question, cell)} ({cell.right:,} of {cell.trials:,})"
    if question.kind != "rating":
        return _mean(question, cell)
    count = f", n = {cell.people:,}" if question.left_out else ""
    return f"M = {_mean(question, cell)}{'' if cell.people < 2 else f', SD = {apa.number(cell.sd)}'}{count}"


def _tests_words(found: DesignSummary, question: QuestionSummary, *, exact: bool) -> Iterator[str]:
    planned = [test for test in question.tests if _standing(question, test) == "planned"]
    yield from (f"No test of {effect_words(test.effect)}: {test.reason}." for test in planned if _is_none(test))
    anovas = [_anova_words(test, exact=exact) for test in planned if test.name == "anova" and not _is_none(test)]
    if anovas:
        yield f"ANOVA{' of natural logarithms' if question.kind == 'number' else ''}: {'; '.join(anovas)}."
    yield from (_ranks_words(test, exact=exact) for test in planned if test.name == "friedman" and not test.reason)
    pairs = [test for test in planned if test.name == "tukey"]
    if len(pairs) > _TOLD:
        below = sum(test.p is not None and test.p < 0.05 for test in pairs)
        yield f"Planned comparisons (Tukey's HSD): {below} of {len(pairs)} pairs differed at p < .05."
    elif pairs:
        told = "; ".join(
            f"{_pair(found, test.effect)}, q = {apa.number(test.statistic)}, {apa.p_value(test.p, exact=exact)}"
            for test in pairs
        )
        yield f"Planned comparisons (Tukey's HSD): {told}."
    yield from (_exponent_words(test, exact=exact) for test in question.tests if test.name == "exponent")
    yield from _sensitivity_words(question)


def _is_none(test: DesignTest) -> bool:
    """Whether there is no test: where everybody differs alike F is infinite, and that is one."""
    return bool(test.reason) and (test.p is None or math.isnan(test.p))


def _anova_words(test: DesignTest, *, exact: bool) -> str:
    size = "" if test.size is None else f", generalised η² = {apa.below_one(test.size)}"
    significant = test.p is not None and test.p < SIGNIFICANT
    effect = "significant effect" if significant else "no significant effect"
    lost = f" ({NOT_CORRECTED})" if significant and test.p_gg is not None and test.p_gg >= SIGNIFICANT else ""
    told = apa.f_test(test.statistic, test.df or (), test.p, exact=exact)
    corrected = f", {_sphericity(test, exact=exact)}" if test.p_gg is not None else ""
    return f"{effect} of {effect_words(test.effect)}{lost}, {told}{size}{corrected}"


def _sphericity(test: DesignTest, *, exact: bool = False) -> str:
    return f"Greenhouse–Geisser ε = {apa.below_one(test.epsilon)}, {apa.p_value(test.p_gg, exact=exact)}"


def _ranks_words(test: DesignTest, *, exact: bool) -> str:
    of = f"{', '.join(map(str, test.df or ()))}, N = {test.n}"
    told = f"χ²({of}) = {apa.number(test.statistic)}, {apa.p_value(test.p, exact=exact)}, {_agreement(test)}"
    return f"Friedman's test of {effect_words(test.effect)}: {told}."


def _agreement(test: DesignTest) -> str:
    return f"Kendall's W = {apa.below_one(test.kendall_w)}"


def _sensitivity_words(question: QuestionSummary) -> Iterator[str]:
    """d′ of all answers, and that of people in the mean; conditions follow, and are in the table."""
    of_all = {test.name: test for test in reversed(question.tests) if test.name in _SENSITIVITY}
    if "d_prime" in of_all and of_all["d_prime"].reason:
        yield f"No d′ and no test against chance: {of_all['d_prime'].reason}."
    elif "d_prime" in of_all:
        corrected = " with the log-linear correction" if question.detected else ""
        one = max(cell.people for cell in question.cells) == 1
        whose = "The participant's answers" if one else "All participants' answers together"
        told = f"{whose} gave d′ = {apa.number(of_all['d_prime'].statistic)}{corrected}"
        own = of_all.get("d_prime_mean")
        yield f"{told}; the participants' own: {_mean_and_interval(own)}." if own else f"{told}."


def _exponent_words(test: DesignTest, *, exact: bool) -> str:
    if test.reason:
        return f"No power-law exponent over {effect_words(test.effect)}: {test.reason}."
    told = f"{_mean_and_interval(test)}; against 0 {apa.p_value(test.p, exact=exact)}"
    return f"Power-law exponent over {effect_words(test.effect)}: {told}."


def _mean_and_interval(test: DesignTest) -> str:
    interval = "" if test.ci_low is None else f", 95 % CI {apa.interval(test.ci_low, test.ci_high)}"
    return f"M = {apa.number(test.statistic)}{interval}"


_LISTED = 15
"""More levels than these are counted: of a procedure that chooses among many, each says nothing."""


def _factors(found: DesignSummary) -> str:
    varied = {name: levels for name, levels in found.factors.items() if len(levels) > 1}
    said = "; ".join(f"{factor_words(name)}: {_listed(found, name, levels)}" for name, levels in varied.items())
    return f"What varied: {said}." if said else "Nothing varied."


def _listed(found: DesignSummary, name: str, levels: Sequence[Level]) -> str:
    shown = [display_name(found.label(name, level)) for level in levels]
    return ", ".join(shown) if len(shown) <= _LISTED else f"{len(shown)} levels from {shown[0]} to {shown[-1]}"


def _held(found: DesignSummary) -> Iterator[str]:
    held = [asked for asked, question in found.questions.items() if question.held and question.pairs is None]
    if held:
        yield (
            f"Levels were chosen by the answers, so that the share of successes in {' and '.join(held)} is where the "
            "procedure held it: thresholds tell what differs."
        )
    pairs = [asked for asked, question in found.questions.items() if question.held and question.pairs is not None]
    if pairs:
        yield (
            f"Pairs were chosen by the answers to {' and '.join(pairs)}, so how often an item was chosen is of little "
            "worth: most met their equals. Scores tell what differs."
        )


def _assumed(found: DesignSummary) -> tuple[str, ...]:
    return (f"Assumed, as the design says: {', '.join(found.assumed)}.",) if found.assumed else ()


def _words(found: DesignSummary) -> Iterator[str]:
    for name, said in found.words.items():
        yield f"{name}: {how_many(said, 'answer')} in words; they stand in the logs." if said else f"{name}: no answer."


def lacking_conditions(found: DesignSummary) -> Iterator[str]:
    """Who is in no test of a question, and which answers are in no mean; and why."""
    for asked, question in found.questions.items():
        if question.left_out:
            people = ", ".join(question.left_out)
            yield f"In no test of {asked}, with no {question.lacked} in some condition: {people}."
        if question.not_above_0:
            numbers = how_many(question.not_above_0, "number")
            yield f"In no mean and no test of {asked}: {numbers} of 0 or less, which have no logarithm."


def _picture(name: str, found: DesignSummary) -> Picture:
    shown = {asked: question for asked, question in found.questions.items() if question.drawn}
    shares = [f"{words} ({asked})" for asked, one in shown.items() if (words := _drawn_words(one))]
    drawn = f" Drawn is {joined_by_and(shares)}." if shares else ""
    return Picture(
        stem=figure_of(name),
        caption=f"{found.title.rstrip('.?!')}.{drawn}{_whiskers([*shown.values()], found.n)}",
        alt="Means by condition. " + "; ".join(f"{asked}: {_means(found, one)}" for asked, one in shown.items()),
    )


def _drawn_words(question: QuestionSummary) -> str:
    """What a picture's marks count, where its axis does not say it; else empty."""
    tie = _tie(question)
    if question.false_alarms:
        return "the share of hits and, hollow, of false alarms in catch trials"
    if question.counted:
        return f"the share of {question.label(question.counted)}"
    return f"how often each was chosen{tie}" if tie else ""


def _whiskers(shown: Sequence[QuestionSummary], people: int) -> str:
    """What the whiskers of a picture are, by what was asked."""
    scored = [any(cell.right is not None for cell in question.cells) for question in shown]
    unscored = {question.kind for question, right in zip(shown, scored, strict=True) if not right and people > 1}
    parts = [("right answers", "the exact 95 % interval of all trials together")] if any(scored) else []
    if "number" in unscored:
        parts.append(("numbers", "the SD of ln between participants, up and down from the geometric mean"))
    if unscored - {"number"}:
        ends = ", of shares cut off at 0 and 100 %" if any(question.cut_at_ends for question in shown) else ""
        parts.append(("others", f"the SD between participants{ends}"))
    told = [f"{what} of {of}" for of, what in parts[:-1]]
    told += [f"else {what}" if told else what for _, what in parts[-1:]]
    return f" Whiskers: {', '.join(told)}." if told else ""


_SPELLED_OUT = 12


def _means(found: DesignSummary, question: QuestionSummary) -> str:
    told = [f"{_condition(found, cell)} {_mean(question, cell)}" for cell in question.pictured]
    alarms = [f"false alarms, {_condition(found, cell)} {_mean(question, cell)}" for cell in question.false_alarms]
    return "; ".join([first_few(told, _SPELLED_OUT, "condition"), *alarms])


_WITH_STIMULUS = "trials with a stimulus"


def _condition(found: DesignSummary, cell: ConditionSummary) -> str:
    """The levels of a condition, by what they are called."""
    levels = found.condition(cell.levels, display_name)
    rest = "catch trials" if cell.catch else "" if levels else _WITH_STIMULUS if cell.catch is False else "all trials"
    return ", ".join(filter(None, (levels, rest)))


def _shown(cell: ConditionSummary) -> float | None:
    """What stands for a condition: of scored answers the share of all that are right, else the mean over people."""
    return cell.mean if cell.right is None else cell.right / cell.trials


def _mean(question: QuestionSummary, cell: ConditionSummary) -> str:
    return (apa.percent if question.kind in _SHARES else apa.number)(_shown(cell))


def _tables(found: DesignSummary, name: str, question: QuestionSummary) -> Iterator[Table]:
    if question.preferred:
        often = f"{name}: how often each was chosen{_tie(question)},"
        yield _conditions(found, often, replace(question, cells=question.preferred))
    if question.cells:
        named_scale = f"{name} ({question.scale})" if question.scale else name
        yield _conditions(found, named_scale, replace(question, preferred=None))
    if question.tests:
        header = ("Test", "Of", "Statistic", "df", "p", "Effect or interval", "Standing")
        standings = (apa.NO_NUMBER if _is_none(test) else _standing(question, test) for test in question.tests)
        rows = tuple((*_test(found, question, test), how) for test, how in zip(question.tests, standings, strict=True))
        note = f"; {_PLANNED}" if any(row[-1] == "planned" for row in rows) else ""
        note += f"; {_POOLED}" if any(test.name == "d_prime" for test in question.tests) else ""
        note += _false_alarms_of(found, question) if question.detected and _POOLED in note else ""
        note += _of_pairs(question) if any(test.name == "tukey" for test in question.tests) else ""
        yield Table(caption=f"{name}: tests{note}", header=header, rows=rows)


def _false_alarms_of(found: DesignSummary, question: QuestionSummary) -> str:
    """How d′ of a detection was corrected, and by which catch trials each condition has its false alarms."""
    caught = [cell.levels for cell in question.cells if cell.catch]
    same = list(dict.fromkeys(name for levels in caught for name in levels))
    signals = [cell for cell in question.cells if not cell.catch]
    lacking = [
        _condition(found, cell)
        for cell in signals
        if same and not any(levels.items() <= cell.levels.items() for levels in caught)
    ]
    told = ", with the log-linear correction"
    if same:
        factors = joined_by_and([*map(factor_words, same)])
        told += f"; false alarms of a condition: those of catch trials of the same {factors}"
    elif len(signals) > 1:
        told += "; false alarms of every condition: those of all catch trials"
    return told + (f", but of all catch trials for {joined_by_and(lacking)}, which had none" if lacking else "")


def _of_pairs(question: QuestionSummary) -> str:
    """What the intervals of Tukey's test are of."""
    units = {"number": " of natural logarithms"} | dict.fromkeys(_SHARES, " in percentage points")
    return f"; intervals of pairs: the difference{units.get(question.kind, '')}, 95 %, simultaneous"


_SHARES = ("choice", "yes-no")
_SD_OF_SHARES = "SD [percentage points]"


def _conditions(found: DesignSummary, name: str, question: QuestionSummary) -> Table:
    factors = list(dict.fromkeys(factor for cell in question.cells for factor in cell.levels))
    scored = any(cell.right is not None for cell in question.cells)
    sd = {"number": "SD of ln", "choice": _SD_OF_SHARES, "yes-no": _SD_OF_SHARES}.get(question.kind, "SD")
    last = ("95 % interval", *(["p against chance"] if _against_chance(question) else [])) if scored else (sd,)
    caught = any(cell.catch and set(factors) <= set(cell.levels) for cell in question.cells)
    answers = () if question.preferred is not None else tuple(next(iter(question.cells)).answers or ())
    rows = tuple(
        (
            *(_level(found, cell, factor) for factor in factors),
            *(["catch trials" if cell.catch else _WITH_STIMULUS] if caught else []),
            str(cell.people),
            str(cell.trials),
            *(str((cell.answers or {})[answer]) for answer in answers),
            _mean(question, cell),
            *_spread(question, cell, scored=scored),
        )
        for cell in question.cells
    )
    first = f"Share of {question.label(question.counted)}{_tie(question)}" if question.counted else "Chosen"
    mean = {"number": "Geometric mean", "choice": first, "yes-no": first}.get(question.kind, "Mean")
    right = "Hits (of catch trials: correct rejections)" if question.detected else "Right"
    kind = ["Trials were"] if caught else []
    named = (*map(factor_words, factors), *kind, "People", "Trials", *map(question.label, answers))
    header = (*named, right if scored else mean, *last)
    return Table(caption=f"{name} by condition", header=header, rows=rows)


def _level(found: DesignSummary, cell: ConditionSummary, factor: str) -> str:
    return display_name(found.label(factor, cell.levels[factor])) if factor in cell.levels else "catch trials"


def _spread(question: QuestionSummary, cell: ConditionSummary, *, scored: bool) -> tuple[str, ...]:
    if not scored:
        shares = question.kind in _SHARES and cell.sd is not None
        return (apa.number(100.0 * cell.sd, 1) if shares and cell.sd is not None else apa.number(cell.sd),)
    interval = f"{apa.percent(cell.ci_low)} to {apa.percent(cell.ci_high)}"
    return (interval, apa.p_cell(cell.p)) if _against_chance(question) else (interval,)


def _against_chance(question: QuestionSummary) -> bool:
    """Whether right answers were tested against chance: there is one, and no procedure held them at a share."""
    return question.chance is not None and not question.held


def _test(found: DesignSummary, question: QuestionSummary, test: DesignTest) -> tuple[str, ...]:
    df = ", ".join(map(str, test.df)) if test.df else apa.NO_NUMBER
    if test.reason:
        more = test.reason
    elif test.ci_low is not None and test.ci_high is not None:
        points = test.name == "tukey" and question.kind in _SHARES
        scale, digits = (100.0, 1) if points else (1.0, 2)
        more = apa.interval(scale * test.ci_low, scale * test.ci_high, digits)
    elif test.kendall_w is not None:
        more = f"{_agreement(test)}, N = {test.n}"
    else:
        more = apa.NO_NUMBER if test.size is None else f"η²_G = {apa.below_one(test.size)}"
        more += f"; {_sphericity(test)}" if test.p_gg is not None else ""
    if test.name == "d_prime_mean" and test.n is not None:
        more += f"; of {how_many(test.n, 'participant')} with catch trials there"
    p = apa.NO_NUMBER if test.p is None else apa.p_cell(test.p)
    return (_TESTS.get(test.name, test.name), _effect(found, test), apa.number(test.statistic), df, p, more)


def _effect(found: DesignSummary, test: DesignTest) -> str:
    """What was tested; of a pair both levels by what they are called."""
    if test.name in _SENSITIVITY and " " not in test.effect:
        return "all conditions"
    return _pair(found, test.effect) if test.name == "tukey" else condition_words(found, test.effect)


def _pair(found: DesignSummary, effect: str) -> str:
    """Both levels of a pair, of the one factor that varies within people, by what they are called."""
    for name, levels in found.factors.items():
        shown = {shown_level(level): level for level in levels}
        if len(levels) > 1 and {*effect.split(_LESS)} <= {*shown}:
            return _MINUS.join(display_name(found.label(name, shown[level])) for level in effect.split(_LESS))
    return effect_words(effect)
