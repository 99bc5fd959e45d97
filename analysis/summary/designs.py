"""The statistics of any design, from its factors and questions: what each condition gave, and what differs.

A question's answers become scores first: 1 and 0 where an answer can be right, ratings as they are, the logarithm of
numbers. A person's score in a condition is the mean of theirs; whoever lacks a condition is left out of the tests and
named. Which test there is follows from how many factors vary within and between people.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
import pandas as pd

from analysis.logs.design_logs import DesignLogs
from analysis.stats.binomial import binomial_test
from analysis.summary.conditions import answer_scores, varied
from analysis.summary.design_comparisons import condition_tests, nested_between
from analysis.summary.origins import origin_of_design
from analysis.summary.pairs import paired_comparison
from analysis.summary.question_results import ConditionSummary, QuestionSummary
from analysis.summary.results import DesignSummary
from analysis.summary.sensitivity import sensitivity
from analysis.summary.thresholds import thresholds
from experiments.design.config import DesignConfig
from experiments.design.language import METHOD_FACTOR, Level, QuestionConfig, shown_level
from experiments.design.methods_section import methods_section
from experiments.design.planned import runs_of_groups
from experiments.design.procedure_problems import chooses_of_pair, has_success
from experiments.tasks.questions import chance, correct_columns


def summarise_each(logs: Iterable[DesignLogs], *, fits: bool) -> dict[str, DesignSummary]:
    """What the logs of each design come to, by its name."""
    return _told_apart({one.design.design: summarise(one.design, one.table, one.gun_labels, fits=fits) for one in logs})


def _told_apart(designs: Mapping[str, DesignSummary]) -> dict[str, DesignSummary]:
    """The designs, those of one title with their names behind it: a retest is a copy under another name."""
    alike = Counter(one.title.casefold() for one in designs.values())
    return {
        name: replace(one, title=f"{one.title} ({name})") if alike[one.title.casefold()] > 1 else one
        for name, one in designs.items()
    }


def summarise(
    design: DesignConfig,
    table: pd.DataFrame,
    gun_labels: Mapping[str, str] = MappingProxyType({}),
    *,
    fits: bool = False,
) -> DesignSummary:
    """The statistics of a design from its table: one row a trial, the columns of `design_columns.columns`.

    Pairs are described, not tested. `gun_labels`: what the gun calls its methods; `fits`: psychometric functions are
    fitted to everybody, however many there are.
    """
    asked = {name: question for name, question in design.questions.items() if question.kind != "text"}
    return DesignSummary(
        title=design.title,
        n=int(table["participant_id"].nunique()),
        factors={name: factor.all_levels for name, factor in design.factors.items()},
        questions={
            name: replace(
                _question(design, name, question, table),
                thresholds=thresholds(design, name, table, everybody=fits),
                pairs=paired_comparison(design, name, table),
            )
            for name, question in asked.items()
        },
        origin=origin_of_design(design, table),
        words={name: int(table[name].notna().sum()) for name in design.questions if name not in asked},
        assumed=design.assumed,
        protocol=methods_section(design, runs_of_groups(design), gun_labels),
        labels=_labels(design, gun_labels),
    )


def _labels(design: DesignConfig, gun_labels: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """What the levels in each column are called: as the design says, else as the gun does of its methods."""
    found: dict[str, dict[str, str]] = {}
    for name, factor in design.factors.items():
        labels = {**(gun_labels if name == METHOD_FACTOR else {}), **factor.labels}
        own = {level: labels[level] for level in map(shown_level, factor.all_levels) if level in labels}
        columns = [name, *([f"{name}_1", f"{name}_2"] if name == design.trial.compare else [])]
        found |= dict.fromkeys(columns, own) if own else {}
    return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class QuestionScores:
    """Answered trials with their `score`, those with a stimulus (`real`), and each person's mean in every condition.

    `people`: a row for each person who has all conditions; `left_out`: who has not.
    """

    scored: pd.DataFrame
    real: pd.DataFrame
    people: pd.DataFrame
    left_out: tuple[str, ...]


def question_scores(design: DesignConfig, name: str, table: pd.DataFrame) -> QuestionScores:
    """The scores of a question, trial by trial and person by person."""
    column = correct_columns(design.questions).get(name, name)
    scores = answer_scores(design.questions[name], table[column], of_pair=_of_pair(design, name))
    scored = table.assign(score=scores).dropna(subset=["score"])
    real = scored if "stimulus" not in scored else scored[scored["stimulus"].astype(int) == 1]
    people = _complete(design, real)
    untested = design.trial.kind == "pair" or nested_between(design)  # nobody lacks a condition of a test
    there = real["participant_id"] if untested else people.index
    left_out = sorted({*table["participant_id"].astype(str)} - {*there.astype(str)})
    return QuestionScores(scored=scored, real=real, people=people, left_out=tuple(left_out))


def _of_pair(design: DesignConfig, name: str) -> bool:
    """Whether an answer chooses between the two of a pair; what is asked after a block is of no trial."""
    return design.trial.kind == "pair" and design.questions[name].when != "block"


def _question(design: DesignConfig, name: str, question: QuestionConfig, table: pd.DataFrame) -> QuestionSummary:
    found, factors = question_scores(design, name, table), varied(design)
    scored, people = found.scored, found.people
    apart = [*factors, *(["stimulus"] if "stimulus" in scored else [])]
    cells = _ordered(design, (_cell(design, name, question, some) for some in _conditions(scored, apart)))
    caught = scored[scored["stimulus"].astype(int) == 0] if question.correct == "stimulus" else scored.iloc[:0]
    apart_in = [factor for factor in factors if caught[factor].notna().any()]
    conditions = {**_named(design, found.real, apart_in), **_named(design, found.real, factors)}
    tests = (
        *condition_tests(design, question, people, _groups(design, found.real)),
        *(() if design.adapted else sensitivity(design.trial, question, scored, conditions, factors)),
    )
    return QuestionSummary(
        kind=question.kind,
        cells=cells,
        tests=tests,
        left_out=found.left_out,
        chance=_chance(design, question),
        preferred=_preferred(design, question, scored) if _of_pair(design, name) else None,
        scale=_scale(question),
        held=_is_held(design, question),
        not_above_0=_not_above_0(question, table[name]),
        called=question.labels,
    )


def _not_above_0(question: QuestionConfig, column: pd.Series) -> int | None:
    """How many numbers have no logarithm, and so no score; `None` without any."""
    return int((pd.to_numeric(column) <= 0).sum()) or None if question.kind == "number" else None


def _chance(design: DesignConfig, question: QuestionConfig) -> float | None:
    """How often who does not know is right; unknown where the standard has an interval of its own: a lean decides."""
    return chance(question) if design.trial.standard_interval == "random" else None


def _is_held(design: DesignConfig, question: QuestionConfig) -> bool:
    """Whether what was answered is where a procedure held it: near its target, or near a half of a pair's items."""
    of_pairs = design.trial.kind == "pair" and chooses_of_pair(question)
    return bool(design.adapted) and (of_pairs or has_success(question))


