"""The participant's own keys, ratings and descriptions in a live run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from experiments.live_run import EventVerdict, RunStopped
from experiments.record.replay import history
from experiments.session import events
from experiments.session.events import Event
from experiments.session.judging import NOTHING_TO_UNDO
from experiments.session.remarks import EntryCorrected, Refused
from experiments.session.steps import Answered, Rate
from experiments.study.folders import place
from tests.at_controls import DIRECTION, GUARD_S, PREFERENCE, Sitting, remarks, sat
from tests.at_display import records
from tests.designs import changed
from tests.live_hands import (
    S,
    at_one_instant,
    by_hand,
    of_journal,
    own_key,
    own_rating,
    own_words,
    ranked,
    three_ranks,
    to_the_end,
)

pytestmark = pytest.mark.slow


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
