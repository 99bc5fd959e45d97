"""Synthetic participants of experiment 2: from assumed means with two habits, from a table, or from what is felt."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from experiments.config.setup import Setup
from experiments.design.plan import Plan, Trial
from experiments.design.streams import Stream
from experiments.preference.config import PreferenceConfig, RatingScale
from experiments.preference.config import Ratings as RatingsLaw
from experiments.synthetic.answers import EXPOSURE_SIGMA
from experiments.synthetic.percept import evidence, percepts_of
from experiments.synthetic.preference import felt_ratings
from experiments.tasks.questions import on_scale

TABLE_COLUMNS = ("participant_id", "method", "rating")
"""The table of answers: each participant's rating of each method."""


def synthetic_participant(setup: Setup[PreferenceConfig], plan: Plan) -> RatingsParticipant:
    """The synthetic participant that a setup asks for."""
    config, kind = setup.config, setup.config.synthetic.observer
    if kind == "table":
        return RatingsParticipant(config, plan, _from_table(config, plan, setup.answers))
    stream = Stream(plan.seed, "ratings", plan.experiment, plan.participant_id)
    if kind == "felt":
        ratings = felt_ratings(config.synthetic.appeal, config.rating, strengths(setup), stream)
    else:
        ratings = draw_ratings(config.synthetic.ratings, config.rating, plan.methods, stream)
    return RatingsParticipant(config, plan, ratings)


def strengths(setup: Setup[PreferenceConfig]) -> dict[str, float]:
    """How strongly each method's shot is felt: its evidence, whichever way it points."""
    parameters = setup.config.synthetic.percept.own
    percepts = percepts_of(setup.gun.renderings(setup.config.design.methods), parameters.leak_s)
    return {name: abs(evidence(percept, parameters)) for name, percept in percepts.items()}


def draw_ratings(law: RatingsLaw, scale: RatingScale, methods: Sequence[str], stream: Stream) -> dict[str, float]:
    """One person's ratings: mean + person + noise, kept to the scale and its grain; then the habits.

    With the share `same_share` the two methods of `same` get the first one's rating; the method named `lowest` is kept
    at least one grain below all others (all that the scale's lower end leaves).
    """
    person = law.person_sd * stream.normal()
    noise = {method: law.noise_sd * stream.normal() for method in sorted(methods)}
    ratings = {method: _kept(law.mean[method] + person + noise[method], scale) for method in methods}
    if law.same and stream.uniform() < law.same_share:
        ratings[law.same[1]] = ratings[law.same[0]]
    others = min((rating for method, rating in ratings.items() if method != law.lowest), default=scale.maximum)
    if law.lowest:
        ratings[law.lowest] = min(ratings[law.lowest], _kept(others - scale.grain, scale))
    return ratings


def _kept(value: float, scale: RatingScale) -> float:
    return on_scale(value, scale)


class RatingsParticipant:
    """A person whose ratings are given beforehand: drawn by the seed, or read from a table. `None` is no answer."""

    def __init__(self, config: PreferenceConfig, plan: Plan, ratings: Mapping[str, float | None]) -> None:
        self._mean_s = config.timing.exposure_s
        self._plan = plan
        self._ratings = ratings

    def rate(self, trial: Trial, question: str = "rating") -> float | None:  # noqa: ARG002 - there is one
        """The rating of this trial's method."""
        return self._ratings[trial.method]

    def describe(self, trial: Trial, question: str = "comment") -> str:  # noqa: ARG002 - nobody says anything
        """No words."""
        return ""

    def exposure_s(self, trial: Trial) -> float:
        """How long the participant asks for a stimulus before saying next."""
        plan = self._plan
        draws = Stream(plan.seed, "exposure", plan.experiment, plan.participant_id, str(trial.trial))
        return self._mean_s * math.exp(EXPOSURE_SIGMA * draws.normal() - EXPOSURE_SIGMA**2 / 2)


def _from_table(config: PreferenceConfig, plan: Plan, answers: Sequence[Mapping[str, str]]) -> dict[str, float | None]:
    """`ValueError` if the table has no row for the participant and method, or a rating off the scale."""
    return {method: _cell(answers, plan.participant_id, method, config.rating) for method in plan.methods}


def _cell(answers: Sequence[Mapping[str, str]], participant: str, method: str, scale: RatingScale) -> float | None:
    rows = [row for row in answers if (row["participant_id"], row["method"]) == (participant, method)]
    if len(rows) != 1:
        raise ValueError(f"{len(rows)} rows for participant {participant}, method {method}; there must be one")
    cell = rows[0]["rating"]
    if not cell:
        return None
    try:
        rating = float(cell)
    except ValueError:
        rating = math.nan
    if not scale.minimum <= rating <= scale.maximum:
        raise ValueError(
            f"participant {participant}, {method}, rating is {cell!r}; it must be a number from "
            f"{scale.minimum:g} to {scale.maximum:g}, or empty for no answer"
        )
    return rating
