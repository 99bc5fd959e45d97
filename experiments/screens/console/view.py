"""What the console shows of a live run. Pure: no Qt, no clock.

Neither correctness nor a score is in here. The method's name appears only where a damper is set by hand, else a code.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from device import GunStatus
from experiments.entries import entries, trial_at, value
from experiments.plan import Plan, Trial
from experiments.remarks import (
    AnswerCorrected,
    DescriptionCorrected,
    Flagged,
    Noted,
    RatingCorrected,
    Remark,
)
from experiments.screens import texts
from experiments.screens.console.messages import Ended, GunSeen, ParticipantSeen
from experiments.setup import Setup
from experiments.states import Position, State
from experiments.steps import Answered, Ask, Describe, Outcome, Prepare, Present, Rate, Repeat, Rest, Step
from experiments.tables import Told

STRIP = 40
"""So many response times are shown at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class About:
    """What does not change during a run.

    `band` says that it is a practice or a training; `participant_rates` and `participant_keys` what the participant
    does on a screen of their own.
    """

    setup: Setup[Any]
    plan: Plan
    band: str = ""
    last: str = "Thank the participant."
    simulated: bool = False
    participant_rates: bool = False
    participant_keys: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """Everything that is looked at to be shown."""

    about: About
    position: Position = field(default_factory=Position)
    told: Told = ()
    gun: GunSeen | None = None
    participant: ParticipantSeen | None = None
    ended: Ended | None = None

    @property
    def here(self) -> Trial:
        """The trial at hand, whatever is corrected."""
        return trial_at(self.about.plan, self.told, self.position.step)


@dataclass(frozen=True, slots=True, kw_only=True)
class Instruction:
    """What to do now: a line in the largest type, the damper in large type, what belongs to it, and a mood.

    The mood chooses the colour; the words say it as well.
    """

    title: str
    damper: str = ""
    detail: str = ""
    mood: str = "act"


def code(plan: Plan, trial: Trial) -> str:
    """The name under which the experimenter meets a method: A, B, C in the order of the run."""
    return f"Method {chr(ord('A') + plan.methods.index(trial.method))}"


def method_text(about: About, trial: Trial) -> str:
    """The method's name where its damper is set by hand, else its code."""
    method = about.setup.gun.methods[trial.method]
    return method.label if method.damper else code(about.plan, trial)


def place_text(seen: Seen) -> str:
    """Where the run stands: trial, set, session."""
    place = texts.place_text(seen.about.plan, seen.here)
    return f"{place} ({method_text(seen.about, seen.here)})" if seen.about.plan.trials[-1].session > 1 else place


def bands(seen: Seen) -> list[tuple[str, str]]:
    """What must not be overlooked, each with its colour's name."""
    found = [(seen.about.band, "practice")] if seen.about.band else []
    if seen.about.simulated:
        found.append(("SIMULATED GUN – nothing is felt", "simulated"))
    return found


def instruction(seen: Seen, now_s: float) -> Instruction:
    """What to do now."""
    if seen.ended is not None:
        return _end(seen.about, seen.ended)
    return _OF_STATE[seen.position.state](seen, now_s)


def _end(about: About, ended: Ended) -> Instruction:
    safe = "" if ended.saved is None else f"Read back from the disk: {_answers(ended.saved)}, all that were given. "
    close = "Q closes this window."
    if ended.reason is None:
        return Instruction(title="Finished", detail=f"{safe}{about.last}\n{close}", mood="good")
    resumed = "" if ended.saved is None else f"{safe}The run can be resumed."
    detail = "\n".join(filter(None, (_sentence(ended.reason), resumed, close)))
    return Instruction(title="Stopped", detail=detail, mood="bad")


def _sentence(why: str) -> str:
    """A reason as a sentence of its own; a path at its beginning stays as it is.

    >>> _sentence("the gun is gone"), _sentence("results/a.jsonl: the journal was deleted")
    ('The gun is gone.', 'results/a.jsonl: the journal was deleted.')
    """
    first = why if "/" in why.split(" ", 1)[0] else f"{why[:1].upper()}{why[1:]}"
    return first if first.endswith((".", "!", "?")) else f"{first}."


def _answers(count: int) -> str:
    return f"{count} answer{'' if count == 1 else 's'}"


def _moment(seen: Seen, now_s: float) -> Instruction:
    del seen, now_s
    return Instruction(title="One moment", mood="wait")


def _firing(seen: Seen, now_s: float) -> Instruction:
    del seen, now_s
    return Instruction(title="Firing", detail="F12 stops it at once.", mood="wait")


def _rearming(seen: Seen, now_s: float) -> Instruction:
    del seen, now_s
    return Instruction(
        title="There was an emergency stop.\nStand clear.",
        detail="Put the gun where it hurts nobody, then hold T for a second: a test shot, then the run goes on.",
        mood="bad",
    )


def _turned(seen: Seen, *, damper: str, then: str) -> Instruction:
    step = seen.position.step
    if not isinstance(step, Prepare):
        return _moment(seen, 0.0)
    again = texts.again_text(seen.told, step)
    told = texts.read_out_text(seen.about.plan, step).strip()
    return Instruction(
        title=f"Turn the gun to {step.trial.direction.upper()}\nand hand it over",
        damper=damper.format(damper=step.damper.upper(), method=method_text(seen.about, step.trial)),
        detail="\n".join(filter(None, (told, again, then))),
    )


def _setting(seen: Seen, now_s: float) -> Instruction:
    del now_s
    return _turned(seen, damper="Set the damper {damper} ({method})", then="Confirm the damper with M.")


