"""The trials table of experiment 1, from what the journal holds."""

from __future__ import annotations

from collections.abc import Iterable

from experiments.plan import Plan, Trial
from experiments.steps import Answered, Fired, History, Outcome
from experiments.tables import Row, presentation, where


def rows(plan: Plan, history: History) -> list[Row]:
    """One row a planned trial, in order; what was not reached is empty."""
    return [
        {
            "participant_id": plan.participant_id,
            "experiment": plan.experiment,
            "session": trial.session,
            "method": trial.method,
            "set": trial.set,
            "trial": trial.trial,
            "direction": trial.direction,
            **_answer(trial, (outcome for _, outcome in where(history, trial))),
            **presentation(where(history, trial), Fired),
        }
        for trial in plan.trials
    ]


def _answer(trial: Trial, outcomes: Iterable[Outcome]) -> Row:
    answers = [outcome for outcome in outcomes if isinstance(outcome, Answered)]
    if not answers:
        return {}
    last = answers[-1]
    return {
        "response": last.response,
        "correct": int(last.response == trial.direction),
        "response_time_s": last.response_time_s,
        "response_source": last.response_source,
        "response_time_valid": int(last.response_time_valid),
    }
