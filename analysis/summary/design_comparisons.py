"""What differs between the conditions of a design, by as many factors as vary within and between people."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
import scipy

from analysis.stats.anova import rm_anova, rm_tukey_hsd
from analysis.stats.arrays import FloatArray
from analysis.stats.diagnostics import effect_size, unit_scaled
from analysis.stats.factorial import FactorialEffect, factorial_anova
from analysis.stats.paired import friedman
from analysis.summary.question_results import DesignTest
from analysis.summary.thresholds import MOST_COMPARED
from experiments.design.config import DesignConfig
from experiments.design.language import Level, QuestionConfig, shown_level


def condition_tests(
    design: DesignConfig, question: QuestionConfig, people: pd.DataFrame, group: pd.Series | None
) -> Iterator[DesignTest]:
    """What differs between conditions, by as many factors as there are."""
    if design.trial.kind == "pair" or (people.empty and not nested_between(design)):
        return
    names = [str(name) for name in people.columns.names if name is not None]
    if not (names or design.between):
        return
    if question.kind == "number" and not with_levels_of_their_own(design, (*design.between, *names)):
        nested = _OTHERS_DIFFER if len(names) > 1 else _GROUPS_DIFFER
        why = nested if _is_nested(design, people) else _TOO_FEW if len(people) < 2 else ""
        yield from (_exponent(name, people, why) for name in _powers(people))
    if why := _untested(design, question, people):
        yield DesignTest(name="anova", effect=" × ".join((*design.between, *names)), reason=why)
    elif len(names) == 1 and (group is None or question.kind == "ranking"):
        scores = people.to_numpy(dtype=np.float64)
        yield from _one_factor(names[0], scores, question)
        yield from _pairs(scores, [shown_level(level) for level in people.columns], question)
    else:
        yield from _factorial(names, people, group)


MOST_FACTORS = 4
"""Of more factors within people there are more interactions than anybody reads."""


def _untested(design: DesignConfig, question: QuestionConfig, people: pd.DataFrame) -> str:
    """Why there is no test of a question's conditions; empty if there is one."""
    instead = f"not tested here; {design.design}_long.csv has everyone's scores for other programs, such as R's afex"
    named = (*design.between, *(str(name) for name in people.columns.names if name is not None))
    if apart := with_levels_of_their_own(design, named):
        return f"a procedure chose the levels of each {' and '.join(apart)} by the answers: compare thresholds"
    if question.kind == "ranking" and people.columns.nlevels > 1:
        return "ranks of several factors are described, not tested"
    if question.correct is None and len(question.named_answers) > 2:
        return "more than two answers and none is right: they are counted"
    if len(design.between) > 1:
        return f"several factors between people are {instead}"
    if len(_sizes(people)) > MOST_FACTORS:
        return f"more than {MOST_FACTORS} factors within people are {instead}"
    if _is_nested(design, people):
        return f"factors that are nested, not crossed, are {instead}"
    return _TOO_FEW if len(people) < 2 else ""


_TOO_FEW = "fewer than two people have all conditions"


def nested_between(design: DesignConfig) -> list[str]:
    """The factors that are nested in one between people, so that nobody meets the conditions of another group."""
    return [name for name, one in design.factors.items() if one.within in design.between and name not in design.adapted]


def _is_nested(design: DesignConfig, people: pd.DataFrame) -> bool:
    return bool(nested_between(design)) or math.prod(_sizes(people)) != people.shape[1]


def with_levels_of_their_own(design: DesignConfig, names: Iterable[str]) -> list[str]:
    """The factors whose conditions have tracks of their own: these differ in levels, and hardly in right answers."""
    return [] if design.adaptive is None else [name for name in names if name not in design.adaptive.mixed]


def _sizes(people: pd.DataFrame) -> tuple[int, ...]:
    """How many levels each factor within people has."""
    named = [str(name) for name in people.columns.names if name is not None]
    return tuple(people.columns.get_level_values(name).nunique() for name in named)