def _scale(question: QuestionConfig) -> str | None:
    """What the numbers of a rating or ranking mean: its ends, with their words if they have any."""
    if question.kind == "ranking":
        return f"1 = {question.minimum_text}"
    if question.kind != "rating":
        return None
    if not (question.minimum_text or question.maximum_text):
        return f"{question.minimum:g} to {question.maximum:g}"
    ends = ((question.minimum, question.minimum_text), (question.maximum, question.maximum_text))
    return ", ".join(f"{end:g} = {text}" if text else f"{end:g}" for end, text in ends)


def _ordered(design: DesignConfig, cells: Iterable[ConditionSummary]) -> tuple[ConditionSummary, ...]:
    """The conditions in the order in which the design names its levels; catch trials last."""
    return tuple(sorted(cells, key=lambda cell: (bool(cell.catch), _place(design, cell.levels))))


def _place(design: DesignConfig, levels: Mapping[str, Level]) -> list[int]:
    """Where a condition stands: the place of each of its levels in the design."""
    known = _known_levels(design)
    return [some.index(levels[name]) if name in levels else len(some) for name, some in known.items()]


def _known_levels(design: DesignConfig) -> dict[str, tuple[Level, ...]]:
    """The levels in each column by which conditions differ."""
    compared = design.trial.compare or ""
    named = {f"{compared}_1": compared, f"{compared}_2": compared}
    return {name: design.factors[named.get(name, name)].all_levels for name in varied(design)}


def _levels(design: DesignConfig, rows: pd.DataFrame) -> dict[str, Level]:
    """The levels of a condition, as its rows have them; catch trials lack some."""
    first = rows.iloc[0]
    return {factor: first[factor] for factor in varied(design) if not pd.isna(first[factor])}


