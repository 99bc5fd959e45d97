"""What `direction.toml` may say: a balanced two-alternative forced choice in sessions of one method each."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from experiments.config.door import (
    Count,
    ExperimentConfig,
    InnerShare,
    Methods,
    Model,
    Order,
    Seconds,
    Spread,
    SyntheticConfig,
    Text,
    check_covered,
    check_duration,
    once,
)
from experiments.synthetic.model_based import DiffusionConfig, PeopleConfig
from experiments.synthetic.percept import PerceptConfig

Balance = Literal["session", "set", "set-exact"]
InstructionName = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,31}$")]
Instructions = Annotated[tuple[InstructionName, ...], Field(max_length=26), AfterValidator(once)]
"""The names of instructions, each once."""


class Design(Model):
    """Sessions of one method each, made of sets of trials, with both directions."""

    methods: Methods
    session_order: Order = "random"
    sets_per_session: Count
    trials_per_set: Count
    forward_per_session: Annotated[int, Field(ge=0)]
    backward_per_session: Annotated[int, Field(ge=0)]
    balance: Balance = "session"
    instructions: Instructions = ()

    @property
    def order(self) -> Order:
        """How the order of methods is found."""
        return self.session_order

    @property
    def trials_per_session(self) -> int:
        """Sets times trials a set."""
        return self.sets_per_session * self.trials_per_set

    @property
    def trials(self) -> int:
        """Trials of the whole run."""
        return len(self.methods) * self.trials_per_session

    @model_validator(mode="after")
    def _counts_fit(self) -> Self:
        forward, backward, planned = self.forward_per_session, self.backward_per_session, self.trials_per_session
        if forward + backward != planned:
            raise ValueError(
                f"{forward} forward and {backward} backward make {forward + backward} trials, but "
                f"{self.sets_per_session} sets of {self.trials_per_set} make {planned}; make them equal"
            )
        if self.balance == "set-exact" and forward % self.sets_per_session:
            raise ValueError(
                f'balance = "set-exact" is impossible: {forward} forward trials cannot be shared equally among '
                f'{self.sets_per_session} sets of {self.trials_per_set}; use "set" for as even as it gets'
            )
        return self

    @model_validator(mode="after")
    def _instructions_share_the_sets(self) -> Self:
        count = len(self.instructions)
        if count and self.sets_per_session % count:
            raise ValueError(
                f"sets_per_session = {self.sets_per_session} cannot be shared equally among {count} instructions, "
                f"one a set; make it a multiple of {count}"
            )
        return self


class Breaks(Model):
    """Rests between sets and between sessions."""

    between_sets_s: Seconds
    between_sessions_s: Seconds


class Practice(Model):
    """Trials before the first session, which are not analysed; 0 for none."""

    trials_per_method: Annotated[int, Field(ge=0, le=100)] = 0


class Fatigue(Model):
    """What a participant is spared."""

    max_trials_without_break: Count
    max_planned_s: Seconds


class InstructionConfig(Model):
    """What is read out to the participant before a set."""

    text: Annotated[str, Field(min_length=1, max_length=300)]


class Question(Model):
    """The question of the forced choice, and how its two answers are called to the participant."""

    text: Text
    forward: Text
    backward: Text


class Timing(Model):
    """How long a trial takes, how much of it the hand-over, and how long the whole is said to take."""

    trial_s: Seconds
    planned_s: Annotated[float, Field(gt=0, le=86_400)]
    hand_over_s: Seconds

    @model_validator(mode="after")
    def _hand_over_is_part_of_the_trial(self) -> Self:
        if self.hand_over_s > self.trial_s:
            raise ValueError(
                f"hand_over_s = {self.hand_over_s:g} is part of trial_s = {self.trial_s:g}; make it shorter"
            )
        return self


class Rates(Model):
    """Shares of correct answers in the mean over people, differences between people, and bias (probit units)."""

    forward: dict[str, InnerShare]
    backward: dict[str, InnerShare]
    ability_sd: Spread
    bias_mean: Annotated[float, Field(ge=-10, le=10)]
    bias_sd: Spread


class ResponseTime(Model):
    """A shifted log-normal response time."""

    shift_s: Seconds
    median_s: Annotated[float, Field(gt=0, le=3_600)]
    sigma: Spread


class Synthetic(SyntheticConfig):
    """Who answers when nobody sits there."""

    observer: Literal["rates", "table", "felt"]
    rates: Rates
    response_time: ResponseTime
    percept: PerceptConfig = PerceptConfig()
    diffusion: DiffusionConfig = DiffusionConfig()
    people: PeopleConfig = PeopleConfig()


class DirectionConfig(ExperimentConfig):
    """Experiment 1: which way did it shoot?"""

    experiment: Literal["direction"]
    design: Design
    breaks: Breaks
    practice: Practice = Practice()
    fatigue: Fatigue
    question: Question
    instructions: dict[str, InstructionConfig] = Field(default_factory=dict)
    timing: Timing
    synthetic: Synthetic

    @property
    def break_s(self) -> float:
        """All planned breaks together."""
        sessions, sets = len(self.design.methods), self.design.sets_per_session
        between_sets_s = sessions * (sets - 1) * self.breaks.between_sets_s
        return between_sets_s + (sessions - 1) * self.breaks.between_sessions_s

    @property
    def methods(self) -> tuple[str, ...]:
        """The rendering methods that are met."""
        return self.design.methods

    @property
    def hand_over_s(self) -> float:
        """Planned time of a hand-over."""
        return self.timing.hand_over_s

    @property
    def trial_s(self) -> float:
        """Planned time of a trial, from its hand-over to its answer."""
        return self.timing.trial_s

    @property
    def duration_s(self) -> float:
        """Planned duration: trials and breaks."""
        return self.design.trials * self.timing.trial_s + self.break_s

    @property
    def trials_without_break(self) -> int:
        """The longest stretch of trials that no break interrupts."""
        longest = stretch = 0
        for place in range(len(self.design.methods) * self.design.sets_per_session):
            new_session = place % self.design.sets_per_session == 0
            rest_s = self.breaks.between_sessions_s if new_session else self.breaks.between_sets_s
            stretch = self.design.trials_per_set + (0 if rest_s > 0 else stretch)
            longest = max(longest, stretch)
        return longest

    @model_validator(mode="after")
    def _spares_the_participant(self) -> Self:
        if self.trials_without_break > self.fatigue.max_trials_without_break:
            raise ValueError(
                f"{self.trials_without_break} trials without a break exceed fatigue.max_trials_without_break = "
                f"{self.fatigue.max_trials_without_break}; make sets smaller or the breaks longer than 0"
            )
        check_duration(self.duration_s, self.fatigue.max_planned_s)
        return self

    @model_validator(mode="after")
    def _methods_have_rates(self) -> Self:
        rates = self.synthetic.rates
        check_covered("synthetic.rates.forward", rates.forward, self.design.methods)
        check_covered("synthetic.rates.backward", rates.backward, self.design.methods)
        return self

    @model_validator(mode="after")
    def _instructions_are_worded(self) -> Self:
        for name in self.design.instructions:
            if name not in self.instructions:
                raise ValueError(
                    f"design.instructions names {name}, but there is no table [instructions.{name}]; add it with a text"
                )
        return self

    @model_validator(mode="after")
    def _instructions_have_boundaries(self) -> Self:
        if self.synthetic.observer == "felt":
            boundaries = self.synthetic.diffusion.boundaries
            missing = [name for name in self.design.instructions if name not in boundaries]
            if missing:
                raise ValueError(
                    f"synthetic.diffusion.boundaries has no value for {', '.join(missing)}; "
                    "give one for each of design.instructions"
                )
        return self

    def instruction_text(self, name: str) -> str:
        """What is read out under an instruction; nothing where there is none."""
        return self.instructions[name].text if name else ""
