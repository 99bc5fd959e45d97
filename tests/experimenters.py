"""Experimenters at the console's controls who do what was drawn, and keep their own book of what must come of it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from experiments.screens.console.state import State
from hypothesis import strategies as st

from device.words import Direction
from experiments.live_run import RunStopped
from experiments.plan import Trial
from experiments.screens.console.messages import Ended, ParticipantAnswered, Waiting
from experiments.setup import Setup
from experiments.steps import Ask, Describe, Prepare, Present, Rate, Rest
from tests.at_controls import PREFERENCE, Sitting


@dataclass
class Book:
    """What the test itself keeps of a run: what counts now, all that was ever said, and the marks."""

    counts: dict[Trial, Direction] = field(default_factory=dict)
    valid: dict[Trial, bool] = field(default_factory=dict)
    said: list[tuple[str, Trial, Direction]] = field(default_factory=list)
    marks: dict[Trial, set[str]] = field(default_factory=dict)
    own: dict[Trial, list[str]] = field(default_factory=dict)
    notes: dict[Trial, list[str]] = field(default_factory=dict)
    fired: dict[Trial, int] = field(default_factory=dict)
    cuts: list[str] = field(default_factory=list)
    pauses: int = 0
    stops: int = 0

    def entered(self, kind: str, trial: Trial, response: Direction, *, valid: bool) -> None:
        self.counts[trial], self.valid[trial] = response, valid
        self.said.append((kind, trial, response))

    def mark(self, trial: Trial, flag: str) -> None:
        self.marks.setdefault(trial, set()).add(flag)

    def flags(self, trial: Trial) -> str:
        order = [flag for flag in ("interrupted", "repeated", "corrected") if flag in self.marks.get(trial, ())]
        return " ".join(dict.fromkeys(order + self.own.get(trial, [])))


class Experimenter:
    """Does the moves that were drawn, each at the first step where an experimenter could, and then only what is due."""

    def __init__(self, setup: Setup[Any], results: Path, moves: Sequence[tuple[Any, ...]]) -> None:
        self._setup, self._results = setup, results
        self._moves = iter(moves)
        self.book = Book()
        self.heard: list[str] = []

    def work(self) -> None:
        """From the first hand-over to the end, through every stop."""
        while True:
            sitting = Sitting(self._setup, self._results, resumed=self.book.stops > 0)
            stopped = self._sit(sitting)
            sitting.finish()
            self.heard += sitting.view.heard
            if not stopped:
                assert sitting.error is None
                return
            assert isinstance(sitting.error, RunStopped)
            self.book.stops += 1

    def _sit(self, sitting: Sitting) -> bool:
        while isinstance(message := sitting.step(), Waiting):
            self._knows(sitting.state)
            if self._at(sitting, message):
                sitting.until(lambda message: isinstance(message, Ended))
                return True
        return False

    def _knows(self, state: State) -> None:
        """What the console would show of an answer is the one that counts."""
        assert [state.said(trial) for trial in state.answered_in_set()] == [
            self.book.counts[trial].upper() for trial in state.answered_in_set()
        ]
        assert state.done() == set(self.book.counts)

    def _at(self, sitting: Sitting, message: Waiting) -> bool:
        """Moves until the step is over; true if the run was stopped."""
        while True:
            move = next(self._moves, ("go", "forward", False, False))
            if move[0] == "stop":
                if isinstance(message.step, Ask):
                    self.book.mark(message.step.trial, "interrupted")
                sitting.controls.stop_for("lunch")
                return True
            if getattr(self, f"_{move[0]}")(sitting, message, *move[1:]):
                return False

    def _go(self, sitting: Sitting, message: Waiting, response: Direction, by_participant: bool, twice: bool) -> bool:
        step, do = message.step, sitting.controls
        for _ in range(1 + twice):
            if isinstance(step, Prepare):
                do.main()
            elif isinstance(step, Ask) and by_participant:
                sitting.screen.reply(ParticipantAnswered(response=response, at_s=sitting.clock.now()))
            elif isinstance(step, Ask):
                do.answer(response)
        if isinstance(step, Prepare):
            self.book.fired[step.trial] = self.book.fired.get(step.trial, 0) + 1
        elif isinstance(step, Ask):
            self.book.entered("answered", step.trial, response, valid=by_participant)
        elif step.between == "sets":
            sitting.view.line = f"cut {len(self.book.cuts)}"
            self.book.cuts.append(sitting.view.line)
            do.end_break()
        return True

    def _correct(self, sitting: Sitting, _: Waiting, depth: int, response: Direction, leaves: bool) -> bool:
        answered = sitting.state.answered_in_set()
        for _press in range(depth):
            sitting.controls.undo()
        if not answered:
            assert "Nothing to undo in this set." in sitting.view.heard
            return False
        assert sitting.controls.correcting == answered[max(0, len(answered) - depth)]
        if leaves:
            assert sitting.controls.leave_correction()
            return False
        trial = answered[max(0, len(answered) - depth)]
        sitting.controls.answer(response)
        sitting.remarked()
        self.book.entered("answer-corrected", trial, response, valid=False)
        self.book.mark(trial, "corrected")
        return False

    def _repeat(self, sitting: Sitting, message: Waiting) -> bool:
        answered, step = sitting.state.answered_in_set(), message.step
        trial = step.trial if isinstance(step, Ask) else answered[-1] if answered else None
        sitting.controls.repeat()
        if isinstance(step, Rest) or trial is None:
            assert sitting.view.heard[-1] == "There is no trial of this set to repeat now."
            return False
        self.book.mark(trial, "repeated")
        return True

    def _flag(self, sitting: Sitting, _: Waiting, typed: str, kept: str) -> bool:
        trial = sitting.state.trial
        sitting.view.line = typed
        sitting.controls.flag()
        if kept:
            sitting.remarked()
            self.book.own.setdefault(trial, []).append(kept)
        else:
            assert sitting.view.heard[-1].startswith("A flag is a word")
        return False

    def _note(self, sitting: Sitting, _: Waiting, text: str) -> bool:
        sitting.view.line = text
        sitting.controls.note()
        sitting.remarked()
        self.book.notes.setdefault(sitting.state.trial, []).append(text)
        return False

    def _pause(self, sitting: Sitting, _: Waiting) -> bool:
        do = sitting.controls
        do.pause()
        do.main()  # neither may come through
        do.answer("forward")
        do.pause()
        sitting.remarked(2)
        self.book.pauses += 1
        return False


DIRECTIONS = st.sampled_from(["forward", "backward"])
FLAGS = [("noise", "noise"), ("Door slam", "door-slam"), ("9 lives", ""), ("späte", ""), ("-", ""), ("x" * 40, "")]
GO = st.tuples(st.just("go"), DIRECTIONS, st.booleans(), st.booleans())
MOVES = st.lists(
    st.one_of(
        GO,
        GO,
        GO,
        st.tuples(st.just("correct"), st.integers(1, 4), DIRECTIONS, st.booleans()),
        st.just(("repeat",)),
        st.sampled_from(FLAGS).map(lambda flag: ("flag", *flag)),
        st.tuples(st.just("note"), st.sampled_from(["a dog barked", "=1+1", 'he said "hm", loudly', "später"])),
        st.just(("pause",)),
        st.just(("stop",)),
    ),
    min_size=8,
    max_size=50,
)


RATING_MOVES = st.lists(
    st.one_of(
        st.tuples(st.just("rate"), st.sampled_from(["0", "7,5", "10", "3.14"])),
        st.tuples(st.just("rate"), st.sampled_from(["11", "nan", "", "-1"])),
        st.tuples(st.just("undo"), st.integers(0, 3), st.sampled_from(["0", "2.5", "3.14", "9", "x", "12", "many"])),
        st.just(("none",)),
        st.just(("stop",)),
    ),
    max_size=14,
)
GOOD: dict[str, float | None] = {"0": 0.0, "7,5": 7.5, "10": 10.0, "3.14": 3.1, "2.5": 2.5, "9": 9.0, "x": None}


class Rater:
    """Works experiment 2: nexts, ratings good and bad, corrections, stops."""

    def __init__(self, results: Path, moves: Sequence[tuple[Any, ...]]) -> None:
        self._results, self._moves = results, iter(moves)
        self.counts: dict[Trial, float | None] = {}
        self.said: list[tuple[str, Trial, float | None]] = []
        self.corrected: set[Trial] = set()
        self.heard: list[str] = []

    def work(self) -> None:
        for sitting_number in itertools.count():
            sitting = Sitting(PREFERENCE, self._results, resumed=sitting_number > 0)
            stopped = self._sit(sitting)
            sitting.finish()
            self.heard += sitting.view.heard
            if not stopped:
                assert sitting.error is None
                return

    def _sit(self, sitting: Sitting) -> bool:
        do = sitting.controls
        while isinstance(message := sitting.step(), Waiting):
            assert {trial: sitting.state.said(trial) for trial in sitting.state.rated()} == {
                trial: "no answer" if rating is None else f"{rating:g}" for trial, rating in self.counts.items()
            }
            match message.step:
                case Prepare() | Present():
                    do.main()
                case Rate() as step:
                    if self._rate(sitting, step):
                        sitting.until(lambda message: isinstance(message, Ended))
                        return True
                case Describe():
                    do.words("  like a toy ")
        return False

    def _rate(self, sitting: Sitting, step: Rate) -> bool:
        """Moves until the rating is given; true if the run was stopped."""
        while True:
            move, *how = next(self._moves, ("rate", "0"))
            if move == "stop":
                sitting.controls.stop_for("lunch")
                return True
            if move == "undo":
                self._undo(sitting, *how)
            elif move == "none":
                sitting.controls.no_rating()
                return self._given(step.trial, None)
            else:
                typed = str(how[0])
                sitting.controls.rating(typed)
                if typed in GOOD:
                    return self._given(step.trial, GOOD[typed])
                assert sitting.view.heard[-1] == "Not a rating: type a number from 0 to 10."

    def _given(self, trial: Trial, rating: float | None) -> bool:
        self.counts[trial] = rating
        self.said.append(("rated", trial, rating))
        return False

    def _undo(self, sitting: Sitting, further: int, typed: str) -> None:
        sitting.view.lines = ["U"] * further + [typed]
        sitting.controls.undo()
        if not self.counts:
            sitting.view.lines.clear()
            assert sitting.view.heard[-1] == "There is no rating to undo yet."
        elif typed in GOOD:
            sitting.remarked()
            trial = list(self.counts)[max(0, len(self.counts) - 1 - further)]
            self.counts[trial] = GOOD[typed]
            self.said.append(("rating-corrected", trial, GOOD[typed]))
            self.corrected.add(trial)
