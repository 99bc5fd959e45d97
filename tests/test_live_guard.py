"""When an event is taken in a live run: the guard, standstills, and whose the keys are."""

from __future__ import annotations

from pathlib import Path

import pytest

from device.serial_gun.triggering import ARM_WITHIN_S
from experiments.live_run import EventVerdict
from experiments.record.replay import history
from experiments.session import events
from experiments.session import remarks as words
from experiments.session.events import Event, Press
from experiments.session.judging import HEARS_LATE, KEYS_ELSEWHERE, STANDSTILL_S, STOOD_STILL
from experiments.session.remarks import Paused, Refused
from experiments.session.states import State
from experiments.session.steps import Presented
from tests.at_controls import GUARD_S, PATIENCE_S, PREFERENCE, Sitting, remarks, sat, sat_at
from tests.live_hands import DUE, LEAST_S, S, by_hand, of_journal, presses

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("state", DUE)
def test_what_carries_on_counts_from_the_guard_time_after_its_position_was_painted(
    state: State, tmp_path: Path
) -> None:
    event = DUE[state]
    with sat_at(state, tmp_path) as sitting:
        sitting.clock.skip(LEAST_S)
        position = sitting.position
        unpainted = sitting.live.offer(event, Press(at_s=4096.0, serial=position.serial))
        painted_s, serial = presses(sitting)
        for early_s in (-1.0, 0.0, 0.249):
            verdict = sitting.live.offer(event, Press(at_s=painted_s + early_s, serial=serial))
            assert verdict == EventVerdict(taken=False, text="Too soon after the change: press again.")
        old = sitting.live.offer(event, Press(at_s=painted_s + 1.0, serial=serial - 1))
        assert (
            unpainted
            == old
            == EventVerdict(taken=False, text="That was pressed for what stood there before: press again.")
        )
        assert sitting.position == position
        assert GUARD_S == 0.25
        assert sitting.live.offer(event, Press(at_s=painted_s + 0.25, serial=serial))


@pytest.mark.parametrize("state", DUE)
def test_what_no_hand_pressed_is_not_guarded(state: State, tmp_path: Path) -> None:
    with sat_at(state, tmp_path) as sitting:
        sitting.clock.skip(LEAST_S)
        assert sitting.live.offer(DUE[state])


@pytest.mark.parametrize("event", [events.Pause(), events.EmergencyStop(), events.Stop(reason="lunch")])
def test_what_stops_or_holds_is_not_guarded(event: Event, tmp_path: Path) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        assert sitting.live.offer(event, Press(at_s=0.0, serial=-1))


def test_a_gun_that_does_not_answer_is_not_fired_until_it_does(tmp_path: Path) -> None:
    with sat_at(S.PREPARING, tmp_path) as sitting:
        sitting.live.gun_silence = "the gun is not there."
        refused = by_hand(sitting, events.Fire())
        assert refused == EventVerdict(taken=False, text="See to the gun first: the gun is not there.")
        assert sitting.position.state is S.PREPARING
        sitting.live.gun_silence = ""
        assert by_hand(sitting, events.Fire())


def looks(sitting: Sitting, times: int) -> None:
    """The screen looks at its keys in time, as often as that."""
    for _ in range(times):
        sitting.live.beats.beat()
        sitting.clock.skip(0.1)


def looks_while_it_waits(sitting: Sitting) -> None:
    """From now on the screen looks whenever the run waits for the gun."""
    gets_ready = sitting.clock.by_itself
    sitting.clock.by_itself = lambda: sitting.live.beats.beat() or gets_ready()


@pytest.mark.parametrize("came", ["before the screen looks again", "with one of its first looks"])
def test_a_shot_that_was_asked_for_while_the_screen_stood_still_is_not_fired(came: str, tmp_path: Path) -> None:
    with sat_at(S.PREPARING, tmp_path) as sitting:
        looks(sitting, 10)
        sitting.clock.skip(9.0)
        looks(sitting, 0 if came.startswith("before") else 2)
        refused = by_hand(sitting, events.Fire())
        assert not refused
        assert refused.text.startswith("The console stood still as that was pressed: ")
        looks(sitting, 4)
        assert not sitting.live.offer(
            events.Fire(), Press(at_s=sitting.clock.now() - 5.0, serial=sitting.position.serial)
        )
        assert "rendered" not in sitting.gun.words
        looks_while_it_waits(sitting)
        assert by_hand(sitting, events.Fire())
        assert [one.event for one in remarks(of_journal(sitting), Refused)] == ["fire", "fire"]


