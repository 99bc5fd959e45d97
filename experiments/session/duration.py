"""How long a run still takes: from its plan, and ever more from the trials that were measured. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime, timedelta
from itertools import pairwise

from experiments.design.config import DesignConfig
from experiments.design.plan import Plan, Trial
from experiments.session import steps
from experiments.session.history import History, answered, done
from experiments.session.remarks import Remark
from experiments.session.states import Position, State
from experiments.session.steps import Asking, Outcome, Step

PRIOR_TRIALS = 5
"""The plan counts as much as so many measured trials, so that the estimate does not jump with the first."""

ROUGH_S = 1200.0
"""With more than this still to go, the end is told to five minutes."""


@dataclass(slots=True)
class RunTiming:
    """Measures how long trials take, without the time of pauses, up to the last question that is asked at once."""

    began_s: float | None = None
    measured_s: list[float] = field(default_factory=list)
    _trial_s: float | None = None
    _is_measured: bool = False
    _paused_s: float = 0.0
    _pause_began_s: float | None = None

    def at(self, position: Position, now_s: float) -> None:
        """Take a new position."""
        if self.began_s is None and position.step is not None:
            self.began_s = now_s
        if position.state in (State.SETTING, State.PREPARING) and (self._trial_s is None or self._is_measured):
            self._trial_s, self._paused_s, self._is_measured = now_s, 0.0, False
        if position.paused_s is not None:
            self._pause_began_s = position.paused_s
        elif self._pause_began_s is not None:
            self._paused_s += now_s - self._pause_began_s
            self._pause_began_s = None

    def saved(self, step: Step | None, word: Outcome | Remark, now_s: float) -> None:
        """Take what was saved: a trial is over with its last answer, or its stimulus where answers come at the end."""
        answers = isinstance(word, steps.Answered) and isinstance(step, Asking) and not step.later
        if (answers or isinstance(word, steps.Presented)) and self._trial_s is not None:
            if self._is_measured:
                self.measured_s.pop()
            self.measured_s.append(now_s - self._trial_s - self._paused_s)
            self._is_measured = True
        if isinstance(word, steps.Rested):
            self._trial_s = None

    def elapsed_s(self, now_s: float) -> float:
        """How long the run has been under way; 0 before it begins."""
        return 0.0 if self.began_s is None else now_s - self.began_s

    def trial_s(self, planned_s: float) -> float:
        """How long a trial takes: the mean of those measured and of `PRIOR_TRIALS` as planned."""
        return (PRIOR_TRIALS * planned_s + sum(self.measured_s)) / (PRIOR_TRIALS + len(self.measured_s))


@dataclass(frozen=True, slots=True, kw_only=True)
class Ahead:
    """What tells how long a run still takes: its design and plan, what was done, and where it is at a time."""

    design: DesignConfig
    plan: Plan
    told: History
    position: Position
    now_s: float


def remaining_s(ahead: Ahead, timing: RunTiming) -> float:
    """Seconds still to go: trials left, breaks left, what is left of this one, and the ratings still to come."""
    design, planned = ahead.design, len(ahead.plan.trials)
    left = planned - len(done(ahead.told, design))
    later = sum(planned - len(answered(ahead.told, (name,))) for name in design.asked_later)
    ratings_s = later * design.question_s
    return float(left * timing.trial_s(design.trial_s) + _breaks_left_s(ahead) + ratings_s)


def _breaks_left_s(ahead: Ahead) -> float:
    position = ahead.position
    taken_s = sum(
        step.duration_s for step, word in ahead.told if isinstance(step, steps.Rest) and isinstance(word, steps.Rested)
    )
    trials = ahead.plan.trials
    left_s = sum(break_s(ahead.design, before, trial) for before, trial in pairwise(trials)) - taken_s
    if position.base is State.RESTING and position.until_s is not None and isinstance(position.step, steps.Rest):
        since_s = ahead.now_s if position.paused_s is None else position.paused_s
        left_s -= position.step.duration_s - max(0.0, position.until_s - since_s)
    return max(0.0, left_s)


def break_s(design: DesignConfig, before: Trial, trial: Trial) -> float:
    """How long the break between two trials is; 0 without one."""
    if (before.session, before.set) == (trial.session, trial.set):
        return 0.0
    breaks = design.breaks
    return float(breaks.between_sets_s if before.session == trial.session else breaks.between_sessions_s)


def end_text(left_s: float, now: datetime, *, at_most: bool = False) -> str:
    """When a run ends, as a time of day: to five minutes if it is far. `at_most`: adaptive tracks may be over sooner.

    >>> end_text(3000.0, datetime(2026, 11, 22, 13, 43, 20)), end_text(300.0, datetime(2026, 11, 22, 13, 43, 20))
    ('about 14:35', 'about 13:48')
    """
    end, grain_s = now + timedelta(seconds=left_s), 300 if left_s > ROUGH_S else 60
    midnight = end.replace(hour=0, minute=0, second=0, microsecond=0)
    grains = round((end - midnight).total_seconds() / grain_s)
    return f"{'by' if at_most else 'about'} {midnight + timedelta(seconds=grains * grain_s):%H:%M}"


def clock_text(seconds: float) -> str:
    """Minutes and seconds, hours where there are some.

    >>> clock_text(75), clock_text(3725)
    ('1:15', '1:02:05')
    """
    whole = max(0, round(seconds))
    minutes, rest = divmod(whole, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
