"""The emergency stop in a live run, and what comes after it."""

from __future__ import annotations

import os
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from device import Identity, LimitError, LinkError
from experiments.earlier_run import owes_shot
from experiments.live_run import RunStopped
from experiments.record.owed_shot import OWED_FILE, OwedShot, owe_shot
from experiments.record.replay import history
from experiments.screens.texts import again_text
from experiments.session import events
from experiments.session import remarks as words
from experiments.session.events import Event
from experiments.session.remarks import HALTED_BEFORE, Halted, HaltReason, Noted, Refused
from experiments.session.states import EMERGENCY, State
from experiments.session.steps import Failed, FireShot, Interrupted
from experiments.study.folders import place
from tests.at_controls import (
    DIRECTION,
    GUARD_S,
    PATIENCE_S,
    PREFERENCE,
    Sitting,
    WatchedGun,
    gated,
    remarks,
    sat,
    sat_at,
)
from tests.live_hands import DUE, LEAST_S, LIVE, S, by_hand, of_journal, own_key, prepare, to_the_end

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("state", LIVE)
def test_an_emergency_stop_halts_before_the_gun_hears_of_it_and_nothing_arms_or_fires_afterwards(
    state: State, tmp_path: Path
) -> None:
    with sat_at(state, tmp_path) as sitting:
        before = len(sitting.gun.calls)
        assert sitting.live.offer(events.EmergencyStop())
        hands = [threading.Thread(target=all_at_once, args=(sitting,)) for _ in range(4)]
        for hand in hands:
            hand.start()
        for hand in hands:
            hand.join(PATIENCE_S)
        sitting.gun.release()
        if sitting.gate is not None:
            sitting.gate.open()
        sitting.settle()
        sitting.live.settle()
        assert sitting.position.base is S.HALTED
        calls = sitting.gun.calls[before:]
        assert {call.word for call in calls} == {"disarm", "disarmed"}
        assert {call.position.base for call in calls} == {S.HALTED}
        assert sitting.gun.status().state == "disarmed"
        contents = of_journal(sitting)
    assert isinstance(sitting.error, RunStopped)
    assert str(sitting.error) == EMERGENCY
    assert len(remarks(contents, Halted)) == 1 + (state is S.REARMING)


def all_at_once(sitting: Sitting) -> None:
    """Everything that a hand could do, but end the run."""
    for event in (*DUE.values(), own_key(sitting), events.Leave(), events.Repeat(reason="moved"), events.Pause()):
        sitting.live.offer(event)


def test_the_gun_itself_is_asked_after_the_emergency_stop(tmp_path: Path) -> None:
    with sat_at(S.TRAIN, tmp_path) as sitting:
        assert sitting.gun.status().state != "disarmed"
        sitting.live.offer(events.EmergencyStop())
        sitting.live.settle()
        assert sitting.window.gun is not None
        assert sitting.window.gun.status is not None
        assert (sitting.window.gun.status.state, sitting.window.gun.fault) == ("disarmed", "")
        assert sitting.window.troubles == []


@pytest.mark.parametrize("state", [S.TRAIN, S.FIRING, S.ASKING])
def test_a_gun_that_does_not_answer_is_to_be_switched_off_and_the_reason_can_still_be_told(
    state: State, tmp_path: Path
) -> None:
    with sat_at(state, tmp_path) as sitting:
        sitting.gun.mute = True
        sitting.live.offer(events.EmergencyStop())
        sitting.live.settle()
        sitting.gun.release()
        sitting.settle()
        assert sitting.window.gun is not None
        assert sitting.window.gun.status is None
        assert sitting.window.gun.fault == "no answer"
        assert "switch off its power" in sitting.window.troubles[0]
        assert sitting.state is S.HALTED
        assert sitting.live.offer(events.Reason(text="it smelt"))
        sitting.press("Q")
        contents = of_journal(sitting)
    assert "switch off its power" in str(sitting.error)
    assert remarks(contents, HaltReason) == [HaltReason(text="it smelt")]


PASSED = pytest.mark.parametrize("passed", [0, 1], ids=["hand-over", "shot"])
"""Between the key and the shot two records are synced: that of the hand-over, and that of the step."""


