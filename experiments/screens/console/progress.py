"""How far a run is, and when it will end: from the plan, and ever more from the trials that were measured."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from itertools import pairwise

from device import GunStatus
from experiments.design.plan import Trial
from experiments.design.stimuli import settings
from experiments.screens import texts
from experiments.screens.console.view import About, GunSeen, Seen
from experiments.session import steps
from experiments.session.history import History, answered, done, entries, of_one_set
from experiments.session.remarks import EntryCorrected, Flagged, Noted, Remark
from experiments.session.states import Position, State
from experiments.session.steps import Outcome, Step

PRIOR_TRIALS = 5
"""The plan counts as much as so many measured trials, so that the estimate does not jump with the first."""

ROUGH_S = 1200.0
"""With more than this still to go, the end is told to five minutes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialCount:
    """How many trials are done of those planned, and of what."""

    what: str
    count: int
    planned: int


def trials_done(seen: Seen) -> list[TrialCount]:
    """How far the run is, seen from the current trial.

    Trials of the set, of the session and of the experiment; where all are rated after all were felt, felt and rated.
    """
    felt, trials, here = done(seen.told), seen.about.plan.trials, seen.here
    if seen.about.rated_last:
        return [_count("felt", trials, felt), _count("rated", trials, answered(seen.told))]
    session = [trial for trial in trials if trial.session == here.session]
    parts = {"set": [trial for trial in session if of_one_set(trial, here)], "session": session, "experiment": trials}
    return [_count(what, trials, felt) for what, trials in parts.items()]


def _count(what: str, trials: Sequence[Trial], finished: Collection[Trial | None]) -> TrialCount:
    return TrialCount(what=what, count=sum(trial in finished for trial in trials), planned=len(trials))


@dataclass(slots=True)
class RunTiming:
    """Measures how long trials take, without the time of pauses."""

    began_s: float | None = None
    measured_s: list[float] = field(default_factory=list)
    _trial_s: float | None = None
    _paused_s: float = 0.0
    _pause_began_s: float | None = None

    def at(self, position: Position, now_s: float) -> None:
        """Take a new position."""
        if self.began_s is None and position.step is not None:
            self.began_s = now_s
        if position.state in (State.SETTING, State.PREPARING) and self._trial_s is None:
            self._trial_s, self._paused_s = now_s, 0.0
        if position.paused_s is not None:
            self._pause_began_s = position.paused_s
        elif self._pause_began_s is not None:
            self._paused_s += now_s - self._pause_began_s
            self._pause_began_s = None

    def saved(self, word: Outcome | Remark, now_s: float) -> None:
        """Take what was saved: a trial is over with its answer, or with its stimulus where answers come at the end."""
        if isinstance(word, steps.Answered | steps.Presented) and self._trial_s is not None:
            self.measured_s.append(now_s - self._trial_s - self._paused_s)
        if isinstance(word, steps.Answered | steps.Presented | steps.Rested):
            self._trial_s = None

    def elapsed_s(self, now_s: float) -> float:
        """How long the run has been under way; 0 before it begins."""
        return 0.0 if self.began_s is None else now_s - self.began_s

    def trial_s(self, planned_s: float) -> float:
        """How long a trial takes: the mean of those measured and of `PRIOR_TRIALS` as planned."""
        return (PRIOR_TRIALS * planned_s + sum(self.measured_s)) / (PRIOR_TRIALS + len(self.measured_s))


def remaining_s(seen: Seen, progress: RunTiming) -> float:
    """Seconds still to go: trials left, breaks left, what is left of this one, and the ratings still to come."""
    config, planned = seen.about.setup.config, len(seen.about.plan.trials)
    left = planned - len(done(seen.told))
    ratings_s = max(0, planned - len(answered(seen.told))) * config.rating_s
    return float(left * progress.trial_s(config.trial_s) + _breaks_left_s(seen) + ratings_s)


def _breaks_left_s(seen: Seen) -> float:
    position = seen.position
    taken_s = sum(
        step.duration_s for step, word in seen.told if isinstance(step, steps.Rest) and isinstance(word, steps.Rested)
    )
    trials = seen.about.plan.trials
    left_s = sum(_break_s(seen.about, before, trial) for before, trial in pairwise(trials)) - taken_s
    if position.base is State.RESTING and position.until_s is not None and isinstance(position.step, steps.Rest):
        since_s = seen.now_s if position.paused_s is None else position.paused_s
        left_s -= position.step.duration_s - max(0.0, position.until_s - since_s)
    return max(0.0, left_s)


def end_text(left_s: float, now: datetime) -> str:
    """When a run ends, as a time of day: to five minutes if it is far.

    >>> end_text(3000.0, datetime(2026, 11, 22, 13, 43, 20)), end_text(300.0, datetime(2026, 11, 22, 13, 43, 20))
    ('about 14:35', 'about 13:48')
    """
    end, grain_s = now + timedelta(seconds=left_s), 300 if left_s > ROUGH_S else 60
    midnight = end.replace(hour=0, minute=0, second=0, microsecond=0)
    grains = round((end - midnight).total_seconds() / grain_s)
    return f"about {midnight + timedelta(seconds=grains * grain_s):%H:%M}"


