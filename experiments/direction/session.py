"""Experiment 1: its plan, sessions of one method each; turn, fire, ask, with breaks; and the table of its trials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

from device.words import Direction
from experiments.config.setup import Setup
from experiments.design.plan import Plan, Trial, condition, method_order
from experiments.design.stimuli import damper
from experiments.design.streams import Stream
from experiments.direction.config import Breaks, Design, DirectionConfig
from experiments.record.design_table import ANTICIPATION_S
from experiments.record.tables import Row, presentation
from experiments.session.history import History, TrialHistory, by_trial
from experiments.session.steps import Answered, Ask, Fired, FireShot, Prepare, Presenter, Rest, Session, Step
from experiments.tasks.questions import Choice, choices_of


def make_plan(config: DirectionConfig, participant_id: str, seed: int, order_row: int | None) -> Plan:
    """The plan that a config, a participant, a seed and a row of the square make; the same for the same."""
    design, who = config.design, (config.experiment, participant_id)
    methods = method_order(design.order, design.methods, order_row, Stream(seed, "session-order", *who))
    trials = [
        trial
        for session, method in enumerate(methods, start=1)
        for trial in _session(
            design,
            session,
            method,
            ways=_directions(design, Stream(seed, "directions", *who, str(session))),
            instructed=_instructions(design, seed, (*who, str(session))),
        )
    ]
    return Plan(
        experiment=config.experiment,
        participant_id=participant_id,
        seed=seed,
        order_row=order_row,
        trials=tuple(trials),
    )


def make_practice(config: DirectionConfig, participant_id: str, seed: int) -> Plan | None:
    """The plan of a practice: some trials of each method, mixed, in one set. `None` if the config has none.

    A practice is of the gun: it has no instruction.
    """
    who, each = (config.experiment, participant_id), config.practice.trials_per_method
    methods = Stream(seed, "practice-methods", *who).shuffled([*config.design.methods] * each)
    forward = len(methods) // 2
    ways = Stream(seed, "practice-directions", *who).shuffled(_ways(forward, len(methods) - forward))
    trials = [
        Trial(session=1, set=1, trial=place, levels=condition(method=method, direction=way))
        for place, (method, way) in enumerate(zip(methods, ways, strict=True), start=1)
    ]
    if not trials:
        return None
    return Plan(
        experiment=config.experiment,
        participant_id=participant_id,
        seed=seed,
        order_row=None,
        trials=tuple(trials),
        practice=True,
    )


def _session(design: Design, session: int, method: str, *, ways: list[Direction], instructed: list[str]) -> list[Trial]:
    """The trials of a session; `ways` has one direction a trial, `instructed` one instruction a set."""
    return [
        Trial(
            session=session,
            set=1 + place // design.trials_per_set,
            trial=1 + place,
            levels=condition(method=method, direction=way, instruction=instructed[place // design.trials_per_set]),
        )
        for place, way in enumerate(ways)
    ]


def _instructions(design: Design, seed: int, session: tuple[str, ...]) -> list[str]:
    """The instruction of each set: each equally often, in random order; empty where the design has none."""
    if not design.instructions:
        return [""] * design.sets_per_session
    each = design.sets_per_session // len(design.instructions)
    return Stream(seed, "instructions", *session).shuffled([*design.instructions] * each)


def _directions(design: Design, stream: Stream) -> list[Direction]:
    if design.balance == "session":
        return stream.shuffled(_ways(design.forward_per_session, design.backward_per_session))
    return [
        way
        for forward in _forward_by_set(design, stream)
        for way in stream.shuffled(_ways(forward, design.trials_per_set - forward))
    ]


def _forward_by_set(design: Design, stream: Stream) -> list[int]:
    """Forward trials of each set, as even as it gets; which sets have one more is random."""
    each, left = divmod(design.forward_per_session, design.sets_per_session)
    return stream.shuffled([each + 1] * left + [each] * (design.sets_per_session - left))


def _ways(forward: int, backward: int) -> list[Direction]:
    ways: list[Direction] = ["forward"] * forward
    return ways + ["backward"] * backward


def session(plan: Plan, setup: Setup[DirectionConfig]) -> Session:
    """The steps of a run, from the first hand-over to its end."""
    script = _Script(
        dampers={name: damper(setup.gun, name) for name in setup.config.methods},
        texts={name: setup.config.instruction_text(name) for name in ("", *setup.config.design.instructions)},
        question=setup.config.question.text,
        choices=ways(setup),
    )
    presenter = Presenter(script.steps)
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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Script:
    """What a presentation is made of: how hands set each method, what is told, what is asked."""

    dampers: Mapping[str, tuple[tuple[str, str], ...]]
    texts: Mapping[str, str]
    question: str
    choices: tuple[Choice, ...]

    def steps(self, trial: Trial, attempt: int) -> tuple[Step, ...]:
        told = self.texts[trial.instruction]
        return (
            Prepare(trial=trial, attempt=attempt, settings=self.dampers[trial.method], instruction=told),
            FireShot(trial=trial, attempt=attempt),
            Ask(trial=trial, question=QUESTION, text=self.question, choices=self.choices),
        )


QUESTION = "response"
"""The name of what is asked, which is its column."""


def ways(setup: Setup[DirectionConfig]) -> tuple[Choice, ...]:
    """The two answers; the participant's own keys are the arrows up and down."""
    question = setup.config.question
    labels = {"forward": question.forward, "backward": question.backward}
    return choices_of(labels, {"forward": "up", "backward": "down"})


def rows(plan: Plan, history: History) -> list[Row]:
    """One row a planned trial, in order; what was not reached is empty."""
    return [
        {
            "participant_id": plan.participant_id,
            "experiment": plan.experiment,
            "session": trial.session,
            "method": trial.method,
            "set": trial.set,
            "trial": trial.trial,
            "direction": trial.direction,
            **_answer(trial, events),
            **_marked(presentation(events, Fired), events),
            "instruction": trial.instruction,
        }
        for trial, events in by_trial(plan.trials, history).items()
    ]


def _answer(trial: Trial, events: TrialHistory) -> Row:
    """The answer that counts: the last one given, or what it was corrected to, whose time is not the participant's."""
    entered, given = events.entered(QUESTION), events.last(Answered)
    if given is None:
        return {}
    counts = entered[-1]
    return {
        "response": counts.value,
        "correct": int(counts.value == trial.direction),
        "response_time_s": given.response_time_s,
        "response_source": given.by if counts is given else "experimenter",
        "response_time_valid": int(bool(given.response_time_valid) and counts is given),
    }


def _marked(row: Row, events: TrialHistory) -> Row:
    """A presentation whose answer came sooner than anybody reacts is marked: it was kept, and it was guessed."""
    given = events.last(Answered)
    if given is None or given.by != "participant" or (given.response_time_s or 0.0) >= ANTICIPATION_S:
        return row
    return row | {"flags": " ".join(filter(None, (str(row["flags"]), "anticipation")))}