@PASSED
def test_a_halt_between_the_key_and_the_shot_fires_nothing(passed: int, tmp_path: Path) -> None:
    with gated() as gate, sat(DIRECTION, tmp_path, gate=gate) as sitting:
        at_sync(sitting, passed)
        assert sitting.live.offer(events.EmergencyStop())
        gate.open()
        sitting.settle()
        assert "arm" not in sitting.gun.words
        assert "fire" not in sitting.gun.words
        sitting.press("Q")
        sitting.finish()
        with sat(DIRECTION, tmp_path, resumed=True) as again:
            again.to(S.PREPARING)
            assert again_text(again.live.history, prepare(again)) == ""
            _, rows = to_the_end(again)
    assert (rows[0]["attempts"], rows[0]["flags"]) == ("1", "")


def at_sync(sitting: Sitting, passed: int) -> None:
    """Press the key to fire, and have the disk hold one of the records before the shot."""
    assert sitting.gate is not None
    sitting.to(S.PREPARING)
    sitting.ready()
    sitting.gate.shut(after=passed)
    sitting.window.press("Space")
    assert sitting.gate.holds.wait(PATIENCE_S)
    assert sitting.state is S.FIRING


@PASSED
@pytest.mark.parametrize("gone_on", [False, True])
def test_a_pause_between_the_key_and_the_shot_takes_the_shot_back_also_if_it_is_over_by_then(
    passed: int, gone_on: bool, tmp_path: Path
) -> None:
    with gated() as gate, sat(DIRECTION, tmp_path, gate=gate) as sitting:
        at_sync(sitting, passed)
        assert sitting.live.offer(events.Pause())
        if gone_on:
            assert sitting.live.offer(events.GoOn())
        gate.open()
        sitting.settle()
        assert "fire" not in sitting.gun.words
        assert sitting.position.base in (S.SETTING, S.PREPARING)
        assert again_text(sitting.live.history, prepare(sitting)) == ""
        contents, rows = to_the_end(sitting)
    given_up = next(word for step, word in history(contents) if isinstance(step, FireShot))
    assert given_up == Interrupted(presented=False, cause="pause")
    assert (rows[0]["attempts"], rows[0]["flags"]) == ("1", "")


@pytest.mark.parametrize("name", ["halt", "pause", "pause that is over"])
@pytest.mark.parametrize("setup", [DIRECTION, PREFERENCE], ids=["one shot", "train"])
def test_what_comes_while_the_gun_is_being_armed_takes_the_shot_back(setup: Any, name: str, tmp_path: Path) -> None:
    with sat(setup, tmp_path) as sitting:
        sitting.to(S.PREPARING)
        sitting.gun.hang = "arm"
        sitting.press("Space")
        assert sitting.live.offer(events.EmergencyStop() if name == "halt" else events.Pause())
        if name == "pause that is over":
            assert sitting.live.offer(events.GoOn())
        sitting.live.settle()  # the gun is disarmed, and then it arms
        sitting.gun.release()
        sitting.settle()
        assert sitting.position.base is S.HALTED if name == "halt" else sitting.position.base is not S.HALTED
        assert "fire" not in sitting.gun.words
        assert sitting.gun.status().state == "disarmed"


@pytest.mark.parametrize("setup", [DIRECTION, PREFERENCE], ids=["one shot", "train"])
def test_an_emergency_stop_right_before_the_gun_is_armed_leaves_it_unarmed(setup: Any, tmp_path: Path) -> None:
    with sat(setup, tmp_path) as sitting:
        sitting.to(S.PREPARING)
        settle = sitting.live.settle

        def stopped_meanwhile() -> None:
            settle()
            sitting.live.offer(events.EmergencyStop())

        sitting.live.settle = stopped_meanwhile
        sitting.press("Space")
        assert sitting.position.base is S.HALTED
        assert "arm" not in sitting.gun.words


def test_a_stop_between_the_key_and_the_shot_is_no_attempt(tmp_path: Path) -> None:
    with gated() as gate, sat(DIRECTION, tmp_path, gate=gate) as sitting:
        at_sync(sitting, 1)
        assert sitting.live.offer(events.Stop(reason="lunch"))
        gate.open()
        sitting.finish()
        with sat(DIRECTION, tmp_path, resumed=True) as again:
            _, rows = to_the_end(again)
    assert (rows[0]["attempts"], rows[0]["flags"]) == ("1", "")


