"""Experiment 2: its plan, one trial a method; each felt until next, then each rated; and the table of its ratings."""

from __future__ import annotations

from functools import partial

from experiments.config.setup import Setup
from experiments.design.plan import Plan, Trial, condition, method_order
from experiments.design.stimuli import damper
from experiments.design.streams import Stream
from experiments.preference.config import PreferenceConfig
from experiments.record.design_table import exposure_row
from experiments.record.tables import Row, presentation
from experiments.session.history import History, TrialHistory, by_trial
from experiments.session.steps import (
    Answered,
    Describe,
    Prepare,
    Present,
    Presented,
    Presenter,
    Rate,
    Session,
    Step,
)


def make_plan(config: PreferenceConfig, participant_id: str, seed: int, order_row: int | None) -> Plan:
    """The plan that a config, a participant, a seed and a row of the square make; the same for the same."""
    design = config.design
    stream = Stream(seed, "trial-order", config.experiment, participant_id)
    trials = [
        Trial(session=1, set=1, trial=place, levels=condition(method=method, direction=design.direction))
        for place, method in enumerate(method_order(design.order, design.methods, order_row, stream), start=1)
    ]
    return Plan(
        experiment=config.experiment,
        participant_id=participant_id,
        seed=seed,
        order_row=order_row,
        trials=tuple(trials),
    )


def session(plan: Plan, setup: Setup[PreferenceConfig]) -> Session:
    """The steps of a run, from the first hand-over to its end."""
    presenter = Presenter(partial(_steps, setup))
    for trial in plan.trials:
        yield from presenter.present(trial)
    for trial in plan.trials:
        yield from presenter.until_done(_rate(trial, setup.config))
        yield from presenter.until_done(_describe(trial, setup.config))
    yield from presenter.close()


def _steps(setup: Setup[PreferenceConfig], trial: Trial, attempt: int) -> tuple[Step, ...]:
    return (
        Prepare(trial=trial, attempt=attempt, settings=damper(setup.gun, trial.method)),
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
        question="rating",
        text=scale.question,
        minimum=scale.minimum,
        maximum=scale.maximum,
        minimum_text=scale.minimum_text,
        maximum_text=scale.maximum_text,
        grain=scale.grain,
        later=True,
    )


def _describe(trial: Trial, config: PreferenceConfig) -> Describe:
    return Describe(trial=trial, question="comment", text=config.description.text, later=True)


def rows(plan: Plan, history: History) -> list[Row]:
    """One row a planned trial, in order of presentation; what was not reached is empty."""
    return [
        {
            "participant_id": plan.participant_id,
            "experiment": plan.experiment,
            "trial": trial.trial,
            "method": trial.method,
            **exposure_row(events),
            **_rating(events),
            **presentation(events, Presented),
        }
        for trial, events in by_trial(plan.trials, history).items()
    ]


def _rating(events: TrialHistory) -> Row:
    """The rating that counts, the participant's words, and whose hand entered them."""
    entered, described = events.entered("rating"), events.entered("comment")
    row: Row = {"comment": described[-1].value} if described else {}
    if not entered:
        return row
    counts = entered[-1]
    return row | {"rating": counts.value, "rating_by": counts.by if isinstance(counts, Answered) else "experimenter"}
