"""Runs of designs without a gun, a screen or a file: the generator is driven, and its journal told as history."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from experiments.config.setup import GunConfig, Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.session.design_session import design_session
from experiments.session.steps import (
    Answered,
    Ask,
    Close,
    Closed,
    Describe,
    Failed,
    Fired,
    FireShot,
    Inform,
    Informed,
    Interrupted,
    Outcome,
    Prepare,
    Prepared,
    Present,
    Presented,
    Rate,
    Rest,
    Rested,
    Session,
    Step,
    step_after,
)

FIRED = Fired(
    gun="simulated",
    onset_utc="2026-01-01T00:00:00.000000Z",
    requested_s=0.0,
    pulse_start_s=0.0,
    pulse_end_s=0.01,
    home_predicted_s=0.2,
    motion="home",
)
SHOWN = Presented(gun="simulated", onset_utc=FIRED.onset_utc, shots=2, exposure_s=2.0, ended_by="next")
FAILED, FELT, UNFELT = Failed(cause="no answer"), Interrupted(presented=True), Interrupted(presented=False)


def session_of(design: DesignConfig, gun: GunConfig, plan: Plan) -> Session:
    """The steps of a plan."""
    setup: Setup[Any] = Setup(config=design, gun=gun, source=Path("design.toml"))
    return design_session(plan, setup)


def done(step: Step, number: int) -> Outcome:
    """What becomes of a step where nothing goes wrong; the answers differ from step to step."""
    match step:
        case Prepare():
            return Prepared(settings=step.settings)
        case FireShot():
            return FIRED
        case Present():
            return SHOWN
        case Inform():
            return Informed()
        case Rest():
            return Rested(rested_s=step.duration_s)
        case Close():
            return Closed()
        case _:
            own = isinstance(step, Ask)
            return Answered(value=answer(step, number), by="synthetic", response_time_s=0.5, response_time_valid=own)


def steps_of(session: Session, troubles: Mapping[int, Outcome] | None = None) -> list[Step]:
    """All steps of a session; the n-th is sent `troubles[n]` instead of what becomes of it where nothing goes wrong."""
    steps: list[Step] = []
    step: Step | None = next(session)
    while step is not None:
        outcome = (troubles or {}).get(len(steps)) or done(step, len(steps))
        steps.append(step)
        step = step_after(session, outcome)
    return steps


def answer(step: Ask | Rate | Describe, number: int) -> str | float:
    """An answer to what is asked, not always the same."""
    match step:
        case Ask():
            return step.answers[number % len(step.answers)]
        case Rate():
            return step.minimum if number % 2 else step.maximum
        case Describe():
            return f"words {number}"


def driven(session: Session, *outcomes: Outcome) -> Iterator[tuple[Step, Outcome]]:
    """The steps with their outcomes: those given first, then what becomes of them where nothing goes wrong."""
    step: Step | None = next(session)
    given = iter(outcomes)
    number = 0
    while step is not None:
        outcome = next(given, None) or done(step, number)
        yield step, outcome
        number += 1
        step = step_after(session, outcome)
