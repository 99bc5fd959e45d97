"""Runs in a thread, with a gun in trouble."""

import csv
import json
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from device import Identity, Shot, ShotReport, open_gun
from device.words import GunStatus
from experiments.clock import Clock, VirtualClock
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.design.planning import plan_of
from experiments.design.stimuli import stimuli_of
from experiments.live_run import LiveRun
from experiments.load import load_setup
from experiments.record import replay, storage
from experiments.record.journal import Journal, read_journal
from experiments.record.names import Place
from experiments.record.rebuild import table
from experiments.record.replay import RunPosition
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.runner import Desk, carry_out
from experiments.screens.synthetic import SyntheticScreen, synthetic_screen
from experiments.session.design_session import design_session
from experiments.session.history import GrowingHistory
from experiments.session.remarks import Remark
from experiments.session.states import Position, State
from experiments.session.steps import Outcome, Step, step_record
from experiments.study.folders import place
from experiments.synthetic.answers import SyntheticParticipant, synthetic_participant_of
from tests.designs import direction_with

SETUPS = {
    "direction": direction_with(sets=2, repetitions=2),
    "preference": load_setup("preference"),
}
"""Experiment 1 with three sessions of two sets of two trials."""


class TroubledGun:
    """The simulated gun, with all that is asked of it written down, and trouble at chosen calls of a word.

    `troubles["fire", 3]` is raised at the third `fire`, before the simulated gun hears of it.
    """

    def __init__(
        self, setup: Setup[DesignConfig], clock: Clock, troubles: dict[tuple[str, int], BaseException]
    ) -> None:
        methods = setup.gun.renderings(setup.config.methods)
        self._gun = open_gun("simulated", methods, clock=clock.now)
        self._troubles = troubles
        self.asked: list[str] = []

    def _told(self, word: str) -> None:
        self.asked.append(word)
        if trouble := self._troubles.get((word, self.asked.count(word))):
            raise trouble

    @property
    def armed(self) -> bool:
        return self._gun.status().state != "disarmed"

    def identify(self) -> Identity:
        self._told("identify")
        return self._gun.identify()

    def arm(self) -> None:
        self._told("arm")
        self._gun.arm()

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        self._told("fire")
        return self._gun.fire(shot, at_s)

    def disarm(self) -> None:
        self._gun.disarm()
        self._told("disarm")

    def status(self) -> GunStatus:
        self._told("status")
        return self._gun.status()

    def close(self) -> None:
        self._gun.close()


class WatchingScreen(SyntheticScreen):
    """A synthetic participant who looks at gun and journal whenever asked or told something."""

    def __init__(
        self, config: Any, participant: SyntheticParticipant, clock: Clock, gun: TroubledGun, journal: Path
    ) -> None:
        super().__init__(config, participant, clock)
        self.gun, self._journal = gun, journal
        self.acknowledged = 0
        self.trouble: dict[int, BaseException] = {}

    def act(self, position: Position, until_s: float | None) -> None:
        assert position.state is State.TRAIN or not self.gun.armed
        super().act(position, until_s)

    def acknowledge(self, step: Step | None, outcome: Outcome | Remark) -> None:
        assert not self.gun.armed
        assert step is not None
        assert not isinstance(outcome, Remark)
        lines = self._journal.read_bytes().splitlines(keepends=True)
        done, announced = islice((one for line in reversed(lines) if (one := json.loads(line))["kind"] != "shot"), 2)
        assert lines[-1].endswith(b"\n")
        assert (announced["kind"], announced["body"]) == ("step", json.loads(json.dumps(step_record(step))))
        assert (done["kind"], done["body"]) == ("outcome", json.loads(json.dumps(step_record(outcome))))
        self.acknowledged += 1
        if trouble := self.trouble.get(self.acknowledged):
            raise trouble


class Sitting(NamedTuple):
    """A desk with all that lies on it."""

    plan: Plan
    setup: Setup[DesignConfig]
    where: Place
    gun: TroubledGun
    screen: WatchingScreen
    clock: VirtualClock
    journal: Journal

    def carry_out(self) -> list[tuple[Step, Outcome]]:
        told: GrowingHistory = []
        going = design_session(self.plan, self.setup, told)
        live = LiveRun(
            plan=self.plan,
            gun=self.gun,
            journal=self.journal,
            clock=self.clock,
            screen=self.screen,
            guard_s=0.25,
            told=told,
        )
        stimuli = stimuli_of(self.setup.config, self.setup.gun)
        desk = Desk(live=live, stimuli=stimuli)
        self.screen.begin(live)
        with self.journal:
            first = next(going)
            self.journal.append("step", body=step_record(first))
            carry_out(going, desk, RunPosition(step=first))
        return replay.outcomes(replay.history(read_journal(self.where.journal)))

    def rows(self) -> list[dict[str, str]]:
        data = table(read_journal(self.where.journal))
        return list(csv.DictReader(data.decode().splitlines(keepends=True)))


def sitting(
    name: str, results: Path, troubles: dict[tuple[str, int], BaseException] | None = None, **changes: Any
) -> Sitting:
    setup, clock = changes.get("setup") or SETUPS[name], VirtualClock()
    plan = plan_of(setup.config, "P01", changes.get("seed", 1))
    where = place(results, "P01", name)
    storage.make_folder(where.folder)
    journal = Journal.create(where.journal, clock)
    heads = {"plan": plan.record(), "plan_sha256": plan.sha256()}
    journal.append("run", **heads, setup=setup.record(), setup_sha256=setup.sha256())
    gun = TroubledGun(setup, clock, troubles or {})
    participant = synthetic_participant_of(setup, plan)
    screen = WatchingScreen(setup.config, participant, clock, gun, where.journal)
    return Sitting(plan, setup, where, gun, screen, clock, journal)


def resumed_rows(desk: Sitting) -> list[dict[str, str]]:
    request = RunRequest(setup=desk.setup, participant_id="P01", results=desk.where.results, seed=None, again="resume")
    done = run(request, synthetic_screen, VirtualClock())
    with done.place.table.open(newline="") as file:
        return list(csv.DictReader(file))