def _preparing(seen: Seen, now_s: float) -> Instruction:
    del now_s
    step = seen.position.step
    damper = "Damper {damper} ({method})" if isinstance(step, Prepare) and step.damper else ""
    return _turned(seen, damper=damper, then="Then fire with Space.")


def _train(seen: Seen, now_s: float) -> Instruction:
    del now_s
    least_s = seen.position.step.least_exposure_s if isinstance(seen.position.step, Present) else 0.0
    after = f", not before {least_s:g}\N{NO-BREAK SPACE}s" if least_s else ""
    return Instruction(
        title="Wait for “next”",
        detail=f"The gun goes on firing until then. Press Space when the participant says it{after}.",
        mood="ask",
    )


def _asking(seen: Seen, now_s: float) -> Instruction:
    del now_s
    step = seen.position.step
    question = step.question if isinstance(step, Ask) else ""
    own = "Awaited: the participant's own key, UP for forward or DOWN for backward.\nF or B enters it for them."
    detail = own if seen.about.participant_keys else "Enter what the participant says: F or B."
    return Instruction(title=question, detail=detail, mood="ask")


def _rating(seen: Seen, now_s: float) -> Instruction:
    del now_s
    step = seen.position.step
    if not isinstance(step, Rate | Describe):
        return _moment(seen, 0.0)
    own = (
        "\nAwaited: the participant's rating on their own screen, or type it here."
        if seen.about.participant_rates
        else ""
    )
    detail = f"{step.question}{own if isinstance(step, Rate) else ''}"
    return Instruction(title=texts.ordinal(seen.about.plan, step.trial), detail=detail, mood="ask")


def _resting(seen: Seen, now_s: float) -> Instruction:
    until_s, step = seen.position.until_s, seen.position.step
    left_s = max(0, round((now_s if until_s is None else until_s) - now_s))
    between = step.between if isinstance(step, Rest) else ""
    return Instruction(
        title=f"Break: {left_s} s", detail=f"Between {between}. It ends by itself with a tone.", mood="rest"
    )


def _closing(seen: Seen, now_s: float) -> Instruction:
    del seen, now_s
    return Instruction(
        title="Everything is answered",
        detail="Is there anything to correct, to note or to flag? Enter ends the run.",
        mood="good",
    )


def _paused(seen: Seen, now_s: float) -> Instruction:
    del now_s
    if seen.position.why:
        detail = f"{_sentence(seen.position.why)}\nS starts it again. P goes on without it: you enter the answers."
    else:
        detail = "The gun is disarmed, and nothing goes on. P goes on."
    return Instruction(title="Paused", detail=detail, mood="wait")


def _correcting(seen: Seen, now_s: float) -> Instruction:
    del now_s
    entry = seen.position.correcting
    if entry is None:
        return _moment(seen, 0.0)
    how = {
        "answer": "Enter what the participant said: F or B.",
        "rating": "Type what the participant said, Enter saves; Ctrl+X for no answer.",
        "description": "Type the participant's words; Enter saves.",
    }[entry.what]
    further = "Ctrl+U" if entry.what != "answer" else "U"
    return Instruction(
        title=f"Correct the {entry.what}",
        damper=texts.place_text(seen.about.plan, entry.trial),
        detail=f"It was entered as {texts.value_text(value(seen.told, entry))}. {how}\n"
        f"{further} goes further back, Esc leaves it.",
        mood="ask",
    )


def _halted(seen: Seen, now_s: float) -> Instruction:
    del now_s
    status = None if seen.gun is None else seen.gun.status
    if status is not None and status.state == "disarmed":
        gun = "The gun itself says that it is disarmed."
    else:
        gun = "The gun does not say that it is disarmed: SWITCH OFF ITS POWER."
    return Instruction(
        title="EMERGENCY STOP",
        damper=gun,
        detail="Nothing fires in this run any more. Y says why, Q closes it. Resumed, it begins with a test shot.",
        mood="bad",
    )


_OF_STATE: dict[State, Callable[[Seen, float], Instruction]] = {
    State.SAVING: _moment,
    State.REARMING: _rearming,
    State.SETTING: _setting,
    State.PREPARING: _preparing,
    State.FIRING: _firing,
    State.TRAIN: _train,
    State.ASKING: _asking,
    State.RATING: _rating,
    State.DESCRIBING: _rating,
    State.RESTING: _resting,
    State.CLOSING: _closing,
    State.PAUSED: _paused,
    State.CORRECTING: _correcting,
    State.HALTED: _halted,
    State.STOPPED: _moment,
}


def coming(seen: Seen, count: int = 3) -> list[str]:
    """The next few things to do after the trial at hand."""
    step = seen.position.step
    if isinstance(step, Rate | Describe):
        return _still_to_rate(seen, step)[:count]
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
    return [f"break of {seconds:g} s"] if seconds else []


def answers(seen: Seen) -> list[str]:
    """What was entered in the set at hand, as it counts now."""
    return [texts.entry_text(seen.about.plan, seen.told, entry) for entry in entries(seen.told, seen.here)]


def marks(seen: Seen) -> list[str]:
    """Flags, notes, corrections and repeats of the set at hand, in order."""
    here = seen.here
    found = [_mark(step, word) for step, word in seen.told if (trial := _about(step, word)) and _same_set(trial, here)]
    return list(filter(None, found)) or ["Nothing was flagged, noted, corrected or repeated in this set."]


def _about(step: Step | None, word: Outcome | Remark) -> Trial | None:
    return word.trial if isinstance(word, Repeat) or (step is None and hasattr(word, "trial")) else None


def _same_set(one: Trial, other: Trial) -> bool:
    return (one.session, one.set) == (other.session, other.set)


def _mark(step: Step | None, word: Outcome | Remark) -> str:
    del step
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
