"""The plan of experiment 2: one trial a method, all in one direction."""

from __future__ import annotations

from experiments.design.orders import method_order
from experiments.design.plan import Plan, Trial
from experiments.design.streams import Stream
from experiments.preference.config import PreferenceConfig


def make_plan(config: PreferenceConfig, participant_id: str, seed: int, order_row: int | None) -> Plan:
    """The plan that a config, a participant, a seed and a row of the square make; the same for the same."""
    design = config.design
    stream = Stream(seed, "trial-order", config.experiment, participant_id)
    trials = [
        Trial(session=1, method=method, set=1, trial=place, direction=design.direction)
        for place, method in enumerate(method_order(design.order, design.methods, order_row, stream), start=1)
    ]
    return Plan(
        experiment=config.experiment,
        participant_id=participant_id,
        seed=seed,
        order_row=order_row,
        trials=tuple(trials),
    )
