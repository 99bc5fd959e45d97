"""How a practice in rounds stands: it is over once so many of a round's answers were right, as they count now. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from experiments.design.config import DesignConfig
from experiments.design.plan import Plan, Trial
from experiments.session.history import History, counting
from experiments.session.remarks import EntryCorrected
from experiments.session.steps import Answered, Ask
from experiments.tasks.questions import AnswerValue, correct_columns, right_answer


@dataclass(frozen=True, slots=True)
class RoundScore:
    """How many answers of a round were right, of how many trials in which one is."""

    right: int
    trials: int

    def reaches(self, share: float) -> bool:
        """Whether that is such a share of the trials.

        >>> RoundScore(7, 10).reaches(0.7), RoundScore(6, 10).reaches(0.7)
        (True, False)
        """
        return self.right >= share * self.trials - 1e-9  # 0.7 of 10 is 7, whatever its last digit


def scores(design: DesignConfig, plan: Plan, told: History) -> list[RoundScore]:
    """The rounds that had begun when this was told, in order, by the design's first scored question.

    Who gave no answer was not right. None of a run, or of a practice without a criterion.
    """
    if not plan.practice or design.practice.until_right is None:
        return []
    name, begun = next(iter(correct_columns(design.questions))), 0
    given: dict[Trial, AnswerValue] = {}
    for step, word in counting(told):
        if isinstance(step, Ask):
            begun = max(begun, step.trial.set)
            if step.question == name and isinstance(word, Answered):
                given[step.trial] = word.value
        elif isinstance(word, EntryCorrected) and word.question == name:
            given[word.trial] = word.value
    found = [RoundScore(0, 0)] * begun
    for trial in plan.trials:
        right = right_answer(design, design.questions[name], trial)
        if right is not None and trial.set <= begun:
            one = found[trial.set - 1]
            found[trial.set - 1] = RoundScore(one.right + (given.get(trial) == right), one.trials + 1)
    return found


def is_needed(design: DesignConfig, plan: Plan, told: History, number: int) -> bool:
    """Whether a round is to be presented, now that all before it is done."""
    wanted = design.practice.until_right
    return wanted is None or not any(one.reaches(wanted) for one in scores(design, plan, told)[: number - 1])


def is_to_be_repeated(design: DesignConfig, plan: Plan, told: History) -> bool:
    """Whether a practice that is over has not reached what was wanted."""
    wanted, rounds = design.practice.until_right, scores(design, plan, told)
    return wanted is not None and bool(rounds) and not rounds[-1].reaches(wanted)
