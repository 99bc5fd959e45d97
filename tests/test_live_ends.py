"""How a live run ends, and what a hand does in passing."""

from __future__ import annotations

from pathlib import Path

import pytest

from device import LinkError
from experiments.design.plan import Trial
from experiments.live_run import EventVerdict
from experiments.record.replay import history
from experiments.screens.console.typed_lines import LINE_QUESTIONS, line_question
from experiments.screens.texts import again_text
from experiments.session import events
from experiments.session.judging import MINIMISED
from experiments.session.remarks import EntryCorrected, Flagged, HaltReason, Noted, Paused, Refused
from experiments.session.steps import Answered, Rate, trial_of
from tests.at_controls import DIRECTION, PREFERENCE, Sitting, kept, raw_answers, remarks, sat, sat_at
from tests.designs import changed
from tests.live_hands import S, by_hand, of_journal, own_key, prepare, to_the_end

pytestmark = pytest.mark.slow


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
