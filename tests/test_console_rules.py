"""The console's rules without its window: whatever an experimenter does in whatever order, the record stays whole."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, settings

from device import Gun, LinkError, Shot, ShotReport
from experiments import run as runs
from experiments.live_run import RunStopped
from experiments.plan import Plan
from experiments.remarks import Continued, Paused, RatingCorrected
from experiments.replay import told
from experiments.screens.console.messages import Ended, Waiting
from experiments.steps import Ask, Prepare, Rated, Rested
from tests.at_controls import CORRECTNESS, DIRECTION, Sitting, kept, raw_answers, remarks, stopped_at_the_end
from tests.experimenters import MOVES, RATING_MOVES, Experimenter, Rater

FIRE, SAID = ("go", "forward", False, False), ("go", "forward", True, True)
CORRECTED_THEN_RESUMED = [FIRE, SAID, ("correct", 1, "backward", False), ("stop",), ("correct", 1, "backward", True)]
ALL_AT_ONCE = [
    *(FIRE, SAID, FIRE, SAID, FIRE, ("repeat",), ("flag", "Door slam", "door-slam"), FIRE, SAID),
    *(("correct", 4, "backward", False), ("note", "später"), ("pause",), ("stop",), FIRE, FIRE, ("stop",)),
    *(("repeat",), FIRE, ("correct", 2, "backward", False), FIRE, ("repeat",), ("repeat",)),
]


@settings(max_examples=80)
@example(moves=CORRECTED_THEN_RESUMED)
@example(moves=ALL_AT_ONCE)
@given(moves=MOVES)
def test_whatever_the_experimenter_does_each_trial_has_one_row_and_nothing_said_is_lost(
    moves: list[tuple[Any, ...]],
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        someone = Experimenter(DIRECTION, Path(folder), moves)
        someone.work()
        _, contents, rows = kept(Path(folder), "direction")
    book = someone.book
    trials = Plan.from_record(contents.header["plan"]).trials
    assert [(row["session"], row["set"], row["trial"]) for row in rows] == [
        (str(trial.session), str(trial.set), str(trial.trial)) for trial in trials
    ]
    assert raw_answers(contents) == book.said
    assert [row["response"] for row in rows] == [book.counts[trial] for trial in trials]
    assert [row["response_time_valid"] for row in rows] == [str(int(book.valid[trial])) for trial in trials]
    assert all(row["response_time_valid"] == "0" for row in rows if "corrected" in row["flags"] and not _again(row))
    assert [row["flags"] for row in rows] == [book.flags(trial) for trial in trials]
    assert [row["attempts"] for row in rows] == [str(book.fired[trial]) for trial in trials]
    assert [row["note"].lstrip("'") for row in rows] == ["; ".join(book.notes.get(trial, [])) for trial in trials]
    assert [word.cut_reason for _, word in told(contents) if isinstance(word, Rested) and word.cut_reason] == book.cuts
    assert len(remarks(contents, Paused)) == len(remarks(contents, Continued)) == book.pauses
    assert sum(record["kind"] == "stopped" for record in contents.records) == book.stops
    assert not [line for line in someone.heard if CORRECTNESS.search(line)]


def _again(row: dict[str, str]) -> bool:
    """Whether a corrected trial was presented once more, so that a later answer may count."""
    return row["attempts"] != "1"


@settings(max_examples=40)
@given(moves=RATING_MOVES)
def test_ratings_given_corrected_and_refused_in_any_order_make_one_row_each(moves: list[tuple[Any, ...]]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        someone = Rater(Path(folder), moves)
        someone.work()
        _, contents, rows = kept(Path(folder), "preference")
    trials = Plan.from_record(contents.header["plan"]).trials
    entered = [
        (word.kind, word.trial if step is None else step.trial, word.rating)
        for step, word in told(contents)
        if isinstance(word, Rated | RatingCorrected)
    ]
    assert entered == someone.said
    assert [row["trial"] for row in rows] == [str(trial.trial) for trial in trials]
    expected = [someone.counts[trial] for trial in trials]
    assert [float(row["rating"]) if row["rating"] not in ("", "NA") else None for row in rows] == expected
    assert [row["flags"] for row in rows] == ["corrected" if trial in someone.corrected else "" for trial in trials]
    assert {row["comment"] for row in rows} == {"like a toy"}
    assert not [line for line in someone.heard if CORRECTNESS.search(line)]


class FailsOnce:
    """The simulated gun, whose first shot fails."""

    def __init__(self, gun: Gun) -> None:
        self._gun, self.shots = gun, 0

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        self.shots += 1
        if self.shots == 1:
            raise LinkError("no answer")
        return self._gun.fire(shot, at_s)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._gun, name)


def test_a_key_pressed_twice_does_not_fire_again_without_a_hand_over_after_a_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    guns: list[FailsOnce] = []
    opened = runs.open_gun

    def open_gun(*where: Any, **how: Any) -> Any:
        guns.append(FailsOnce(opened(*where, **how)))
        return guns[-1]

    monkeypatch.setattr(runs, "open_gun", open_gun)
    with stopped_at_the_end(Sitting(DIRECTION, tmp_path)) as sitting:
        assert isinstance(sitting.step(), Waiting)
        sitting.controls.main()
        sitting.controls.main()
        again = sitting.step()
        assert isinstance(again, Waiting)
        assert isinstance(again.step, Prepare)
        assert again.step.attempt == 2
    assert guns[0].shots == 1


def test_an_emergency_stop_disarms_and_stops_from_every_step(tmp_path: Path) -> None:
    sitting = Sitting(DIRECTION, tmp_path)
    for kind in (Prepare, Ask, Prepare, Ask):
        message = sitting.step()
        assert isinstance(message, Waiting)
        assert isinstance(message.step, kind)
        sitting.controls.emergency_stop()
        ended = sitting.until(lambda message: isinstance(message, Ended))
        sitting.finish()
        assert ended == Ended(reason="emergency stop")
        assert isinstance(sitting.error, RunStopped)
        sitting = Sitting(DIRECTION, tmp_path, resumed=True)
        if kind is Prepare:
            assert isinstance(sitting.step(), Waiting)
            sitting.controls.main()
    sitting.controls.stop_for("enough")
    sitting.until(lambda message: isinstance(message, Ended))
    sitting.finish()
