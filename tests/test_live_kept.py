"""What a live run keeps of what was done, refused, corrected and undone."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.design.plan import Trial
from experiments.live_run import EventVerdict
from experiments.record.replay import history
from experiments.session import events
from experiments.session.events import Event
from experiments.session.remarks import EntryCorrected, Flagged, Noted, Refused
from experiments.session.states import State
from experiments.session.steps import Asking, Repeated, what
from tests.at_controls import DIRECTION, PREFERENCE, Sitting, raw_answers, remarks, sat, sat_at
from tests.live_hands import DUE, S, at_one_instant, by_hand, of_journal, own_key, rate_and_describe, to_the_end

pytestmark = pytest.mark.slow


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
