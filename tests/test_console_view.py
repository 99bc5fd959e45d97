"""What the console shows, without its window: no method's name too many, text that stands out, the time to go."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from device.words import GunState, GunStatus
from experiments.config.setup import Setup
from experiments.design import planning
from experiments.design.config import DesignConfig
from experiments.design.language import LARGEST_NUMBER
from experiments.design.plan import Plan, Trial
from experiments.design.stimuli import damper
from experiments.load import load_setup
from experiments.record.design_table import design_rows
from experiments.screens.console import progress, view, widgets
from experiments.screens.console.instructions import instruction
from experiments.screens.console.progress import trials_done
from experiments.screens.console.view import About, Ended, GunSeen, ParticipantSeen, Seen
from experiments.screens.texts import ends_text, track_text, typed_rating
from experiments.session.duration import Ahead, RunTiming, clock_text, end_text, remaining_s
from experiments.session.remarks import EntryCorrected, Flagged, Noted
from experiments.session.states import Position, State
from experiments.session.steps import (
    Answered,
    Ask,
    Asking,
    FireShot,
    Interrupted,
    Prepare,
    Present,
    Presented,
    Repeated,
    Rest,
)
from experiments.tasks.questions import choices_of
from tests.asked import ask, describe, rate
from tests.at_controls import DIRECTION, PREFERENCE, sat_at, tells_correctness
from tests.designs import changed, direction_with

SAID = Answered(value="forward", by="experimenter", response_time_s=1.0, response_time_valid=False)
RATED = replace(SAID, value=2.0)
SHOWN = Presented(gun="simulated", onset_utc="", shots=3, exposure_s=2.0, ended_by="next")


def plan_of(setup: Setup[DesignConfig]) -> Plan:
    return planning.plan_of(setup.config, "P01", 1)


def present(trial: Trial) -> Present:
    return Present(trial=trial, attempt=1, repeat_every_s=0.5, max_shots=9, least_exposure_s=1.0)


def prepare(trial: Trial) -> Prepare:
    return Prepare(trial=trial, attempt=2, settings=damper(DIRECTION.gun, trial.method))


def status_of(state: GunState) -> GunStatus:
    return GunStatus(state=state, shots=1, coil_temperature_C=20.0, ready_at_s=0.0)


def seen(setup: Setup[DesignConfig], position: Position, *told: Any, **more: Any) -> Seen:
    return Seen(about=About(setup=setup, plan=plan_of(setup)), position=position, told=told, **more)


def shown_texts(here: Seen) -> list[str]:
    shown = instruction(replace(here, now_s=10.0))
    texts = [shown.title, shown.damper, shown.detail, view.where_text(here), *progress.coming(here)]
    return [*texts, *progress.answer_lines(here), *progress.marks(here), progress.gun_text(here)[0]]


def test_what_comes_next_leaves_out_tracks_that_have_ended() -> None:
    setup = load_setup("threshold")
    here = seen(setup, Position(step=ask(plan_of(setup).trials[0])))
    own = [one.direction.upper() for one in here.about.plan.trials[1:] if one.track == 1]
    assert progress.coming(replace(here, over=frozenset([2]))) == own[:3] != progress.coming(here)


@pytest.mark.parametrize("answers", [("forward", "backward"), ("near", "rather far"), ("much stronger", "a bit", "no")])
def test_answers_that_have_no_room_on_their_buttons_are_listed_with_their_keys(answers: tuple[str, ...]) -> None:
    asked = choices_of({answer: answer for answer in answers}, {})
    step = replace(ask(plan_of(DIRECTION).trials[0]), choices=asked)
    shown = instruction(seen(DIRECTION, Position(states=(State.ASKING,), step=step))).detail
    there = seen(DIRECTION, Position(states=(State.ASKING,), step=step))
    by_own_key = instruction(replace(there, about=replace(there.about, participant_keys=True))).detail
    for detail in (shown, by_own_key):
        listed = [f"{one.key.upper()}  {one.told}" in detail for one in asked]
        assert listed == [len(answers) > 2] * len(answers)


def test_a_correction_names_its_question_where_several_of_its_kind_are_asked() -> None:
    first = rate(plan_of(PREFERENCE).trials[0])
    other = replace(first, question="realism")
    corrected = Position(states=(State.RATING, State.CORRECTING), correcting=first)
    assert instruction(seen(PREFERENCE, corrected, (first, RATED))).title == "Correct the rating"
    told = ((first, RATED), (other, RATED))
    assert instruction(seen(PREFERENCE, corrected, *told)).title == "Correct the rating “rating”"
    assert instruction(seen(PREFERENCE, replace(corrected, correcting=other), *told)).title.endswith("“realism”")


def practised(*, reached: bool) -> Seen:
    """A practice of two rounds after the first, whose answers were all right or none was."""
    rounds = {"repetitions": 1, "of": ("method", "direction"), "until_right": 0.8, "rounds": 2}
    setup = changed("direction", practice=rounds)
    plan = planning.practice_of(setup.config, "P01", 1)
    right = [trial.direction for trial in plan.trials[:6]]
    said = right if reached else [{"forward": "backward"}.get(one, "forward") for one in right]
    told = tuple((ask(trial), replace(SAID, value=one)) for trial, one in zip(plan.trials, said, strict=False))
    about = About(setup=setup, plan=plan, band="PRACTICE", last="The run itself comes next.")
    return Seen(about=about, position=Position(states=(State.CLOSING,)), told=told)


def test_a_round_of_a_practice_never_ends_early_but_its_rounds_may() -> None:
    at_most = {one.what: (one.planned, one.at_most) for one in trials_done(practised(reached=True))}
    assert at_most == {"set": (6, False), "session": (12, True), "experiment": (12, True)}
    tracks = load_setup("staircase")
    assert all(one.at_most for one in trials_done(seen(tracks, Position())))


def test_no_further_round_comes_next_once_a_correction_in_the_break_has_reached_the_criterion() -> None:
    rest = Rest(duration_s=30.0, between="sets")
    missed = replace(practised(reached=False), position=Position(states=(State.RESTING,), step=rest))
    assert len(progress.coming(missed)) == 3
    corrected = [
        (None, EntryCorrected(trial=step.trial, question=step.question, value=step.trial.direction))
        for step, _ in missed.told
        if isinstance(step, Ask)
    ]
    assert progress.coming(replace(missed, told=(*missed.told, *corrected))) == ["the end"]


@pytest.mark.parametrize("reached", [True, False])
def test_a_practice_in_rounds_says_at_its_end_whether_the_run_comes_next(*, reached: bool) -> None:
    at_the_end = practised(reached=reached)
    for here in (at_the_end, replace(at_the_end, ended=Ended(reason=None))):
        assert ("That was not reached: explain the task again" in instruction(here).detail) is not reached
    assert ("The run itself comes next." in instruction(here).detail) is reached


@pytest.mark.parametrize(("between_s", "interval"), [(0.0, 0), (0.0, 1), (20.0, 0)])
def test_a_practice_without_breaks_says_how_a_round_went_as_the_next_one_begins(
    between_s: float, interval: int
) -> None:
    missed = practised(reached=False)
    design = missed.about.setup.config
    breaks = design.breaks.model_copy(update={"between_sets_s": between_s})
    setup = replace(missed.about.setup, config=design.model_copy(update={"breaks": breaks}))
    step = prepare(missed.about.plan.trials[6 + interval])
    here = replace(missed, about=replace(missed.about, setup=setup))
    for state in (State.SETTING, State.PREPARING):
        detail = instruction(replace(here, position=Position(states=(state,), step=step))).detail
        assert detail.startswith("Round 1: 0 of 6 right; wanted: 80 %.\n") is (between_s == interval == 0)


# what is never told


@pytest.mark.parametrize("number", range(6))
def test_a_method_is_named_only_where_its_damper_is_set_by_hand(number: int) -> None:
    for make_step, state in ((prepare, State.SETTING), (prepare, State.PREPARING), (ask, State.ASKING)):
        trial = plan_of(DIRECTION).trials[number]
        here = seen(DIRECTION, Position(states=(state,), step=make_step(trial)))
        said = "\n".join(shown_texts(here)).lower()
        for name in DIRECTION.config.methods:
            method = DIRECTION.gun.methods[name]
            if not (method.damper and trial.method == name):
                assert name not in said
                assert method.label.lower() not in said
        assert not tells_correctness(said)


@pytest.mark.slow
@pytest.mark.parametrize("state", State)
def test_every_state_says_what_to_do_and_none_says_anything_of_how_good_the_participant_is(
    state: State, tmp_path: Path
) -> None:
    with sat_at(state, tmp_path) as sitting:
        sitting.window.paint()
        assert instruction(Seen(about=sitting.window.about, position=sitting.position)).title
        assert not [text for text in sitting.window.heard if tells_correctness(text)]


@pytest.mark.slow
def test_whoever_looks_finds_the_word_they_need_in_each_state(tmp_path: Path) -> None:
    needed = {
        State.REARMING: "hold T",
        State.SETTING: "Confirm the damper with M",
        State.PREPARING: "fire with Space",
        State.TRAIN: "Press Space",
        State.ASKING: "F or B",
        State.CLOSING: "Enter ends the run",
        State.PAUSED: "P goes on",
        State.CORRECTING: "Esc leaves it",
        State.HALTED: "Q closes it",
    }
    for state, word in needed.items():
        with sat_at(state, tmp_path / state) as sitting:
            sitting.window.paint()
            assert any(word in text for text in sitting.window.heard), (state, sitting.window.heard)


# a participant's language from right to left


QUESTION = "أي اتجاه؟"


def reads_from_the_left(text: str) -> bool:
    """Whether each line begins at the left: its first letter outside isolates, if it has one, is not from the right."""
    outside = re.sub("\u2068[^\u2068\u2069]*\u2069", "", text)
    ways = ([unicodedata.bidirectional(letter) for letter in line] for line in outside.splitlines())
    return all(next((way for way in line if way in ("L", "R", "AL")), "L") == "L" for line in ways)


@pytest.mark.parametrize("make_step", [ask, rate, describe])
@pytest.mark.parametrize("there", [False, True])
def test_what_the_console_says_in_english_keeps_its_sides_beside_a_question_from_the_right(
    make_step: Callable[[Trial], Asking], there: bool
) -> None:
    step = replace(make_step(plan_of(PREFERENCE).trials[0]), text=QUESTION)
    here = seen(PREFERENCE, Position(states=(State.RATING if step.kind != "ask" else State.ASKING,), step=step))
    asked = instruction(replace(here, about=replace(here.about, participant_rates=there, participant_keys=there)))
    assert not reads_from_the_left(QUESTION)
    assert QUESTION in f"{asked.title}\n{asked.detail}"
    assert reads_from_the_left(asked.title)
    assert reads_from_the_left(asked.detail)


def test_a_scale_whose_ends_are_from_the_right_keeps_its_low_end_on_the_left(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("PyQt6")
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    from PyQt6.QtGui import QTextLayout

    from experiments.screens.console.app import application

    application()
    scale = replace(rate(plan_of(PREFERENCE).trials[0]), minimum_text="لا أحبه", maximum_text="أحبه")
    shown = ends_text(scale)
    layout = QTextLayout(shown)
    layout.beginLayout()
    line = layout.createLine()
    layout.endLayout()
    low, high = (line.cursorToX(shown.index(end))[0] for end in ("0 =", "10 ="))
    assert low < high


# what is told


def test_the_gun_is_shown_as_it_says_itself_and_never_as_safe_when_it_says_nothing() -> None:
    halted = Position(states=(State.HALTED,))
    silent = seen(DIRECTION, halted, gun=GunSeen(status=None, asked_s=1.0, fault="no answer"))
    assert "does not say that it is disarmed: SWITCH OFF ITS POWER" in instruction(silent).damper
    assert "SWITCH OFF ITS POWER" in instruction(seen(DIRECTION, halted)).damper
    assert progress.gun_text(silent)[1] == "bad"


def test_what_the_gun_said_before_an_emergency_stop_says_nothing_of_what_it_is_after_it() -> None:
    halted, disarmed = Position(states=(State.HALTED,), since_s=5.0), status_of("disarmed")
    before = seen(DIRECTION, halted, gun=GunSeen(status=disarmed, asked_s=4.99))
    assert "Disarming" in instruction(before).damper
    assert "SWITCH OFF ITS POWER" in instruction(before).damper
    after = replace(before, gun=GunSeen(status=disarmed, asked_s=5.0))
    assert instruction(after).damper == "The gun itself says that it is disarmed."
    silent = replace(after, now_s=6.5)
    assert "SWITCH OFF ITS POWER" in instruction(silent).damper
    armed = replace(before, gun=GunSeen(status=status_of("armed"), asked_s=5.1))
    assert "does not say that it is disarmed" in instruction(armed).damper


def test_a_gun_that_has_not_answered_for_a_while_is_not_shown_in_its_last_state() -> None:
    asked = seen(DIRECTION, Position(), gun=GunSeen(status=status_of("disarmed"), asked_s=1.0))
    assert progress.gun_text(replace(asked, now_s=1.0 + view.UNANSWERED_S))[1] == "good"
    text, mood = progress.gun_text(replace(asked, now_s=5.0))
    assert (text, mood) == ("Gun: no answer for 4 s", "wait")


def test_a_gun_that_has_not_answered_for_a_while_is_neither_handed_over_nor_fired() -> None:
    preparing = Position(states=(State.PREPARING,), step=prepare(plan_of(DIRECTION).trials[0]))
    here = seen(DIRECTION, preparing, gun=GunSeen(status=status_of("disarmed"), asked_s=1.0), now_s=1.0)
    silent = replace(here, now_s=3.0)
    assert here.gun_silence == ""
    assert silent.gun_silence == "the gun has not answered for 2 s"
    assert instruction(here).title.endswith("hand it over")
    assert instruction(silent).title == "See to the gun first"
    assert replace(silent, gun=GunSeen(status=None, asked_s=1.0, fault="no port")).gun_silence == "no port"


@pytest.mark.parametrize("state", [State.FIRING, State.ASKING])
def test_the_gun_gives_no_trial_away_that_has_no_stimulus(state: State) -> None:
    detection = load_setup("detection")
    trial = plan_of(detection).trials[0]
    step = FireShot(trial=trial, attempt=1) if state is State.FIRING else ask(trial)
    left_out, fired = status_of("disarmed"), replace(status_of("armed"), shots=2)
    told = GunSeen(status=left_out, asked_s=1.0), GunSeen(status=fired, asked_s=1.0)
    for setup, differ in ((detection, 1), (DIRECTION, 2)):
        here = seen(setup, Position(states=(state,), step=step, since_s=2.0))
        assert len({progress.gun_text(replace(here, gun=one)) for one in told}) == differ
    later = [
        GunSeen(status=replace(left_out, shots=shots, coil_temperature_C=24.8 + shots), asked_s=3.0) for shots in (1, 2)
    ]
    asked = seen(detection, Position(states=(State.ASKING,), step=ask(trial), since_s=2.0))
    assert {progress.gun_text(replace(asked, gun=one)) for one in later} == {("Gun: disarmed", "good")}


def test_the_method_of_the_others_gives_no_catch_trial_away() -> None:
    setup = direction_with(("vibration", "asymmetric-1"), 1, 1)
    here = seen(setup, Position(step=prepare(plan_of(setup).trials[0])))
    trial = here.here
    assert view.method_text(here.about, trial)
    left_out = replace(trial, trial=99, levels=(), catch=True)
    beside = replace(here.about.plan, trials=(*here.about.plan.trials, left_out))
    assert view.method_text(replace(here.about, plan=beside), trial) == ""


def test_the_count_of_a_track_gives_no_catch_trial_away() -> None:
    trials = [replace(trial, catch=False, track=1) for trial in plan_of(DIRECTION).trials]
    plan = replace(plan_of(DIRECTION), trials=tuple(trials))
    assert track_text(plan, (), trials[0]).startswith("Track 1: 0 of ")
    assert track_text(replace(plan, trials=(*trials, replace(trials[0], catch=True, track=0))), (), trials[0]) == ""


def test_an_armed_gun_is_not_shown_armed_for_good_after_the_end() -> None:
    ended = Ended(reason="no space left on device")
    armed = seen(DIRECTION, Position(), gun=GunSeen(status=status_of("armed"), asked_s=1.0), ended=ended)
    assert progress.gun_text(armed) == ("Gun: not looked at any more", "wait")
    disarmed = replace(armed, gun=GunSeen(status=status_of("disarmed"), asked_s=1.0), now_s=60.0)
    assert progress.gun_text(disarmed)[1] == "good"


def test_a_test_shot_is_promised_only_where_the_emergency_stop_is_on_record() -> None:
    halted = seen(DIRECTION, Position(states=(State.HALTED,)))
    assert "begins with a test shot" in instruction(halted).detail
    unsaved = instruction(replace(halted, halt_unsaved=True)).detail
    assert "begins with a test shot" not in unsaved
    assert "not on record" in unsaved


def test_rating_and_description_are_awaited_from_the_participants_screen_where_there_is_one() -> None:
    trial = plan_of(PREFERENCE).trials[0]
    for state, step, what in (
        (State.RATING, rate(trial), "rating"),
        (State.RATING, replace(rate(trial), is_number=True), "number"),
        (State.DESCRIBING, describe(trial), "words"),
    ):
        here = seen(PREFERENCE, Position(states=(state,), step=step))
        there = replace(here, about=replace(here.about, participant_rates=True))
        awaited = f"Awaited: the participant's {what} on their own screen, or typed here."
        assert instruction(here).detail == "?"
        assert instruction(there).detail == f"?\n{awaited}"


def test_a_participants_screen_that_is_gone_is_awaited_no_more() -> None:
    gone = ParticipantSeen(failure="killed by signal 9")
    for setup, step, state, does in (
        (PREFERENCE, rate, State.RATING, {"participant_rates": True}),
        (DIRECTION, ask, State.ASKING, {"participant_keys": True}),
    ):
        here = seen(setup, Position(states=(state,), step=step(plan_of(setup).trials[0])), participant=gone)
        detail = instruction(replace(here, about=replace(here.about, **does))).detail
        assert "Awaited" not in detail
        assert "Their screen is gone." in detail


def test_a_pause_names_the_key_that_starts_a_lost_participants_screen_again() -> None:
    trial = plan_of(DIRECTION).trials[0]
    paused = seen(DIRECTION, Position(states=(State.ASKING, State.PAUSED), step=ask(trial)))
    assert "starts it again" not in instruction(paused).detail
    still = replace(paused, position=replace(paused.position, why="the program stood still"))
    assert instruction(still).detail.startswith("The program stood still.\nNothing happens meanwhile. ")
    gone = replace(paused, participant=ParticipantSeen(failure="killed by signal 9"))
    assert "Their screen is gone: S starts it again." in instruction(gone).detail


@pytest.mark.parametrize(
    ("asked_s", "state", "now_s", "says"),
    [
        (9.9, "armed", 10.5, ""),
        (10.1, "disarmed", 10.5, "The gun is disarmed."),
        (59.9, "disarmed", 60.0, "The gun is disarmed."),
        (58.0, "disarmed", 60.0, "SWITCH OFF ITS POWER."),  # it has said nothing since
        (10.1, "resetting", 10.5, ""),
        (10.1, "armed", 11.5, "SWITCH OFF ITS POWER."),
        (9.9, "disarmed", 11.5, "SWITCH OFF ITS POWER."),
        (10.1, None, 11.5, "SWITCH OFF ITS POWER."),
    ],
)
def test_a_pause_says_that_the_gun_is_disarmed_where_the_gun_said_so_since(
    asked_s: float, state: GunState | None, now_s: float, says: str
) -> None:
    trial = plan_of(DIRECTION).trials[0]
    status = None if state is None else status_of(state)
    paused = Position(states=(State.FIRING, State.PAUSED), step=prepare(trial), since_s=10.0, paused_s=10.0)
    shown = instruction(seen(DIRECTION, paused, gun=GunSeen(status=status, asked_s=asked_s), now_s=now_s))
    assert shown.damper.endswith(says)
    assert bool(shown.damper) is bool(says)
    assert shown.mood == ("bad" if "POWER" in says else "wait")


def test_a_participants_screen_that_is_being_started_again_is_neither_gone_nor_to_be_started() -> None:
    starting = ParticipantSeen(failure="killed by signal 9", starting=True)
    here = seen(DIRECTION, Position(states=(State.ASKING,), step=ask(plan_of(DIRECTION).trials[0])))
    asked = replace(here, participant=starting, about=replace(here.about, participant_keys=True))
    told = "Their screen is being started again."
    assert f"{told} Until it is there: Enter what the participant says: F or B." in instruction(asked).detail
    for why in ("", "the participant's screen ended: killed by signal 9"):
        paused = replace(asked.position, states=(State.ASKING, State.PAUSED), why=why)
        does = f"{told} P goes on; until it is there you enter the answers."
        assert instruction(replace(asked, position=paused)).detail == does


def test_after_an_emergency_stop_nothing_comes_next_and_no_end_is_told() -> None:
    trial = plan_of(DIRECTION).trials[0]
    assert progress.coming(seen(DIRECTION, Position(states=(State.ASKING,), step=ask(trial))))
    assert not progress.coming(seen(DIRECTION, Position(states=(State.HALTED,), step=ask(trial))))


def test_before_a_test_shot_nothing_that_is_done_is_still_to_come() -> None:
    plan = plan_of(PREFERENCE)
    told: list[Any] = [(present(trial), SHOWN) for trial in plan.trials]
    rearming = Position(states=(State.REARMING,))
    assert progress.coming(seen(PREFERENCE, rearming, *told)) == ["ratings and words", "the end"]
    told += [(one(trial), RATED) for trial in plan.trials for one in (rate, describe)]
    assert progress.coming(seen(PREFERENCE, rearming, *told)) == ["the end"]


def test_a_train_is_not_said_to_go_on_while_the_gun_does_not_answer() -> None:
    train = Position(states=(State.TRAIN,), step=present(plan_of(PREFERENCE).trials[0]))
    here = seen(PREFERENCE, train, gun=GunSeen(status=status_of("armed"), asked_s=9.5), now_s=10.0)
    assert "The gun goes on firing until then. Press Space" in instruction(here).detail
    silent = GunSeen(status=None, asked_s=9.5, fault="no answer")
    for gone in (replace(here, gun=silent), replace(here, now_s=10.6)):
        assert "The gun does not answer. Press Space" in instruction(gone).detail


def test_the_participants_screen_has_the_keys_from_one_rating_or_description_to_the_next_and_no_longer() -> None:
    here = seen(PREFERENCE, Position()).about
    step = describe(plan_of(PREFERENCE).trials[0])
    there = replace(here, participant_rates=True)
    typed = {state for state in State if view.typed_there(there, Position(states=(state,), step=step))}
    assert typed == {State.RATING, State.DESCRIBING, State.SAVING}
    assert not any(view.typed_there(here, Position(states=(state,), step=step)) for state in State)
    assert not view.typed_there(there, Position(states=(State.SAVING,)))


def test_a_run_that_stopped_says_what_is_safe_only_if_it_was_read_back() -> None:
    def end(**how: Any) -> str:
        return instruction(seen(DIRECTION, Position(), ended=Ended(**how))).detail

    assert "1 answer," in end(reason="lunch", saved=1)
    assert "2 answers," in end(reason="lunch", saved=2)
    assert "can be resumed" in end(reason="lunch", saved=0)
    unread = end(reason="the gun is gone", saved=None)
    assert unread == "The gun is gone.\nQ closes this window."


def test_a_run_that_is_over_says_how_many_answers_count_where_a_trial_was_presented_again() -> None:
    first, second = plan_of(DIRECTION).trials[:2]
    told = ((ask(first), SAID), (prepare(second), Repeated(trial=first, reason="a noise")))
    told += ((ask(first), SAID), (ask(second), SAID))
    said = instruction(seen(DIRECTION, Position(), *told, ended=Ended(reason=None, saved=3))).detail
    assert "3 answers, all that were given; without those before a trial was presented again: 2." in said


def test_whose_the_keys_are_is_said_where_somebody_else_can_have_them() -> None:
    beside = ParticipantSeen(focused=True)
    assert progress.focus_text(seen(DIRECTION, Position(), participant=beside), here=False)[0].startswith(
        "Keys: the participant's screen"
    )
    assert progress.focus_text(seen(DIRECTION, Position(), participant=beside), here=True) == (
        "Keys: this window",
        "good",
    )
    assert progress.focus_text(seen(DIRECTION, Position()), here=True)[0] == ""
    assert "ANOTHER WINDOW" in progress.focus_text(seen(DIRECTION, Position()), here=False)[0]


def test_the_list_of_marks_has_those_of_this_set_and_an_answer_that_was_given_again_counts() -> None:
    trials = plan_of(DIRECTION).trials
    first, other = trials[0], trials[-1]
    step, given = ask(first), (ask(first), SAID)
    corrected = (None, EntryCorrected(trial=first, question="response", value="backward"))
    spoiled = (Prepare(trial=trials[1], attempt=1), Repeated(trial=first, reason="noise"))
    flagged, noted = (None, Flagged(trial=other, flag="late")), (None, Noted(trial=first, text="a dog"))
    here = Position(states=(State.ASKING,), step=step)
    marks = progress.marks(seen(DIRECTION, here, given, corrected, spoiled, flagged, noted))
    assert marks == [
        f"Trial {first.trial}: corrected to BACKWARD",
        f"Trial {first.trial}: to be presented again (noise)",
        f"Trial {first.trial}: “a dog”",
    ]
    assert progress.answer_lines(seen(DIRECTION, here, given, corrected)) != progress.answer_lines(
        seen(DIRECTION, here, given)
    )
    assert progress.answer_lines(seen(DIRECTION, here, given, corrected, spoiled, given)) == progress.answer_lines(
        seen(DIRECTION, here, given)
    )


def test_the_strip_shows_the_own_hands_times_of_the_session_alone() -> None:
    first, second, *_ = trials = plan_of(DIRECTION).trials
    own = Answered(value="forward", by="participant", response_time_s=0.7, response_time_valid=True)
    told = ((ask(first), own), (ask(second), SAID))
    here = Position(states=(State.ASKING,), step=ask(trials[2]))
    assert progress.own_times_s(seen(DIRECTION, here, *told)) == [0.7]
    later = next(trial for trial in trials if trial.session != first.session)
    assert progress.own_times_s(seen(DIRECTION, Position(states=(State.ASKING,), step=ask(later)), *told)) == []


# colours


def contrast(one: str, other: str) -> float:
    """The contrast ratio of two colours (WCAG 2): 1 to 21."""
    light, dark = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def _luminance(hex_colour: str) -> float:
    parts = [int(hex_colour[start : start + 2], 16) / 255 for start in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("name", ["dark", "light"])
def test_text_of_every_mood_stands_out_on_ground_and_panel_seven_to_one(name: widgets.Theme) -> None:
    for ground in ("ground", "panel"):
        for text in (*widgets.MOODS, "text", "quiet"):
            assert contrast(widgets.colour(name, text), widgets.colour(name, ground)) >= 7, (text, ground)


@pytest.mark.parametrize("name", ["dark", "light"])
@pytest.mark.parametrize("ground", ["stop", "practice", "simulated"])
def test_the_text_of_stop_button_and_bands_stands_out(name: widgets.Theme, ground: str) -> None:
    text = widgets.colour(name, f"{ground}_text")
    assert contrast(text, widgets.colour(name, ground)) >= 4.5  # WCAG 2 AA; it is large and bold


def test_contrast_is_that_of_the_published_definition() -> None:
    # WCAG 2: a colour on itself is 1 to 1; #767676 is the lightest grey with 4.5 to 1 on white
    assert contrast("#767676", "#ffffff") == pytest.approx(4.54, abs=0.005)
    assert contrast("#ffffff", "#ffffff") == 1


# the time to go


class Day:
    """A run whose trials take what they are told to."""

    def __init__(self, setup: Setup[DesignConfig]) -> None:
        self.setup, self.plan, self.so_far = setup, plan_of(setup), RunTiming()
        self.told: list[Any] = []
        self.now_s = 100.0
        self.position = Position()

    def begin(self, trial: Trial) -> None:
        self.at(Position(states=(State.PREPARING,), step=prepare(trial)))

    def at(self, position: Position) -> None:
        self.position = position
        self.so_far.at(position, self.now_s)

    def answer(self, trial: Trial, duration_s: float) -> None:
        self.begin(trial)
        self.now_s += duration_s
        self.told.append((ask(trial), SAID))
        self.so_far.saved(ask(trial), SAID, self.now_s)

    @property
    def left_s(self) -> float:
        so_far = {"told": self.told, "position": self.position, "now_s": self.now_s}
        return remaining_s(Ahead(design=self.setup.config, plan=self.plan, **so_far), self.so_far)


@pytest.mark.slow
@given(durations=st.lists(st.floats(1, 300), min_size=1, max_size=6))
def test_the_estimate_moves_from_the_plan_towards_what_is_measured_and_never_beyond(durations: list[float]) -> None:
    day = Day(DIRECTION)
    planned_s = DIRECTION.config.trial_s
    for trial, duration_s in zip(day.plan.trials, durations, strict=False):
        before_s, left = day.left_s, len(day.plan.trials) - len(day.told)
        day.answer(trial, duration_s)
        # a trial less; the others by at most a sixth of what this one was off, as the plan counts like five trials
        assert abs(before_s - day.left_s - planned_s) <= (left + 1) * 300 / 6
    measured_s = (5 * planned_s + sum(durations)) / (5 + len(durations))
    left, breaks_s = len(day.plan.trials) - len(durations), 30.0 + 60.0 + 30.0
    assert day.left_s == pytest.approx(left * measured_s + breaks_s)


@pytest.mark.parametrize("pause_s", [60.0, 3600.0])
def test_a_pause_does_not_count_as_a_trials_time(pause_s: float) -> None:
    day, quick = Day(DIRECTION), Day(DIRECTION)
    first = day.plan.trials[0]
    day.begin(first)
    day.at(Position(states=(State.PREPARING, State.PAUSED), step=prepare(first), paused_s=day.now_s))
    day.now_s += pause_s
    day.at(Position(states=(State.PREPARING,), step=prepare(first)))
    for one in (day, quick):
        one.answer(first, 15.0)
    assert day.left_s == pytest.approx(quick.left_s)


def test_a_trial_lasts_until_the_last_question_that_is_asked_at_once() -> None:
    trial, so_far = plan_of(DIRECTION).trials[0], RunTiming()
    so_far.at(Position(states=(State.PREPARING,), step=prepare(trial)), 100.0)
    for step, word, now_s in (
        (present(trial), SHOWN, 110.0),
        (ask(trial), SAID, 117.0),
        (replace(rate(trial), later=False), SAID, 125.0),
        (rate(trial), SAID, 190.0),
    ):
        so_far.saved(step, word, now_s)
    assert so_far.measured_s == [25.0]
    so_far.at(Position(states=(State.PREPARING,), step=prepare(trial)), 200.0)
    so_far.saved(present(trial), SHOWN, 204.0)
    assert so_far.measured_s == [25.0, 4.0]


def test_a_break_that_is_on_counts_as_what_is_left_of_it_and_stands_still_in_a_pause() -> None:
    day = Day(DIRECTION)
    whole_s = day.left_s
    rest = Rest(duration_s=30.0, between="sets")
    day.at(Position(states=(State.RESTING,), step=rest, until_s=day.now_s + 30.0))
    day.now_s += 20.0
    assert day.left_s == pytest.approx(whole_s - 20.0)
    day.at(Position(states=(State.RESTING, State.PAUSED), step=rest, until_s=day.now_s + 10.0, paused_s=day.now_s))
    day.now_s += 500.0
    assert day.left_s == pytest.approx(whole_s - 20.0)


def test_ratings_still_to_come_are_counted() -> None:
    day = Day(PREFERENCE)
    day.told = [(present(trial), SHOWN) for trial in day.plan.trials]
    assert day.left_s == pytest.approx(len(day.plan.trials) * PREFERENCE.config.rating_s)
    assert day.left_s > 0
    day.told.append((rate(day.plan.trials[0]), Answered(value=5.0, by="experimenter")))
    questions = len(day.plan.trials) * len(PREFERENCE.config.asked_later)
    assert day.left_s == pytest.approx((questions - 1) * PREFERENCE.config.question_s)


def test_how_far_the_run_is_counts_what_was_felt_and_what_was_rated_where_all_is_rated_last() -> None:
    first, second, *_ = plan_of(PREFERENCE).trials
    felt = [(present(trial), SHOWN) for trial in (first, second)]
    told = (*felt, (rate(first), Answered(value=None, by="experimenter")))
    assert counted(seen(PREFERENCE, Position(step=rate(first)), *told)) == [("felt", 2, 3), ("rated", 1, 3)]
    trials = plan_of(DIRECTION).trials
    answers = tuple((ask(trial), SAID) for trial in trials[:4])
    assert counted(seen(DIRECTION, Position(step=ask(trials[4])), *answers)) == [
        ("set", 1, 3),
        ("session", 4, 6),
        ("experiment", 4, 12),
    ]


def counted(here: Seen) -> list[tuple[str, int, int]]:
    return [(one.what, one.count, one.planned) for one in trials_done(here)]


def test_the_end_is_a_time_of_day_also_over_midnight() -> None:
    assert end_text(1200.0, datetime(2026, 1, 1, 23, 50)) == "about 00:10"
    assert end_text(0.0, datetime(2026, 1, 1, 9, 0, 29)) == "about 09:00"
    assert clock_text(0.4) == "0:00"


def test_no_time_has_gone_by_before_the_run_begins() -> None:
    so_far = RunTiming()
    assert so_far.elapsed_s(5_000.0) == 0.0
    so_far.began_s = 5_000.0
    assert so_far.elapsed_s(5_030.0) == 30.0


@pytest.mark.parametrize(
    ("grain", "typed", "meant"),
    [
        *(
            (0.1, "7,3", 7.3),
            (0.1, "\uff17\uff0e\uff13", 7.3),
            (0.1, "\u0667\u066b\u0663", 7.3),
            (0.5, "7.5", 7.5),
            (1.0, "10", 10.0),
            (0.0, "7.123", 7.123),
            (0.1, " 0 ", 0.0),
        ),
        (1.0, "2.5", "It goes in steps of 1: type 2 or 3."),
        (0.5, "7.3", "It goes in steps of 0.5: type 7 or 7.5."),
        (0.5, "3.50000001", "It goes in steps of 0.5: type 3.5 or 4."),
        (1.0, "9.51", "It goes in steps of 1: type 9 or 10."),
        *((0.1, typed, "Not a rating: type a number from 0 to 10.") for typed in ("11", "-1", "nan", "1_0", "", "1e")),
    ],
)
def test_a_rating_is_taken_as_it_was_typed_or_not_at_all(grain: float, typed: str, meant: float | str) -> None:
    scale = replace(rate(plan_of(PREFERENCE).trials[0]), grain=grain)
    assert typed_rating(typed, scale) == meant


def test_what_is_no_number_or_rank_is_told_as_such_with_its_bounds_in_full() -> None:
    scale = replace(rate(plan_of(PREFERENCE).trials[0]), minimum=0.001, maximum=LARGEST_NUMBER, is_number=True)
    for grain in (0.0, 0.001):
        any_number = replace(scale, grain=grain)
        assert typed_rating("hard", any_number) == "Not a number: type a number from 0.001 to 1,000,000,000."
    rank = replace(any_number, grain=1.0, minimum=1.0, maximum=8.0, distinct=True)
    assert typed_rating("9", rank) == "Not a rank: type a number from 1 to 8."


@pytest.mark.parametrize("state", [State.SETTING, State.PREPARING])
def test_a_gun_that_does_not_answer_is_not_handed_over(state: State) -> None:
    here = seen(DIRECTION, Position(states=(state,), step=prepare(plan_of(DIRECTION).trials[0])))
    lost = replace(here, gun=GunSeen(status=None, asked_s=9.0, fault="the gun is not there"))
    for silent in (lost, replace(here, gun=GunSeen(status=replace(status_of("fault"), fault="too hot"), asked_s=9.0))):
        shown = instruction(silent)
        assert (shown.title, shown.mood) == ("See to the gun first", "bad")
        assert "its cable and its power before anybody takes it" in shown.detail
        assert "hand it over" not in shown.title + shown.detail
    assert "The gun is not there." in instruction(lost).detail
    assert "hand it over" in instruction(replace(here, gun=GunSeen(status=status_of("disarmed"), asked_s=9.0))).title


def test_a_training_promises_nothing_that_is_not_kept() -> None:
    halted = seen(DIRECTION, Position(states=(State.HALTED,), step=ask(plan_of(DIRECTION).trials[0])))
    training = replace(halted, about=replace(halted.about, band="TRAINING"))
    assert "test shot" in instruction(halted).detail
    assert "test shot" not in instruction(training).detail
    for here, is_kept in ((halted, True), (training, False)):
        said = instruction(replace(here, ended=Ended(reason="emergency stop", saved=3))).detail
        assert ("3 answers" in said, "The run can be resumed" in said) == (is_kept, is_kept)


# several questions a trial


@pytest.fixture
def several() -> Setup[DesignConfig]:
    """Sets of two trials with a direction and a rating at once, and words after the set."""
    scale = {"kind": "rating", "text": "How strong?", "minimum": 0.0, "maximum": 10.0, "grain": 1.0}
    words = {"kind": "text", "text": "What was it like?", "when": "block"}
    return direction_with(methods=("vibration",), sets=2, repetitions=2, questions={"strength": scale, "words": words})


@pytest.mark.parametrize("state", [State.RATING, State.DESCRIBING, State.SAVING])
def test_a_question_after_its_set_names_its_trial_once(several: Setup[DesignConfig], state: State) -> None:
    for setup, its_set in ((several, "set 1 of 2 · session 1 of 1"), (PREFERENCE, "")):
        asked = rate(plan_of(setup).trials[1])
        here = seen(setup, Position(states=(state,), step=asked))
        assert view.where_text(here) == its_set
        in_other_words = replace(here.about, messages=replace(here.about.messages, place="{number}/{of}"))
        others = replace(here, about=in_other_words), replace(here, position=Position(step=prepare(asked.trial)))
        assert all(view.where_text(other).startswith("Trial 2 of ") for other in others)


def test_a_trial_is_done_when_all_that_is_asked_at_once_is_answered(several: Setup[DesignConfig]) -> None:
    first, second, *_ = plan_of(several).trials
    strength = replace(rate(first), question="strength", later=False)
    said = (ask(first), SAID)
    assert counted(seen(several, Position(step=strength), said))[0] == ("set", 0, 2)
    told = (said, (strength, Answered(value=3.0, by="experimenter")))
    assert counted(seen(several, Position(step=prepare(second)), *told))[0] == ("set", 1, 2)
    spoiled = (*told, (prepare(second), Repeated(trial=first, reason="coughed")))
    here = seen(several, Position(step=prepare(first)), *spoiled)
    assert counted(here)[0] == ("set", 0, 2)
    assert progress.answer_lines(here) == []
    broken = (said, (strength, Interrupted(presented=True)))  # killed, and resumed: it is presented again
    here = seen(several, Position(step=prepare(first)), *broken)
    assert (counted(here)[0], progress.answer_lines(here)) == (("set", 0, 2), [])
    assert [
        row["response"] for row in design_rows(plan_of(several), broken, several.config)[:1] if "response" in row
    ] == []


def test_what_comes_next_in_a_set_with_questions_after_it_ends_with_the_set(several: Setup[DesignConfig]) -> None:
    first, second, third, *_ = plan_of(several).trials
    words = replace(describe(first), question="words")
    break_s = "break of 20 s"
    assert progress.coming(seen(several, Position(step=ask(second)))) == ["words", break_s, shown_way(third)]
    said = progress.coming(seen(several, Position(step=words)), count=4)
    assert said[:3] == ["“words”: Trial 2 of 2", break_s, shown_way(third)]
    said = progress.coming(seen(several, Position(step=replace(words, trial=second))))
    assert said[:2] == [break_s, shown_way(third)]
    last = replace(words, trial=plan_of(several).trials[-1])
    assert progress.coming(seen(several, Position(step=last))) == ["the end"]


def shown_way(trial: Trial) -> str:
    return trial.direction.upper()
