"""`[synthetic.diffusion]` and `[synthetic.people]`: how somebody who feels the gun decides, and how people differ."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from experiments.config.models import Model, Share
from experiments.synthetic.diffusion import Lapses, People
from experiments.synthetic.felt import NEUTRAL, Mind

_MIND = Mind()

Boundary = Annotated[float, Field(gt=0, le=100)]
DecisionSeconds = Annotated[float, Field(ge=0, le=60)]
PeopleSpread = Annotated[float, Field(ge=0, le=5)]


class LapsesConfig(Model):
    """Answers that are not decided: a fair coin after a time between the two."""

    rate: Share = _MIND.lapses.rate
    earliest_s: DecisionSeconds = _MIND.lapses.earliest_s
    latest_s: DecisionSeconds = _MIND.lapses.latest_s

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

    boundaries: dict[str, Boundary] = Field(default_factory=lambda: dict(_MIND.boundaries))
    non_decision_s: DecisionSeconds = _MIND.non_decision_s
    lapses: LapsesConfig = LapsesConfig()

    @model_validator(mode="after")
    def _neutral_is_there(self) -> Self:
        if NEUTRAL not in self.boundaries:
            raise ValueError(f"boundaries has no value for {NEUTRAL}, the trials without an instruction; give one")
        return self


class PeopleConfig(Model):
    """Spreads between people; 0 for people who are alike."""

    drift_factor_sd: PeopleSpread = _MIND.people.drift_factor_sd
    log_boundary_sd: PeopleSpread = _MIND.people.log_boundary_sd
    log_non_decision_sd: PeopleSpread = _MIND.people.log_non_decision_sd
    logit_start_sd: PeopleSpread = _MIND.people.logit_start_sd

    @property
    def own(self) -> People:
        """The diffusion's own type."""
        return People(**self.model_dump())
