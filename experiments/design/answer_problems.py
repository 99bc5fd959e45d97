"""What the answers of a question must agree on with trials and factors: each disagreement in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from device.messages import first_few
from experiments.design.language import INTERVAL_NAMES, FactorConfig, QuestionConfig, TrialConfig, shown_level

Factors = Mapping[str, FactorConfig]


def answer_problems(question: QuestionConfig, trial: TrialConfig, factors: Factors) -> Iterator[str]:
    """Why a question cannot be scored, or its answers not be counted, as it says."""
    yield from _right_answer_problems(question, trial, factors)
    yield from _pair_answer_problems(question, trial)


def _right_answer_problems(question: QuestionConfig, trial: TrialConfig, factors: Factors) -> Iterator[str]:
    if question.correct is None:
        return
    if question.correct in {"interval", "larger"}:
        yield from _interval_problems(question, trial, factors)
        yield from _constant_problems(question, trial, factors)
    elif question.correct == "stimulus":
        if question.kind != "yes-no" or not trial.catch:
            yield "correct = 'stimulus' is for yes-no with catch trials; set trial.catch, or remove the key"
    elif question.correct not in factors:
        yield f"correct = {question.correct!r} is no factor; name a factor, or interval, larger or stimulus"
    else:
        answers = question.named_answers
        levels = sorted(map(shown_level, factors[question.correct].all_levels))
        if not set(levels) <= set(answers):
            shown = f"its levels {first_few(levels, 9)} are not all among the answers {', '.join(answers)}"
            yield f"correct = {question.correct!r}: {shown}"
    if question.when == "block":
        yield "when = 'block': a question about remembered trials is not scored; remove `correct`"


def _pair_answer_problems(question: QuestionConfig, trial: TrialConfig) -> Iterator[str]:
    """An answer about a pair is counted by its place: another order would score ties as choices."""
    of_pair, answers = INTERVAL_NAMES[:2], question.answers
    misplaced = [one for at, one in enumerate(of_pair) if one in answers and answers[at] != one]
    if misplaced and trial.kind == "pair":
        rest = [one for one in answers if one not in of_pair]
        yield (
            f"answers: {misplaced[0]} is not in its place; of a pair the first answer chooses the first interval, the "
            f"second the other, and any more is a tie: write {', '.join((*of_pair, *rest))}"
        )


def _interval_problems(question: QuestionConfig, trial: TrialConfig, factors: Factors) -> Iterator[str]:
    correct = question.correct
    if trial.intervals == 1:
        yield f"correct = {correct!r}: a trial of kind {trial.kind!r} has one interval"
        return
    if correct == "larger" and trial.kind not in {"two-interval", "pair"}:
        yield f"correct = 'larger' is of two intervals; of kind {trial.kind!r} say interval"
    elif correct == "larger" and not _numeric(factors.get(trial.compare or "")):
        yield f"correct = 'larger': the levels of {trial.compare} are no numbers, so none is larger"
    elif correct == "larger" and isinstance(trial.standard, str):
        yield f"correct = 'larger': the standard is no number (it is {trial.standard!r}), so none is larger"
    elif correct == "interval" and trial.standard in factors[trial.compare or ""].all_levels:
        yield f"correct = 'interval': the standard {trial.standard} is a level as well, where neither is the comparison"
    elif correct == "interval" and trial.kind == "pair":
        yield "correct = 'interval': of a pair neither is the comparison; say larger, or leave the key out"
    places = ("a", "b") if trial.kind == "abx" else INTERVAL_NAMES[: trial.intervals]
    if set(question.named_answers) != set(places):
        shown = f"the answers must be {', '.join(places)}, not {', '.join(question.named_answers)}"
        yield f"correct = {correct!r}: {shown}"


def _constant_problems(question: QuestionConfig, trial: TrialConfig, factors: Factors) -> Iterator[str]:
    """Where the standard has an interval of its own, the right answer may have one as well."""
    if trial.standard_interval == "random":
        return
    standard, levels = trial.standard, factors[trial.compare or ""].all_levels
    numbers = [level for level in levels if not isinstance(level, str)]
    both_sides = numbers and isinstance(standard, float) and min(numbers) < standard < max(numbers)
    if question.correct == "interval" or not both_sides:
        yield (
            f"correct = {question.correct!r}: with trial.standard_interval = {trial.standard_interval!r} the same "
            "answer is right in every trial; leave `correct` out, or have levels on both sides of the standard and "
            "say larger"
        )


def _numeric(factor: FactorConfig | None) -> bool:
    return factor is not None and not isinstance(factor.all_levels[0], str)
