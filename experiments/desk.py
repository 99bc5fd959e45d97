"""What a run is carried out at: the live run, and its gun as a run uses it, shot by shot and train by train.

The gun is armed for a stimulus alone, and disarmed behind it. Whether a shot may be fired is looked at after the gun
was armed, and again just before it fires: what halts or holds the run is set before the gun is told to disarm. A
train's shots are asked for a little ahead, each for its own tick, and the gun waits for it by its own clock: neither
the line nor this machine delays them. Each is in the journal before the next is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from device import DeviceError, Gun, LimitError, Shot, ShotReport
from experiments.design.plan import Trial
from experiments.live_run import Held, LiveRun, RunStopped
from experiments.session import events, steps
from experiments.session.remarks import TestShot
from experiments.session.states import State

EMPTY_S = 0.05
"""So long after the key to fire nothing is felt: about as long as a gun takes to arm and fire (assumed)."""
NOTHING = "none"
"""The motion of no shot."""
LEAD_S = 0.03
"""How long before its tick a shot of a train is asked for; a `next` within that time comes too late for it.

Assumed: twice what the doctor lets pass, 5 ms that a sleep overruns and 10 ms to the gun and back.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Desk:
    """All that carries steps out: the live run with its gun, what that is called, and the shot of each interval."""

    live: LiveRun
    gun_name: str
    shots: Mapping[tuple[Trial, int], Shot | None]


class Train:
    """A stimulus of several shots: each in the journal before the next is asked for."""

    def __init__(self, step: steps.Present, desk: Desk) -> None:
        self._step, self._desk, self._live = step, desk, desk.live
        self._onset_utc, self._onset_s = "", math.nan
        self.shots = 0

    def began(self, onset_utc: str, first: ShotReport) -> None:
        """Take the first shot; `next` counts after the least exposure."""
        self._onset_utc, self._onset_s = onset_utc, first.pulse_start_s
        self._live.stimulus_begins(first.pulse_start_s, least_s=self._step.least_exposure_s)
        self.fired(first)

    def fired(self, report: ShotReport) -> None:
        """Have a shot on the disk."""
        self.shots += 1
        shot = steps.TrainShot(
            shot=self.shots,
            requested_s=report.requested_s,
            pulse_start_s=report.pulse_start_s,
            pulse_end_s=report.pulse_end_s,
            home_predicted_s=report.home_predicted_s,
            motion=report.motion,
            timing=report.timing,
        )
        self._live.journal.append("shot", body=steps.step_record(shot))

    def due_s(self) -> float:
        """The next shot's tick, whole microseconds after the first; later if the magnet is not home by then."""
        tick_s = self._onset_s + self.shots * round(self._step.repeat_every_s * 1e6) / 1e6
        return max(tick_s, self._live.gun.status().ready_at_s)

    def presented(self, ended_by: Literal["next", "limit"]) -> steps.Presented:
        """The stimulus as it was felt to its end."""
        return steps.Presented(
            gun=self._desk.gun_name,
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

    def fire(
        self, step: steps.FireShot, not_before_s: float | None = None
    ) -> steps.Fired | steps.Failed | steps.Interrupted:
        """One shot, armed for it alone; in a catch trial, or an empty interval, nothing is armed and nothing fires."""
        shot, asked, before = self._desk.shots[step.trial, step.interval], False, step.interval > 0
        try:
            if shot is None:
                return self._nothing(step, not_before_s)
            self._get_ready(State.FIRING, step, not_before_s)
            asked = True
            onset_utc, report = self._first(shot)
        except Held:
            return steps.Interrupted(presented=before, cause="pause")
        except DeviceError as error:
            return self._failed(error, felt=before or (asked and not isinstance(error, LimitError)))
        finally:
            disarm(self._live.gun)
        self._live.stimulus_begins(report.pulse_start_s)
        return steps.Fired(
            gun=self._desk.gun_name,
            onset_utc=onset_utc,
            requested_s=report.requested_s,
            pulse_start_s=report.pulse_start_s,
            pulse_end_s=report.pulse_end_s,
            home_predicted_s=report.home_predicted_s,
            motion=report.motion,
            timing=report.timing,
        )

    def _nothing(self, step: steps.FireShot, not_before_s: float | None) -> steps.Fired:
        """What is felt of no shot, in about the time that one takes. Raises as `allow_shot`."""
        self._live.enter(State.FIRING, step)
        self._live.sleep(max(not_before_s or 0.0, self._live.clock.now() + EMPTY_S))
        utc, now_s = self._live.clock.utc(), self._live.clock.now()
        self._live.stimulus_begins(now_s)
        return steps.Fired(
            gun=self._desk.gun_name,
            onset_utc=utc,
            requested_s=now_s,
            pulse_start_s=now_s,
            pulse_end_s=now_s,
            home_predicted_s=now_s,
            motion=NOTHING,
        )

    def present(self, step: steps.Present) -> steps.Presented | steps.Failed | steps.Interrupted:
        """Shots at whole multiples of the interval since the first, until next is said."""
        train, asked, shot = Train(step, self._desk), False, self._shot(step.trial)
        try:
            self._get_ready(State.TRAIN, step)
            asked = True
            train.began(*self._first(shot))
            while (event := self._live.wait((at_s := train.due_s()) - LEAD_S)) is None:
                if train.shots == step.max_shots:
                    return train.presented("limit")
                self._live.allow_shot()
                train.fired(self._live.gun.fire(shot, at_s))
        except Held:
            return train.interrupted()
        except DeviceError as error:
            return self._failed(error, felt=train.shots > 0 or (asked and not isinstance(error, LimitError)))
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
            felt = isinstance(step, steps.FireShot) and step.interval > 0
            self._live.journal.append("outcome", body=steps.step_record(steps.Interrupted(presented=felt)))
            raise

    def _arm(self) -> None:
        """Arm the gun, and wait until its magnet is home. Raises as `allow_shot`."""
        self._live.settle()
        self._live.allow_shot()
        self._live.gun.arm()
        self._live.sleep(self._live.gun.status().ready_at_s)

    def _first(self, shot: Shot) -> tuple[str, ShotReport]:
        """The first shot of a stimulus, and its date and time."""
        return self._live.clock.utc(), self._live.gun.fire(shot)

    def _shot(self, trial: Trial) -> Shot:
        """The first shot that is felt of a trial; of a catch trial, that of any other."""
        own = (shot for (one, _), shot in self._desk.shots.items() if one == trial)
        return next(shot for shot in (*own, *self._desk.shots.values()) if shot is not None)

    def _failed(self, error: DeviceError, *, felt: bool) -> steps.Failed | steps.Interrupted:
        """What became of a stimulus at which the gun failed; a pause that disarmed it is no fault of the gun's."""
        if isinstance(self._live.taken(), events.Pause | events.ParticipantLost):
            return steps.Interrupted(presented=felt, cause="pause")
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
