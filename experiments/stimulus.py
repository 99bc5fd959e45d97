"""What the gun does for a step: a shot, a train of shots, a test shot. Armed for it alone, and disarmed behind it.

Whether a shot may be fired is looked at after the gun was armed, and again just before it fires: what halts or holds
the run is set before the gun is told to disarm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal

from device import DeviceError, Gun, LimitError, Shot, ShotReport
from device.words import Drive
from experiments.clock import Clock
from experiments.design.plan import Trial
from experiments.live_run import Held, LiveRun, RunStopped
from experiments.record.journal import Journal
from experiments.session import events
from experiments.session.remarks import TestShot
from experiments.session.states import State
from experiments.session.steps import Failed, Fire, Fired, Interrupted, Present, Presented, TrainShot, record

LEAD_S = 0.03
"""How long before its tick a shot of a train is asked for; a `next` within that time comes too late for it.

Assumed: twice what the doctor lets pass, 5 ms that a sleep overruns and 10 ms to the gun and back.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Desk:
    """All that carries steps out: gun and how each method drives it, journal, clock, and the live run."""

    gun: Gun
    gun_name: str
    drives: Mapping[str, Drive]
    journal: Journal
    clock: Clock
    live: LiveRun


def disarm(gun: Gun) -> None:
    """Disarm, or stop the run: nobody is to hold a gun that may fire. `RunStopped` says what to do."""
    try:
        gun.disarm()
    except DeviceError as error:
        raise RunStopped(f"the gun cannot be disarmed ({error}): switch off its power") from error


class Stimulus:
    """The gun at a desk, as a run uses it."""

    def __init__(self, desk: Desk) -> None:
        self._desk, self._live = desk, desk.live

    def fire(self, step: Fire) -> Fired | Failed | Interrupted:
        """One shot, armed for it alone."""
        asked = False
        try:
            self._get_ready(State.FIRING, step)
            asked = True
            onset_utc, report = self._first(step.trial)
        except Held:
            return Interrupted(presented=False, cause="pause")
        except DeviceError as error:
            return self._failed(error, felt=asked and not isinstance(error, LimitError))
        finally:
            disarm(self._desk.gun)
        self._live.felt(report.pulse_start_s)
        return Fired(gun=self._desk.gun_name, onset_utc=onset_utc, **_times(report))

    def present(self, step: Present) -> Presented | Failed | Interrupted:
        """Shots at whole multiples of the interval since the first, until next is said."""
        train, asked = _Train(step, self._desk), False
        try:
            self._get_ready(State.TRAIN, step)
            asked = True
            train.began(*self._first(step.trial))
            while (event := self._live.wait((at_s := train.due_s()) - LEAD_S)) is None:
                if train.shots == step.max_shots:
                    return train.presented("limit")
                self._live.allow_shot()
                train.fired(self._shoot(step.trial, at_s))
        except Held:
            return train.interrupted()
        except DeviceError as error:
            return self._failed(error, felt=train.shots > 0 or (asked and not isinstance(error, LimitError)))
        finally:
            disarm(self._desk.gun)
        return train.presented("next") if isinstance(event, events.Next) else train.interrupted()

    def _get_ready(self, state: State, step: Fire | Present) -> None:
        """Enter a state in which the gun fires, and arm it. Raises as `allow_shot`.

        If the run ends before the shot, it is on the disk that nothing was felt.
        """
        try:
            self._live.enter(state, step)
            if state is State.TRAIN:
                self._live.felt(None)
            self._arm()
        except RunStopped:
            self._desk.journal.append("outcome", body=record(Interrupted(presented=False)))
            raise

    def _arm(self) -> None:
        """Arm the gun, and wait until its magnet is home. Raises as `allow_shot`."""
        self._live.settle()
        self._live.allow_shot()
        self._desk.gun.arm()
        self._live.sleep(self._desk.gun.status().ready_at_s)

    def _first(self, trial: Trial) -> tuple[str, ShotReport]:
        """The first shot of a stimulus, and its date and time."""
        return self._desk.clock.utc(), self._shoot(trial)

    def _shoot(self, trial: Trial, at_s: float | None = None) -> ShotReport:
        shot = Shot(method=trial.method, direction=trial.direction, drive=self._desk.drives[trial.method])
        return self._desk.gun.fire(shot, at_s)

    def _failed(self, error: DeviceError, *, felt: bool) -> Failed | Interrupted:
        """What became of a stimulus at which the gun failed; a pause that disarmed it is no fault of the gun's."""
        if isinstance(self._live.taken(), events.Pause | events.ParticipantLost):
            return Interrupted(presented=felt, cause="pause")
        lost = events.GunFault if isinstance(error, LimitError) else events.LinkLost
        self._live.offer(lost(cause=str(error)))
        return Failed(cause=str(error), presented=felt)

    def test_shot(self, trial: Trial, held_s: float | None) -> bool:
        """Fire a shot that nobody judges; whether it was fired."""
        try:
            self._arm()
            _, report = self._first(trial)
        except (Held, DeviceError) as error:
            cause = str(error) or "paused"
            self._live.remark(TestShot(method=trial.method, held_s=held_s, cause=cause))
            return False
        finally:
            disarm(self._desk.gun)
        fired = TestShot(method=trial.method, held_s=held_s, pulse_start_s=report.pulse_start_s, motion=report.motion)
        self._live.remark(fired)
        return True


class _Train:
    """A stimulus of several shots: each in the journal before the next is asked for."""

    def __init__(self, step: Present, desk: Desk) -> None:
        self._step, self._desk = step, desk
        self._onset_utc, self._onset_s = "", math.nan
        self.shots = 0

    def began(self, onset_utc: str, first: ShotReport) -> None:
        """Take the first shot; `next` counts after the least exposure."""
        self._onset_utc, self._onset_s = onset_utc, first.pulse_start_s
        self._desk.live.felt(first.pulse_start_s, least_s=self._step.least_exposure_s)
        self.fired(first)

    def fired(self, report: ShotReport) -> None:
        """Have a shot on the disk."""
        self.shots += 1
        self._desk.journal.append("shot", body=record(TrainShot(shot=self.shots, **_times(report))))

    def due_s(self) -> float:
        """The next shot's tick, whole microseconds after the first; later if the magnet is not home by then."""
        tick_s = self._onset_s + self.shots * round(self._step.repeat_every_s * 1e6) / 1e6
        return max(tick_s, self._desk.gun.status().ready_at_s)

    def presented(self, ended_by: Literal["next", "limit"]) -> Presented:
        """The stimulus as it was felt to its end."""
        return Presented(
            gun=self._desk.gun_name,
            onset_utc=self._onset_utc,
            shots=self.shots,
            exposure_s=self._exposure_s(),
            ended_by=ended_by,
        )

    def interrupted(self) -> Interrupted:
        """The stimulus as it was felt until a pause ended it."""
        if not self.shots:
            return Interrupted(presented=False, cause="pause")
        return Interrupted(presented=True, cause="pause", shots=self.shots, exposure_s=self._exposure_s())

    def _exposure_s(self) -> float:
        return self._desk.clock.now() - self._onset_s


def _times(report: ShotReport) -> dict[str, Any]:
    """What the journal keeps of a shot's report, beside what was asked for."""
    return {field.name: getattr(report, field.name) for field in fields(report) if field.name != "shot"}
