import csv
import os
from collections import Counter
from contextlib import closing, nullcontext, suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from device import GunStatus, Identity, LimitError, LinkError, Shot, ShotReport
from experiments.clock import Clock, VirtualClock
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.live_run import RunStopped
from experiments.load import load_setup
from experiments.record.journal import Journal, JournalError, read_journal
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.runner import MAX_FAILURES
from experiments.screens.synthetic import SyntheticScreen, synthetic_screen
from experiments.session.remarks import Remark
from experiments.session.steps import NO_MOTION, Outcome, Step
from experiments.study.folders import PlaceError, place
from experiments.synthetic.answers import synthetic_participant_of
from tests.designs import changed
from tests.journals import raw
from tests.sittings import SETUPS, TroubledGun, resumed_rows, sitting

pytestmark = pytest.mark.slow

BOTH = pytest.mark.parametrize("name", SETUPS)


# when all goes well


@BOTH
def test_an_answer_is_acknowledged_once_its_record_is_on_the_disk(name: str, tmp_path: Path) -> None:
    desk = sitting(name, tmp_path)
    done = desk.carry_out()
    steps = Counter(step.kind for step, _ in done)
    trials = len(desk.plan.trials)
    rests = {"rest": 5} if name == "direction" else {}
    each = ("prepare", "fire", "ask") if name == "direction" else ("prepare", "present", "rate", "describe")
    assert steps == dict.fromkeys(each, trials) | rests | {"close": 1}
    assert desk.screen.acknowledged == len(done)


@BOTH
def test_each_stimulus_is_armed_for_itself_and_disarmed_behind_it(name: str, tmp_path: Path) -> None:
    desk = sitting(name, tmp_path)
    desk.carry_out()
    words = [word for word in desk.gun.asked if word in ("arm", "fire", "disarm")]
    trains = "".join(word[0] for word in words).split("d")
    stimuli = 12 if name == "direction" else 3
    assert [train[:2] for train in trains if train] == ["af"] * stimuli
    assert all(train[1:] == "f" * len(train[1:]) for train in trains if train)
    assert words[-1] == "disarm"


def test_the_journal_says_which_damper_was_asked_for_and_which_was_confirmed(tmp_path: Path) -> None:
    desk = sitting("direction", tmp_path)
    desk.carry_out()
    records = raw(desk.where.journal)
    asked = [
        dict(one["body"].get("settings", [])).get("damper", "")
        for one in records
        if one.get("body", {}).get("kind") == "prepare"
    ]
    confirmed = [
        dict(one["body"].get("settings", [])).get("damper", "")
        for one in records
        if one.get("body", {}).get("kind") == "prepared"
    ]
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
    desk.screen.gun = timed
    done = desk.carry_out()
    shots = [outcome.shots for _, outcome in done if outcome.kind == "presented"]
    assert sum(shots) == len(times)
    for train in range(3):
        first = sum(shots[:train])
        of_train = times[first : first + shots[train]]
        assert [time - of_train[0] for time in of_train] == pytest.approx(list(range(len(of_train))), abs=1e-6)


def times_to_fire(journal: Path) -> list[tuple[bool, float]]:
    """Of each trial whether it was a catch trial, and how long after the hand-over its stimulus was over."""
    outcomes = [one for one in raw(journal) if one["kind"] == "outcome"]
    return [
        (after["body"]["motion"] == NO_MOTION, after["monotonic_s"] - before["monotonic_s"])
        for before, after in pairwise(outcomes)
        if after["body"]["kind"] == "fired"
    ]


def test_a_catch_trial_comes_to_its_question_as_late_as_the_shot_before(tmp_path: Path) -> None:
    class Slow(TroubledGun):
        def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
            desk.clock.sleep(0.18)
            return super().fire(shot, at_s)

    desk = sitting("detection", tmp_path, setup=load_setup("detection"))
    slow = Slow(desk.setup, desk.clock, {})
    desk = desk._replace(gun=slow)
    desk.screen.gun = slow
    desk.carry_out()
    took = times_to_fire(desk.where.journal)
    since = took.index(next(one for one in took if not one[0]))
    assert {of_none for of_none, _ in took[since:]} == {True, False}
    assert [s for _, s in took[since:]] == pytest.approx([took[since][1]] * len(took[since:]), abs=1e-3)
    assert took[since][1] > 0.17


@pytest.mark.parametrize(("model", "waits"), [("simulated", False), ("coil", True)])
def test_a_catch_trial_before_any_shot_takes_as_long_as_a_shot_is_likely_to(
    tmp_path: Path, model: str, waits: bool
) -> None:
    word_s = 0.005

    class Slow(TroubledGun):
        def identify(self) -> Identity:
            return replace(super().identify(), model=model)

        def arm(self) -> None:
            desk.clock.sleep(word_s)
            super().arm()

        def status(self) -> GunStatus:
            desk.clock.sleep(word_s)
            return super().status()

        def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
            desk.clock.sleep(2 * word_s)
            report = super().fire(shot, at_s)
            desk.clock.sleep(report.pulse_end_s - report.pulse_start_s if waits else 0.0)
            return report

    desk = sitting("detection", tmp_path, setup=load_setup("detection"), seed=2)
    desk = desk._replace(gun=(slow := Slow(desk.setup, desk.clock, {})))
    desk.screen.gun = slow
    desk.carry_out()
    took = times_to_fire(desk.where.journal)
    assert took[0][0]
    assert took[0][1] == pytest.approx(next(s for of_none, s in took if not of_none), abs=0.003)


