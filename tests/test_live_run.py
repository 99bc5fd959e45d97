"""A live run with a real journal and the simulated gun: who may do what, as the side that runs decides it."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from device import Identity, LimitError, LinkError
from device.serial_gun.triggering import ARM_WITHIN_S
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Trial
from experiments.earlier_run import owes_shot
from experiments.live_run import CORRECTION_UNSAVED, EventVerdict, RunStopped
from experiments.record import storage
from experiments.record.journal import JournalError
from experiments.record.owed_shot import OWED_FILE, OwedShot, owe_shot
from experiments.record.replay import history
from experiments.screens.console.typed_lines import LINE_QUESTIONS, line_question
from experiments.screens.texts import again_text
from experiments.session import events
from experiments.session import remarks as words
from experiments.session.events import Event, Press
from experiments.session.history import entered_value
from experiments.session.judging import (
    HEARS_LATE,
    KEYS_ELSEWHERE,
    MINIMISED,
    NOTHING_TO_UNDO,
    STANDSTILL_S,
    STOOD_STILL,
)
from experiments.session.remarks import (
    HALTED_BEFORE,
    EntryCorrected,
    Flagged,
    Halted,
    HaltReason,
    Noted,
    Paused,
    Refused,
)
from experiments.session.states import EMERGENCY, State
from experiments.session.steps import (
    Answered,
    Asking,
    Failed,
    FireShot,
    Interrupted,
    Prepare,
    Presented,
    Rate,
    Repeated,
    trial_of,
    what,
)
from experiments.study.folders import place
from tests.at_controls import (
    DIRECTION,
    GUARD_S,
    PATIENCE_S,
    PREFERENCE,
    Sitting,
    WatchedGun,
    gated,
    kept,
    raw_answers,
    remarks,
    sat,
    sat_at,
)
from tests.at_display import records
from tests.designs import changed, design
from tests.waiting import wait_for

pytestmark = pytest.mark.slow

S = State
LEAST_S: float = PREFERENCE.config.trial.least_exposure_s
DUE: dict[State, Event] = {
    S.REARMING: events.Rearm(held_s=1.0),
    S.SETTING: events.DamperSet(),
    S.PREPARING: events.Fire(),
    S.TRAIN: events.Next(),
    S.ASKING: events.Answer(response="forward", at_s=2000.0),
    S.RATING: events.Rating(rating=7.0),
    S.DESCRIBING: events.Description(text="like a toy"),
    S.RESTING: events.EndBreak(reason="cold"),
    S.CLOSING: events.Finish(),
    S.PAUSED: events.GoOn(),
    S.CORRECTING: events.Correct(value="backward"),
}
"""What carries a run on at each state."""
LIVE = [state for state in State if state is not S.STOPPED]


def own_key(sitting: Sitting, **changes: Any) -> events.ParticipantKey:
    """The participant's own key for the question at hand, pressed now."""
    position = sitting.position
    known = {"response": "backward", "at_s": sitting.clock.now(), "step": position.number}
    return events.ParticipantKey(**known | changes)


def by_hand(sitting: Sitting, event: Event) -> EventVerdict:
    """What somebody does who looks first and takes their time."""
    sitting.ready()
    verdict = sitting.live.offer(event, Press(at_s=sitting.clock.now(), serial=sitting.position.serial))
    sitting.settle()
    return verdict


def experiment_of(sitting: Sitting) -> str:
    return str(sitting.setup.config.experiment)


def to_the_end(sitting: Sitting) -> tuple[Any, list[dict[str, str]]]:
    """Work on to the end: the journal and the table."""
    while not sitting.ended.is_set():
        sitting.go_on()
    sitting.finish()
    assert sitting.error is None
    _, contents, rows = kept(sitting.results, experiment_of(sitting))
    return contents, rows


def of_journal(sitting: Sitting) -> Any:
    """The journal of a run that was left."""
    if not sitting.ended.is_set():
        sitting.stop()
    sitting.finish()
    return kept(sitting.results, experiment_of(sitting))[1]


def presses(sitting: Sitting) -> tuple[float, int]:
    """The position at hand, painted at a time of which the guard's is no rounded multiple."""
    sitting.settle()
    position = sitting.position
    sitting.live.painted(position.serial, 4096.0)
    return 4096.0, position.serial


# the guard


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


@pytest.mark.parametrize(("away_s", "goes_on"), [(0.4, True), (3.0, False)])
def test_a_train_fires_nothing_while_the_keys_are_elsewhere(away_s: float, goes_on: bool, tmp_path: Path) -> None:
    """They pass from window to window in less than half a second."""
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
        for _ in range(7):
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


# the participant's own key


def test_a_key_for_an_earlier_question_is_refused(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.ASKING)
        late = own_key(sitting)
        sitting.press("F")
        sitting.to(S.ASKING)
        sitting.press("F")
        sitting.to(S.ASKING)
        assert sitting.live.offer(late).text == "It was the answer to an earlier question."
        assert sitting.live.offer(own_key(sitting))


def test_a_key_counts_if_it_went_down_after_the_onset(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.ASKING)
        onset_s = sitting.position.onset_s
        assert onset_s is not None
        early = sitting.live.offer(own_key(sitting, at_s=onset_s - 0.001))
        assert early == EventVerdict(taken=False, text="It went down before the stimulus, or in a pause.")
        assert sitting.live.offer(own_key(sitting, at_s=onset_s + 0.05))
        contents, rows = to_the_end(sitting)
    assert (rows[0]["response_source"], rows[0]["response_time_valid"]) == ("participant", "1")
    assert float(rows[0]["response_time_s"]) == pytest.approx(0.05)
    assert rows[0]["flags"] == "anticipation"
    assert [remark.by for remark in remarks(contents, Refused)] == ["participant"]


