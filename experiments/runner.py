"""The one loop that carries steps out: it tells the journal, waits for what the live run takes, and uses the gun.

Console, terminal and synthetic participant differ only in the `Screen` that is shown the run and offers events to it.
"""

from __future__ import annotations

import math

from device.words import Identity
from experiments.design.plan import Trial
from experiments.desk import Desk, DeskGun, disarm
from experiments.live_run import RunStopped
from experiments.record.replay import RunPosition
from experiments.session import events, steps
from experiments.session.history import trial_at
from experiments.session.states import State
from experiments.tasks.questions import on_scale

MAX_FAILURES = 3
"""Failures of the gun in a row after which a run stops and can be resumed."""


class Unforeseen(TypeError):  # noqa: N818 - a fault of the program
    """The table took an event for a step that knows none of its kind."""


def gun_name(identity: Identity) -> str:
    """Who renders, as the tables say it: `simulated`, or model and serial number."""
    return identity.model if identity.model == identity.serial else f"{identity.model}:{identity.serial}"


def carry_out(session: steps.Session, desk: Desk, position: RunPosition) -> None:
    """Carry out a session from where it stands to its end.

    `RunStopped`, `JournalError` and interrupts pass through; whatever happens, the gun is disarmed. After an emergency
    stop the run stays where it is until it is closed, also if the gun does not answer.
    """
    try:
        _Runner(session, desk).carry_out(position)
    except RunStopped as stop:
        if desk.live.position.base is not State.HALTED:
            raise
        raise RunStopped(desk.live.stay_halted()) from stop
    finally:
        session.close()
        disarm(desk.live.gun)


