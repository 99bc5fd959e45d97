"""How a practice in rounds stands: it is over once so many of a round's answers were right, as they count now. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.session.history import History, entered_value
from experiments.session.steps import Answered, Ask
from experiments.tasks.questions import correct_columns, right_answer


@dataclass(frozen=True, slots=True)
class RoundScore:
    """How many answers of a round were right, of how many trials."""

    right: int
    trials: int

    def reaches(self, share: float) -> bool:
        """Whether that is such a share of the trials.

        >>> RoundScore(7, 10).reaches(0.7), RoundScore(6, 10).reaches(0.7)
        (True, False)
        """
        return self.right >= share * self.trials - 1e-9  # 0.7 of 10 is 7, whatever its last digit


def round_score(design: DesignConfig, plan: Plan, told: History, number: int) -> RoundScore:
    """The score of a round, by the design's first scored question; who gave no answer was not right."""
    name = next(iter(correct_columns(design.questions)))
    asked = {
        step.trial: step
        for step, word in told
        if isinstance(word, Answered) and isinstance(step, Ask) and (step.trial.set, step.question) == (number, name)
    }
    question = design.questions[name]
    right = sum(entered_value(told, step) == right_answer(design, question, trial) for trial, step in asked.items())
    return RoundScore(right, sum(trial.set == number for trial in plan.trials))


def scores(design: DesignConfig, plan: Plan, told: History) -> list[RoundScore]:
    """The rounds that had begun when this was told, in order; none of a run, or of a practice without a criterion."""
    if not plan.practice or design.practice.until_right is None:
        return []
    begun = max((step.trial.set for step, _ in told if isinstance(step, Ask)), default=0)
    return [round_score(design, plan, told, number) for number in range(1, begun + 1)]


def is_needed(design: DesignConfig, plan: Plan, told: History, number: int) -> bool:
    """Whether a round is to be presented, now that all before it is done."""
    wanted = design.practice.until_right
    return wanted is None or not any(one.reaches(wanted) for one in scores(design, plan, told)[: number - 1])