HOW = {"kind": "choice", "text": "How was it?", "answers": ("hard", "weak")}


def answers_from(sitting: Sitting, response: str, before_s: tuple[float, ...]) -> None:
    """A key counts from the guard time after the question on: none that went down before it, or just after."""
    sitting.settle()
    assert sitting.position.state is S.ASKING
    from_s = sitting.position.keys_from_s + GUARD_S
    sitting.clock.skip(2 * GUARD_S)
    for at_s in (*before_s, from_s - 2 * GUARD_S, from_s - GUARD_S, from_s - 0.001):
        early = sitting.live.offer(own_key(sitting, response=response, at_s=at_s))
        assert early == EventVerdict(taken=False, text="It went down before the question, or in a pause.")
    assert sitting.live.offer(own_key(sitting, response=response, at_s=from_s))


@pytest.mark.parametrize("when", ["trial", "block"])
def test_the_key_of_one_question_answers_no_other(when: str, tmp_path: Path) -> None:
    with sat(changed("direction", questions={"how": HOW | {"when": when}}), tmp_path) as sitting:
        first_s = ()
        while sitting.state is not S.ASKING or sitting.position.step.question != "how":
            sitting.to(S.ASKING)
            answered = own_key(sitting)
            first_s = (sitting.position.onset_s, answered.at_s)
            assert sitting.live.offer(answered)
            sitting.settle()
        answers_from(sitting, "weak", first_s)


def test_a_key_in_a_train_answers_nothing(tmp_path: Path) -> None:
    with sat(changed("preference", questions={"how": HOW}), tmp_path) as sitting:
        sitting.to(S.TRAIN)
        onset_s = sitting.position.onset_s
        assert onset_s is not None
        sitting.go_on()
        answers_from(sitting, "weak", (onset_s, onset_s + 1.0))


def test_no_key_passes_through_a_pause_also_if_it_arrives_afterwards(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.ASKING)
        sitting.press("P")
        in_the_pause = own_key(sitting)
        assert sitting.live.offer(in_the_pause).text == "The run is paused: go on first."
        sitting.press("P")
        assert sitting.live.offer(in_the_pause).text == "It went down before the stimulus, or in a pause."
        sitting.clock.skip(0.5)
        assert sitting.live.offer(own_key(sitting))
        _, rows = to_the_end(sitting)
    assert (rows[0]["response_source"], rows[0]["response_time_valid"]) == ("participant", "0")


def test_a_pause_right_after_an_answer_does_not_spoil_its_time(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.ASKING)
        sitting.clock.skip(0.5)
        with at_one_instant(sitting):
            assert sitting.live.offer(own_key(sitting))
            sitting.clock.skip(0.01)
            assert sitting.live.offer(events.Pause())
        _, rows = to_the_end(sitting)
    assert rows[0]["response_time_valid"] == "1"


def test_a_key_that_was_stamped_too_late_answers_with_a_time_that_does_not_count(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.ASKING)
        sitting.clock.skip(0.5)
        assert sitting.live.offer(own_key(sitting, timed=False))
        _, rows = to_the_end(sitting)
    row = rows[0]
    assert (row["response"], row["response_source"], row["response_time_valid"]) == ("backward", "participant", "0")
    assert [row["flags"] for row in rows] == ["key-time-lost"] + [""] * (len(rows) - 1)


@pytest.mark.parametrize("said", ["forward", "backward"])
def test_a_corrected_answer_of_the_own_hand_keeps_its_time_and_is_not_valid(said: Any, tmp_path: Path) -> None:
    times = []
    for number, corrected in enumerate((False, True)):
        with sat(DIRECTION, tmp_path / str(number)) as sitting:
            sitting.to(S.ASKING)
            sitting.clock.skip(0.5)
            assert sitting.live.offer(own_key(sitting, response=said))
            sitting.settle()
            sitting.to(S.PREPARING)
            if corrected:
                sitting.press("U")
                sitting.press("B" if said == "forward" else "F")
            _, rows = to_the_end(sitting)
        assert (rows[0]["response"] == said, rows[0]["response_time_valid"]) == (not corrected, str(int(not corrected)))
        times.append(rows[0]["response_time_s"])
    assert times[0] == times[1]


def test_a_time_over_a_pause_that_began_before_the_shot_is_not_the_participants(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.PREPARING)
        sitting.gun.hang = "fire"
        sitting.gun.stubborn = True
        sitting.press("Space")
        sitting.live.offer(events.Pause())  # too late to call off a shot that is on the line
        sitting.clock.skip(0.1)
        sitting.gun.release()
        sitting.settle()
        assert sitting.position.states == (S.ASKING, S.PAUSED)
        sitting.press("P")
        sitting.clock.skip(0.5)
        assert sitting.live.offer(own_key(sitting))
        _, rows = to_the_end(sitting)
    assert (rows[0]["response_time_valid"], rows[0]["attempts"]) == ("0", "1")


# the participant's own rating and description


def own_rating(sitting: Sitting) -> EventVerdict:
    """A rating of 3 on the participant's own screen."""
    verdict = sitting.live.offer(events.ParticipantRated(rating=3.0, step=sitting.position.number))
    sitting.settle()
    return verdict


def own_words(sitting: Sitting, text: str = "soft") -> EventVerdict:
    """A description on the participant's own screen."""
    verdict = sitting.live.offer(events.ParticipantDescribed(text=text, step=sitting.position.number))
    sitting.settle()
    return verdict