def _preferred(
    design: DesignConfig, question: QuestionConfig, scored: pd.DataFrame
) -> tuple[ConditionSummary, ...] | None:
    """How often each level of a pair was chosen: in the mean over people, of all their trials that had it.

    `None`, too, where a procedure chose the pairs: a level that met its equals alone is chosen half the time.
    """
    compared = design.trial.compare
    if design.adapted or compared is None or question.kind != "choice" or question.correct is not None:
        return None
    first = scored["score"]
    halves = [
        scored.assign(level=scored[f"{compared}_{place}"], score=first if place == 1 else 1 - first) for place in (1, 2)
    ]
    both = pd.concat(halves)
    return _ordered_levels(design.factors[compared].all_levels, compared, both)


def _ordered_levels(levels: Sequence[Level], name: str, rows: pd.DataFrame) -> tuple[ConditionSummary, ...]:
    found = []
    for level in levels:
        some = rows[rows["level"] == level]
        means = some.groupby("participant_id")["score"].mean().to_numpy(dtype=np.float64)
        if means.size:
            sd = float(means.std(ddof=1)) if means.size > 1 else None
            found.append(
                ConditionSummary(
                    levels={name: level}, people=int(means.size), trials=len(some), mean=float(means.mean()), sd=sd
                )
            )
    return tuple(found)


def _conditions(scored: pd.DataFrame, factors: Sequence[str]) -> Iterator[pd.DataFrame]:
    """The rows of each condition, in the order of their levels."""
    if not factors:
        yield from [scored] if len(scored) else []
        return
    for _, some in scored.groupby(list(factors), sort=True, dropna=False, observed=True):
        yield some


def _cell(design: DesignConfig, name: str, question: QuestionConfig, rows: pd.DataFrame) -> ConditionSummary:
    means = rows.groupby("participant_id")["score"].mean().to_numpy(dtype=np.float64)
    first = rows.iloc[0]
    mean = float(means.mean()) if means.size else None
    described = ConditionSummary(
        levels=_levels(design, rows),
        people=int(means.size),
        trials=len(rows),
        mean=math.exp(mean) if question.kind == "number" and mean is not None else mean,
        sd=float(means.std(ddof=1)) if means.size > 1 else None,
        answers={one: int((rows[name] == one).sum()) for one in question.named_answers} or None,
        catch=int(first["stimulus"]) == 0 if "stimulus" in rows else None,
    )
    if not question.correct:
        return described
    by_chance = None if _is_held(design, question) else _chance(design, question)  # what is held says nothing of it
    return _with_right(described, int(rows["score"].sum()), by_chance)


def _with_right(cell: ConditionSummary, right: int, by_chance: float | None) -> ConditionSummary:
    """With so many right answers, their exact interval, and the exact test against chance, if there is one."""
    test = binomial_test(right, cell.trials, 0.5 if by_chance is None else by_chance)  # the interval is the same
    p = None if by_chance is None else float(test.p)
    return replace(cell, right=right, p=p, ci_low=float(test.ci_low), ci_high=float(test.ci_high))


def _complete(design: DesignConfig, rows: pd.DataFrame) -> pd.DataFrame:
    """The mean score by condition, in the design's order; one row for each person who has all of them."""
    within = [name for name in varied(design) if rows.groupby("participant_id")[name].nunique().max() > 1]
    if not within:
        return rows.groupby("participant_id")[["score"]].mean()
    wide = rows.pivot_table(index="participant_id", columns=within, values="score").dropna()
    known = _known_levels(design)
    return wide.sort_index(axis="columns", key=lambda levels: levels.map(known[str(levels.name)].index))


def _groups(design: DesignConfig, rows: pd.DataFrame) -> pd.Series | None:
    """Each person's level of the one factor that varies between people; `None` without one, or with more."""
    if len(design.between) != 1:
        return None
    return rows.groupby("participant_id")[design.between[0]].first()


def _named(design: DesignConfig, rows: pd.DataFrame, factors: Sequence[str]) -> dict[str, pd.DataFrame]:
    """The rows of each condition of these factors by its name, in the design's order; none without a factor."""

    def place(some: pd.DataFrame) -> list[int]:
        return _place(design, {name: level for name, level in _levels(design, some).items() if name in factors})

    return {_named_condition(some, factors): some for some in sorted(_conditions(rows, factors), key=place) if factors}


def _named_condition(rows: pd.DataFrame, factors: Sequence[str]) -> str:
    """The levels of a condition, with their factors."""
    return ", ".join(f"{name} {shown_level(rows.iloc[0][name])}" for name in factors)
