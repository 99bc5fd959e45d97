"""What an experimenter looks for beside the instruction: what comes next, what was answered, the gun. Pure: no Qt."""

from __future__ import annotations

from device import GunStatus
from experiments.entries import entries
from experiments.plan import Trial
from experiments.remarks import (
    AnswerCorrected,
    DescriptionCorrected,
    Flagged,
    Noted,
    RatingCorrected,
    Remark,
)
from experiments.screens import texts
from experiments.screens.console.messages import GunSeen
from experiments.screens.console.view import About, Seen
from experiments.states import State
from experiments.steps import Answered, Ask, Close, Describe, Outcome, Rate, Repeat, Rest, Step

STRIP = 40
"""So many response times are shown at most."""


def coming(seen: Seen, count: int = 3) -> list[str]:
    """The next few things to do after the trial at hand; after an emergency stop, or at the end, nothing is."""
    step = seen.position.step
    if seen.ended is not None or seen.position.base is State.HALTED:
        return []
    if isinstance(step, Rate | Describe):
        return _still_to_rate(seen, step)[:count]
    if isinstance(step, Close):
        return ["the end"]
    trials, here = seen.about.plan.trials, seen.here
    after = trials.index(here) + 1
    lines: list[str] = []
    for before, trial in zip(trials[after - 1 :], trials[after : after + count], strict=False):
        if lines or not isinstance(step, Rest):  # a break that is taken now is not still to come
            lines += _break_between(seen.about, before, trial)
        lines += _to_do(seen.about, before, trial)
    if len(lines) < count and seen.about.setup.config.rating_s:
        lines.append("ratings and descriptions")
    return lines[:count] or ["the end"]


def _to_do(about: About, before: Trial, trial: Trial) -> list[str]:
    methods = about.setup.gun.methods
    damper, was = methods[trial.method].damper, methods[before.method].damper
    told = [f"instruction: {trial.instruction}"] if trial.instruction and about.plan.opens_set(trial) else []
    changed = f", DAMPER {damper.upper()}" if damper and damper != was else ""
    return [*told, f"{trial.direction.upper()}{changed}"]


def _still_to_rate(seen: Seen, step: Rate | Describe) -> list[str]:
    plan = seen.about.plan
    lines = ["its description"] if isinstance(step, Rate) else []
    later = plan.trials[plan.trials.index(step.trial) + 1 :]
    return [*lines, *(f"rating: {texts.ordinal(plan, trial)}" for trial in later), "the end"]


def _break_between(about: About, before: Trial, trial: Trial) -> list[str]:
    breaks = getattr(about.setup.config, "breaks", None)
    if breaks is None or (before.session, before.set) == (trial.session, trial.set):
        return []
    seconds = breaks.between_sets_s if before.session == trial.session else breaks.between_sessions_s
    return [f"break of {texts.duration_text(seconds)}"] if seconds else []


def answers(seen: Seen) -> list[str]:
    """What was entered in the set at hand, as it counts now."""
    return [texts.entry_text(seen.about.plan, seen.told, entry) for entry in entries(seen.told, seen.here)]


def marks(seen: Seen) -> list[str]:
    """Flags, notes, corrections and repeats of the set at hand, in order."""
    here = seen.here
    found = [_mark(word) for step, word in seen.told if (trial := _about(step, word)) and _same_set(trial, here)]
    return list(filter(None, found)) or ["Nothing was flagged, noted, corrected or repeated in this set."]


def _about(step: Step | None, word: Outcome | Remark) -> Trial | None:
    return word.trial if isinstance(word, Repeat) or (step is None and hasattr(word, "trial")) else None


def _same_set(one: Trial, other: Trial) -> bool:
    return (one.session, one.set) == (other.session, other.set)


def _mark(word: Outcome | Remark) -> str:
    match word:
        case Flagged():
            return f"Trial {word.trial.trial}: flagged {word.flag}"
        case Noted(trial=Trial() as trial):
            return f"Trial {trial.trial}: “{word.text}”"
        case AnswerCorrected():
            return f"Trial {word.trial.trial}: corrected to {word.response.upper()}"
        case RatingCorrected():
            return f"Trial {word.trial.trial}: rating corrected to {texts.value_text(word.rating)}"
        case DescriptionCorrected():
            return f"Trial {word.trial.trial}: description corrected"
        case Repeat():
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


def response_times(seen: Seen) -> list[float]:
    """The participant's own response times of this session, in order: by their own hand alone."""
    times = [
        (step.trial, word.response_time_s)
        for step, word in seen.told
        if isinstance(step, Ask) and isinstance(word, Answered) and word.response_time_valid
    ]
    return [time_s for trial, time_s in times if trial.session == seen.here.session][-STRIP:]
