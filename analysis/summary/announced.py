"""Which tests the report makes of a design, said before there are any data.

It follows from the design alone, as in `design_comparisons` and `sensitivity` and, for the two experiments of the
paper, in `summary`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from analysis.summary.conditions import varied
from analysis.summary.design_comparisons import MOST_FACTORS, has_exponent, with_levels_of_their_own
from analysis.summary.thresholds import MOST_COMPARED
from experiments.design.config import DesignConfig
from experiments.design.language import QuestionConfig
from experiments.design.methods_section import joined_by_and
from experiments.design.procedure_problems import has_success
from experiments.tasks.questions import chance

TestName = Literal["anova", "friedman", "tukey", "exponent", "d_prime", "criterion", "d_prime_mean"]


def names_of_tests(design: DesignConfig, question: QuestionConfig) -> tuple[TestName, ...]:
    """The tests of a question by their names in the statistics; none where its answers are only described."""
    if question.kind == "text":
        return ()
    return (*_comparisons(design, question), *(() if design.adapted else _sensitivity(design, question)))


def _comparisons(design: DesignConfig, question: QuestionConfig) -> Iterator[TestName]:
    within = _within(design)
    if question.kind == "number" and _powers(design) and not _of_other_conditions(design, within):
        yield "exponent"
    if _is_described(design, question, within):
        return
    if len(within) != 1 or (design.between and question.kind != "ranking"):
        yield "anova"
        return
    levels = design.factors[within[0]].all_levels
    if question.kind != "ranking":
        yield "anova"
    if question.kind in {"rating", "ranking"}:
        yield "friedman"
    if question.kind != "ranking" and 2 < len(levels) <= MOST_COMPARED:
        yield "tukey"


def _powers(design: DesignConfig) -> list[str]:
    """The factors over which numbers have an exponent."""
    return [name for name in _within(design) if has_exponent(design.factors[name].all_levels)]


def _within(design: DesignConfig) -> list[str]:
    return [name for name in varied(design) if name not in design.between]


def _is_described(design: DesignConfig, question: QuestionConfig, within: list[str]) -> bool:
    """Whether the conditions of a question are described, not tested."""
    return (
        _of_other_conditions(design, within)
        or not (within or design.between)
        or (question.kind == "ranking" and len(within) > 1)
        or (question.correct is None and len(question.named_answers) > 2)
        or len(design.between) > 1
        or len(within) > MOST_FACTORS
    )


def _of_other_conditions(design: DesignConfig, within: list[str]) -> bool:
    """Whether conditions differ in more than their own levels: pairs, nested factors, levels that answers chose."""
    return (
        design.trial.kind == "pair"
        or any(factor.within is not None for factor in design.factors.values())
        or bool(with_levels_of_their_own(design, (*design.between, *within)))
    )


def _sensitivity(design: DesignConfig, question: QuestionConfig) -> Iterator[TestName]:
    balanced = question.correct in {"interval", "larger"} and design.trial.standard_interval == "random"
    if question.correct == "stimulus" or balanced:
        yield "d_prime"
    if question.correct == "stimulus":
        yield "criterion"
        yield "d_prime_mean"


def sentences_of_tests(design: DesignConfig) -> Iterator[str]:
    """The tests of a design in sentences, question by question."""
    if design.design == "direction":
        yield (
            "direction: the share of right answers on forward shots is compared between methods by a one-way "
            "repeated-measures ANOVA, then all pairs by Tukey's HSD with its pooled error term."
        )
        yield (
            "direction: the answers to each method and direction, of all participants together, are tested against "
            "50 % by exact binomial tests."
        )
    elif design.design == "preference":
        yield (
            "preference: the ratings are compared between methods by a one-way repeated-measures ANOVA, then all pairs "
            "by Tukey's HSD with its pooled error term."
        )
    else:
        for name, question in design.questions.items():
            yield f"{design.design}, {name}: {'; '.join(_sentences(design, question))}."


def _sentences(design: DesignConfig, question: QuestionConfig) -> Iterator[str]:
    factors = " × ".join((*design.between, *_within(design)))
    several = len(_within(design)) != 1 or bool(design.between)
    powers = " and over ".join(_powers(design))
    told: dict[TestName, str] = {
        "anova": f"{'an ANOVA with all interactions' if several else 'a one-way repeated-measures ANOVA'} of {factors}",
        "friedman": f"Friedman's test of {factors}",
        "tukey": "Tukey's HSD of all pairs with its pooled error term",
        "exponent": f"the exponent of the power law over {powers}, tested against 0",
        "d_prime": f"d′ of all answers together and of each condition{_false_alarms(design, question)}",
        "criterion": "and the criterion",
        "d_prime_mean": "the means of the participants' own d′ with their 95 % intervals",
    }
    names = names_of_tests(design, question)
    held = bool(design.adapted) and has_success(question)
    by_chance = None if held or design.trial.standard_interval != "random" else chance(question)
    if held and len(design.adapted) == 1:
        yield (
            f"a cumulative normal over {design.adapted[0]}, whose levels a procedure chose by the answers, is fitted "
            "person by person; thresholds, their mean over people and their differences between conditions have 95 % "
            "credible intervals"
        )
    if names or not held:
        yield f"the score is {_score(question)}"
    yield from (told[name] for name in names)
    if by_chance is not None:
        yield f"each condition against chance ({by_chance:g}) by an exact binomial test over all answers"
    elif question.correct == "stimulus" and not held:
        yield "hits of each condition, and correct rejections, with their exact 95 % intervals over all answers"
    if not (names or held) and by_chance is None:
        yield "it is described, not tested"


def _false_alarms(design: DesignConfig, question: QuestionConfig) -> str:
    """Which catch trials a condition of a detection is held against."""
    if question.correct != "stimulus":
        return ""
    same = [name for name in varied(design) if name in design.factors and name not in design.varying]
    return f", with the false alarms of {f'the same {joined_by_and(same)}' if same else 'all catch trials'}"


def _score(question: QuestionConfig) -> str:
    if question.correct is not None:
        return "the share of hits" if question.correct == "stimulus" else "the share of right answers"
    if question.named_answers:
        return f"the share of “{question.named_answers[0]}”"
    return {"number": "the natural logarithm", "rating": "the rating", "ranking": "the rank"}.get(
        question.kind, "the participants' own words"
    )