def rate_and_describe(sitting: Sitting) -> None:
    assert own_rating(sitting)
    assert own_words(sitting)


def bodies(results: Path) -> list[dict[str, Any]]:
    """What is in the journal of experiment 2 so far, whether it is still written or not."""
    return [record.get("body", {}) for record in records(place(results, "P01", "preference").journal)]


def test_the_participants_own_rating_is_in_the_journal_before_the_description_is_asked_for(tmp_path: Path) -> None:
    with sat(PREFERENCE, tmp_path) as sitting:
        sitting.to(S.RATING)
        assert own_rating(sitting)
        assert sitting.state is S.DESCRIBING
        rated, asked = bodies(tmp_path)[-2:]
        assert (rated["kind"], rated["value"], rated["by"]) == ("answered", 3.0, "participant")
        assert asked["kind"] == "describe"
        assert own_words(sitting)
        assert sitting.state is S.RATING
        _, rows = to_the_end(sitting)
    assert [(row["rating"], row["rating_by"], row["comment"]) for row in rows] == [
        ("3.0", "participant", "soft"), ("5.0", "experimenter", "like a toy"), ("5.0", "experimenter", "like a toy"),
    ]  # fmt: skip


def ranked(sitting: Sitting, rank: float) -> str:
    """A rank given on the participant's own screen; why it is not taken."""
    verdict = sitting.live.offer(events.ParticipantRated(rating=rank, step=sitting.position.number))
    sitting.settle()
    return verdict.text


def three_ranks() -> Setup[DesignConfig]:
    rank = {"kind": "ranking", "when": "block", "text": "Which place?", "minimum_text": "best"}
    factors = {"method": {"levels": ["vibration", "asymmetric-1", "asymmetric-2"]}}
    return replace(PREFERENCE, config=design(design="places", factors=factors, questions={"rank": rank}))


def test_ranks_by_the_participants_own_hand_never_tie_nor_do_those_that_are_corrected(tmp_path: Path) -> None:
    with sat(three_ranks(), tmp_path) as sitting:
        sitting.to(S.RATING)
        assert ranked(sitting, 2.0) == ""
        assert "2 was given to another one of this set" in ranked(sitting, 2.0)
        assert ranked(sitting, 1.0) == ""
        assert ranked(sitting, 3.0) == ""
        assert sitting.state is S.CLOSING
        assert by_hand(sitting, events.Undo())
        assert by_hand(sitting, events.Correct(value=2.0))  # the third gets the place of the first, and the first its
        contents, rows = to_the_end(sitting)
    assert [row["rank"] for row in rows] == ["3", "1", "2"]
    assert [row["rank_by"] for row in rows] == ["experimenter", "participant", "experimenter"]
    assert [remark.value for remark in remarks(contents, EntryCorrected)] == [2.0, 3.0]


def test_a_pause_before_the_description_keeps_the_rating_and_takes_no_words_until_it_is_over(tmp_path: Path) -> None:
    with sat(PREFERENCE, tmp_path) as sitting:
        sitting.to(S.RATING)
        assert own_rating(sitting)
        assert by_hand(sitting, events.Pause())
        assert own_words(sitting, "in the pause").text == "The run is paused: go on first."
        assert by_hand(sitting, events.GoOn())
        assert sitting.state is S.DESCRIBING
        assert own_words(sitting)
        contents, rows = to_the_end(sitting)
    assert (rows[0]["rating"], rows[0]["rating_by"], rows[0]["comment"]) == ("3.0", "participant", "soft")
    assert [(remark.event, remark.by) for remark in remarks(contents, Refused)] == [
        ("participant's description", "participant")
    ]


@pytest.mark.parametrize("end", [events.EmergencyStop(by="participant"), events.Stop(reason="lunch")])
def test_what_ends_the_run_before_the_description_keeps_the_rating_and_the_words_are_asked_for_when_it_is_resumed(
    end: Event, tmp_path: Path
) -> None:
    with sat(PREFERENCE, tmp_path) as sitting:
        sitting.to(S.RATING)
        assert own_rating(sitting)
        assert sitting.live.offer(end)
        sitting.settle()
        assert not own_words(sitting)
        contents = of_journal(sitting)
    assert [
        word.value for step, word in history(contents) if isinstance(step, Rate) and isinstance(word, Answered)
    ] == [3.0]
    assert isinstance(sitting.error, RunStopped)
    assert sitting.error.saved == 1
    with sat(PREFERENCE, tmp_path, resumed=True) as sitting:
        sitting.to(S.DESCRIBING)
        assert own_words(sitting)
        _, rows = to_the_end(sitting)
    assert (rows[0]["rating"], rows[0]["rating_by"], rows[0]["comment"]) == ("3.0", "participant", "soft")


def test_a_key_that_comes_behind_what_the_experimenter_entered_is_refused_with_its_answer(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.ASKING)
        late = own_key(sitting)
        sitting.press("F")
        entered = sitting.position.entered_for(late.step)
        assert isinstance(entered, events.Answer)
        assert entered.at_s is not None
        said = [sitting.live.offer(replace(late, at_s=entered.at_s + after_s)).text for after_s in (0.0, -2.0)]
        same = sitting.live.offer(replace(late, response="forward")).text
        sitting.to(S.PREPARING)
        assert sitting.live.offer(replace(late, timed=False)).text == said[0]
        undone = []
        for number in (1, 2):
            while sitting.live.moment.trial.set < number:
                sitting.go_on()
            undone.append(sitting.live.offer(events.Undo()).text)
            sitting.live.offer(events.Leave())
        contents = of_journal(sitting)
    corrected = "undo corrects it until its set is over, then a note says it."
    assert said == [
        f"“forward” was entered at the console and taken before “backward” came: {corrected}",
        "“forward” was entered at the console and taken before “backward” came, though that went down 2.00 s earlier: "
        f"{corrected}",
    ]
    assert undone == ["", NOTHING_TO_UNDO]
    assert same == "“forward” was entered at the console first: it is the same."
    kept = [word.answer for word in remarks(contents, Refused) if isinstance(word, Refused)]
    assert kept == ["backward", "backward", "forward", "backward"]