def test_a_virtual_run_takes_the_planned_time(tmp_path: Path) -> None:
    desk = sitting("direction", tmp_path, setup=load_setup("direction"))
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
    desk = sitting("preference", tmp_path, setup=changed("preference", trial={"max_shots": 5}))
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
    desk = sitting(name, tmp_path, {("identify", 2): LinkError("no answer")})
    desk.carry_out()
    assert all(row["response" if name == "direction" else "rating"] for row in desk.rows())


@BOTH
def test_a_link_that_is_dead_even_for_disarming_stops_the_run_as_any_other_fault(name: str, tmp_path: Path) -> None:
    words = ("arm", "fire", "disarm", "status")
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
    assert [one["kind"] for one in raw(desk.where.journal) if one["kind"] != "shot"][-1] == "step"


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
    desk.screen.trouble[10 if name == "direction" else 9] = KeyboardInterrupt()
    with suppress(KeyboardInterrupt):
        desk.carry_out()
    before = read_journal(desk.where.journal).records
    assert before[-1].kind == "outcome"
    rows = resumed_rows(desk)
    assert read_journal(desk.where.journal).records[: len(before)] == before
    assert {row["flags"] for row in rows} == {""}


def test_an_interrupted_run_leaves_a_reason_and_a_table_of_what_was_answered(tmp_path: Path) -> None:
    class Impatient(SyntheticScreen):
        def acknowledge(self, step: Step | None, outcome: Outcome | Remark) -> None:
            super().acknowledge(step, outcome)
            if outcome.kind == "answered":
                raise KeyboardInterrupt

    def impatient(setup: Setup[DesignConfig], plan: Plan, clock: Clock) -> SyntheticScreen:
        return Impatient(setup.config, synthetic_participant_of(setup, plan), clock)

    request = RunRequest(setup=SETUPS["direction"], participant_id="P01", results=tmp_path, seed=1)
    with pytest.raises(KeyboardInterrupt):
        run(request, impatient, VirtualClock())
    where = place(tmp_path, "P01", "direction")
    last = read_journal(where.journal).records[-1]
    assert (last.kind, last.reason) == ("stopped", "interrupted")
    with where.table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    assert [number for number, row in enumerate(rows) if row["response"]] == [0]


class LosingScreen(SyntheticScreen):
    """Somebody who does all, and loses the journal's last record at an acknowledgement of a number."""

    at, journal, acknowledged = 0, Path(), 0

    def acknowledge(self, step: Step | None, outcome: Outcome | Remark) -> None:
        super().acknowledge(step, outcome)
        self.acknowledged += 1
        if self.acknowledged == self.at:
            os.truncate(self.journal, self.journal.read_bytes().rfind(b"\n", 0, -1) + 1)


def test_an_answer_that_was_lost_on_the_disk_is_missed_at_the_end(tmp_path: Path) -> None:
    """The journal is whole without it: what was given is known to the run alone."""
    screens = list[LosingScreen]()

    def losing(setup: Setup[DesignConfig], plan: Plan, clock: Clock) -> SyntheticScreen:
        screens.append(screen := LosingScreen(setup.config, synthetic_participant_of(setup, plan), clock))
        screen.at = screens[0].acknowledged
        screen.journal = place(tmp_path, plan.participant_id, "direction").journal
        return screen

    for code in ("P01", "P02"):
        request = RunRequest(setup=SETUPS["direction"], participant_id=code, results=tmp_path, seed=1)
        with pytest.raises(JournalError, match="not the") if code == "P02" else nullcontext():
            run(request, losing, VirtualClock())
    assert not read_journal(screens[1].journal).finished


def test_the_gun_is_closed_and_the_journal_let_go_after_a_run(tmp_path: Path) -> None:
    request = RunRequest(setup=SETUPS["preference"], participant_id="P01", results=tmp_path, seed=1)
    done = run(request, synthetic_screen, VirtualClock())
    with closing(Journal.reopen(read_journal(done.place.journal), VirtualClock())) as journal:
        assert journal.path == done.place.journal


def test_a_finished_run_whose_table_cannot_be_written_says_that_nothing_is_lost(tmp_path: Path) -> None:
    where = place(tmp_path, "P01", "preference")
    where.table.mkdir(parents=True)  # nothing can be put there, as in a folder that is for reading alone
    request = RunRequest(setup=SETUPS["preference"], participant_id="P01", results=tmp_path, seed=1)
    said = r"the run is finished, and every answer is in the journal, but its table .* see to that, and `recoil rebuild"
    with pytest.raises(PlaceError, match=said):
        run(request, synthetic_screen, VirtualClock())
    assert read_journal(where.journal).finished
