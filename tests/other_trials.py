"""A trial as another one: what is planned with other levels."""

from __future__ import annotations

from dataclasses import replace

from experiments.design.language import Level
from experiments.design.plan import Trial, condition


def with_levels(trial: Trial, **levels: Level) -> Trial:
    """The trial with other levels of some factors; without those whose level is empty."""
    return replace(trial, levels=condition(**(dict(trial.levels) | levels)))


def turned(trial: Trial) -> Trial:
    """The trial with the gun the other way round."""
    return with_levels(trial, direction="backward" if trial.direction == "forward" else "forward")