def test_a_rating_that_comes_behind_what_the_experimenter_entered_is_refused_with_its_answer(tmp_path: Path) -> None:
    with sat(PREFERENCE, tmp_path) as sitting:
        sitting.to(S.RATING)
        late = events.ParticipantRated(rating=3.0, step=sitting.position.number)
        sitting.type("7.5")
        assert sitting.live.offer(late).text.startswith("“7.5” was entered at the console and taken before “3.0” came")
        contents = of_journal(sitting)
    assert [word.answer for word in remarks(contents, Refused) if isinstance(word, Refused)] == [3.0]


def test_words_for_an_earlier_stimulus_are_refused(tmp_path: Path) -> None:
    with sat(PREFERENCE, tmp_path) as sitting:
        sitting.to(S.DESCRIBING)
        late = events.ParticipantDescribed(text="late", step=sitting.position.number)
        sitting.type("like a toy")
        sitting.to(S.DESCRIBING)
        assert sitting.live.offer(late).text == "It was the answer to an earlier question."


@contextmanager
def at_one_instant(sitting: Sitting) -> Iterator[None]:
    """What happens in here comes before the run looks."""
    with sitting.live.news:
        yield


# what is kept


@pytest.mark.parametrize("state", [state for state in DUE if state is not S.REARMING])
def test_what_is_refused_is_in_the_journal_with_state_reason_hand_and_answer(state: State, tmp_path: Path) -> None:
    event = events.Answer(response="forward", at_s=0.0) if state is S.RATING else events.Rating(rating=1.0)
    with sat_at(state, tmp_path) as sitting:
        if state is S.RATING:
            key: Event = own_key(sitting)
        else:
            key = events.ParticipantRated(rating=1.0, step=sitting.position.number)
        hers, theirs = sitting.live.offer(event), sitting.live.offer(key)
        assert not hers
        assert not theirs
        found = remarks(of_journal(sitting), Refused)[-2:]
    assert found == [
        Refused(
            event=events.word(type(event)),
            state=state,
            because=hers.text,
            by="experimenter",
            answer="forward" if state is S.RATING else 1.0,
        ),
        Refused(
            event=events.word(type(key)),
            state=state,
            because=theirs.text,
            by="participant",
            answer="backward" if state is S.RATING else 1.0,
        ),
    ]


def test_what_was_taken_is_in_the_journal_also_if_the_run_is_stopped_the_next_moment(tmp_path: Path) -> None:
    for name, end in (("stop", events.Stop(reason="lunch")), ("emergency", events.EmergencyStop())):
        with sat(DIRECTION, tmp_path / name) as sitting:
            sitting.to(S.ASKING)
            with at_one_instant(sitting):
                assert sitting.live.offer(own_key(sitting))
                assert sitting.live.offer(end)
            sitting.settle()
            contents = of_journal(sitting)
        assert [(kind, response) for kind, _, response in raw_answers(contents)] == [("answered", "backward")]


def test_forward_corrected_to_forward_is_no_correction(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.ASKING)
        sitting.press("F")
        assert by_hand(sitting, events.Undo())
        same = by_hand(sitting, events.Correct(value="forward"))
        assert same == EventVerdict(taken=True, text="That is what stands there: nothing was corrected.")
        assert S.CORRECTING not in sitting.position.states
        contents, rows = to_the_end(sitting)
    assert not remarks(contents, EntryCorrected)
    assert rows[0]["flags"] == ""