def test_a_pause_while_a_shot_hangs_in_the_gun_takes_it_back(tmp_path: Path) -> None:
    with sat_at(S.FIRING, tmp_path) as sitting:
        assert sitting.live.offer(events.Pause())
        sitting.live.settle()
        sitting.gun.release()
        sitting.settle()
        assert "rendered" not in sitting.gun.words
        assert sitting.position.states[-1] is S.PAUSED
        contents, rows = to_the_end(sitting)
    assert Interrupted(presented=False, cause="pause") in [word for _, word in history(contents)]
    assert (rows[0]["attempts"], rows[0]["flags"]) == ("1", "")


def test_a_pause_ends_a_train_and_its_trial_is_presented_again_with_both_exposures_kept(tmp_path: Path) -> None:
    with sat_at(S.TRAIN, tmp_path) as sitting:
        sitting.clock.skip(1.5)
        sitting.settle()
        sitting.press("P")
        sitting.live.settle()
        shots = sitting.gun.words.count("rendered")
        assert shots == 2
        sitting.clock.skip(60.0)
        sitting.settle()
        assert sitting.gun.words.count("rendered") == shots
        assert sitting.gun.status().state == "disarmed"
        contents, rows = to_the_end(sitting)
    ended = next(word for _, word in history(contents) if isinstance(word, Interrupted))
    assert (ended.presented, ended.cause, ended.shots) == (True, "pause", 2)
    assert ended.exposure_s == pytest.approx(1.5 + 2 * 0.03 + GUARD_S + 0.01, abs=0.05)
    assert (rows[0]["attempts"], rows[0]["flags"]) == ("2", "paused")
    assert float(rows[0]["earlier_exposure_s"]) == ended.exposure_s
    assert float(rows[0]["exposure_s"]) > LEAST_S


def test_of_trains_at_which_the_gun_failed_or_the_run_ended_it_is_known_how_long_they_were_felt(tmp_path: Path) -> None:
    with sat_at(S.TRAIN, tmp_path) as sitting:
        for _ in range(2):
            sitting.clock.skip(1.0)
            sitting.settle()
        sitting.gun.fails = [LinkError("no answer")]
        sitting.clock.skip(1.0)
        sitting.settle()
        sitting.to(S.TRAIN)
        sitting.clock.skip(1.0)
        sitting.settle()
        assert sitting.live.offer(events.EmergencyStop())
    with sat(PREFERENCE, tmp_path, resumed=True) as sitting:
        contents, rows = to_the_end(sitting)
    ended = [word for _, word in history(contents) if isinstance(word, Failed | Interrupted)]
    assert [(word.presented, word.shots) for word in ended] == [(True, 3), (True, 2)]
    assert [word.exposure_s for word in ended] == pytest.approx([2.0, 1.0])
    assert (rows[0]["attempts"], rows[0]["flags"]) == ("3", "device-error interrupted")
    assert float(rows[0]["earlier_exposure_s"]) == pytest.approx(3.0)


def test_a_disarming_that_is_slow_does_not_disarm_the_next_shot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with sat_at(S.TRAIN, tmp_path) as sitting:
        sitting.gun.slow = True
        sitting.live.offer(events.Pause())
        assert sitting.gun.hangs.wait(PATIENCE_S)
        waits, settle = threading.Event(), sitting.live.settle

        def watched() -> None:
            waits.set()
            settle()

        monkeypatch.setattr(sitting.live, "settle", watched)
        before = len(sitting.gun.calls)
        sitting.gun.hangs.clear()  # the run goes on meanwhile
        sitting.settle()
        sitting.live.offer(events.GoOn())
        sitting.settle()
        assert sitting.state is S.PREPARING
        sitting.live.offer(events.Fire())
        assert waits.wait(PATIENCE_S)
        sitting.gun.release()
        sitting.settle()
        said = [(call.word, call.beside) for call in sitting.gun.calls[before:]]
        assert said.index(("disarmed", True)) < said.index(("arm", False)) < said.index(("rendered", False))


