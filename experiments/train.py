"""A stimulus of several shots, and the desk that steps are carried out at."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from device import Gun, ShotReport
from device.words import Drive
from experiments.clock import Clock
from experiments.live_run import LiveRun
from experiments.record.journal import Journal
from experiments.session.steps import Interrupted, Present, Presented, TrainShot, step_record


@dataclass(frozen=True, slots=True, kw_only=True)
class Desk:
    """All that carries steps out: gun and how each method drives it, journal, clock, and the live run."""

    gun: Gun
    gun_name: str
    drives: Mapping[str, Drive]
    journal: Journal
    clock: Clock
    live: LiveRun


class Train:
    """A stimulus of several shots: each in the journal before the next is asked for."""

    def __init__(self, step: Present, desk: Desk) -> None:
        self._step, self._desk = step, desk
        self._onset_utc, self._onset_s = "", math.nan
        self.shots = 0

    def began(self, onset_utc: str, first: ShotReport) -> None:
        """Take the first shot; `next` counts after the least exposure."""
        self._onset_utc, self._onset_s = onset_utc, first.pulse_start_s
        self._desk.live.stimulus_begins(first.pulse_start_s, least_s=self._step.least_exposure_s)
        self.fired(first)

    def fired(self, report: ShotReport) -> None:
        """Have a shot on the disk."""
        self.shots += 1
        shot = TrainShot(
            shot=self.shots,
            requested_s=report.requested_s,
            pulse_start_s=report.pulse_start_s,
            pulse_end_s=report.pulse_end_s,
            home_predicted_s=report.home_predicted_s,
            motion=report.motion,
            timing=report.timing,
        )
        self._desk.journal.append("shot", body=step_record(shot))

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
