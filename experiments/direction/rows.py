"""The trials table of experiment 1, from what the journal holds."""

from __future__ import annotations

from experiments.design.plan import Plan, Trial
from experiments.record.tables import Row, presentation
from experiments.session.history import Story, Told, stories
from experiments.session.remarks import AnswerCorrected
from experiments.session.steps import Answered, Fired

ANTICIPATION_S = 0.1
"""A key that comes sooner was not pressed for what was felt: simple reactions to touch take longer (assumed)."""


def rows(plan: Plan, told: Told) -> list[Row]:
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
            **_answer(trial, story),
            **_marked(presentation(story, Fired), story),
            "instruction": trial.instruction,
        }
        for trial, story in stories(plan.trials, told).items()
    ]


def _answer(trial: Trial, story: Story) -> Row:
    """The answer that counts: the last one given, or what it was corrected to, whose time is not the participant's."""
    given = story.last(Answered)
    if given is None:
        return {}
    counts = [word for word in story.words if isinstance(word, Answered | AnswerCorrected)][-1]
    as_given = counts is given
    return {
        "response": counts.response,
        "correct": int(counts.response == trial.direction),
        "response_time_s": given.response_time_s,
        "response_source": given.response_source if as_given else "experimenter",
        "response_time_valid": int(given.response_time_valid and as_given),
    }


def _marked(row: Row, story: Story) -> Row:
    """A presentation whose answer came sooner than anybody reacts is marked: it was kept, and it was guessed."""
    given = story.last(Answered)
    if given is None or given.response_source != "participant" or given.response_time_s >= ANTICIPATION_S:
        return row
    return row | {"flags": " ".join(filter(None, (str(row["flags"]), "anticipation")))}
