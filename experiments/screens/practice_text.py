"""How a practice in rounds went, in words. Of a run nothing of the kind is told: who sees it may hint at it."""

from __future__ import annotations

from experiments.design.config import DesignConfig
from experiments.design.plan import Plan, Trial
from experiments.screens.phrases import phrase
from experiments.session.history import History
from experiments.session.practice_rounds import is_to_be_repeated, scores


def practice_text(design: DesignConfig, plan: Plan, told: History, *, over: bool) -> str:
    """The score of the last round, and what was wanted; empty of a run, or of a practice without a criterion.

    `over`: no round follows, whether it was reached or not.
    """
    wanted, rounds = design.practice.until_right, scores(design, plan, told)
    if wanted is None or not rounds:
        return ""
    last = rounds[-1]
    said = phrase(
        "Round {number}: {right} of {trials} right; wanted: {share} %.",
        number=len(rounds),
        right=last.right,
        trials=last.trials,
        share=f"{100.0 * wanted:g}",
    )
    if not (over and is_to_be_repeated(design, plan, told)):
        return said
    return phrase("{said} That was not reached: explain the task again, then practise anew.", said=said)


def round_before_text(design: DesignConfig, plan: Plan, told: History, trial: Trial) -> str:
    """The score of the round before, where another one opens and no break came between; else empty."""
    if design.breaks.between_sets_s or not plan.opens_set(trial) or len(scores(design, plan, told)) >= trial.set:
        return ""
    return practice_text(design, plan, told, over=False)
