"""The session of experiment 2: each method felt until next, then each rated and described."""

from __future__ import annotations

from functools import partial

from experiments.config.setup import Setup
from experiments.design.plan import Plan, Trial
from experiments.preference.config import PreferenceConfig
from experiments.session.presenting import Presenter
from experiments.session.steps import Describe, Prepare, Present, Rate, Session, Step


def session(plan: Plan, setup: Setup[PreferenceConfig]) -> Session:
    """The steps of a run, from the first hand-over to its end."""
    presenter = Presenter(partial(_steps, setup))
    for trial in plan.trials:
        yield from presenter.present(trial)
    for trial in plan.trials:
        yield from presenter.until_done(_rate(trial, setup.config))
        yield from presenter.until_done(Describe(trial=trial, question=setup.config.description.text))
    yield from presenter.close()


def _steps(setup: Setup[PreferenceConfig], trial: Trial, attempt: int) -> tuple[Step, ...]:
    return (
        Prepare(trial=trial, attempt=attempt, damper=setup.gun.methods[trial.method].damper),
        Present(
            trial=trial,
            attempt=attempt,
            repeat_every_s=setup.config.stimulus.repeat_every_s,
            max_shots=setup.config.fatigue.max_shots_per_trial,
            least_exposure_s=setup.config.stimulus.least_exposure_s,
        ),
    )


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