def _factorial(names: Sequence[str], people: pd.DataFrame, group: pd.Series | None) -> Iterator[DesignTest]:
    """Every effect of the factors within people, of the one between them, and their interactions."""
    named = [*([] if group is None else [str(group.name)]), *names]
    groups = None if group is None else [str(group[code]) for code in people.index]
    if groups is not None and (len(set(groups)) < 2 or min(map(groups.count, groups)) < 2):
        yield DesignTest(name="anova", effect=" × ".join(named), reason="a group has fewer than two people")
        return
    scores = people.to_numpy(dtype=np.float64).reshape(len(people), *_sizes(people))
    free = len(people) - len(set(groups or [""]))
    for one in factorial_anova(scores, named, groups):
        test = DesignTest(
            name="anova",
            effect=" × ".join(one.source),
            statistic=one.F,
            df=one.df,
            p=one.p,
            size=one.size,
            reason=one.reason or None,
        )
        yield test if one.reason else _corrected(test, one, free)


def _corrected(test: DesignTest, effect: FactorialEffect, free: int) -> DesignTest:
    """With the p that does not take sphericity, which two levels give for nothing, of however many groups.

    `free`: people less groups, the degrees of freedom that one contrast within people leaves for its error.
    """
    return replace(test, epsilon=effect.epsilon, p_gg=effect.p_gg) if effect.df[1] > free else test


def _one_factor(name: str, scores: FloatArray, question: QuestionConfig) -> Iterator[DesignTest]:
    if question.kind != "ranking":
        anova = rm_anova(scores)
        test = DesignTest(
            name="anova",
            effect=name,
            statistic=float(anova.F),
            df=(int(anova.df_effect), int(anova.df_error)),
            p=float(anova.p),
            size=effect_size(rm_anova(unit_scaled(scores))).generalized_eta_squared,
            reason=str(anova.reason) or None,
        )
        (effect,) = factorial_anova(scores, [name])
        yield test if anova.reason else _corrected(test, effect, len(scores) - 1)
    if question.kind in {"rating", "ranking"}:
        yield _ranks_test(name, scores)


def _ranks_test(name: str, scores: FloatArray) -> DesignTest:
    ranks = friedman(scores)
    return DesignTest(
        name="friedman",
        effect=name,
        statistic=ranks.chi2,
        df=None if ranks.df is None else (ranks.df,),
        p=ranks.p,
        n=len(scores),
        kendall_w=ranks.kendall_w,
        reason=ranks.reason,
    )


def _pairs(scores: FloatArray, labels: Sequence[str], question: QuestionConfig) -> Iterator[DesignTest]:
    """Tukey's test of every two conditions, on the error of the ANOVA; of numbers, of their logarithms."""
    if question.kind == "ranking" or not 2 < len(labels) <= MOST_COMPARED or rm_anova(scores).reason:
        return
    for pair in rm_tukey_hsd(scores, labels):
        yield DesignTest(
            name="tukey",
            effect=f"{pair.a} – {pair.b}",
            statistic=float(pair.q),
            df=(len(labels), (len(scores) - 1) * (len(labels) - 1)),
            p=float(pair.p),
            ci_low=float(pair.ci_low),
            ci_high=float(pair.ci_high),
        )


def has_exponent(levels: Collection[Level]) -> bool:
    """Whether there is a power law over a factor's levels: over at least three numbers above 0.

    >>> has_exponent([1.0, 2.0, 4.0]), has_exponent([1.0, 2.0]), has_exponent([0.0, 1.0, 2.0]), has_exponent(["a"])
    (True, False, False, False)
    """
    return len(levels) > 2 and all(isinstance(level, float) and level > 0 for level in levels)


_OTHERS_DIFFER = "factors are nested, so the means over its levels can differ by the levels of the others too"
_GROUPS_DIFFER = "each group of people has levels of its own, so nobody has them all"


def _powers(people: pd.DataFrame) -> list[str]:
    """The numeric factors within people over which there is a power law."""
    names = [str(name) for name in people.columns.names if name is not None]
    return [name for name in names if has_exponent(people.columns.unique(name).to_list())]


def _exponent(name: str, people: pd.DataFrame, why: str) -> DesignTest:
    """The mean exponent of the power law: each person's slope of log number over log level, tested against 0.

    `why` there is none, if so.
    """
    if why:
        return DesignTest(name="exponent", effect=name, reason=why)
    means = people.T.groupby(level=name).mean()
    slopes = np.polyfit(np.log(means.index.to_numpy(dtype=np.float64)), means.to_numpy(dtype=np.float64), 1)[0]
    test = scipy.stats.ttest_1samp(slopes, 0.0)
    low, high = test.confidence_interval()
    return DesignTest(
        name="exponent",
        effect=name,
        statistic=float(slopes.mean()),
        df=(len(slopes) - 1,),
        p=float(test.pvalue),
        ci_low=float(low),
        ci_high=float(high),
    )
