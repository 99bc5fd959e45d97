"""What a live run does where the disk takes no record."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.live_run import CORRECTION_UNSAVED
from experiments.record import storage
from experiments.record.journal import JournalError
from experiments.session import events
from experiments.session.history import entered_value
from experiments.session.remarks import EntryCorrected, Halted
from experiments.session.states import EMERGENCY
from tests.at_controls import DIRECTION, Sitting, raw_answers, remarks, sat, sat_at
from tests.live_hands import DUE, S, at_one_instant, by_hand, of_journal, own_key, ranked, three_ranks
from tests.waiting import wait_for

pytestmark = pytest.mark.slow


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