def test_undo_goes_back_one_by_one_through_the_answers_of_the_set_and_stops_at_the_first(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        for _ in range(3):
            sitting.to(S.ASKING)
            sitting.press("F")
        first_set = sitting.live.plan.trials[:3]
        assert sitting.state is S.RESTING
        assert opened(sitting, 3) == [(trial, "answer") for trial in first_set[::-1]]
        assert by_hand(sitting, events.Undo()).text == "There is nothing further back in this set."
        assert sitting.position.correcting
        sitting.press("Esc")
        sitting.to(S.PREPARING)
        assert by_hand(sitting, events.Undo()).text == "There is nothing to undo in this set."


def test_undo_goes_back_through_ratings_and_descriptions_as_they_were_entered(tmp_path: Path) -> None:
    with sat(PREFERENCE, tmp_path) as sitting:
        for _ in range(2):
            sitting.to(S.RATING)
            sitting.type("5")
            sitting.type("like a toy")
        one, two, _ = sitting.live.plan.trials
        entered = [(one, "rating"), (one, "description"), (two, "rating"), (two, "description")]
        assert opened(sitting, 4) == entered[::-1]
        assert not by_hand(sitting, events.Undo())


def opened(sitting: Sitting, times: int) -> list[tuple[Trial, str]]:
    """What an undo opens, one after the other."""
    found = []
    for _ in range(times):
        assert by_hand(sitting, events.Undo())
        entry = sitting.position.correcting
        assert isinstance(entry, Asking)
        found.append((entry.trial, what(entry)))
    return found


def test_flags_and_notes_go_to_the_trial_that_they_were_opened_for(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.ASKING)
        sitting.press("G")  # the line of a flag, and then of a note, is open while the participant answers
        sitting.window.fields["line"] = "noise"
        first = sitting.live.moment.trial
        assert sitting.live.offer(own_key(sitting))
        sitting.settle()
        assert sitting.live.moment.trial != first
        sitting.press("Enter")
        sitting.live.offer(events.Note(text="a dog barked", trial=first))
        sitting.live.offer(events.Flag(flag="late"))
        sitting.live.offer(events.Undo())
        sitting.live.offer(events.Note(text="said so afterwards"))
        contents = of_journal(sitting)
    second = sitting.live.plan.trials[1]
    assert remarks(contents, Flagged) == [Flagged(trial=first, flag="noise"), Flagged(trial=second, flag="late")]
    assert remarks(contents, Noted) == [
        Noted(trial=first, text="a dog barked"),
        Noted(trial=first, text="said so afterwards"),
    ]


@pytest.mark.parametrize("how", ["emergency", "stop", "leave", "enter"])
def test_a_correction_that_is_half_typed_is_kept_as_a_note_unless_it_is_left_or_entered(
    how: str, tmp_path: Path
) -> None:
    with sat(PREFERENCE, tmp_path) as sitting:
        sitting.to(S.RATING)
        rate_and_describe(sitting)
        assert opened(sitting, 2)[-1][1] == "rating"
        sitting.ready()
        sitting.window.paint()
        sitting.window.type_text("2.5")
        first = sitting.position.correcting
        assert first is not None
        if how == "stop":
            sitting.window.press("Q", ctrl=True)
            sitting.window.fields["line"] = "enough"
            sitting.window.press("Enter")
        elif how == "emergency":
            sitting.window.press("F12")
        else:
            sitting.window.press("Esc" if how == "leave" else "Enter")
        sitting.settle()
        sitting.window.paint()
        contents = of_journal(sitting)
    kept_as = [Noted(trial=first.trial, text="correction of the rating: 2.5")] if how in ("emergency", "stop") else []
    assert remarks(contents, Noted) == kept_as
    assert [one.value for one in remarks(contents, EntryCorrected)] == ([2.5] if how == "enter" else [])


def test_a_repeat_that_was_asked_for_one_trial_is_not_taken_for_the_next(tmp_path: Path) -> None:
    with sat(PREFERENCE, tmp_path) as sitting:
        sitting.to(S.RATING)
        sitting.ready()
        sitting.window.press("R", ctrl=True)
        sitting.window.fields["line"] = "moved"
        rate_and_describe(sitting)
        assert sitting.state is S.RATING
        sitting.press("Enter")
        said = "Trial 1 cannot be presented again any more. What you typed is kept as a note."
        assert sitting.window.heard.count(said) == 1
        contents = of_journal(sitting)
    assert not [word for _, word in history(contents) if isinstance(word, Repeated)]


# the emergency stop


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


def prepare(sitting: Sitting) -> Prepare:
    step = sitting.position.step
    assert isinstance(step, Prepare)
    return step


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


# after the emergency stop


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


# ends


AGAIN = "Presented again, for the second time. Its answers so far stay in the journal and do not count."


def test_a_stop_while_a_trial_has_open_questions_says_that_its_answers_will_not_count(tmp_path: Path) -> None:
    with sat_at(S.PREPARING, tmp_path) as sitting:
        trial = sitting.live.moment.trial
        assert line_question("stop", trial, sitting.live, kept=True) == LINE_QUESTIONS["stop"]
        sitting.to(S.ASKING)
        said = line_question("stop", trial, sitting.live, kept=True)
    assert said.endswith(f"Resumed, it presents trial {trial.trial} again: answers of it so far do not count.")


def test_the_last_set_can_be_corrected_and_repeated_until_the_run_is_ended(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.CLOSING)
        assert not sitting.ended.is_set()
        assert by_hand(sitting, events.Undo())
        assert by_hand(sitting, events.Undo())
        assert by_hand(sitting, events.Correct(value="backward"))
        assert sitting.state is S.CLOSING
        assert by_hand(sitting, events.Repeat(reason="a noise"))
        assert sitting.position.base in (S.SETTING, S.PREPARING)
        assert again_text(sitting.live.history, prepare(sitting)) == AGAIN
        sitting.to(S.CLOSING)
        contents, rows = to_the_end(sitting)
    assert (rows[-2]["response"], rows[-2]["flags"]) == ("backward", "corrected")
    assert (rows[-1]["attempts"], rows[-1]["flags"], rows[-1]["response"]) == ("2", "repeated", "forward")
    assert contents.finished


def test_a_trial_can_be_repeated_in_the_break_after_it_which_then_begins_anew(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.RESTING)
        last = trial_of(sitting.live.history[-1][0])
        sitting.clock.skip(10.0)
        assert by_hand(sitting, events.Repeat(reason="a noise"))
        assert prepare(sitting).trial == last
        sitting.to(S.RESTING)
        assert sitting.position.until_s == pytest.approx(sitting.clock.now() + 30.0, abs=1.0)
        _, rows = to_the_end(sitting)
    assert [row["attempts"] for row in rows[:4]] == ["1", "1", "2", "1"]


def test_a_presented_trial_can_be_repeated_until_its_rating_is_in(tmp_path: Path) -> None:
    with sat(PREFERENCE, tmp_path) as sitting:
        sitting.to(S.RATING)
        assert by_hand(sitting, events.Repeat(reason="it slipped"))
        assert prepare(sitting).trial == sitting.live.plan.trials[0]
        sitting.to(S.RATING)
        sitting.type("5")
        assert (
            by_hand(sitting, events.Repeat(reason="again")).text
            == "It is being described: it cannot be presented again now."
        )
        sitting.to(S.CLOSING)
        assert by_hand(sitting, events.Repeat(reason="again")).text == "There is no trial of this set to repeat now."
        contents, rows = to_the_end(sitting)
    assert [row["attempts"] for row in rows] == ["2", "1", "1"]
    assert rows[0]["flags"] == "repeated"
    assert [
        word.value for step, word in history(contents) if isinstance(step, Rate) and isinstance(word, Answered)
    ] == [5.0] * 3


def test_a_rating_corrected_at_the_very_end_counts(tmp_path: Path) -> None:
    with sat(PREFERENCE, tmp_path) as sitting:
        sitting.to(S.CLOSING)
        by_hand(sitting, events.Undo())
        by_hand(sitting, events.Undo())
        assert by_hand(sitting, events.Correct(value=0.0))
        contents, rows = to_the_end(sitting)
    assert (rows[-1]["rating"], rows[-1]["flags"]) == ("0.0", "corrected")
    assert len(remarks(contents, EntryCorrected)) == 1


def test_how_often_a_trial_was_presented_is_told_as_the_table_counts_it(tmp_path: Path) -> None:
    told_by_trial: dict[Trial, str] = {}

    def note(sitting: Sitting) -> None:
        sitting.to(S.PREPARING)
        told_by_trial[prepare(sitting).trial] = again_text(sitting.live.history, prepare(sitting))

    def on(sitting: Sitting) -> None:
        while not sitting.ended.is_set():
            if sitting.state is S.PREPARING:
                note(sitting)
            sitting.go_on()

    with sat(DIRECTION, tmp_path) as sitting:
        note(sitting)
        sitting.gun.fails = [LinkError("no answer")]
        sitting.press("Space")
        note(sitting)
        sitting.press("Space")
        by_hand(sitting, events.Repeat(reason="a noise"))
        note(sitting)
        sitting.press("Space")
        sitting.live.offer(events.Stop(reason="lunch"))
    with sat(DIRECTION, tmp_path, resumed=True) as again:
        on(again)
    _, _, rows = kept(tmp_path, "direction")
    nth = {"1": "", "2": "second", "3": "third", "4": "4th"}
    expected = [nth[row["attempts"]] for row in rows]
    assert expected[:2] == ["4th", ""]
    assert [text and text.split(" the ")[1].split()[0] for text in told_by_trial.values()] == expected


def test_a_pause_that_was_asked_for_and_one_that_was_not_are_told_apart(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.ASKING)
        by_hand(sitting, events.Pause())
        assert sitting.position.why == ""
        by_hand(sitting, events.GoOn())
        sitting.live.offer(events.ParticipantLost(cause="its process ended"))
        assert sitting.position.why == "its process ended"
        contents = of_journal(sitting)
    assert remarks(contents, Paused) == [Paused(), Paused(cause="its process ended")]


def test_no_pause_ends_while_the_participants_window_is_minimised(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.PREPARING)
        sitting.live.minimised = True
        sitting.live.offer(events.ParticipantLost(cause=MINIMISED))
        assert (sitting.state, sitting.position.why) == (S.PAUSED, MINIMISED)
        assert by_hand(sitting, events.GoOn()) == EventVerdict(taken=False, text=MINIMISED)
        sitting.live.minimised = False
        sitting.live.offer(events.ParticipantBack(how="It is seen again."))
        assert by_hand(sitting, events.GoOn()).taken
        contents = of_journal(sitting)
    noted = [word.text for word in remarks(contents, Noted) if isinstance(word, Noted)]
    assert noted == ["It is seen again."]


def test_a_participants_screen_that_is_lost_in_a_pause_is_on_record_too(tmp_path: Path) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        sitting.to(S.ASKING)
        by_hand(sitting, events.Pause())
        sitting.live.offer(events.ParticipantLost(cause="its window was closed"))
        sitting.live.offer(events.ParticipantBack())
        contents = of_journal(sitting)
    noted = [word.text for word in remarks(contents, Noted) if isinstance(word, Noted)]
    assert noted == ["its window was closed", "The participant's screen was started again."]


# what a hand does in passing


def test_the_second_enter_behind_a_note_is_not_for_what_stands_there(tmp_path: Path) -> None:
    with sat_at(S.CLOSING, tmp_path) as sitting:
        sitting.press("N")
        sitting.type("a dog")
        sitting.window.press("Enter")
        assert sitting.state is S.CLOSING
        assert remarks(of_journal(sitting), Refused)
        assert [remark.text for remark in remarks(of_journal(sitting), Noted)] == ["a dog"]


def test_a_key_that_went_into_what_is_open_on_the_console_is_nobodys_answer(tmp_path: Path) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        assert not sitting.live.offer(own_key(sitting, typed=True))
        assert sitting.state is S.ASKING
        assert sitting.live.offer(own_key(sitting))
        assert len(raw_answers(of_journal(sitting))) == 1


@pytest.mark.parametrize("where", ["at the console", "on the participant's screen"])
@pytest.mark.parametrize(("line", "noted"), [("E", "break: bored"), ("N", "note: bored"), ("G", "flag: bored")])
def test_an_emergency_stop_takes_a_line_away_that_was_being_typed_and_keeps_it_as_a_note(
    line: str, noted: str, where: str, tmp_path: Path
) -> None:
    with sat_at(S.RESTING, tmp_path) as sitting:
        sitting.press(line)
        sitting.window.type_text("bored")
        if where == "at the console":
            sitting.press("F12")
        else:
            sitting.live.offer(events.EmergencyStop(by="participant"))
            sitting.paint()
        assert not sitting.controls.typing.line
        sitting.press("Y")
        sitting.window.type_text("it smelt")
        sitting.press("Enter")
        sitting.press("Q")
        sitting.finish()
        contents = of_journal(sitting)
    assert [note.text for note in remarks(contents, Noted)] == [noted]
    assert [why.text for why in remarks(contents, HaltReason)] == ["it smelt"]
    assert [line.reason for line in contents.records if line.kind == "stopped"] == ["emergency stop"]


def test_what_is_no_flag_stays_to_be_typed_over(tmp_path: Path) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        sitting.press("G")
        sitting.type("!?")
        assert sitting.controls.typing.line
        sitting.window.fields["line"] = "noise"
        sitting.press("Enter")
        assert not sitting.controls.typing.line
        assert [remark.flag for remark in remarks(of_journal(sitting), Flagged)] == ["noise"]


def test_a_damper_that_may_have_been_set_is_confirmed_before_anything_fires(tmp_path: Path) -> None:
    both = {"method": {"levels": ("asymmetric-1", "asymmetric-2")}}
    with sat(changed("preference", factors=both), tmp_path) as sitting:
        sitting.to(S.SETTING)
        first = sitting.position.step
        while sitting.state is not S.SETTING or sitting.position.step == first:
            sitting.go_on()
        assert sitting.position.step.settings != first.settings
        sitting.press("R")
        sitting.type("too short")
        assert sitting.position.step.settings == first.settings
        assert sitting.state is S.SETTING


def test_an_emergency_stop_stays_to_be_seen_when_the_results_are_gone(tmp_path: Path) -> None:
    with sat_at(S.HALTED, tmp_path) as sitting:
        assert sitting.live.offer(events.ResultsGone(cause="the journal was deleted"))
        assert sitting.state is S.HALTED
        assert sitting.position.why == EMERGENCY


def full(descriptor: int) -> None:
    raise OSError(28, "No space left on device")


def test_an_emergency_stop_that_cannot_be_written_is_said_and_is_on_record_once_the_disk_is_free(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        with monkeypatch.context() as disk:
            disk.setattr(storage, "sync", full)
            assert sitting.live.offer(events.EmergencyStop())
            wait_for(lambda: any("not on record" in text for text in sitting.window.troubles), "it is not said")
        assert sitting.live.halt_unsaved
        assert sitting.live.offer(events.Stop(reason=EMERGENCY))
        sitting.settle()
        assert not remarks(of_journal(sitting), Halted)
    with sat(DIRECTION, tmp_path, resumed=True) as sitting:
        sitting.to(S.REARMING)


@pytest.mark.parametrize(
    ("word", "again"),
    [(events.Reason(text="the cable was loose"), []), (events.Note(text="room was made"), ["experimenter"])],
)
def test_an_emergency_stop_that_the_disk_refused_is_on_record_once_anything_is_written_again(
    word: events.Event, again: list[str], tmp_path: Path
) -> None:
    """By its reason, or by itself again: once."""
    with sat_at(S.ASKING, tmp_path) as sitting, pytest.MonkeyPatch.context() as disk:
        full_for_one_record(disk)
        assert sitting.live.offer(events.EmergencyStop())
        wait_for(lambda: sitting.live.halt_unsaved, "it is not said")
        assert sitting.live.offer(word)
        wait_for(lambda: not sitting.live.halt_unsaved, "it is still said")
        journal = sitting.live.journal.path.read_bytes()
        assert sitting.live.offer(events.Note(text="and more"))
        sitting.live.journal.catch_up()
        assert [one.by for one in remarks(of_journal(sitting), Halted)] == again
    sitting.live.journal.path.write_bytes(journal)  # as if it was killed: nothing says why the run ended
    with sat(DIRECTION, tmp_path, resumed=True) as sitting:
        sitting.to(S.REARMING)


def test_a_run_that_ends_with_an_emergency_stop_on_no_record_says_that_it_will_be_forgotten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        monkeypatch.setattr(storage, "sync", full)
        assert sitting.live.offer(events.EmergencyStop())
        wait_for(lambda: sitting.live.halt_unsaved, "it is not said")
        assert sitting.live.offer(events.Stop(reason=EMERGENCY))
        sitting.settle()
    assert isinstance(sitting.error, JournalError)
    assert "The emergency stop is not on record: note it" in str(sitting.error)


def test_an_emergency_stop_that_a_failing_answer_ends_at_once_is_named_with_the_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        monkeypatch.setattr(storage, "sync", full)
        with sitting.live.news:  # the run has not come to the answer when the stop comes
            assert sitting.live.offer(DUE[S.ASKING])
            assert sitting.live.offer(events.EmergencyStop())
        sitting.settle()
    assert isinstance(sitting.error, JournalError)
    assert "The emergency stop is not on record" in str(sitting.error)


def test_an_answer_that_cannot_be_written_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        monkeypatch.setattr(storage, "sync", full)
        assert sitting.live.offer(DUE[S.ASKING])
        sitting.finish()
    assert isinstance(sitting.error, JournalError)
    named = ". The answer “response” of session 1, set 1, trial 1 is not saved: it is to be given anew"
    assert str(sitting.error).endswith(named)


def test_an_emergency_stop_on_a_journal_that_was_moved_is_on_record_there(tmp_path: Path) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        journal = sitting.live.journal.path
        journal.rename(journal.with_name("moved.jsonl"))
        assert sitting.live.offer(events.EmergencyStop())
        wait_for(lambda: any("was moved to" in text for text in sitting.window.troubles), "it is not said")
        assert not sitting.live.halt_unsaved
        assert '"kind":"halted"' in journal.with_name("moved.jsonl").read_text()


def test_a_note_that_cannot_be_written_is_given_back_in_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with sat_at(S.ASKING, tmp_path) as sitting:
        with monkeypatch.context() as disk:
            disk.setattr(storage, "sync", full)
            sitting.press("N")
            sitting.type("the dog barked")
            wait_for(lambda: sitting.window.troubles, "it is not said")
        assert "No space left" in sitting.window.troubles[0]
        assert "the dog barked" in sitting.window.troubles[0]


def full_for_one_record(disk: pytest.MonkeyPatch) -> None:
    """The next record finds no room, those behind it do."""

    def full_once(descriptor: int) -> None:
        disk.undo()
        full(descriptor)

    disk.setattr(storage, "sync", full_once)


def room_for(disk: pytest.MonkeyPatch, left: int) -> None:
    """The disk has room for so many bytes; once it was full somebody made room."""
    whole = storage.write_all

    def while_it_lasts(descriptor: int, data: bytes) -> None:
        nonlocal left
        whole(descriptor, data[:left])
        if len(data) > left:
            disk.undo()
            full(descriptor)
        left -= len(data)

    disk.setattr(storage, "write_all", while_it_lasts)


def begin_to_correct(sitting: Sitting, *, halted: bool) -> None:
    """An answer is entered and opened again, after an emergency stop if so."""
    sitting.to(S.ASKING)
    assert by_hand(sitting, events.Answer(response="forward", at_s=sitting.clock.now()))
    sitting.to(S.PREPARING)
    if halted:
        assert sitting.live.offer(events.EmergencyStop())
        sitting.settle()
    assert by_hand(sitting, events.Undo())


@pytest.mark.parametrize("halted", [False, True])
def test_a_correction_that_cannot_be_written_counts_nowhere_and_nothing_follows_from_it(
    halted: bool, tmp_path: Path
) -> None:
    with sat(DIRECTION, tmp_path) as sitting, pytest.MonkeyPatch.context() as disk:
        begin_to_correct(sitting, halted=halted)
        entry = sitting.position.correcting
        assert entry is not None
        full_for_one_record(disk)
        assert sitting.live.offer(events.Correct(value="backward"))
        wait_for(lambda: sitting.window.troubles, "it is not said")
        wait_for(lambda: halted or sitting.position.state is S.STOPPED, "the run goes on")
        assert entered_value(sitting.live.history, entry) == "forward"
        if halted:
            assert sitting.position.base is S.HALTED
            assert by_hand(sitting, events.Undo())
            assert by_hand(sitting, events.Correct(value="backward"))
        contents = of_journal(sitting)
    assert [one.value for one in remarks(contents, EntryCorrected)] == ["backward"] * halted
    assert contents.records[-1].reason == (EMERGENCY if halted else CORRECTION_UNSAVED)


@pytest.mark.parametrize("halted", [False, True])
def test_a_run_that_ends_on_a_full_disk_says_that_a_correction_is_to_be_entered_anew(
    halted: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with sat(DIRECTION, tmp_path) as sitting:
        begin_to_correct(sitting, halted=halted)
        monkeypatch.setattr(storage, "sync", full)
        assert sitting.live.offer(events.Correct(value="backward"))
        wait_for(lambda: sitting.window.troubles, "it is not said")
        if halted:
            assert sitting.live.offer(events.Stop(reason=EMERGENCY))
        sitting.finish()
    anew = ". A correction could not be saved: enter it anew (undo) when the run goes on"
    assert isinstance(sitting.error, JournalError)
    assert str(sitting.error).endswith(anew)
    assert sitting.window.troubles[0].endswith(anew)


def test_two_ranks_that_are_exchanged_are_both_written_or_neither(tmp_path: Path) -> None:
    with sat(three_ranks(), tmp_path) as sitting, pytest.MonkeyPatch.context() as disk:
        sitting.to(S.RATING)
        for rank in (2.0, 1.0, 3.0):
            assert ranked(sitting, rank) == ""
        assert by_hand(sitting, events.Undo())
        room_for(disk, 500)  # more than one record, and less than both
        assert by_hand(sitting, events.Correct(value=2.0))
        wait_for(lambda: sitting.window.troubles, "it is not said")
        assert ["No space left" in text for text in sitting.window.troubles] == [True]
        assert not [word for _, word in sitting.live.history if isinstance(word, EntryCorrected)]
        contents = of_journal(sitting)
    assert remarks(contents, EntryCorrected) == []
    assert contents.records[-1].reason == CORRECTION_UNSAVED


def test_no_step_follows_from_a_correction_that_cannot_be_written_also_if_the_answer_was_already_taken(
    tmp_path: Path,
) -> None:
    with sat(DIRECTION, tmp_path) as sitting, pytest.MonkeyPatch.context() as disk:
        sitting.to(S.ASKING)
        assert by_hand(sitting, events.Answer(response="forward", at_s=sitting.clock.now()))
        sitting.to(S.ASKING)
        assert by_hand(sitting, events.Undo())
        full_for_one_record(disk)
        with at_one_instant(sitting):
            assert sitting.live.offer(events.Correct(value="backward"))
            assert sitting.live.offer(own_key(sitting, response="forward"))
        contents = of_journal(sitting)
    assert [record.kind for record in contents.records[-2:]] == ["outcome", "stopped"]
    assert [response for _, _, response in raw_answers(contents)] == ["forward", "forward"]
