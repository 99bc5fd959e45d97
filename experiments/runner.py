"""The one loop that carries steps out: it tells the journal, waits for what the live run takes, and drives the gun.

Console, terminal and synthetic participant differ only in the `Screen` that is shown the run and offers events to it.
The gun is armed for a stimulus alone, and disarmed behind it. Whether a shot may be fired is looked at after the gun
was armed, and again just before it fires: what halts or holds the run is set before the gun is told to disarm. A
train's shots are asked for a little ahead, each for its own tick, and the gun waits for it by its own clock: neither
the line nor this machine delays them. Each is in the journal before the next is asked for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any, Literal, TypeVar

from device import DeviceError, Gun, LimitError, Shot, ShotReport
from experiments.design.plan import Trial
from experiments.design.stimuli import Stimuli
from experiments.live_run import Held, LiveRun, RunStopped
from experiments.record.replay import RunPosition
from experiments.record.tables import is_simulated
from experiments.session import events, steps
from experiments.session.history import trial_at
from experiments.session.remarks import Refused, TestShot
from experiments.session.states import State
from experiments.tasks.questions import on_scale


@dataclass(frozen=True, slots=True, kw_only=True)
class Desk:
    """All that carries steps out: the live run with its gun, and what that can fire."""

    live: LiveRun
    stimuli: Stimuli


_Recorded = TypeVar("_Recorded", steps.Fired, steps.TrainShot)


def _recorded(kind: type[_Recorded], report: ShotReport, **more: Any) -> _Recorded:
    """The record of a shot: all that its report says but the command, and more."""
    said = {one.name: getattr(report, one.name) for one in fields(ShotReport) if one.name != "shot"}
    return kind(**said, **more)


class Train:
    """A stimulus of several shots: each in the journal before the next is asked for."""

    def __init__(self, step: steps.Present, desk: Desk) -> None:
        self._step, self._desk, self._live = step, desk, desk.live
        self._onset_utc, self._onset_s, self._last_s = "", math.nan, math.nan
        self.shots = 0

    def began(self, onset_utc: str, first: ShotReport) -> None:
        """Take the first shot; `next` counts after the least exposure."""
        self._onset_utc, self._onset_s = onset_utc, first.pulse_start_s
        self._live.stimulus_begins(first.pulse_start_s, least_s=self._step.least_exposure_s)
        self.fired(first)

    def fired(self, report: ShotReport) -> None:
        """Have a shot on the disk."""
        self.shots, self._last_s = self.shots + 1, report.pulse_start_s
        shot = _recorded(steps.TrainShot, report, shot=self.shots)
        self._live.journal.append("shot", body=steps.step_record(shot))

    def due_s(self) -> float:
        """The next shot's tick, whole microseconds after the first; later if the magnet is not home by then."""
        # left out: ticks in a standstill, or too soon after a late shot: by half, as guns always late keep their rate
        every_us, begun_s = round(self._step.repeat_every_s * 1e6), self._onset_s
        earliest_s = max(self._live.clock.now() + LEAD_S, self._last_s + self._step.repeat_every_s / 2)
        tick_s = begun_s + math.ceil((earliest_s - begun_s) * 1e6 / every_us) * every_us / 1e6
        return max(tick_s, self._live.gun.status().ready_at_s)

    def presented(self, ended_by: Literal["next", "limit"]) -> steps.Presented:
        """The stimulus as it was felt to its end."""
        return steps.Presented(
            gun=self._live.gun_name,
            onset_utc=self._onset_utc,
            shots=self.shots,
            exposure_s=self._exposure_s(),
            ended_by=ended_by,
        )

    def interrupted(self) -> steps.Interrupted:
        """The stimulus as it was felt until a pause ended it."""
        if not self.shots:
            return steps.Interrupted(presented=False, cause="pause")
        return steps.Interrupted(presented=True, cause="pause", shots=self.shots, exposure_s=self._exposure_s())

    def _exposure_s(self) -> float:
        return round(self._live.clock.now() - self._onset_s, 6)


