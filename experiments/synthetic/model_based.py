"""Decisions from what the gun does, percept then diffusion: what people are made of, and its config."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Self

from pydantic import Field, model_validator

from device.words import Direction
from experiments.config.door import Model, Share
from experiments.synthetic.diffusion import Diffusion, Lapses, People, Person
from experiments.synthetic.percept import Percept, PerceptParameters, diffusion_of, evidence

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
    from experiments.synthetic.decision import forward_rates  # noqa: PLC0415 - slow, and few designs are asked

    log_odds, neutral = evidence(percept, model.percept), model.boundaries[NEUTRAL]
    return {
        name: float(forward_rates(log_odds * boundary / neutral, model.percept.start, model.people, model.lapses.rate))
        for name, boundary in model.boundaries.items()
    }


def own_diffusion(
    model: ModelParameters, someone: Person, percept: Percept, direction: Direction, instruction: str
) -> Diffusion:
    """Somebody's decision on a shot that gives this percept when it is fired forward; "upper" is "forward".

    The sensitivity is that at the neutral boundary, so a hurried person has the same drift and errs more.
    `KeyError`: an instruction without a boundary. `ValueError`: somebody whose drift, boundary or non-decision time is
    beyond what a `Diffusion` may be.
    """
    forward = evidence(percept, model.percept)
    neutral = _neutral(model, forward if direction == "forward" else -forward)
    return someone.own(replace(neutral, boundary=model.boundaries[instruction]))


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
