"""The session of experiment 1: turn, fire, ask, sixty times, with a break after each set and session."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

from experiments.config.setup import Setup
from experiments.design.plan import Plan, Trial
from experiments.direction.config import Breaks, DirectionConfig
from experiments.session.presenting import Presenter
from experiments.session.steps import Ask, Fire, Prepare, Rest, Session, Step


def session(plan: Plan, setup: Setup[DirectionConfig]) -> Session:
    """The steps of a run, from the first hand-over to its end."""
    presenter = Presenter(partial(_steps, setup))
    yield from presenter.present(plan.trials[0])
    for before, trial in pairwise(plan.trials):
        yield from _rest(presenter, before, trial, setup.config.breaks)
        yield from presenter.present(trial)
    yield from presenter.close()


def _rest(presenter: Presenter, before: Trial, trial: Trial, breaks: Breaks) -> Session:
    if trial.session != before.session and breaks.between_sessions_s:
        yield from presenter.until_done(Rest(between="sessions", duration_s=breaks.between_sessions_s))
    elif trial.session == before.session and trial.set != before.set and breaks.between_sets_s:
        yield from presenter.until_done(Rest(between="sets", duration_s=breaks.between_sets_s))


def _steps(setup: Setup[DirectionConfig], trial: Trial, attempt: int) -> tuple[Step, ...]:
    question = setup.config.question
    return (
        Prepare(
            trial=trial,
            attempt=attempt,
            damper=setup.gun.methods[trial.method].damper,
            instruction=setup.config.instruction_text(trial.instruction),
        ),
        Fire(trial=trial, attempt=attempt),
        Ask(
            trial=trial,
            attempt=attempt,
            question=question.text,
            forward=question.forward,
            backward=question.backward,
        ),
    )
