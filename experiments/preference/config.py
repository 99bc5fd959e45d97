"""What `preference.toml` may say: each method felt until `next`, then rated on a continuous scale."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from device.words import Direction
from experiments.config.door import (
    Count,
    ExperimentConfig,
    Methods,
    Model,
    Order,
    Seconds,
    Share,
    Spread,
    SyntheticConfig,
    Text,
    check_covered,
    check_duration,
)
from experiments.synthetic.percept import PerceptConfig
from experiments.synthetic.preference import Appeal


class Design(Model):
    """One trial a method, always in one direction."""

    methods: Methods
    trial_order: Order = "random"
    direction: Direction = "forward"

    @property
    def order(self) -> Order:
        """How the order of methods is found."""
        return self.trial_order

    @property
    def trials(self) -> int:
        """Trials of the whole run: one a method."""
        return len(self.methods)


class Stimulus(Model):
    """A shot every so often until the participant says next, which is not taken before the least exposure."""

    repeat_every_s: Annotated[float, Field(gt=0, le=3_600)]
    least_exposure_s: Annotated[float, Field(ge=0, le=3_600)] = 1.0


class RatingScale(Model):
    """A continuous scale with worded ends; `grain` is how fine a rating is kept."""

    question: Text
    minimum: float
    maximum: float
    minimum_text: Text
    maximum_text: Text
    grain: Annotated[float, Field(ge=1e-6)]

    @model_validator(mode="after")
    def _ends_in_order(self) -> Self:
        if not 0 <= self.minimum < self.maximum <= 10:
            raise ValueError(
                f"minimum {self.minimum:g} and maximum {self.maximum:g}: need 0 <= minimum < maximum <= 10"
            )
        steps = (self.maximum - self.minimum) / self.grain
        if abs(steps - round(steps)) > 1e-9 * steps:
            raise ValueError(f"grain {self.grain:g} does not divide the scale; use a part such as 1, 0.5 or 0.1")
        return self


class DescriptionConfig(Model):
    """What is asked beside each rating."""

    text: Text


class Fatigue(Model):
    """What a participant is spared."""

    max_shots_per_trial: Count
    max_planned_s: Seconds


class Timing(Model):
    """How long the parts take, and how long the whole is said to take."""

    instruction_s: Seconds
    hand_over_s: Seconds
    exposure_s: Annotated[float, Field(gt=0, le=86_400)]
    rating_s: Seconds
    description_s: Seconds
    planned_s: Annotated[float, Field(gt=0, le=86_400)]


class Ratings(Model):
    """Ratings in the mean, their spread over people and over one person's methods, and two published habits."""

    mean: dict[str, float]
    person_sd: Spread
    noise_sd: Spread
    lowest: Text | None = None
    same: tuple[Text, Text] | None = None
    same_share: Share = 0.0

    @property
    def named(self) -> tuple[str, ...]:
        """The methods that the habits speak of."""
        return (*((self.lowest,) if self.lowest else ()), *(self.same or ()))


class Synthetic(SyntheticConfig):
    """Who rates when nobody sits there."""

    observer: Literal["ratings", "table", "felt"]
    ratings: Ratings
    percept: PerceptConfig = PerceptConfig()
    appeal: Appeal = Appeal()


class PreferenceConfig(ExperimentConfig):
    """Experiment 2: how do you like it?"""

    experiment: Literal["preference"]
    design: Design
    stimulus: Stimulus
    rating: RatingScale
    description: DescriptionConfig
    fatigue: Fatigue
    timing: Timing
    synthetic: Synthetic

    @property
    def methods(self) -> tuple[str, ...]:
        """The rendering methods that are met."""
        return self.design.methods

    @property
    def hand_over_s(self) -> float:
        """Planned time of a hand-over."""
        return self.timing.hand_over_s

    def asking_s(self, kind: str) -> float:
        """Planned time of a question by the kind of its step, `rate` or `describe`."""
        return self.timing.rating_s if kind == "rate" else self.timing.description_s

    @property
    def trial_s(self) -> float:
        """Planned time of a trial, from its hand-over to next."""
        return self.timing.hand_over_s + self.timing.exposure_s

    @property
    def asks_later(self) -> bool:
        """Each method is rated after all were felt."""
        return True

    @property
    def rating_s(self) -> float:
        """Planned time of a trial's rating and description, after all were felt."""
        return self.timing.rating_s + self.timing.description_s

    @property
    def duration_s(self) -> float:
        """Planned duration: instruction, trials, ratings and descriptions."""
        return self.timing.instruction_s + self.design.trials * (self.trial_s + self.rating_s)

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        check_duration(self.duration_s, self.fatigue.max_planned_s)
        ratings, methods = self.synthetic.ratings, self.design.methods
        check_covered("synthetic.ratings.mean", ratings.mean, methods)
        for name in ratings.named:
            if name not in methods:
                raise ValueError(f"synthetic.ratings names {name!r}, which is not among design.methods")
        return self