class _Runner:
    """A session that is being carried out, and what one step leaves to the next."""

    def __init__(self, session: steps.Session, desk: Desk) -> None:
        self._session, self._desk, self._live = session, desk, desk.live
        self._stimulus = DeskGun(desk)
        self._failures, self._onset_s = 0, math.nan
        self._set: dict[str, str] = {}
        """What was set by hand in this sitting; unknown at its beginning."""

    def carry_out(self, position: RunPosition) -> None:
        step = position.step
        if position.halted:
            self._rearm(trial_at(self._live.plan, position.history, step))
        while step is not None:
            self._live.journal.append("step", body=steps.step_record(step))
            outcome = self._do(step)
            self._live.journal.append("outcome", body=steps.step_record(outcome), **self._shown())
            self._live.keep(step, outcome)
            self._count(outcome)
            step = steps.step_after(self._session, outcome)

    def _shown(self) -> dict[str, float]:
        """When the step was painted, where that is known."""
        return {} if self._live.shown_s is None else {"shown_s": self._live.shown_s}

    def _count(self, outcome: steps.Outcome) -> None:
        if isinstance(outcome, steps.Prepared):
            return
        self._failures = self._failures + 1 if isinstance(outcome, steps.Failed) else 0
        if isinstance(outcome, steps.Failed) and self._failures == MAX_FAILURES:
            raise RunStopped(f"the gun failed {MAX_FAILURES} times in a row, last: {outcome.cause}")

    def _do(self, step: steps.Step) -> steps.Outcome:  # noqa: C901, PLR0911 - one case a step
        match step:
            case steps.Prepare():
                return self._prepare(step)
            case steps.FireShot():
                return self._fired(step)
            case steps.Ask():
                return self._ask(step)
            case steps.Inform():
                return self._inform(step)
            case steps.Rest():
                return self._rest(step)
            case steps.Present():
                return self._stimulus.present(step)
            case steps.Rate():
                return self._rate(step)
            case steps.Describe():
                return self._describe(step)
            case steps.Close():
                return self._close(step)

    # steps that wait for a person

    def _prepare(self, step: steps.Prepare) -> steps.Prepared | steps.Repeated:
        wanted = dict(step.settings)
        to_be_set = any(self._set.get(name) != value for name, value in wanted.items())
        if to_be_set:  # they may be set by now, or not: known again when that is said
            self._set = {name: value for name, value in self._set.items() if name not in wanted}
        self._live.enter(State.SETTING if to_be_set else State.PREPARING, step)
        while True:
            match self._live.wait():
                case events.DamperSet():
                    self._set |= wanted
                case events.Fire():
                    return steps.Prepared(settings=step.settings)
                case events.Repeat(reason=reason):
                    return self._repeat(reason)
                case other:
                    raise Unforeseen(other)

    def _ask(self, step: steps.Ask) -> steps.Answered | steps.Repeated:
        self._live.enter(State.ASKING, step)
        match self._live.wait():
            case events.Answer() | events.ParticipantKey() as answer:
                return self._answered(step, answer)
            case events.Repeat(reason=reason):
                return self._repeat(reason)
            case other:
                raise Unforeseen(other)

    def _answered(self, step: steps.Ask, answer: events.Answer | events.ParticipantKey) -> steps.Answered:
        """The answer with its time, which is the participant's own only by their own key, and without a pause.

        Of what was felt a while ago no time says anything.
        """
        if step.later:
            return steps.Answered(value=answer.response, by=answer.by)
        drawn_s = answer.response_time_s if isinstance(answer, events.Answer) else None
        key_time_s = None if answer.at_s is None else round(answer.at_s - self._onset_s, 6)
        time_s = drawn_s if drawn_s is not None else key_time_s
        if time_s is None:
            raise TypeError("an answer without a time")
        own = drawn_s is not None or isinstance(answer, events.ParticipantKey)
        paused = self._live.moment.paused_between(self._onset_s, self._onset_s + time_s)
        return steps.Answered(
            value=answer.response,
            by=answer.by,
            response_time_s=time_s,
            response_time_valid=own and not paused,
            key_time_s=key_time_s if drawn_s is not None else None,
        )

    def _inform(self, step: steps.Inform) -> steps.Informed | steps.Repeated:
        self._live.enter(State.INFORMING, step)
        match self._live.wait():
            case events.Told():
                return steps.Informed()
            case events.Repeat(reason=reason):
                return self._repeat(reason)
            case other:
                raise Unforeseen(other)

    def _rest(self, step: steps.Rest) -> steps.Rested | steps.Repeated:
        start_s = self._live.clock.now()
        self._live.enter(State.RESTING, step, until_s=start_s + step.duration_s)
        while True:
            match self._live.wait():
                case None:
                    self._live.offer(events.BreakOver())
                case events.BreakOver():
                    return self._rested(start_s, "")
                case events.EndBreak(reason=reason):
                    return self._rested(start_s, reason)
                case events.Repeat(reason=reason):
                    return self._repeat(reason)
                case other:
                    raise Unforeseen(other)

    def _rested(self, start_s: float, reason: str) -> steps.Rested:
        return steps.Rested(rested_s=round(self._live.clock.now() - start_s, 6), cut_reason=reason)

    def _rate(self, step: steps.Rate) -> steps.Answered | steps.Repeated:
        self._live.enter(State.RATING, step)
        match self._live.wait():
            case events.Rating(rating=rating, by=by) | events.ParticipantRated(rating=rating, by=by):
                return steps.Answered(value=None if rating is None else on_scale(rating, step), by=by)
            case events.Repeat(reason=reason):
                return self._repeat(reason)
            case other:
                raise Unforeseen(other)

    def _describe(self, step: steps.Describe) -> steps.Answered:
        self._live.enter(State.DESCRIBING, step)
        match self._live.wait():
            case events.Description(text=text, by=by) | events.ParticipantDescribed(text=text, by=by):
                return steps.Answered(value=text, by=by)
            case other:
                raise Unforeseen(other)

    def _close(self, step: steps.Close) -> steps.Closed | steps.Repeated:
        self._live.enter(State.CLOSING, step)
        match self._live.wait():
            case events.Finish():
                return steps.Closed()
            case events.Repeat(reason=reason):
                return self._repeat(reason)
            case other:
                raise Unforeseen(other)

    def _repeat(self, reason: str) -> steps.Repeated:
        trial = self._live.moment.repeatable
        if trial is None:
            raise TypeError("a repeat of no trial was taken")
        return steps.Repeated(trial=trial, reason=reason)

    # the gun

    def _fired(self, step: steps.FireShot) -> steps.Fired | steps.Failed | steps.Interrupted:
        outcome = self._stimulus.fire(step, self._onset_s + step.gap_s if step.gap_s else None)
        if isinstance(outcome, steps.Fired):
            self._onset_s = outcome.pulse_start_s
        return outcome

    def _rearm(self, trial: Trial) -> None:
        """After an emergency stop: a key held, and a test shot that the gun fires, before anything else."""
        while True:
            self._live.enter(State.REARMING)
            match self._live.wait():
                case events.Rearm(held_s=held_s):
                    if self._stimulus.test_shot(trial, held_s):
                        return
                case other:
                    raise Unforeseen(other)
