"""The ratings table of experiment 2, from what the journal holds."""

from __future__ import annotations

from experiments.design.plan import Plan
from experiments.record.tables import Row, presentation
from experiments.session.history import Story, Told, stories
from experiments.session.remarks import DescriptionCorrected, RatingCorrected
from experiments.session.steps import Described, Interrupted, Presented, Rated


def rows(plan: Plan, told: Told) -> list[Row]:
    """One row a planned trial, in order of presentation; what was not reached is empty."""
    return [
        {
            "participant_id": plan.participant_id,
            "experiment": plan.experiment,
            "trial": trial.trial,
            "method": trial.method,
            **_exposure(story),
            **_rating(story),
            **presentation(story, Presented),
        }
        for trial, story in stories(plan.trials, told).items()
    ]


def _exposure(story: Story) -> Row:
    """The last exposure, and how long earlier ones of the same trial were felt before it."""
    felt = [word.exposure_s for word in story.words if isinstance(word, Presented | Interrupted) and word.exposure_s]
    shown = story.last(Presented)
    if shown is None:
        return {"earlier_exposure_s": sum(felt)} if felt else {}
    row: Row = {"shots": shown.shots, "exposure_s": shown.exposure_s}
    return row | ({"earlier_exposure_s": sum(felt[:-1])} if felt[:-1] else {})


def _rating(story: Story) -> Row:
    """The rating that counts, the participant's words, and whose hand entered them."""
    entered = [word for word in story.words if isinstance(word, Rated | RatingCorrected)]
    described = [word for word in story.words if isinstance(word, Described | DescriptionCorrected)]
    row: Row = {"comment": described[-1].comment} if described else {}
    if not entered:
        return row
    counts = entered[-1]
    by = counts.rating_by if isinstance(counts, Rated) else "experimenter"
    return row | {"rating": counts.rating, "rating_by": by}
