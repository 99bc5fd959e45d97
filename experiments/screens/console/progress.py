"""How far a run is, and what comes next, as the console says it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

from device import GunStatus
from experiments.design.plan import Trial
from experiments.design.stimuli import settings
from experiments.screens import texts
from experiments.screens.console.view import About, Seen
from experiments.screens.phrases import phrase
from experiments.session import steps
from experiments.session.duration import break_s
from experiments.session.history import History, answered, done, entries, felt, of_one_set
from experiments.session.remarks import EntryCorrected, Flagged, Noted, Remark
from experiments.session.states import State
from experiments.session.steps import Outcome, Step


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
    design, trials, here = seen.about.setup.config, seen.about.plan.trials, seen.here
    if seen.about.rated_last:
        rated = answered(seen.told, design.judged_later)
        return [_count("felt", trials, felt(seen.told)), _count("rated", trials, rated)]
    finished = done(seen.told, design)
    session = [trial for trial in trials if trial.session == here.session]
    parts = {"set": [trial for trial in session if of_one_set(trial, here)], "session": session, "experiment": trials}
    return [_count(what, trials, finished) for what, trials in parts.items()]


def _count(what: str, trials: Sequence[Trial], finished: Collection[Trial | None]) -> TrialCount:
    return TrialCount(what=what, count=sum(trial in finished for trial in trials), planned=len(trials))


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
        return [phrase("the end")]
    trials, here = seen.about.plan.trials, seen.here
    after = [trial for trial in trials[trials.index(here) + 1 :] if trial.track not in seen.over][:count]
    lines: list[str] = []
    for before, trial in pairwise([here, *after]):
        if lines or not isinstance(step, steps.Rest):  # a break that is taken now is not still to come
            lines += _break_between(seen.about, before, trial)
        lines += _to_do(seen.about, before, trial)
    if len(lines) < count and seen.about.rated_last:
        lines.append(phrase("ratings and descriptions"))
    return lines[:count] or [phrase("the end")]


def _to_do(about: About, before: Trial, trial: Trial) -> list[str]:
    wanted, was = _set_by_hand(about, trial), _set_by_hand(about, before)
    told = (
        [phrase("instruction: {instruction}", instruction=trial.instruction)]
        if trial.instruction and about.plan.opens_set(trial)
        else []
    )
    changed = "".join(f", {name.upper()} {value.upper()}" for name, value in wanted.items() if was.get(name) != value)
    return [*told, f"{trial.direction.upper()}{changed}"]


def _set_by_hand(about: About, trial: Trial) -> dict[str, str]:
    """What is set by hand for a trial, or for its first interval."""
    return dict(settings(about.setup.config, about.setup.gun, trial.levels_at(0) or trial.levels))


def _still_to_rate(seen: Seen, step: steps.Rate | steps.Describe) -> list[str]:
    plan = seen.about.plan
    lines = [phrase("its description")] if isinstance(step, steps.Rate) else []
    later = plan.trials[plan.trials.index(step.trial) + 1 :]
    return [
        *lines,
        *(phrase("rating: {ordinal}", ordinal=texts.ordinal(plan, trial)) for trial in later),
        phrase("the end"),
    ]


def _break_between(about: About, before: Trial, trial: Trial) -> list[str]:
    seconds = break_s(about.setup.config, before, trial)
    return [phrase("break of {duration}", duration=texts.duration_text(seconds))] if seconds else []


def answer_lines(seen: Seen) -> list[str]:
    """What was entered in the set at hand, as it counts now."""
    return [texts.entry_text(seen.about.plan, seen.told, entry) for entry in entries(seen.told, seen.here)]


def marks(seen: Seen) -> list[str]:
    """Flags, notes, corrections and repeats of the set at hand, in order."""
    here = seen.here
    found = [
        _mark(seen.told, word) for step, word in seen.told if (trial := _about(step, word)) and _same_set(trial, here)
    ]
    return list(filter(None, found)) or [phrase("Nothing was flagged, noted, corrected or repeated in this set.")]


def _about(step: Step | None, word: Outcome | Remark) -> Trial | None:
    return word.trial if isinstance(word, steps.Repeated) or (step is None and hasattr(word, "trial")) else None


def _same_set(one: Trial, other: Trial) -> bool:
    return (one.session, one.set) == (other.session, other.set)


def _mark(told: History, word: Outcome | Remark) -> str:
    match word:
        case Flagged():
            return phrase("Trial {trial}: flagged {flag}", trial=word.trial.trial, flag=word.flag)
        case Noted(trial=Trial() as trial):
            return phrase("Trial {trial}: “{text}”", trial=trial.trial, text=word.text)
        case EntryCorrected():
            return phrase(
                "Trial {trial}: {corrected}", trial=word.trial.trial, corrected=texts.corrected_text(told, word)
            )
        case steps.Repeated():
            return phrase("Trial {trial}: to be presented again ({reason})", trial=word.trial.trial, reason=word.reason)
        case _:
            return ""


UNANSWERED_S = 2.0
"""What a gun said so long ago is not its state any more: it is asked five times a second."""


def gun_text(seen: Seen) -> tuple[str, str]:
    """The gun's state in words, and a word that chooses the colour."""
    said = seen.gun
    if said is None:
        return phrase("Gun: not seen yet"), "wait"
    status: GunStatus | None = said.status
    if status is None or status.fault:
        return phrase("Gun: FAULT – {fault}", fault=said.fault or (status.fault if status else "")), "bad"
    if seen.ended is not None and status.state != "disarmed":
        return phrase("Gun: not looked at any more"), "wait"
    if seen.ended is None and seen.now_s - said.asked_s > UNANSWERED_S:
        return phrase("Gun: no answer for {silent_s:.0f} s", silent_s=seen.now_s - said.asked_s), "wait"
    mood = {"armed": "act", "resetting": "wait", "disarmed": "good", "fault": "bad"}[status.state]
    return phrase(
        "Gun: {state}\n{shots} · coil {coil_temperature_C:.0f} °C",
        state=status.state,
        shots=texts.shots_text(status.shots),
        coil_temperature_C=status.coil_temperature_C,
    ), mood


def focus_text(seen: Seen, *, here: bool) -> tuple[str, str]:
    """Whose the keys are, and a word that chooses the colour; empty where nothing else could have them."""
    if here:
        return (phrase("Keys: this window"), "good") if seen.participant is not None else ("", "good")
    if seen.participant is not None and seen.participant.focused:
        return phrase("Keys: the participant's screen (F12 works there)"), "wait"
    return phrase("Keys: ANOTHER WINDOW – click here"), "bad"


def own_times_s(seen: Seen) -> list[float]:
    """The participant's own response times of this session, in order: by their own hand alone."""
    times = [
        (step.trial, word.response_time_s)
        for step, word in seen.told
        if isinstance(step, steps.Ask) and isinstance(word, steps.Answered)
        if word.response_time_valid and word.response_time_s is not None
    ]
    return [time_s for trial, time_s in times if trial.session == seen.here.session][-STRIP:]
