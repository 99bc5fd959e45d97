"""A synthetic participant who answers from what the gun does, percept then diffusion, and its config."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Self

from pydantic import Field, model_validator

from device.words import DIRECTIONS
from experiments.config.door import Model, Share
from experiments.design.plan import Plan, Trial
from experiments.design.streams import Stream
from experiments.synthetic.diffusion import Decision, Diffusion, Lapses, People, decide, person
from experiments.synthetic.percept import Percept, PerceptParameters, diffusion_of, evidence, forward_rates

NEUTRAL = "neutral"
"""The instruction of a trial that has none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelParameters:
    """What the participants are made of. All but the percept's fitted numbers is assumed: the paper has no times."""

    percept: PerceptParameters = field(default_factory=PerceptParameters)
    boundaries: Mapping[str, float] = field(default_factory=lambda: {"speed": 1.0, NEUTRAL: 1.5, "accuracy": 2.2})
    non_decision_s: float = 0.35
    lapses: Lapses = field(default_factory=Lapses)
    people: People = field(default_factory=People)


def rates_by_instruction(model: ModelParameters, percept: Percept) -> dict[str, float]:
    """The share of "forward" after a forward shot in the mean over people, by instruction."""
    log_odds, neutral = evidence(percept, model.percept), model.boundaries[NEUTRAL]
    return {
        name: float(forward_rates(log_odds * boundary / neutral, model.percept.start, model.people, model.lapses.rate))
        for name, boundary in model.boundaries.items()
    }


class ModelBasedParticipant:
    """A person drawn once, by the seed, who then decides each trial by its own stream.

    The sensitivity is that at the neutral boundary, so a hurried person has the same drift and errs more.
    `ValueError`: somebody whose drift, boundary or non-decision time is beyond what a `Diffusion` may be.
    """

    def __init__(self, model: ModelParameters, percepts: Mapping[str, Percept], plan: Plan) -> None:
        self._seed, self._who = plan.seed, (plan.experiment, plan.participant_id)
        someone = person(model.people, Stream(plan.seed, "person", *self._who))
        self._diffusions = {
            (method, direction, instruction): someone.own(replace(_neutral(model, log_odds), boundary=boundary))
            for method, forward in percepts.items()
            for direction, log_odds in zip(DIRECTIONS, _log_odds(forward, model.percept), strict=True)
            for instruction, boundary in model.boundaries.items()
        }

    def decide(self, trial: Trial, instruction: str = NEUTRAL) -> Decision:
        """The decision on a shot of this trial's method and direction; "upper" is "forward".

        `KeyError`: a method without a percept or an instruction without a boundary.
        """
        draws = Stream(self._seed, "answer", *self._who, str(trial.session), str(trial.trial))
        return decide(self._diffusions[trial.method, trial.direction, instruction], draws)


def _log_odds(percept: Percept, parameters: PerceptParameters) -> tuple[float, float]:
    """Of "forward" after a forward and after a backward shot, without bias."""
    forward = evidence(percept, parameters)
    return forward, -forward


def _neutral(model: ModelParameters, log_odds: float) -> Diffusion:
    return diffusion_of(
        log_odds,
        model.percept,
        boundary=model.boundaries[NEUTRAL],
        non_decision_s=model.non_decision_s,
        lapses=model.lapses,
    )


_DEFAULT = ModelParameters()

Boundary = Annotated[float, Field(gt=0, le=100)]
DecisionSeconds = Annotated[float, Field(ge=0, le=60)]
PeopleSpread = Annotated[float, Field(ge=0, le=5)]


class LapsesConfig(Model):
    """Answers that are not decided: a fair coin after a time between the two."""

    rate: Share = _DEFAULT.lapses.rate
    earliest_s: DecisionSeconds = _DEFAULT.lapses.earliest_s
    latest_s: DecisionSeconds = _DEFAULT.lapses.latest_s

    @model_validator(mode="after")
    def _lapses_last(self) -> Self:
        if self.earliest_s >= self.latest_s:
            raise ValueError(f"earliest_s = {self.earliest_s:g} must be below latest_s = {self.latest_s:g}")
        return self

    @property
    def own(self) -> Lapses:
        """The diffusion's own type."""
        return Lapses(**self.model_dump())


class DiffusionConfig(Model):
    """A boundary (caution, sqrt(s)) for each instruction and for `neutral`, the time beside it, and lapses."""

    boundaries: dict[str, Boundary] = Field(default_factory=lambda: dict(_DEFAULT.boundaries))
    non_decision_s: DecisionSeconds = _DEFAULT.non_decision_s
    lapses: LapsesConfig = LapsesConfig()

    @model_validator(mode="after")
    def _neutral_is_there(self) -> Self:
        if NEUTRAL not in self.boundaries:
            raise ValueError(f"boundaries has no value for {NEUTRAL}, the trials without an instruction; give one")
        return self


class PeopleConfig(Model):
    """Spreads between people; 0 for people who are alike."""

    drift_factor_sd: PeopleSpread = _DEFAULT.people.drift_factor_sd
    log_boundary_sd: PeopleSpread = _DEFAULT.people.log_boundary_sd
    log_non_decision_sd: PeopleSpread = _DEFAULT.people.log_non_decision_sd
    logit_start_sd: PeopleSpread = _DEFAULT.people.logit_start_sd

    @property
    def own(self) -> People:
        """The diffusion's own type."""
        return People(**self.model_dump())
