import csv
import json
from collections import Counter
from contextlib import closing, suppress
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from device import Identity, LimitError, LinkError, Shot, ShotReport, open_gun
from device.words import GunStatus
from experiments import catalogue, limits
from experiments.clock import Clock, VirtualClock
from experiments.config.setup import Setup
from experiments.design.plan import Plan
from experiments.live_run import LiveRun, RunStopped
from experiments.load import load_setup
from experiments.rebuild import table
from experiments.record import replay, storage
from experiments.record.journal import Journal, read
from experiments.record.replay import Standing
from experiments.run import Request, run
from experiments.runner import MAX_FAILURES, carry_out
from experiments.screens.synthetic import SyntheticScreen, synthetic_screen
from experiments.session.remarks import Remark
from experiments.session.states import Position, State
from experiments.session.steps import History, Outcome, Step, record
from experiments.stimulus import Desk
from experiments.study.places import Place, place

SETUPS = {name: load_setup(name) for name in ("direction", "preference")}
BOTH = pytest.mark.parametrize("name", SETUPS)


class TroubledGun:
    """The simulated gun, with all that is asked of it written down, and trouble at chosen calls of a word.

    `troubles["fire", 3]` is raised at the third `fire`, before the simulated gun hears of it.
    """

    def __init__(self, setup: Setup[Any], clock: Clock, troubles: dict[tuple[str, int], BaseException]) -> None:
        methods = setup.gun.renderings(setup.config.design.methods)
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

    def __init__(self, config: Any, observer: Any, clock: Clock, gun: TroubledGun, journal: Path) -> None:
        super().__init__(config, observer, clock)
        self._gun, self._journal = gun, journal
        self.acknowledged = 0
        self.trouble: dict[int, BaseException] = {}

    def act(self, position: Position, until_s: float | None) -> None:
        assert position.state is State.TRAIN or not self._gun.armed
        super().act(position, until_s)

    def acknowledge(self, step: Step | None, outcome: Outcome | Remark) -> None:
        assert not self._gun.armed
        assert step is not None
        assert not isinstance(outcome, Remark)
        lines = self._journal.read_bytes().splitlines(keepends=True)
        told, done = [one for line in lines if (one := json.loads(line))["kind"] != "shot"][-2:]
        assert lines[-1].endswith(b"\n")
        assert (told["kind"], told["body"]) == ("step", json.loads(json.dumps(record(step))))
        assert (done["kind"], done["body"]) == ("outcome", record(outcome))
        self.acknowledged += 1
        if trouble := self.trouble.get(self.acknowledged):
            raise trouble


class Sitting(NamedTuple):
    """A desk with all that lies on it."""

    plan: Plan
    setup: Setup[Any]
    where: Place
    gun: TroubledGun
    screen: WatchingScreen
    clock: VirtualClock
    journal: Journal

    def carry_out(self) -> History:
        going = catalogue.CATALOGUE[self.plan.experiment].session(self.plan, self.setup)
        live = LiveRun(
            plan=self.plan, gun=self.gun, journal=self.journal, clock=self.clock, screen=self.screen, guard_s=0.25
        )
        desk = Desk(
            gun=self.gun,
            gun_name="simulated",
            drives=limits.drives(self.setup),
            journal=self.journal,
            clock=self.clock,
            live=live,
        )
        self.screen.begin(live)
        with self.journal:
            carry_out(going, desk, Standing(step=next(going)))
        return replay.history(read(self.where.journal))

    def rows(self) -> list[dict[str, str]]:
        data = table(read(self.where.journal))
        return list(csv.DictReader(data.decode().splitlines(keepends=True)))


def sitting(
    name: str, results: Path, troubles: dict[tuple[str, int], BaseException] | None = None, **changes: Any
) -> Sitting:
    setup, clock = changes.get("setup", SETUPS[name]), VirtualClock()
    plan = catalogue.CATALOGUE[name].make_plan(setup.config, "P01", 1, None)
    where = place(results, "P01", name)
    storage.make_folder(where.folder)
    journal = Journal.create(where.journal, clock)
    heads = {"plan": plan.record(), "plan_sha256": plan.sha256()}
    journal.append("run", **heads, setup=setup.record(), setup_sha256=setup.sha256())
    gun = TroubledGun(setup, clock, troubles or {})
    observer = catalogue.CATALOGUE[name].observer(setup, plan)
    screen = WatchingScreen(setup.config, observer, clock, gun, where.journal)
    return Sitting(plan, setup, where, gun, screen, clock, journal)


