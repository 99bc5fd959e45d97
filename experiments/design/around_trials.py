"""The tables of a design around its trials: what is told first, practice, breaks, what is spared, how long it takes."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from experiments.config.door import Model, once
from experiments.config.lines import PageText
from experiments.design.language import MAX_TRIALS, ColumnName, DurationSeconds, PauseSeconds


class OpeningConfig(Model):
    """A text for the participant before the first trial, which the experimenter confirms.

    One that asks for consent comes before the first trial of a practice as well.
    """

    kind: Literal["instruction", "consent"] = "instruction"
    text: PageText


class PracticeConfig(Model):
    """Trials before the first session, in files of their own, never analysed: so many of each cell of `of`.

    They come in a round, and again in another order `until_right`: that share of a round's answers was right, in so
    many `rounds` at the most.
    """

    repetitions: Annotated[int, Field(ge=0, le=100)] = 0
    of: Annotated[tuple[ColumnName, ...], AfterValidator(once)] = ()
    feedback: bool = False
    until_right: Annotated[float, Field(gt=0, le=1)] | None = None
    rounds: Annotated[int, Field(ge=1, le=20)] = 1

    @model_validator(mode="after")
    def _of_something(self) -> Self:
        if bool(self.repetitions) != bool(self.of):
            missing = "of: the factors whose cells are practised" if self.repetitions else "repetitions: how often"
            raise ValueError(f"a practice needs {missing}")
        if self.until_right is not None and self.rounds == 1:
            raise ValueError("until_right needs rounds: how many there are at the most, such as 4")
        if self.until_right is None and self.rounds > 1:
            raise ValueError("rounds needs until_right: the share of right answers that ends them, such as 0.8")
        if self.rounds > 1 and not self.repetitions:
            raise ValueError("a practice needs repetitions: how often, and of: the factors whose cells are practised")
        return self


class BreaksConfig(Model):
    """Rests between sets and between sessions."""

    between_sets_s: PauseSeconds = 0.0
    between_sessions_s: PauseSeconds = 0.0


class FatigueConfig(Model):
    """What a participant is spared: a design beyond it is refused."""

    max_trials_without_break: Annotated[int, Field(ge=1, le=MAX_TRIALS)]
    max_planned_s: DurationSeconds


class TimingConfig(Model):
    """How long the parts of a run take, and how long the whole is said to take."""

    hand_over_s: PauseSeconds
    stimulus_s: PauseSeconds = 0.0
    answer_s: PauseSeconds = 0.0
    opening_s: PauseSeconds = 0.0
    planned_s: DurationSeconds
