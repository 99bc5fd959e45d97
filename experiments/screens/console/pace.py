"""How far a run is, and how long it still takes: from the trials that were measured, not from the plan alone."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from experiments.config import ExperimentConfig
from experiments.plan import Plan, Trial


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """Trials done of planned: in the set, in the session, in the experiment."""

    in_set: tuple[int, int]
    in_session: tuple[int, int]
    in_all: tuple[int, int]


def progress(plan: Plan, done: set[Trial], current: Trial) -> Progress:
    """How far the run is, seen from the current trial."""

    def count(trials: Sequence[Trial]) -> tuple[int, int]:
        return sum(trial in done for trial in trials), len(trials)

    session = [trial for trial in plan.trials if trial.session == current.session]
    return Progress(
        in_set=count([trial for trial in session if trial.set == current.set]),
        in_session=count(session),
        in_all=count(plan.trials),
    )


def remaining_s(config: ExperimentConfig, trials_left: int, measured_s: Sequence[float], break_left_s: float) -> float:
    """Seconds still to go: the trials left at the median of those measured, and the breaks left.

    Before anything was measured, a trial takes what the config plans.

    >>> from experiments.load import load_setup
    >>> remaining_s(load_setup("direction").config, 10, [20.0, 18.0, 90.0], 20.0)
    220.0
    """
    trial_s = statistics.median(measured_s) if measured_s else planned_trial_s(config)
    return trials_left * trial_s + break_left_s


def planned_trial_s(config: ExperimentConfig) -> float:
    """What the config plans for a trial, breaks apart."""
    return float((config.duration_s - config.break_s) / config.design.trials)  # type: ignore[attr-defined]


def clock_text(seconds: float) -> str:
    """Minutes and seconds, hours where there are some.

    >>> clock_text(75), clock_text(3725)
    ('1:15', '1:02:05')
    """
    whole = max(0, round(seconds))
    minutes, rest = divmod(whole, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