def resumed_rows(desk: Sitting) -> list[dict[str, str]]:
    request = Request(setup=desk.setup, participant_id="P01", results=desk.where.results, seed=None, again="resume")
    done = run(request, synthetic_screen, VirtualClock())
    with done.place.table.open(newline="") as file:
        return list(csv.DictReader(file))


# when all goes well


@BOTH
def test_an_answer_is_acknowledged_once_its_record_is_on_the_disk(name: str, tmp_path: Path) -> None:
    desk = sitting(name, tmp_path)
    done = desk.carry_out()
    steps = Counter(step.kind for step, _ in done)
    trials = len(desk.plan.trials)
    rests = {"rest": 11} if name == "direction" else {}
    each = ("prepare", "fire", "ask") if name == "direction" else ("prepare", "present", "rate", "describe")
    assert steps == dict.fromkeys(each, trials) | rests | {"close": 1}
    assert desk.screen.acknowledged == len(done)


@BOTH
def test_each_stimulus_is_armed_for_itself_and_disarmed_behind_it(name: str, tmp_path: Path) -> None:
    desk = sitting(name, tmp_path)
    desk.carry_out()
    words = [word for word in desk.gun.asked if word in ("arm", "fire", "disarm")]
    trains = "".join(word[0] for word in words).split("d")
    stimuli = 60 if name == "direction" else 3
    assert [train[:2] for train in trains if train] == ["af"] * stimuli
    assert all(train[1:] == "f" * len(train[1:]) for train in trains if train)
    assert words[-1] == "disarm"


def test_the_journal_says_which_damper_was_asked_for_and_which_was_confirmed(tmp_path: Path) -> None:
    desk = sitting("direction", tmp_path)
    desk.carry_out()
    records = read(desk.where.journal).records
    asked = [one["body"]["damper"] for one in records if one.get("body", {}).get("kind") == "prepare"]
    confirmed = [one["body"].get("damper", "") for one in records if one.get("body", {}).get("kind") == "prepared"]
    methods = [trial.method for trial in desk.plan.trials]
    dampers = {"vibration": "", "asymmetric-1": "off", "asymmetric-2": "on"}
    assert asked == confirmed == [dampers[method] for method in methods]


def test_shots_of_a_train_come_at_whole_multiples_of_the_interval(tmp_path: Path) -> None:
    times: list[float] = []

    class Timed(TroubledGun):
        def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
            report = super().fire(shot, at_s)
            times.append(report.pulse_start_s)
            return report

    desk = sitting("preference", tmp_path)
    timed = Timed(desk.setup, desk.clock, {})
    desk = desk._replace(gun=timed)
    desk.screen._gun = timed
    done = desk.carry_out()
    shots = [outcome.shots for _, outcome in done if outcome.kind == "presented"]
    assert sum(shots) == len(times)
    for train in range(3):
        first = sum(shots[:train])
        of_train = times[first : first + shots[train]]
        assert [time - of_train[0] for time in of_train] == pytest.approx(list(range(len(of_train))), abs=1e-6)


def test_a_virtual_run_takes_the_planned_time(tmp_path: Path) -> None:
    desk = sitting("direction", tmp_path)
    desk.carry_out()
    # 780 s of breaks, 60 hand-overs of 15.8 s, and answers of about 1.2 s
    assert desk.clock.now() == pytest.approx(30 * 60, rel=0.01)


# faults