MAX_FAILURES = 3
"""Failures of the gun in a row after which a run stops and can be resumed."""


class Unforeseen(TypeError):  # noqa: N818 - a fault of the program
    """The table took an event for a step that knows none of its kind."""


def carry_out(session: steps.Session, desk: Desk, position: RunPosition) -> None:
    """Carry out a session from where it stands, at a step that the journal has, to its end.

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
        self._failures = 0
        self._onset_s: float | None = None
        self._set: dict[str, str] = {}
        """What was set by hand in this sitting; unknown at its beginning."""

    def carry_out(self, position: RunPosition) -> None:
        step = position.step
        if position.halted:
            self._rearm(trial_at(self._live.plan, position.history, step))
        while step is not None:
            outcome = self._do(step)
            self._live.keep(step, outcome)
            self._count(outcome)
            step = self._live.go_on(self._session, outcome)

    def _count(self, outcome: steps.Outcome) -> None:
        if isinstance(outcome, steps.Prepared):
            return
        self._failures = self._failures + 1 if isinstance(outcome, steps.Failed) else 0
        if isinstance(outcome, steps.Failed) and self._failures == MAX_FAILURES:
            raise RunStopped(
                f"the gun failed {MAX_FAILURES} times in a row, last: {outcome.cause}; before it goes on see to the "
                "gun's power and cable, and have `recoil doctor` say what is wrong"
            )

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
                case events.Repeat() as again:
                    return self._repeat(again)
                case other:
                    raise Unforeseen(other)

    def _ask(self, step: steps.Ask) -> steps.Answered | steps.Repeated:
        self._live.enter(State.ASKING, step)
        match self._live.wait():
            case events.Answer() | events.ParticipantKey() as answer:
                return self._answered(step, answer)
            case events.Repeat() as again:
                return self._repeat(again)
            case other:
                raise Unforeseen(other)

    def _answered(self, step: steps.Ask, answer: events.Answer | events.ParticipantKey) -> steps.Answered:
        """The answer with its time, which is the participant's own only by their own key, without pause or standstill.

        Of what was felt a while ago no time says anything, nor of a train, which lasts until the participant goes on.
        """
        if step.later or self._onset_s is None:
            return steps.Answered(value=answer.response, by=answer.by)
        drawn_s = answer.response_time_s if isinstance(answer, events.Answer) else None
        key_time_s = None if answer.at_s is None else round(answer.at_s - self._onset_s, 6)
        time_s = drawn_s if drawn_s is not None else key_time_s
        if time_s is None:
            raise TypeError("an answer without a time")
        own = answer.timed if isinstance(answer, events.ParticipantKey) else drawn_s is not None
        paused = self._live.moment.paused_between(self._onset_s, self._onset_s + time_s)
        return steps.Answered(
            value=answer.response,
            by=answer.by,
            response_time_s=time_s,
            response_time_valid=own and not paused,
            key_time_s=key_time_s if drawn_s is not None else None,
        )

    def _inform(self, step: steps.Inform) -> steps.Informed | steps.Interrupted | steps.Repeated:
        self._live.enter(State.INFORMING, step)
        match self._live.wait():
            case events.Told():
                return steps.Informed()
            case events.Correct():  # of the answer that is told of: it is told anew
                return steps.Interrupted(presented=False, cause="correction")
            case events.Repeat() as again:
                return self._repeat(again)
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
                case events.Repeat() as again:
                    return self._repeat(again)
                case other:
                    raise Unforeseen(other)

    def _rested(self, start_s: float, reason: str) -> steps.Rested:
        return steps.Rested(rested_s=round(self._live.clock.now() - start_s, 6), cut_reason=reason)

    def _rate(self, step: steps.Rate) -> steps.Answered | steps.Repeated:
        self._live.enter(State.RATING, step)
        match self._live.wait():
            case events.Rating(rating=rating, by=by) | events.ParticipantRated(rating=rating, by=by):
                return steps.Answered(value=None if rating is None else on_scale(rating, step), by=by)
            case events.Repeat() as again:
                return self._repeat(again)
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
            case events.Repeat() as again:
                return self._repeat(again)
            case other:
                raise Unforeseen(other)

    def _repeat(self, again: events.Repeat) -> steps.Repeated:
        trial = self._live.moment.repeatable
        if trial is None:
            raise TypeError("a repeat of no trial was taken")
        return steps.Repeated(trial=trial, reason=again.reason, by=again.by)

    # the gun

    def _fired(self, step: steps.FireShot) -> steps.Fired | steps.Failed | steps.Interrupted:
        not_before_s = self._onset_s + step.gap_s if step.gap_s and self._onset_s is not None else None
        outcome = self._stimulus.fire(step, not_before_s)
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


WORDS = 4
"""So many words to a gun a shot is, armed for it alone (assumed: on its twin 3.5 to 5.6, by the time of one)."""
LEAD_S = 0.03
"""How long before its tick a shot of a train is asked for; a `next` within that time comes too late for it.

