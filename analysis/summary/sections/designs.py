"""The section of a design: a picture, then for each question what each condition gave, and what differs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from analysis.report import apa
from analysis.report.figures.style import named
from analysis.report.section import Picture, Section, Table
from analysis.summary.results import ConditionSummary, DesignSummary, DesignTest, QuestionSummary
from experiments.design.language import shown_level

_TESTS = {
    "anova": "ANOVA",
    "tukey": "Tukey",
    "friedman": "Friedman",
    "exponent": "exponent",
    "d_prime": "d′",
    "criterion": "criterion",
    "preferred": "preferred",
}


def figure_of(name: str) -> str:
    """The stem of a design's figure."""
    return f"figure-{name}"


def design_section(name: str, found: DesignSummary) -> Section:
    """What a design gave."""
    people = f"{found.n} participant{'' if found.n == 1 else 's'}"
    return Section(
        title=found.title or name.capitalize(),
        paragraphs=(
            f"Design `{name}`: {people}. {_factors(found)}",
            *_assumed(found),
            *_words(found),
            *_left_out(found),
        ),
        pictures=(_picture(name, found),) if any(question.cells for question in found.questions.values()) else (),
        tables=tuple(table for asked, question in found.questions.items() for table in _tables(asked, question)),
    )


def _factors(found: DesignSummary) -> str:
    varied = {name: levels for name, levels in found.factors.items() if len(levels) > 1}
    said = "; ".join(f"{name}: {', '.join(map(shown_level, levels))}" for name, levels in varied.items())
    return f"What varied: {named(said)}." if said else "Nothing varied."


def _assumed(found: DesignSummary) -> tuple[str, ...]:
    return (f"Assumed, as the design says: {', '.join(found.assumed)}.",) if found.assumed else ()


def _words(found: DesignSummary) -> Iterator[str]:
    for name, said in found.words.items():
        yield f"{name}: {said} answer{'' if said == 1 else 's'} in words; they stand in the logs."


def _left_out(found: DesignSummary) -> tuple[str, ...]:
    return tuple(
        f"In no test of {asked}, as a condition is missing: {', '.join(question.left_out)}."
        for asked, question in found.questions.items()
        if question.left_out
    )


def _picture(name: str, found: DesignSummary) -> Picture:
    scored = [question for question in found.questions.values() if question.chance is not None]
    parts = ["the exact 95 % interval of all trials together"] if scored else []
    parts += ["the SD between participants"] if len(scored) < len(found.questions) else []
    spread = f"Whiskers: {' of right answers, else '.join(parts)}."
    means = "; ".join(
        f"{asked}: {', '.join(f'{_condition(cell)} {_mean(question, cell)}' for cell in question.cells)}"
        for asked, question in found.questions.items()
    )
    return Picture(stem=figure_of(name), caption=f"{found.title}. {spread}", alt=f"Means by condition. {means}")


def _condition(cell: ConditionSummary) -> str:
    return named(", ".join(shown_level(level) for level in cell.levels.values())) or "all"


def _mean(question: QuestionSummary, cell: ConditionSummary) -> str:
    if cell.right is not None:
        return apa.percent(cell.right / cell.trials)
    return apa.percent(cell.mean) if question.kind in ("choice", "yes-no") else apa.number(cell.mean)


def _tables(name: str, question: QuestionSummary) -> Iterator[Table]:
    if question.preferred:
        yield _conditions(f"{name}: how often each was chosen,", replace(question, cells=question.preferred))
    if question.cells:
        yield _conditions(f"{name} ({question.scale})" if question.scale else name, question)
    if question.tests:
        header = ("Test", "Of", "Statistic", "df", "p", "Effect or interval")
        yield Table(caption=f"{name}: tests", header=header, rows=tuple(map(_test, question.tests)))


def _conditions(name: str, question: QuestionSummary) -> Table:
    factors = list(dict.fromkeys(factor for cell in question.cells for factor in cell.levels))
    scored = any(cell.right is not None for cell in question.cells)
    last = ("95 % interval", "p against chance") if scored else ("SD",)
    answers = () if question.preferred is not None else tuple(next(iter(question.cells)).answers or ())
    rows = tuple(
        (
            *(_level(cell, factor) for factor in factors),
            str(cell.people),
            str(cell.trials),
            *(str((cell.answers or {})[answer]) for answer in answers),
            _mean(question, cell),
            *_spread(cell, scored=scored),
        )
        for cell in question.cells
    )
    first = f"Share of {answers[0]}" if answers else "Share"
    mean = {"number": "Geometric mean", "choice": first, "yes-no": first}.get(question.kind, "Mean")
    header = (*factors, "People", "Trials", *answers, "Right" if scored else mean, *last)
    return Table(caption=f"{name} by condition", header=header, rows=rows)


def _level(cell: ConditionSummary, factor: str) -> str:
    return named(shown_level(cell.levels[factor])) if factor in cell.levels else apa.NO_NUMBER


def _spread(cell: ConditionSummary, *, scored: bool) -> tuple[str, ...]:
    if not scored:
        return (apa.number(cell.sd),)
    low, high = apa.percent(cell.ci_low), apa.percent(cell.ci_high)
    return f"{low} to {high}", apa.p_cell(cell.p)


def _test(test: DesignTest) -> tuple[str, ...]:
    df = ", ".join(map(str, test.df)) if test.df else apa.NO_NUMBER
    if test.reason:
        more = test.reason
    elif test.ci_low is not None:
        more = apa.interval(test.ci_low, test.ci_high)
    else:
        more = apa.NO_NUMBER if test.size is None else f"η²_G = {apa.below_one(test.size)}"
    p = apa.NO_NUMBER if test.p is None else apa.p_cell(test.p)
    return (_TESTS.get(test.name, test.name), named(test.effect), apa.number(test.statistic), df, p, more)