@pytest.mark.parametrize("end", [events.Stop(reason="lunch"), events.EmergencyStop()], ids=["stop", "emergency stop"])
def test_a_stop_while_the_gun_cannot_be_armed_is_no_attempt(end: Event, tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        arm = sitting.gun.arm

        def arm_in_vain() -> None:
            arm()
            raise LinkError("the line is gone")

        sitting.to(S.PREPARING)
        sitting.gun.hang = "arm"
        sitting.gun.arm = arm_in_vain
        sitting.press("Space")
        assert sitting.live.offer(end)
        sitting.gun.release()
        of_journal(sitting)
        with sat(DIRECTION, tmp_path, resumed=True) as again:
            _, rows = to_the_end(again)
    assert rows[0]["attempts"] == "1"


def test_next_said_while_a_shot_fails_leaves_a_fault_of_the_gun_and_no_pause_and_is_on_record(tmp_path: Path) -> None:
    with sat_at(S.TRAIN, tmp_path) as sitting:
        sitting.gun.hang = "fire"
        sitting.gun.fails = [LinkError("no answer")]
        sitting.clock.skip(LEAST_S + 0.5)
        sitting.settle()
        assert sitting.gun.hangs.is_set()
        assert sitting.live.offer(events.Next())
        sitting.gun.release()
        sitting.settle()
        contents, rows = to_the_end(sitting)
    assert (rows[0]["attempts"], rows[0]["flags"]) == ("2", "device-error")
    assert remarks(contents, Refused) == [Refused(event="next", state=S.TRAIN, because="no answer", by="experimenter")]


@pytest.mark.parametrize(("error", "attempts"), [(LinkError("no answer"), "2"), (LimitError("too soon"), "1")])
def test_a_shot_that_was_refused_was_not_felt_and_one_of_unknown_outcome_may_have_been(
    error: Exception, attempts: str, tmp_path: Path
) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.PREPARING)
        sitting.gun.fails = [error]
        sitting.press("Space")
        sitting.to(S.PREPARING)
        again = again_text(sitting.live.history, prepare(sitting))
        contents, rows = to_the_end(sitting)
    assert again == ("Presented again, for the second time." if attempts == "2" else "")
    assert (rows[0]["attempts"], rows[0]["flags"]) == (attempts, "device-error")
    assert [word.cause for _, word in history(contents) if isinstance(word, Failed)] == [str(error)]


def test_a_practice_after_an_emergency_stop_is_to_be_done_again_as_none_is_resumed(tmp_path: Path) -> None:
    with sat_at(S.HALTED, tmp_path) as sitting:
        assert by_hand(sitting, events.Fire()).text.endswith("close it, then resume it.")
        sitting.live.plan = replace(sitting.live.plan, practice=True)
        assert by_hand(sitting, events.Fire()).text.endswith("close it, then do it again.")


def test_after_an_emergency_stop_a_test_shot_comes_first_for_a_key_held_a_second(tmp_path: Path) -> None:
    with sat_at(S.HALTED, tmp_path) as halted:
        halted.live.offer(events.Reason(text="the cable was loose"))
        halted.press("Q")
    with sat(DIRECTION, tmp_path, resumed=True) as sitting:
        assert sitting.state is S.REARMING
        assert by_hand(sitting, events.Fire()).text.startswith("After an emergency stop a test shot comes first")
        assert by_hand(sitting, events.Rearm(held_s=0.999)).text == "Hold it for 1 s."
        assert sitting.gun.words == []
        assert by_hand(sitting, events.Rearm(held_s=1.0))
        assert sitting.gun.words.count("rendered") == 1
        assert sitting.gun.status().state == "disarmed"
        contents, rows = to_the_end(sitting)
    [shot] = shots_of(contents)
    assert (shot.held_s, shot.cause, shot.motion) == (1.0, "", "home")
    assert shot.pulse_start_s is not None
    assert remarks(contents, HaltReason) == [HaltReason(text="the cable was loose")]
    assert rows[1]["attempts"] == "2"  # the shot that was fired and not answered, and that after the halt


def shots_of(contents: Any) -> list[words.TestShot]:
    return [shot for shot in remarks(contents, words.TestShot) if isinstance(shot, words.TestShot)]


def test_a_test_shot_that_failed_is_asked_for_again(tmp_path: Path) -> None:
    with sat_at(S.REARMING, tmp_path) as sitting:
        sitting.gun.fails = [LinkError("no answer")]
        assert by_hand(sitting, events.Rearm(held_s=1.5))
        assert sitting.state is S.REARMING
        assert by_hand(sitting, events.Rearm(held_s=1.5))
        assert sitting.position.base in (S.SETTING, S.PREPARING)
        contents = of_journal(sitting)
    assert [shot.cause for shot in shots_of(contents)] == ["no answer", ""]


