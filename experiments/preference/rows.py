"""The ratings table of experiment 2, from what the journal holds."""

from __future__ import annotations

from experiments.plan import Plan
from experiments.steps import Described, History, Presented, Rated
from experiments.tables import Row, presentation, where


def rows(plan: Plan, history: History) -> list[Row]:
    """One row a planned trial, in order of presentation; what was not reached is empty."""
    return [
        {
            "participant_id": plan.participant_id,
            "experiment": plan.experiment,
            "trial": trial.trial,
            "method": trial.method,
            **_exposure(own := where(history, trial)),
            **_rating(own),
            **presentation(own, Presented),
        }
        for trial in plan.trials
    ]


def _exposure(history: History) -> Row:
    shown = [outcome for _, outcome in history if isinstance(outcome, Presented)]
    return {"shots": shown[-1].shots, "exposure_s": shown[-1].exposure_s} if shown else {}


def _rating(history: History) -> Row:
    row: Row = {}
    for _, outcome in history:
        if isinstance(outcome, Rated):
            row |= {"rating": outcome.rating, "rating_by": outcome.rating_by}
        elif isinstance(outcome, Described):
            row["comment"] = outcome.comment
    return row
