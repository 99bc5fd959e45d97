"""The session of experiment 1: turn, fire, ask, sixty times, with a break after each set and session."""

from __future__ import annotations

from collections.abc import Generator
from itertools import pairwise

from experiments.direction.config import Breaks, DirectionConfig
from experiments.plan import Plan, Trial
from experiments.setup import Setup
from experiments.steps import Ask, Failed, Fire, Interrupted, Outcome, Prepare, Rest, Session, Step


def session(plan: Plan, setup: Setup[DirectionConfig]) -> Session:
    """The steps of a run, from the first hand-over to the last answer."""
    yield from _present(plan.trials[0], setup)
    for before, trial in pairwise(plan.trials):
        yield from _rest(before, trial, setup.config.breaks)
        yield from _present(trial, setup)


def _rest(before: Trial, trial: Trial, breaks: Breaks) -> Session:
    if trial.session != before.session:
        yield from _take(Rest(between="sessions", duration_s=breaks.between_sessions_s))
    elif trial.set != before.set:
        yield from _take(Rest(between="sets", duration_s=breaks.between_sets_s))


def _take(rest: Rest) -> Session:
    while rest.duration_s > 0 and isinstance((yield rest), Interrupted):
        pass


def _present(trial: Trial, setup: Setup[DirectionConfig]) -> Session:
    attempt = 1
    while not (yield from _attempt(trial, attempt, setup)):
        attempt += 1


def _attempt(trial: Trial, attempt: int, setup: Setup[DirectionConfig]) -> Generator[Step, Outcome, bool]:
    """One presentation of a trial; false if it has to be presented again."""
    question = setup.config.question
    steps = (
        Prepare(trial=trial, attempt=attempt, damper=setup.gun.methods[trial.method].damper),
        Fire(trial=trial, attempt=attempt),
        Ask(
            trial=trial,
            attempt=attempt,
            question=question.text,
            forward=question.forward,
            backward=question.backward,
        ),
    )
    for step in steps:
        if isinstance((yield step), Failed | Interrupted):
            return False
    return True