def test_the_test_shot_is_owed_until_it_was_fired_however_often_the_run_ends(tmp_path: Path) -> None:
    with sat_at(S.REARMING, tmp_path) as sitting:
        assert by_hand(sitting, events.Stop(reason="not yet"))
    for end in (events.EmergencyStop(), events.Stop(reason="nor now")):
        with sat(DIRECTION, tmp_path, resumed=True) as sitting:
            assert sitting.state is S.REARMING
            sitting.live.offer(end)
    with sat(DIRECTION, tmp_path, resumed=True) as sitting:
        sitting.to(S.PREPARING)
        assert sitting.gun.words.count("rendered") == 1
    with sat(DIRECTION, tmp_path, resumed=True) as sitting:
        assert sitting.position.base in (S.SETTING, S.PREPARING)


@pytest.mark.parametrize("resumed", [False, True], ids=["in the halt", "before the test shot"])
def test_the_test_shot_is_owed_also_if_the_process_died(resumed: bool, tmp_path: Path) -> None:
    died = place(tmp_path / "died", "P01", "direction").journal
    with sat_at(S.REARMING if resumed else S.HALTED, tmp_path / "lived") as sitting:
        if not resumed:
            sitting.live.offer(events.Note(text="n"))
        wait_for_the_disk(sitting)
        died.parent.mkdir(parents=True)
        died.write_bytes(place(tmp_path / "lived", "P01", "direction").journal.read_bytes())
    assert b'"stopped"' not in died.read_bytes() or resumed
    with sat(DIRECTION, tmp_path / "died", resumed=True) as sitting:
        assert sitting.state is S.REARMING


def wait_for_the_disk(sitting: Sitting) -> None:
    """Wait until what was written is on the disk."""
    sitting.live.journal.append("remark", body={"kind": "noted", "trial": None, "text": "now"})


@pytest.mark.parametrize(
    "name",
    [
        "direction_journal.aside-1",
        "direction_practice_journal",
        "direction_practice_journal.aside-2",
        "preference_journal",
    ],
)
def test_what_a_participant_does_after_an_emergency_stop_begins_with_a_test_shot(name: str, tmp_path: Path) -> None:
    with sat_at(S.HALTED, tmp_path) as sitting:
        sitting.press("Q")
    journal = place(tmp_path, "P01", "direction").journal
    journal.rename(journal.with_name(f"sub-P01_task-{name}.jsonl"))
    with sat(DIRECTION, tmp_path) as sitting:  # it ends before the test shot
        assert sitting.state is S.REARMING
    with sat(DIRECTION, tmp_path, resumed=True) as sitting:
        assert sitting.state is S.REARMING
        sitting.clock.skip(3600.0)
        sitting.to(S.PREPARING)
        assert sitting.gun.words.count("rendered") == 1
        assert [one.text for one in remarks(of_journal(sitting), Noted)] == [HALTED_BEFORE]
    journal.rename(journal.with_name("sub-P01_task-direction_journal.aside-3.jsonl"))
    with sat(DIRECTION, tmp_path) as sitting:  # a test shot is the last word by now
        assert sitting.position.base in (S.SETTING, S.PREPARING)