@BOTH
@pytest.mark.parametrize("word", ["fire", "arm", "status"])
@pytest.mark.parametrize("trouble", [LinkError("no answer"), LimitError("too warm")], ids=["link", "limit"])
def test_a_fault_of_the_gun_marks_the_trial_and_presents_it_again(
    name: str, word: str, trouble: BaseException, tmp_path: Path
) -> None:
    desk = sitting(name, tmp_path, {(word, 1): trouble})
    done = desk.carry_out()
    failed = [(step, outcome) for step, outcome in done if outcome.kind == "failed"]
    [(step, outcome)] = failed
    assert outcome.cause == str(trouble)
    assert step.trial == desk.plan.trials[0]
    first, *others = desk.rows()
    felt = word == "fire" and isinstance(trouble, LinkError)  # or perhaps; what was refused or not asked for was not
    assert (first["attempts"], first["flags"]) == ("2" if felt else "1", "device-error")
    assert {(row["attempts"], row["flags"]) for row in others} == {("1", "")}
    answer = "response" if name == "direction" else "rating"
    assert all(row[answer] for row in (first, *others))


@BOTH
def test_a_fault_changes_no_answer(name: str, tmp_path: Path) -> None:
    rows = {}
    for place_name, troubles in (("good", {}), ("bad", {("fire", 1): LinkError("?"), ("fire", 3): LinkError("?")})):
        desk = sitting(name, tmp_path / place_name, troubles)
        desk.carry_out()
        rows[place_name] = desk.rows()
    same = ("response", "correct", "response_time_s") if name == "direction" else ("rating", "shots")
    for good, bad in zip(rows["good"], rows["bad"], strict=True):
        assert [good[column] for column in same] == [bad[column] for column in same]


def test_a_fault_within_a_train_presents_the_whole_train_again(tmp_path: Path) -> None:
    desk = sitting("preference", tmp_path, {("fire", 5): LinkError("no answer")})
    desk.carry_out()
    unbroken = sitting("preference", tmp_path / "unbroken")
    unbroken.carry_out()
    assert (desk.rows()[0]["attempts"], desk.rows()[0]["flags"]) == ("2", "device-error")
    assert [row["shots"] for row in desk.rows()] == [row["shots"] for row in unbroken.rows()]


def test_a_train_that_ends_with_the_most_shots_does_not_shorten_the_next(tmp_path: Path) -> None:
    # nobody says next within 5 s of about 40: each of the three trains goes to its limit
    setup = SETUPS["preference"]
    fatigue = setup.config.fatigue.model_copy(update={"max_shots_per_trial": 5})
    config = setup.config.model_copy(update={"fatigue": fatigue})
    capped = Setup(config=config, gun=setup.gun, source=setup.source)
    desk = sitting("preference", tmp_path, setup=capped)
    done = desk.carry_out()
    told = [(outcome.shots, outcome.ended_by) for _, outcome in done if outcome.kind == "presented"]
    assert told == [(5, "limit")] * 3


@BOTH
def test_three_faults_in_a_row_stop_the_run_which_can_be_resumed(name: str, tmp_path: Path) -> None:
    assert MAX_FAILURES == 3
    troubles = {("fire", count): LinkError("no answer") for count in (1, 2, 3)}
    desk = sitting(name, tmp_path, troubles)
    with pytest.raises(RunStopped, match="the gun failed 3 times in a row, last: no answer"):
        desk.carry_out()
    assert not desk.gun.armed
    assert desk.gun.asked.count("fire") == 3
    rows = resumed_rows(desk)
    assert (rows[0]["attempts"], rows[0]["flags"]) == ("4", "device-error")
    assert {(row["attempts"], row["flags"]) for row in rows[1:]} == {("1", "")}
    assert all(row["response" if name == "direction" else "rating"] for row in rows)


def test_faults_that_are_not_in_a_row_do_not_stop_the_run(tmp_path: Path) -> None:
    troubles = {("fire", count): LinkError("no answer") for count in (1, 2, 4, 5, 7, 8)}
    desk = sitting("direction", tmp_path, troubles)
    desk.carry_out()
    assert [row["attempts"] for row in desk.rows()[:4]] == ["3", "3", "3", "1"]


@BOTH
def test_a_gun_that_cannot_say_who_it_is_behind_a_shot_does_not_end_the_run(name: str, tmp_path: Path) -> None:
    desk = sitting(name, tmp_path, {("identify", 1): LinkError("no answer")})
    desk.carry_out()
    assert all(row["response" if name == "direction" else "rating"] for row in desk.rows())