def clock_text(seconds: float) -> str:
    """Minutes and seconds, hours where there are some.

    >>> clock_text(75), clock_text(3725)
    ('1:15', '1:02:05')
    """
    whole = max(0, round(seconds))
    minutes, rest = divmod(whole, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


STRIP = 40
"""So many response times are shown at most."""


def coming(seen: Seen, count: int = 3) -> list[str]:
    """The next few things to do after the trial at hand; after an emergency stop, or at the end, nothing is."""
    step = seen.position.step
    if seen.ended is not None or seen.position.base is State.HALTED:
        return []
    if isinstance(step, steps.Rate | steps.Describe) and step.later:
        return _still_to_rate(seen, step)[:count]
    if isinstance(step, steps.Close):
        return ["the end"]
    trials, here = seen.about.plan.trials, seen.here
    after = trials.index(here) + 1
    lines: list[str] = []
    for before, trial in zip(trials[after - 1 :], trials[after : after + count], strict=False):
        if lines or not isinstance(step, steps.Rest):  # a break that is taken now is not still to come
            lines += _break_between(seen.about, before, trial)
        lines += _to_do(seen.about, before, trial)
    if len(lines) < count and seen.about.rated_last:
        lines.append("ratings and descriptions")
    return lines[:count] or ["the end"]


def _to_do(about: About, before: Trial, trial: Trial) -> list[str]:
    wanted, was = _set_by_hand(about, trial), _set_by_hand(about, before)
    told = [f"instruction: {trial.instruction}"] if trial.instruction and about.plan.opens_set(trial) else []
    changed = "".join(f", {name.upper()} {value.upper()}" for name, value in wanted.items() if was.get(name) != value)
    return [*told, f"{trial.direction.upper()}{changed}"]


def _set_by_hand(about: About, trial: Trial) -> dict[str, str]:
    """What is set by hand for a trial, or for its first interval."""
    return dict(settings(about.setup.config, about.setup.gun, trial.levels_at(0) or trial.levels))


def _still_to_rate(seen: Seen, step: steps.Rate | steps.Describe) -> list[str]:
    plan = seen.about.plan
    lines = ["its description"] if isinstance(step, steps.Rate) else []
    later = plan.trials[plan.trials.index(step.trial) + 1 :]
    return [*lines, *(f"rating: {texts.ordinal(plan, trial)}" for trial in later), "the end"]


def _break_between(about: About, before: Trial, trial: Trial) -> list[str]:
    seconds = _break_s(about, before, trial)
    return [f"break of {texts.duration_text(seconds)}"] if seconds else []


def _break_s(about: About, before: Trial, trial: Trial) -> float:
    """How long the break between two trials is; 0 without one."""
    breaks = about.setup.config.breaks
    if (before.session, before.set) == (trial.session, trial.set):
        return 0.0
    return float(breaks.between_sets_s if before.session == trial.session else breaks.between_sessions_s)


def answer_lines(seen: Seen) -> list[str]:
    """What was entered in the set at hand, as it counts now."""
    return [texts.entry_text(seen.about.plan, seen.told, entry) for entry in entries(seen.told, seen.here)]


def marks(seen: Seen) -> list[str]:
    """Flags, notes, corrections and repeats of the set at hand, in order."""
    here = seen.here
    found = [
        _mark(seen.told, word) for step, word in seen.told if (trial := _about(step, word)) and _same_set(trial, here)
    ]
    return list(filter(None, found)) or ["Nothing was flagged, noted, corrected or repeated in this set."]


def _about(step: Step | None, word: Outcome | Remark) -> Trial | None:
    return word.trial if isinstance(word, steps.Repeated) or (step is None and hasattr(word, "trial")) else None


def _same_set(one: Trial, other: Trial) -> bool:
    return (one.session, one.set) == (other.session, other.set)


def _mark(told: History, word: Outcome | Remark) -> str:
    match word:
        case Flagged():
            return f"Trial {word.trial.trial}: flagged {word.flag}"
        case Noted(trial=Trial() as trial):
            return f"Trial {trial.trial}: “{word.text}”"
        case EntryCorrected():
            return f"Trial {word.trial.trial}: {texts.corrected_text(told, word)}"
        case steps.Repeated():
            return f"Trial {word.trial.trial}: to be presented again ({word.reason})"
        case _:
            return ""


def gun_text(seen: GunSeen | None) -> tuple[str, str]:
    """The gun's state in words, and a word that chooses the colour."""
    if seen is None:
        return "Gun: not seen yet", "wait"
    status: GunStatus | None = seen.status
    if status is None or status.fault:
        return f"Gun: FAULT – {seen.fault or (status.fault if status else '')}", "bad"
    mood = {"armed": "act", "resetting": "wait", "disarmed": "good", "fault": "bad"}[status.state]
    return f"Gun: {status.state}\n{texts.shots_text(status.shots)} · coil {status.coil_temperature_C:.0f} °C", mood


def focus_text(seen: Seen, *, here: bool) -> tuple[str, str]:
    """Whose the keys are, and a word that chooses the colour; empty where nothing else could have them."""
    if here:
        return ("Keys: this window", "good") if seen.participant is not None else ("", "good")
    if seen.participant is not None and seen.participant.focused:
        return "Keys: the participant's screen (F12 works there)", "wait"
    return "Keys: ANOTHER WINDOW – click here", "bad"


def own_times_s(seen: Seen) -> list[float]:
    """The participant's own response times of this session, in order: by their own hand alone."""
    times = [
        (step.trial, word.response_time_s)
        for step, word in seen.told
        if isinstance(step, steps.Ask) and isinstance(word, steps.Answered)
        if word.response_time_valid and word.response_time_s is not None
    ]
    return [time_s for trial, time_s in times if trial.session == seen.here.session][-STRIP:]
