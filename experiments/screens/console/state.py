"""What the console knows, built from the messages it was told; and what it shows of it. Pure: no Qt, no clock.

Neither correctness nor a score is in here. The method's name appears only where a damper is set by hand, else a code.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from device import GunStatus
from experiments.plan import Plan, Trial
from experiments.remarks import AnswerCorrected, RatingCorrected, Remark
from experiments.screens.console.messages import Began, Ended, GunSeen, Message, Saved, Waiting, Working
from experiments.screens.console.pace import Progress, progress, remaining_s
from experiments.setup import Setup
from experiments.steps import (
    Answered,
    Ask,
    Describe,
    Outcome,
    Prepare,
    Present,
    Presented,
    Rate,
    Rated,
    Rest,
    Rested,
    Step,
)


@dataclass(slots=True)
class State:
    """What the console knows at this moment."""

    setup: Setup[Any]
    plan: Plan
    told: list[tuple[Step | None, Outcome | Remark]] = field(default_factory=list)
    waiting: Waiting | None = None
    working: bool = False
    gun: GunSeen | None = None
    ended: Ended | None = None
    began_s: float | None = None
    trial_began_s: float | None = None
    measured_s: list[float] = field(default_factory=list)
    resumed_at: int = 0

    def elapsed_s(self, now_s: float) -> float:
        """How long the run has been under way; 0 before it begins."""
        return 0.0 if self.began_s is None else now_s - self.began_s

    def take(self, message: Message, now_s: float) -> None:
        """Take a message that came now."""
        match message:
            case Began():
                self.told = list(message.told)
                self.resumed_at = len(self.told)
                self.began_s = now_s
            case Waiting():
                self._wait(message)
            case Working():
                self.waiting, self.working = None, True
            case Saved():
                self._save(message, now_s)
            case GunSeen():
                self.gun = message
            case Ended():
                self.ended, self.waiting, self.working = message, None, False

    def _wait(self, message: Waiting) -> None:
        self.waiting, self.working = message, False
        if isinstance(message.step, Prepare) and self.trial_began_s is None:
            self.trial_began_s = message.since_s

    def _save(self, message: Saved, now_s: float) -> None:
        self.told.append((message.step, message.word))
        if isinstance(message.word, Answered | Presented) and self.trial_began_s is not None:
            self.measured_s.append(now_s - self.trial_began_s)
            self.trial_began_s = None
        if isinstance(message.word, Rested):
            self.trial_began_s = None

    @property
    def step(self) -> Step | None:
        """The step that waits for somebody."""
        return self.waiting.step if self.waiting else None

    @property
    def trial(self) -> Trial:
        """The trial at hand, or the last one that was."""
        if self.waiting is not None and not isinstance(self.waiting.step, Rest):
            return self.waiting.step.trial
        trials = [step.trial for step, _ in self.told if step is not None and not isinstance(step, Rest)]
        return trials[-1] if trials else self.plan.trials[0]

    def done(self) -> set[Trial]:
        """The trials that have their answer, or were presented where answers come at the end."""
        kind = Answered if self.plan.experiment == "direction" else Presented
        return {
            step.trial for step, word in self.told if isinstance(word, kind) and step and not isinstance(step, Rest)
        }

    def progress(self) -> Progress:
        """How far the run is."""
        return progress(self.plan, self.done(), self.trial)

    def remaining_s(self) -> float:
        """Seconds still to go, as far as can be told."""
        config, left = self.setup.config, len(self.plan.trials) - len(self.done())
        rested_s = sum(step.duration_s for step, _ in self.told if isinstance(step, Rest))
        return remaining_s(config, left, self.measured_s, max(0.0, config.break_s - rested_s))

    def answered_in_set(self) -> list[Trial]:
        """The trials of the set at hand that have an answer, in order: those that can be corrected or repeated."""
        here, done = self.trial, self.done()
        return [t for t in self.plan.trials if (t.session, t.set) == (here.session, here.set) and t in done]

    def rated(self) -> list[Trial]:
        """The trials that have a rating."""
        return [step.trial for step, word in self.told if isinstance(word, Rated) and isinstance(step, Rate)]

    def said(self, trial: Trial) -> str:
        """What the participant said of a trial, the last that counts, as text."""
        for step, word in reversed(self.told):
            if isinstance(word, AnswerCorrected | RatingCorrected) and word.trial == trial:
                return _words(word.response if isinstance(word, AnswerCorrected) else word.rating)
            if isinstance(word, Answered | Rated) and step and not isinstance(step, Rest) and step.trial == trial:
                return _words(word.response if isinstance(word, Answered) else word.rating)
        return ""


def _words(value: str | float | None) -> str:
    if value is None:
        return "no answer"
    return value.upper() if isinstance(value, str) else f"{value:g}"


def code(plan: Plan, trial: Trial) -> str:
    """The name under which the experimenter meets a method: A, B, C in the order of the run."""
    return f"Method {chr(ord('A') + plan.methods.index(trial.method))}"


def method_text(setup: Setup[Any], plan: Plan, trial: Trial) -> str:
    """The method's name where its damper is set by hand, else its code."""
    method = setup.gun.methods[trial.method]
    return method.label if method.damper else code(plan, trial)


@dataclass(frozen=True, slots=True, kw_only=True)
class Instruction:
    """What to do now: one line in the largest type, what belongs to it, and a word that chooses the colour."""

    title: str
    detail: str = ""
    mood: str = "act"