@BOTH
def test_a_link_that_is_dead_even_for_disarming_stops_the_run_as_any_other_fault(name: str, tmp_path: Path) -> None:
    words = ("arm", "fire", "disarm", "status", "identify")
    troubles = {(word, count): LinkError("no answer") for word in words for count in range(1, 20)}
    desk = sitting(name, tmp_path, troubles)
    with pytest.raises(RunStopped, match="switch off its power"):
        desk.carry_out()


# disarmed, whatever happens


UNEXPECTED = [RuntimeError("a bug"), KeyboardInterrupt(), SystemExit(1), OSError("unplugged")]


@BOTH
@pytest.mark.parametrize("trouble", UNEXPECTED, ids=lambda trouble: type(trouble).__name__)
@pytest.mark.parametrize("call", [("arm", 2), ("fire", 2), ("status", 2)], ids=lambda call: call[0])
def test_the_gun_is_disarmed_after_any_exception_of_its_own(
    name: str, trouble: BaseException, call: tuple[str, int], tmp_path: Path
) -> None:
    desk = sitting(name, tmp_path, {call: trouble})
    with pytest.raises(type(trouble)):
        desk.carry_out()
    assert not desk.gun.armed
    assert desk.gun.asked[-1] == "disarm"
    assert [one["kind"] for one in read(desk.where.journal).records if one["kind"] != "shot"][-1] == "step"


@BOTH
@pytest.mark.parametrize("trouble", UNEXPECTED, ids=lambda trouble: type(trouble).__name__)
@pytest.mark.parametrize("number", [1, 2, 5])
def test_the_gun_is_disarmed_after_any_exception_of_the_screen(
    name: str, trouble: BaseException, number: int, tmp_path: Path
) -> None:
    desk = sitting(name, tmp_path)
    desk.screen.trouble[number] = trouble
    with pytest.raises(type(trouble)):
        desk.carry_out()
    assert not desk.gun.armed
    assert desk.gun.asked[-1] == "disarm"


@BOTH
def test_what_was_acknowledged_before_an_interrupt_is_there_when_resumed(name: str, tmp_path: Path) -> None:
    desk = sitting(name, tmp_path)
    desk.screen.trouble[9] = KeyboardInterrupt()
    with suppress(KeyboardInterrupt):
        desk.carry_out()
    before = read(desk.where.journal).records
    assert before[-1]["kind"] == "outcome"
    rows = resumed_rows(desk)
    assert read(desk.where.journal).records[: len(before)] == before
    assert {row["flags"] for row in rows} == {""}


def test_an_interrupted_run_leaves_a_reason_and_a_table_of_what_was_answered(tmp_path: Path) -> None:
    class Impatient(SyntheticScreen):
        def acknowledge(self, step: Step | None, outcome: Outcome | Remark) -> None:
            super().acknowledge(step, outcome)
            if outcome.kind == "answered":
                raise KeyboardInterrupt

    def impatient(setup: Setup[Any], plan: Plan, clock: Clock) -> SyntheticScreen:
        return Impatient(setup.config, catalogue.experiment(setup).observer(setup, plan), clock)

    request = Request(setup=SETUPS["direction"], participant_id="P01", results=tmp_path, seed=1)
    with pytest.raises(KeyboardInterrupt):
        run(request, impatient, VirtualClock())
    where = place(tmp_path, "P01", "direction")
    last = read(where.journal).records[-1]
    assert (last["kind"], last["reason"]) == ("stopped", "interrupted")
    with where.table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 60
    assert [number for number, row in enumerate(rows) if row["response"]] == [0]


def test_the_gun_is_closed_and_the_journal_let_go_after_a_run(tmp_path: Path) -> None:
    request = Request(setup=SETUPS["preference"], participant_id="P01", results=tmp_path, seed=1)
    done = run(request, synthetic_screen, VirtualClock())
    with closing(Journal.reopen(read(done.place.journal), VirtualClock())) as journal:
        assert journal.path == done.place.journal
