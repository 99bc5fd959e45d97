"""What a procedure's table makes of a track that goes up and down: its rule, and where it may go."""

from __future__ import annotations

from itertools import pairwise

from experiments.design.procedures.config import KestenConfig, StepAs, UpDownConfig
from experiments.design.procedures.up_down import Kesten, LevelRange, TrackEnd, UpDown

NumericLevels = tuple[float, ...]
_OFF = 1e-9
"""So much the distance of two levels may be off, as a share."""


def walk_rule(table: UpDownConfig | KestenConfig, levels: NumericLevels, start: float) -> UpDown | Kesten:
    """The rule of a track that begins at a level."""
    within = level_range(levels, table.step_as)
    stop = TrackEnd(trials=table.trials, reversals=table.reversals, least=table.least_trials)
    if isinstance(table, KestenConfig):
        return Kesten(start=start, first_step=table.first_step, target=table.target, within=within, stop=stop)
    return UpDown(
        start=start, steps=table.steps, within=within, stop=stop, up=table.up, down=table.down, ratio=table.ratio
    )


def level_range(levels: NumericLevels, step_as: StepAs) -> LevelRange:
    """Where a walk may go: levels at even distances, lowest first."""
    grain = (levels[-1] - levels[0]) / (len(levels) - 1)
    return LevelRange(low=levels[0], high=levels[-1], grain=grain, factors=step_as == "factor")


def are_even(levels: NumericLevels) -> bool:
    """Whether levels stand at even distances, lowest first.

    >>> are_even((1.0, 1.5, 2.0)), are_even((1.0, 2.0, 4.0))
    (True, False)
    """
    steps = [after - before for before, after in pairwise(levels)]
    return bool(steps) and steps[0] > 0 and all(abs(step - steps[0]) <= _OFF * max(levels) for step in steps)