def instruction(state: State, now_s: float) -> Instruction:
    """What to do now."""
    if state.ended is not None:
        return _end(state.ended)
    if state.working:
        return Instruction(title="Firing", detail="Wait.", mood="wait")
    if state.waiting is None:
        return Instruction(title="One moment", mood="wait")
    return _of_step(state, state.waiting, now_s)


def _end(ended: Ended) -> Instruction:
    if ended.reason is None:
        return Instruction(
            title="Finished", detail="Every answer is saved. Thank the participant.\nQ closes this window.", mood="good"
        )
    safe = "Every answer up to here is saved, and the run can be resumed.\nQ closes this window."
    return Instruction(title="Stopped", detail=f"{ended.reason}\n{safe}", mood="bad")


def _of_step(state: State, waiting: Waiting, now_s: float) -> Instruction:
    step = waiting.step
    match step:
        case Prepare():
            return _prepare(state, step)
        case Ask():
            return Instruction(title=step.question, detail="Enter what the participant says: F or B.", mood="ask")
        case Rest():
            left_s = (waiting.until_s or now_s) - now_s
            return Instruction(
                title=f"Break: {max(0, round(left_s))} s",
                detail=f"Between {step.between}. It ends by itself with a tone.",
                mood="rest",
            )
        case Present():
            return Instruction(
                title="Wait for “next”",
                detail="The gun goes on firing until then. Press Space when the participant says it.",
                mood="ask",
            )
        case Rate() | Describe():
            return Instruction(title=ordinal(state, step.trial), detail=step.question, mood="ask")
        case _:
            return Instruction(title="Firing", detail="Wait.", mood="wait")


def _prepare(state: State, step: Prepare) -> Instruction:
    damper = f"Set the damper {step.damper.upper()} ({method_text(state.setup, state.plan, step.trial)}).\n"
    again = f"Presented again, for the {_nth(step.attempt)} time.\n" if step.attempt > 1 else ""
    return Instruction(
        title=f"Turn the gun to {step.trial.direction.upper()}\nand hand it over",
        detail=f"{_told(state, step)}{again}{damper if step.damper else ''}Then fire with Space.",
    )


def _told(state: State, step: Prepare) -> str:
    """What the participant is told: to be read out before a set, and as a reminder at its other trials."""
    if not step.instruction:
        return ""
    how = "READ OUT" if state.plan.opens_set(step.trial) else "Instruction"
    return f"{how}: “{step.instruction}”\n"


def ordinal(state: State, trial: Trial) -> str:
    """How a stimulus of experiment 2 is named: by its order of presentation, not by its method."""
    return f"Feedback {trial.trial} of {len(state.plan.trials)}"


def _nth(number: int) -> str:
    return {1: "first", 2: "second", 3: "third"}.get(number, f"{number}th")


def place_text(state: State) -> str:
    """Where the run stands: trial, set, session."""
    trial, found = state.trial, state.progress()
    sessions, sets = state.plan.trials[-1].session, max(t.set for t in state.plan.trials if t.session == trial.session)
    where = f"Trial {trial.trial} of {found.in_session[1]}"
    if sessions == 1:
        return where
    method = method_text(state.setup, state.plan, trial)
    return f"{where} · set {trial.set} of {sets} · session {trial.session} of {sessions} ({method})"


def coming(state: State, count: int = 3) -> list[str]:
    """The next few things to do after the trial at hand."""
    if state.ended is not None and state.ended.reason is None:
        return ["the end"]
    if isinstance(state.step, Rate | Describe):
        return _still_to_rate(state, state.step)[:count]
    trials = state.plan.trials
    after = trials.index(state.trial) + 1
    lines: list[str] = []
    for before, trial in zip(trials[after - 1 :], trials[after : after + count], strict=False):
        if lines or not isinstance(state.step, Rest):  # a break that is taken now is not still to come
            lines += _break_between(state, before, trial)
        if trial.instruction and state.plan.opens_set(trial):
            lines.append(f"instruction: {trial.instruction}")
        damper = state.setup.gun.methods[trial.method].damper
        lines.append(f"{trial.direction.upper()}{f', damper {damper.upper()}' if damper else ''}")
    if len(lines) < count and state.plan.experiment == "preference":
        lines.append("ratings and descriptions")
    return lines[:count] or ["the end"]


def _still_to_rate(state: State, step: Rate | Describe) -> list[str]:
    trials = state.plan.trials
    lines = ["its description"] if isinstance(step, Rate) else []
    return [*lines, *(f"rating: {ordinal(state, t)}" for t in trials[trials.index(step.trial) + 1 :]), "the end"]


def _break_between(state: State, before: Trial, trial: Trial) -> list[str]:
    breaks = getattr(state.setup.config, "breaks", None)
    if breaks is None or (before.session, before.set) == (trial.session, trial.set):
        return []
    seconds = breaks.between_sets_s if before.session == trial.session else breaks.between_sessions_s
    return [f"break of {seconds:g} s"] if seconds else []


def gun_text(seen: GunSeen | None) -> tuple[str, str]:
    """The gun's state in words, and a word that chooses the colour."""
    if seen is None:
        return "Gun: not seen yet", "wait"
    status: GunStatus | None = seen.status
    if status is None or status.fault:
        return f"Gun: FAULT – {seen.fault or (status.fault if status else '')}", "bad"
    mood = {"armed": "act", "resetting": "wait", "disarmed": "good", "fault": "bad"}[status.state]
    return f"Gun: connected, {status.state}\n{status.shots} shots · coil {status.coil_temperature_C:.0f} °C", mood