@pytest.mark.parametrize(("gun", "owed"), [("7", True), ("8", False), ("simulated", False)])
def test_the_next_participant_on_the_same_gun_begins_with_a_test_shot(
    gun: str, owed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def is_now(serial: str) -> None:
        identity = Identity(model="simulated" if serial == "simulated" else "shaker", version="2", serial=serial)
        monkeypatch.setattr(WatchedGun, "identify", lambda _: identity, raising=False)

    is_now("simulated" if gun == "simulated" else "7")
    with sat_at(S.HALTED, tmp_path) as sitting:
        sitting.press("Q")
    (tmp_path / "sub-P01").rename(tmp_path / "sub-P02")  # they were somebody else
    is_now(gun)
    with sat(DIRECTION, tmp_path) as sitting:
        assert (sitting.state is S.REARMING) is owed
        sitting.to(S.PREPARING)
        assert [one.text for one in remarks(of_journal(sitting), Noted)] == [HALTED_BEFORE] * owed
    (tmp_path / "sub-P01").rename(tmp_path / "sub-P03")
    with sat(DIRECTION, tmp_path) as sitting:  # a test shot was made, or another gun was used
        assert sitting.position.base in (S.SETTING, S.PREPARING)


@pytest.mark.parametrize("by_name", [True, False])
@pytest.mark.parametrize(("gun", "owed"), [("7", True), ("9", False), ("simulated", False)])
def test_a_run_pays_the_test_shot_that_one_beside_all_runs_left_owed(
    gun: str, owed: bool, by_name: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    identity = Identity(model="simulated" if gun == "simulated" else "shaker", version="2", serial=gun)
    monkeypatch.setattr(WatchedGun, "identify", lambda _: identity, raising=False)
    for number in ("8", "7" if by_name else ""):  # the first is another gun's
        name = number and f"shaker:{number}"
        owe_shot(
            tmp_path, OwedShot(utc="2000-01-01T00:00:00.000+00:00", gun=name, address=f"serial:/dev/{number or 7}")
        )
    owed = owed or (gun == "9" and not by_name)  # whose it is nobody knows
    with sat(DIRECTION, tmp_path) as sitting:
        assert (sitting.state is S.REARMING) is owed
        sitting.to(S.PREPARING)
        assert [one.text for one in remarks(of_journal(sitting), Noted)] == [HALTED_BEFORE] * owed
    (tmp_path / "sub-P01").rename(tmp_path / "sub-P02")
    with sat(DIRECTION, tmp_path) as sitting:  # the journal of the first has a test shot since
        assert sitting.position.base in (S.SETTING, S.PREPARING)
    assert owes_shot(tmp_path, "serial:/dev/7") is not (gun == "7" and by_name)  # that was paid
    assert owes_shot(tmp_path, "serial:/dev/8")


def test_what_nobody_can_read_each_gun_owes_until_a_run_of_its_own_paid_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / OWED_FILE).write_bytes(b"[" * 100_000)
    os.utime(tmp_path / OWED_FILE, (0.0, 0.0))  # long before the run's own clock
    for code, serial, owed in (("P02", "7", True), ("P03", "7", False), ("P04", "8", True)):
        identity = Identity(model="shaker", version="2", serial=serial)
        monkeypatch.setattr(WatchedGun, "identify", lambda _, found=identity: found, raising=False)
        with sat(DIRECTION, tmp_path) as sitting:
            assert (sitting.state is S.REARMING) is owed
            sitting.to(S.PREPARING)
        (tmp_path / "sub-P01").rename(tmp_path / f"sub-{code}")


def test_a_gun_owes_its_test_shot_until_that_is_fired_on_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither a run that ends before it, nor a test shot on the gun that was taken instead, pays it."""

    def on(serial: str) -> None:
        identity = Identity(model="shaker", version="2", serial=serial)
        monkeypatch.setattr(WatchedGun, "identify", lambda _: identity, raising=False)

    def next_one(code: str) -> None:
        (tmp_path / "sub-P01").rename(tmp_path / f"sub-{code}")

    on("A:1")
    with sat_at(S.HALTED, tmp_path) as sitting:
        sitting.press("Q")
    on("B")
    with sat(DIRECTION, tmp_path, resumed=True) as sitting:
        assert sitting.state is S.REARMING
        sitting.to(S.PREPARING)
        assert sitting.gun.words.count("rendered") == 1
    next_one("P02")
    on("A:1")
    with sat(DIRECTION, tmp_path) as sitting:  # it ends before the test shot
        assert sitting.state is S.REARMING
    next_one("P03")
    with sat(DIRECTION, tmp_path) as sitting:
        assert sitting.state is S.REARMING
        sitting.to(S.PREPARING)
        assert sitting.gun.words.count("rendered") == 1
    next_one("P04")
    with sat(DIRECTION, tmp_path) as sitting:
        assert sitting.position.base in (S.SETTING, S.PREPARING)


def test_a_journal_that_cannot_be_read_is_in_the_way_of_no_other_run(tmp_path: Path) -> None:
    beside = place(tmp_path, "P01", "preference").journal
    beside.parent.mkdir(parents=True)
    beside.write_bytes(b"{}\n")
    with sat(DIRECTION, tmp_path) as sitting:
        assert sitting.position.base in (S.SETTING, S.PREPARING)


def test_an_emergency_stop_during_the_test_shot_owes_another_one(tmp_path: Path) -> None:
    with sat_at(S.REARMING, tmp_path) as sitting:
        sitting.gun.hang = "fire"
        sitting.ready()
        sitting.live.offer(events.Rearm(held_s=1.0))
        sitting.settle()
        assert sitting.state is S.FIRING
        sitting.live.offer(events.EmergencyStop())
        sitting.live.settle()
        sitting.gun.release()
        sitting.settle()
        assert "rendered" not in sitting.gun.words
    with sat(DIRECTION, tmp_path, resumed=True) as sitting:
        assert sitting.state is S.REARMING