def test_on_a_computer_too_busy_to_hear_a_stop_nothing_fires_and_the_run_says_why(tmp_path: Path) -> None:
    with sat_at(S.PREPARING, tmp_path) as sitting:
        looks(sitting, 10)
        for _ in range(3):
            sitting.clock.skip(0.5)
            sitting.live.beats.beat()
        gets_ready = sitting.clock.by_itself
        sitting.clock.by_itself = lambda: sitting.clock.skip(0.5) or sitting.live.beats.beat() or gets_ready()
        assert by_hand(sitting, events.Fire())
        assert sitting.position.states == (S.PREPARING, S.PAUSED)
        assert (sitting.position.why, sitting.gun.words[-1]) == (HEARS_LATE, "disarmed")
        assert "rendered" not in sitting.gun.words
        sitting.clock.by_itself = gets_ready
        looks(sitting, 10)
        looks_while_it_waits(sitting)
        for event in (events.GoOn(), events.Fire()):
            assert by_hand(sitting, event)
        assert sitting.gun.words.count("rendered") == 1
        assert [one.cause for one in remarks(of_journal(sitting), Paused)] == [HEARS_LATE]


@pytest.mark.parametrize(("away_s", "goes_on"), [(0.2, True), (3.0, False)])
def test_a_train_fires_nothing_while_the_keys_are_elsewhere(away_s: float, goes_on: bool, tmp_path: Path) -> None:
    """They pass from window to window in a moment."""
    with sat_at(S.TRAIN, tmp_path) as sitting:
        looks(sitting, 3)
        fired = sitting.gun.words.count("rendered")
        for _ in range(round(away_s / 0.1)):
            sitting.live.beats.beat(heard=False)
            sitting.clock.skip(0.1)
            sitting.settle()
        looks(sitting, 0 if not goes_on else 12)
        sitting.settle()
        assert (S.PAUSED in sitting.position.states) is not goes_on
        assert goes_on or sitting.position.why == KEYS_ELSEWHERE
        assert goes_on or sitting.gun.words[-1] == "disarmed"
        assert sitting.gun.words.count("rendered") == fired + goes_on


@pytest.mark.parametrize(("state", "event"), [(S.TRAIN, None), (S.REARMING, events.Rearm(held_s=1.0))])
def test_nothing_is_fired_behind_keys_that_were_elsewhere_since_they_were_to_fire(
    state: State, event: Event | None, tmp_path: Path
) -> None:
    """They are here again before the next shot of a train, or at the end of the hold of a test shot; F12 was not."""
    with sat_at(state, tmp_path) as sitting:
        looks(sitting, 3)
        fired = sitting.gun.words.count("rendered")
        for _ in range(5):  # for half a second
            sitting.live.beats.beat(heard=False)
            sitting.clock.skip(0.1)
        looks(sitting, 2)
        if event is not None:
            assert by_hand(sitting, event)
        looks(sitting, 10)
        sitting.settle()
        assert sitting.gun.words.count("rendered") == fired
        assert sitting.position.why == KEYS_ELSEWHERE
        assert sitting.gun.words[-1] == "disarmed"


@pytest.mark.parametrize("heard", [True, False])
def test_a_click_from_another_window_fires_at_once_if_it_gives_the_console_the_keys(
    heard: bool, tmp_path: Path
) -> None:
    """It gives none where another program has grabbed the keyboard; the next look would say so too late."""
    with sat_at(S.PREPARING, tmp_path) as sitting:
        looks(sitting, 3)
        for _ in range(20):
            sitting.live.beats.beat(heard=False)
            sitting.clock.skip(0.1)
        if heard:
            sitting.live.beats.hear()
            looks_while_it_waits(sitting)
        assert by_hand(sitting, events.Fire())
        assert sitting.gun.words.count("rendered") == heard
        assert (sitting.position.why == KEYS_ELSEWHERE) is (S.PAUSED in sitting.position.states) is not heard


@pytest.mark.parametrize("state", [S.PREPARING, S.REARMING])
def test_nor_is_one_before_which_the_program_stood_still_on_its_way(state: State, tmp_path: Path) -> None:
    with sat_at(state, tmp_path) as sitting:
        looks(sitting, 10)
        sitting.gun.hang = "arm"
        assert sitting.live.offer(DUE[state])
        assert sitting.gun.hangs.wait(PATIENCE_S)
        sitting.clock.skip(9.0)
        looks(sitting, 5)
        fired = sitting.gun.words.count("rendered")
        sitting.gun.release()
        sitting.settle()
        assert sitting.position.states == (state, S.PAUSED)
        assert sitting.gun.words.count("rendered") == fired
        assert sitting.gun.words[-1] == "disarmed"
        assert sitting.position.why == STOOD_STILL
        looks_while_it_waits(sitting)
        for event in (events.GoOn(), DUE[state]):
            assert by_hand(sitting, event)
        assert sitting.gun.words.count("rendered") == fired + 1
        assert [one.cause for one in remarks(of_journal(sitting), Paused)] == [STOOD_STILL]
        shots = [one.cause for one in remarks(of_journal(sitting), words.TestShot)]
        assert shots == ([STOOD_STILL, ""] if state is S.REARMING else [])


@pytest.mark.parametrize("stood_s", [0.9, 9.0])
def test_a_train_fires_none_late_as_the_program_wakes(stood_s: float, tmp_path: Path) -> None:
    with sat_at(S.TRAIN, tmp_path) as sitting:
        looks(sitting, 3)
        sitting.clock.skip(stood_s)
        sitting.settle()
        assert sitting.gun.words.count("rendered") == 1
        assert (S.PAUSED in sitting.position.states) == (stood_s == 9.0)


