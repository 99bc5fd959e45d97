"""The screen of a synthetic participant: answers come from an observer, waiting from the clock it is given."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from experiments import catalogue
from experiments.clock import Clock
from experiments.config import ExperimentConfig
from experiments.load import ConfigError
from experiments.plan import Plan
from experiments.runner import Desk
from experiments.setup import Setup
from experiments.steps import (
    Answered,
    Ask,
    Describe,
    Described,
    Outcome,
    Prepare,
    Prepared,
    Present,
    Rate,
    Rated,
    Rest,
    Rested,
    Standing,
    Step,
)


def observer_of(setup: Setup[Any], plan: Plan) -> Any:
    """The synthetic participant that a setup asks for, the same in data mode and in visual mode.

    `ConfigError` if its table does not fit, or its numbers make nobody.
    """
    try:
        return catalogue.experiment(setup).observer(setup, plan)
    except ValueError as error:
        synthetic = setup.config.synthetic
        if synthetic.observer == "table":
            raise ConfigError(f"{setup.source.parent / synthetic.table}: {error}") from error
        raise ConfigError(f"{setup.source}: the numbers of [synthetic.*] make nobody: {error}") from error


def synthetic_screen(setup: Setup[Any], plan: Plan, clock: Clock) -> SyntheticScreen:
    """The screen of the synthetic participant that a setup asks for. Raises as `observer_of` does."""
    return SyntheticScreen(setup.config, observer_of(setup, plan), clock)


class SyntheticScreen:
    """Carries steps out as a person would, in as much time as the config plans for them.

    `tell` is called with each step after its outcome is on the disk: for a progress bar.
    """

    shown_s: float | None = None

    def __init__(
        self, config: ExperimentConfig, observer: Any, clock: Clock, tell: Callable[[Step], None] = lambda _: None
    ) -> None:
        self._timing: Any = getattr(config, "timing", None)
        self._observer = observer
        self._clock = clock
        self._tell = tell
        self._next_at_s: float | None = None

    def begin(self, desk: Desk, standing: Standing) -> None:
        """Nothing to take over: every step says all."""

    def prepare(self, step: Prepare) -> Prepared:
        """Take the planned time of a hand-over."""
        del step
        self._next_at_s = None
        self._clock.sleep(self._timing.hand_over_s)
        return Prepared()

    def ask(self, step: Ask, onset_s: float) -> Answered:
        """Answer after the observer's own response time."""
        answer = self._observer.answer(step.trial)
        self._clock.sleep(onset_s + answer.response_time_s - self._clock.now())
        return Answered(
            response=answer.response,
            response_time_s=answer.response_time_s,
            response_source="synthetic",
            response_time_valid=True,
        )

    def rest(self, step: Rest) -> Rested:
        """Rest as long as planned."""
        self._clock.sleep(step.duration_s)
        return Rested(rested_s=step.duration_s)

    def said_next(self, step: Present, onset_s: float, until_s: float) -> bool:
        """Say next once the observer has felt enough since the first onset; drawn when the stimulus begins."""
        if self._next_at_s is None:
            self._next_at_s = onset_s + self._observer.exposure_s(step.trial)
        self._clock.sleep(min(self._next_at_s, until_s) - self._clock.now())
        return self._next_at_s <= until_s

    def rate(self, step: Rate) -> Rated:
        """Rate as the observer does."""
        self._clock.sleep(self._timing.rating_s)
        return Rated(rating=self._observer.rate(step.trial), rating_by="synthetic")

    def describe(self, step: Describe) -> Described:
        """Say nothing: a synthetic participant has no words of its own."""
        del step
        self._clock.sleep(self._timing.description_s)
        return Described(comment="")

    def acknowledge(self, step: Step, outcome: Outcome) -> None:
        """Tell whoever counts."""
        del outcome
        self._tell(step)
