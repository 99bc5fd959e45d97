"""How a trial is presented, in every experiment: until it is done, again after a fault, a break-off or a request."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator

from experiments.design.plan import Trial
from experiments.session.steps import Close, Failed, Interrupted, Outcome, Repeat, Session, Step

StepsOf = Callable[[Trial, int], tuple[Step, ...]]
"""The steps of one presentation of a trial, by its number."""


class Presenter:
    """Presents trials and counts how often. `steps_of` says what a presentation is made of."""

    def __init__(self, steps_of: StepsOf) -> None:
        self._steps_of = steps_of
        self._presented: Counter[Trial] = Counter()

    def present(self, trial: Trial) -> Session:
        """Present a trial until it is done; an earlier one that is to be repeated comes in between."""
        while True:
            outcome = yield from _attempt(self._steps_of(trial, self._presented[trial] + 1))
            if isinstance(outcome, Repeat) and outcome.trial != trial:
                yield from self.present(outcome.trial)
                continue
            self._presented[trial] += 1
            if not isinstance(outcome, Failed | Interrupted | Repeat):
                return

    def until_done(self, step: Step) -> Session:
        """A step that a break-off only delays, and before which a trial can be presented again."""
        while isinstance(outcome := (yield step), Interrupted | Repeat):
            if isinstance(outcome, Repeat):
                yield from self.present(outcome.trial)

    def close(self) -> Session:
        """The end of a run, at which the last trials can still be corrected or presented again."""
        yield from self.until_done(Close())


def _attempt(steps: tuple[Step, ...]) -> Generator[Step, Outcome, Outcome]:
    """One presentation: its last outcome, or the first that breaks it off."""
    for step in steps:
        outcome = yield step
        if isinstance(outcome, Failed | Interrupted | Repeat):
            break
    return outcome
