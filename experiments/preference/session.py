"""The session of experiment 2: each method felt until next, then each rated and described."""

from __future__ import annotations

from collections.abc import Generator

from experiments.plan import Plan, Trial
from experiments.preference.config import PreferenceConfig
from experiments.setup import Setup
from experiments.steps import Describe, Failed, Interrupted, Outcome, Prepare, Present, Rate, Session, Step


def session(plan: Plan, setup: Setup[PreferenceConfig]) -> Session:
    """The steps of a run, from the first hand-over to the last description."""
    for trial in plan.trials:
        yield from _present(trial, setup)
    for trial in plan.trials:
        yield from _until_done(_rate(trial, setup.config))
        yield from _until_done(Describe(trial=trial, question=setup.config.description.text))


def _until_done(step: Step) -> Session:
    while isinstance((yield step), Interrupted):
        pass


def _present(trial: Trial, setup: Setup[PreferenceConfig]) -> Session:
    attempt = 1
    while not (yield from _attempt(trial, attempt, setup)):
        attempt += 1


def _attempt(trial: Trial, attempt: int, setup: Setup[PreferenceConfig]) -> Generator[Step, Outcome, bool]:
    """One presentation of a trial; false if it has to be presented again."""
    steps = (
        Prepare(trial=trial, attempt=attempt, damper=setup.gun.methods[trial.method].damper),
        Present(
            trial=trial,
            attempt=attempt,
            repeat_every_s=setup.config.stimulus.repeat_every_s,
            max_shots=setup.config.fatigue.max_shots_per_trial,
        ),
    )
    for step in steps:
        if isinstance((yield step), Failed | Interrupted):
            return False
    return True


def _rate(trial: Trial, config: PreferenceConfig) -> Rate:
    scale = config.rating
    return Rate(
        trial=trial,
        question=scale.question,
        minimum=scale.minimum,
        maximum=scale.maximum,
        minimum_text=scale.minimum_text,
        maximum_text=scale.maximum_text,
        grain=scale.grain,
    )
