"""The plan of experiment 1: sessions of one method each, both directions balanced over a session or over its sets."""

from __future__ import annotations

from device.words import Direction
from experiments.design.orders import method_order
from experiments.design.plan import Plan, Trial
from experiments.design.streams import Stream
from experiments.direction.config import Design, DirectionConfig


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
            told=_instructions(design, seed, (*who, str(session))),
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
        Trial(session=1, method=method, set=1, trial=place, direction=way)
        for place, (method, way) in enumerate(zip(methods, ways, strict=True), start=1)
    ]
    if not trials:
        return None
    return Plan(
        experiment=config.experiment, participant_id=participant_id, seed=seed, order_row=None, trials=tuple(trials)
    )


def _session(design: Design, session: int, method: str, *, ways: list[Direction], told: list[str]) -> list[Trial]:
    """The trials of a session; `ways` has one direction a trial, `told` one instruction a set."""
    return [
        Trial(
            session=session,
            method=method,
            set=1 + place // design.trials_per_set,
            trial=1 + place,
            direction=way,
            instruction=told[place // design.trials_per_set],
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