def test_a_train_goes_on_after_a_short_standstill_at_a_tick_of_its_own(tmp_path: Path) -> None:
    with sat_at(S.TRAIN, tmp_path) as sitting:
        onset_s = sitting.position.onset_s
        looks(sitting, 3)
        sitting.clock.skip(0.9)
        for _ in range(20):
            looks(sitting, 1)
            sitting.settle()
        shots = [one.body["pulse_start_s"] for one in of_journal(sitting).records if one.kind == "shot"]
    assert onset_s is not None
    assert [round(one - onset_s, 6) for one in shots] == [0.0, 2.0, 3.0]


@pytest.mark.parametrize("state", [S.PREPARING, S.REARMING])
def test_a_stop_that_waits_as_the_program_wakes_is_heard_before_a_first_shot(state: State, tmp_path: Path) -> None:
    with sat_at(state, tmp_path) as sitting:
        looks(sitting, 10)
        fired = sitting.gun.words.count("rendered")
        sitting.gun.hang = "arm"
        assert sitting.live.offer(DUE[state])
        assert sitting.gun.hangs.wait(PATIENCE_S)
        sitting.clock.by_itself = lambda: False
        sitting.clock.skip(0.7)
        sitting.gun.release()
        assert sitting.clock.idle.wait(PATIENCE_S)
        assert sitting.live.offer(events.EmergencyStop(by="participant"))
        sitting.settle()
        assert sitting.state is S.HALTED
        assert sitting.gun.words.count("rendered") == fired


def test_a_standstill_as_long_as_a_gun_may_be_away_keeps_no_shot(tmp_path: Path) -> None:
    with sat_at(S.PREPARING, tmp_path) as sitting:
        looks(sitting, 10)
        sitting.clock.skip(ARM_WITHIN_S / 2)
        assert by_hand(sitting, events.Fire())
    assert STANDSTILL_S == ARM_WITHIN_S


def test_what_holds_stops_or_answers_counts_however_long_the_screen_stood_still(tmp_path: Path) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        for event in (
            events.Pause(),
            events.GoOn(),
            events.Answer(response="forward", at_s=0.0),
            events.EmergencyStop(),
        ):
            looks(sitting, 10)
            sitting.clock.skip(9.0)
            assert bool(by_hand(sitting, event)) == (not isinstance(event, events.GoOn))
            if isinstance(event, events.GoOn):
                looks(sitting, 5)
                assert by_hand(sitting, event)


def test_nor_is_the_test_shot_after_an_emergency_stop(tmp_path: Path) -> None:
    with sat_at(S.REARMING, tmp_path) as sitting:
        sitting.live.gun_silence = "the gun is not there."
        refused = by_hand(sitting, events.Rearm(held_s=1.0))
        assert refused == EventVerdict(taken=False, text="See to the gun first: the gun is not there.")
        sitting.live.gun_silence = ""
        assert by_hand(sitting, events.Rearm(held_s=1.0))


def test_a_test_shot_that_was_typed_while_the_screen_stood_still_is_not_fired(tmp_path: Path) -> None:
    with sat_at(S.REARMING, tmp_path) as sitting:
        looks(sitting, 10)
        sitting.clock.skip(9.0)
        assert by_hand(sitting, events.Rearm(held_s=None)).text.startswith("The console stood still as that was")
        looks(sitting, 5)
        assert by_hand(sitting, events.Rearm(held_s=None))


def test_next_is_taken_from_the_least_exposure_on_and_not_before_the_first_shot(tmp_path: Path) -> None:
    with sat(PREFERENCE, tmp_path) as sitting:
        sitting.to(S.PREPARING)
        sitting.gun.hang = "fire"
        sitting.press("Space")
        too_soon = EventVerdict(taken=False, text="Too soon: it is to be felt for longer.")
        assert sitting.live.offer(events.Next()) == too_soon
        sitting.gun.release()
        sitting.settle()
        onset_s = sitting.position.onset_s
        assert onset_s is not None
        sitting.clock.skip(onset_s + LEAST_S - 0.001 - sitting.clock.now())
        assert sitting.live.offer(events.Next()) == too_soon
        sitting.clock.skip(0.0011)
        assert sitting.live.offer(events.Next())
        contents = of_journal(sitting)
    presented = next(word for _, word in history(contents) if isinstance(word, Presented))
    assert presented.ended_by == "next"
    assert presented.exposure_s >= LEAST_S


def test_a_pause_ends_while_the_first_shot_of_a_train_still_hangs(tmp_path: Path) -> None:
    with sat(PREFERENCE, tmp_path) as sitting:
        sitting.to(S.PREPARING)
        sitting.gun.hang = "fire"
        sitting.press("Space")
        assert sitting.live.offer(events.Pause())
        assert sitting.live.offer(events.GoOn())
        sitting.gun.release()
        sitting.settle()
        assert sitting.state is S.SETTING or sitting.state is S.PREPARING