Assumed: twice what the doctor lets pass, 5 ms that a sleep overruns and 10 ms to the gun and back.
"""


def disarm(gun: Gun) -> None:
    """Disarm, or stop the run: nobody is to hold a gun that may fire. `RunStopped` says what to do."""
    try:
        gun.disarm()
    except DeviceError as error:
        raise RunStopped(f"the gun cannot be disarmed ({error}): switch off its power") from error


class DeskGun:
    """The gun at a desk, as a run uses it."""

    def __init__(self, desk: Desk) -> None:
        self._desk, self._live = desk, desk.live
        self._took_s: float | None = None  # the gun's last shot, armed for it alone

    def fire(
        self, step: steps.FireShot, not_before_s: float | None = None
    ) -> steps.Fired | steps.Failed | steps.Interrupted:
        """One shot, armed for it alone; in a catch trial, or an empty interval, nothing is armed and nothing fires."""
        felt = step.trial.with_chosen(step.chosen)
        levels, asked, before = felt.levels_at(step.interval), False, step.interval > 0
        began_s, shot = self._live.clock.now(), None if levels is None else self._desk.stimuli.of_levels(levels)
        try:
            if shot is None:
                return self._nothing(step, not_before_s)
            self._get_ready(State.FIRING, step, not_before_s)
            asked = True
            onset_utc, report = self._first(shot)
            self._took_s = self._live.clock.now() - max(not_before_s or 0.0, began_s)
        except Held:
            return steps.Interrupted(presented=before, cause="pause")
        except DeviceError as error:
            return self._failed(error, felt=before or (asked and error.may_have_fired))
        finally:
            disarm(self._live.gun)
        self._live.stimulus_begins(report.pulse_start_s)
        return _recorded(steps.Fired, report, gun=self._live.gun_name, onset_utc=onset_utc)

    def _nothing(self, step: steps.FireShot, not_before_s: float | None) -> steps.Fired:
        """What is felt of no shot, in the time that the last one took. Raises as `allow_shot`."""
        self._live.enter(State.FIRING, step)
        began_s = max(not_before_s or 0.0, self._live.clock.now())
        self._live.sleep(began_s + (self._will_take_s(step.trial) if self._took_s is None else self._took_s))
        utc, now_s = self._live.clock.utc(), self._live.clock.now()
        self._live.stimulus_begins(now_s)
        return steps.nothing_fired(self._live.gun_name, utc, now_s)

    def _will_take_s(self, trial: Trial) -> float:
        """How long a first shot is likely to take: words to the gun, and its pulse, for which a real one waits."""
        asked_s = self._live.clock.now()
        self._live.gun.status()
        word_s, simulated = self._live.clock.now() - asked_s, is_simulated(self._live.gun_name)
        return WORDS * word_s + (0.0 if simulated else self._desk.stimuli.pulse_s(self._shot(trial)))

    def present(self, step: steps.Present) -> steps.Presented | steps.Failed | steps.Interrupted:
        """Shots at whole multiples of the interval since the first, until next is said."""
        train, asked, shot = Train(step, self._desk), False, self._shot(step.trial.with_chosen(step.chosen))
        try:
            self._get_ready(State.TRAIN, step)
            asked = True
            train.began(*self._first(shot))
            while (event := self._live.wait((at_s := train.due_s()) - LEAD_S)) is None:
                if train.shots == step.max_shots:
                    return train.presented("limit")
                if self._live.may_fire():  # else its tick is left out
                    train.fired(self._live.gun.fire(shot, at_s))
        except Held:
            return train.interrupted()
        except DeviceError as error:
            return self._failed(error, felt=train.shots > 0 or (asked and error.may_have_fired))
        finally:
            disarm(self._live.gun)
        return train.presented("next") if isinstance(event, events.Next) else train.interrupted()

    def _get_ready(self, state: State, step: steps.FireShot | steps.Present, not_before_s: float | None = None) -> None:
        """Enter a state in which the gun fires, and arm it when its time has come. Raises as `allow_shot`.

        If the run ends before the shot, it is on the disk that nothing was felt.
        """
        try:
            self._live.enter(state, step)
            if state is State.TRAIN:
                self._live.stimulus_begins(None)
            if not_before_s is not None:
                self._live.sleep(not_before_s)
            self._arm()
        except RunStopped:
            self._live.give_up(felt=isinstance(step, steps.FireShot) and step.interval > 0)
            raise

    def _arm(self) -> None:
        """Arm the gun, and wait until its magnet is home. Raises as `allow_shot`."""
        self._live.settle()
        self._live.allow_shot()
        self._live.gun.arm()
        self._live.sleep(self._live.gun.status().ready_at_s)
        while not self._live.may_fire():
            self._live.sleep(self._live.clock.now() + LEAD_S)

    def _first(self, shot: Shot) -> tuple[str, ShotReport]:
        """The first shot of a stimulus, and its date and time."""
        return self._live.clock.utc(), self._live.gun.fire(shot)

    def _shot(self, trial: Trial) -> Shot:
        """The first shot that is felt of a trial; of a catch trial, that of any other."""
        return self._desk.stimuli.first_shot((trial, *self._live.plan.trials))

    def _failed(self, error: DeviceError, *, felt: bool) -> steps.Failed | steps.Interrupted:
        """What became of a stimulus at which the gun failed; a pause that disarmed it is no fault of the gun's."""
        try:
            meanwhile = self._live.taken()
        except RunStopped:
            if not felt:  # where it may have been, that is what a resumed run takes it for
                self._live.give_up(felt=False)
            raise
        if isinstance(meanwhile, events.Pause | events.ParticipantLost):
            return steps.Interrupted(presented=felt, cause="pause")
        if isinstance(meanwhile, events.Next):  # it was taken, and ends nothing any more
            said = events.word(events.Next)
            self._live.remark(Refused(event=said, state=State.TRAIN, because=str(error), by="experimenter"))
        lost = events.GunFault if isinstance(error, LimitError) else events.LinkLost
        self._live.offer(lost(cause=str(error)))
        return steps.Failed(cause=str(error), presented=felt)

    def test_shot(self, trial: Trial, held_s: float | None) -> bool:
        """Fire a shot that nobody judges; whether it was fired."""
        shot = self._shot(trial)
        try:
            self._arm()
            _, report = self._first(shot)
        except (Held, DeviceError) as error:
            cause = str(error) or "paused"
            self._live.remark(TestShot(method=shot.method, held_s=held_s, cause=cause))
            return False
        finally:
            disarm(self._live.gun)
        fired = TestShot(method=shot.method, held_s=held_s, pulse_start_s=report.pulse_start_s, motion=report.motion)
        self._live.remark(fired)
        return True
