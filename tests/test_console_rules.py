"""The console's rules without its window: whatever an experimenter does in whatever order, the record stays whole."""

from __future__ import annotations

import csv
import itertools
import queue
import re
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from device import Gun, LinkError, Shot, ShotReport
from device.words import Direction
from experiments import catalogue
from experiments import run as runs
from experiments.clock import VirtualClock
from experiments.journal import Contents, read
from experiments.load import load_setup
from experiments.places import Place, place
from experiments.plan import Plan, Trial
from experiments.remarks import AnswerCorrected, Continued, Flagged, Noted, Paused, RatingCorrected, Remark
from experiments.replay import told
from experiments.run import Request, run, table
from experiments.runner import RunStopped, Screen
from experiments.screens.console import theme
from experiments.screens.console.controls import Controls
from experiments.screens.console.messages import (
    Began,
    Ended,
    Message,
    ParticipantAnswered,
    Saved,
    Trouble,
    Waiting,
)
from experiments.screens.console.screen import ConsoleScreen
from experiments.screens.console.state import State, coming, gun_text, instruction, place_text
from experiments.setup import Setup
from experiments.steps import Answered, Ask, Describe, Prepare, Present, Rate, Rated, Repeat, Rest, Rested

BREAK_S = 0.02
LONG_BREAK_S = 30.0
PATIENCE_S = 20.0
CORRECTNESS = re.compile(r"\b(correct|incorrect|correctly|wrong|right|score|hits?|points?)\b|%", re.IGNORECASE)


def changed(name: str, **changes: dict[str, Any]) -> Setup[Any]:
    """A shipped setup with some values of its config changed."""
    setup = load_setup(name)
    config = setup.config.model_dump()
    for part, values in changes.items():
        config[part] |= values
    return replace(setup, config=type(setup.config).model_validate(config))


def short_direction(sets: int = 2, trials: int = 3, set_break_s: float = LONG_BREAK_S) -> Setup[Any]:
    """Experiment 1 with two methods. Breaks between sets are long, so they are cut short; the others end by themselves.

    The virtual clock stands still meanwhile, so that a break lasts until its end is asked for or its queue gives up.
    """
    half, rest = divmod(sets * trials, 2)
    design = {"methods": ("vibration", "asymmetric-2"), "sets_per_session": sets, "trials_per_set": trials}
    design |= {"forward_per_session": half + rest, "backward_per_session": half}
    breaks = {"between_sets_s": set_break_s, "between_sessions_s": BREAK_S}
    return changed("direction", design=design, breaks=breaks, fatigue={"max_trials_without_break": 60})


DIRECTION, PREFERENCE = short_direction(), load_setup("preference")


@dataclass
class Listener:
    """A window that remembers what it was told and shown, and answers a question for a line at once."""

    line: str = "a dog barked"
    lines: list[str] = field(default_factory=list)
    heard: list[str] = field(default_factory=list)

    def say(self, text: str, mood: str) -> None:
        assert mood in theme.MOODS
        self.heard.append(text)

    def ask_line(self, question: str, enter: Callable[[str], None]) -> None:
        self.heard.append(question)
        enter(self.lines.pop(0) if self.lines else self.line)

    def refresh(self) -> None:
        pass


class Sitting:
    """One run at the console, from its start to its end or stop: the screen in the run's thread, the hands in ours."""

    def __init__(self, setup: Setup[Any], results: Path, *, resumed: bool = False) -> None:
        again = "resume" if resumed else "ask"
        self._request = Request(setup=setup, participant_id="P01", results=results, seed=1, again=again)
        self._messages: queue.Queue[Message] = queue.Queue()
        self.clock, self.view = VirtualClock(), Listener()
        self.error: BaseException | None = None
        self._made = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        assert self._made.wait(PATIENCE_S), self.error

    def _make_screen(self, setup: Setup[Any], plan: Plan, clock: Any) -> Screen:
        self.screen = ConsoleScreen(clock, self._messages.put, setup=setup)
        self.state = State(setup=setup, plan=plan)
        self.controls = Controls(self.state, clock, self.view, self.screen.reply, self._messages.put)
        self._made.set()
        return self.screen

    def _run(self) -> None:
        try:
            run(self._request, self._make_screen, self.clock)
        except BaseException as error:  # noqa: BLE001 - looked at by the test
            self.error = error
        finally:
            self._messages.put(Ended(reason=None if self.error is None else str(self.error)))
            self._made.set()

    def until(self, wanted: Callable[[Message], bool]) -> Message:
        """Take messages as the window does, up to one that is wanted."""
        while True:
            message = self._messages.get(timeout=PATIENCE_S)
            self.state.take(message, self.clock.now())
            if isinstance(message, Began):
                self.controls.desk = message.desk
            self._show()
            if wanted(message):
                return message
            assert not isinstance(message, Trouble), message.text

    def _show(self) -> None:
        shown = instruction(self.state, self.clock.now())
        self.view.heard += [shown.title, shown.detail, place_text(self.state), *coming(self.state)]

    def step(self) -> Message:
        """The next step that waits, or the end."""
        return self.until(lambda message: isinstance(message, Waiting | Ended))

    def remarked(self, count: int = 1) -> None:
        """Wait until so many remarks are on the disk."""
        for _ in range(count):
            self.until(lambda message: isinstance(message, Saved) and message.step is None)

    def finish(self) -> None:
        self._thread.join(PATIENCE_S)
        self.screen.end()
        assert not self._thread.is_alive()


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


def kept(results: Path, experiment: str) -> tuple[Place, Contents, list[dict[str, str]]]:
    """Where a run lies, what its journal holds, and the rows of the table that was written."""
    where = place(results, "P01", experiment)
    contents = read(where.journal)
    assert contents.finished
    assert where.table.read_bytes() == table(contents)
    with where.table.open(newline="", encoding="utf-8") as file:
        return where, contents, list(csv.DictReader(file))


def remarks(contents: Contents, *kinds: type) -> list[Remark]:
    return [word for step, word in told(contents) if step is None and isinstance(word, kinds)]


def raw_answers(contents: Contents) -> list[tuple[str, Trial, Direction]]:
    """Every answer and correction in the order of the journal."""
    found = []
    for step, word in told(contents):
        if isinstance(word, AnswerCorrected):
            found.append((word.kind, word.trial, word.response))
        elif isinstance(word, Answered):
            found.append((word.kind, step.trial, word.response))
    return found


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

    def fire(self, shot: Shot) -> ShotReport:
        self.shots += 1
        if self.shots == 1:
            raise LinkError("no answer")
        return self._gun.fire(shot)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._gun, name)


@contextmanager
def stopped_at_the_end(sitting: Sitting) -> Any:
    """Stops a sitting that a test leaves in the middle."""
    try:
        yield sitting
    finally:
        sitting.controls.stop_for("enough")
        sitting.until(lambda message: isinstance(message, Ended))
        sitting.finish()


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
        time.sleep(0.2)  # for a shot that must not come
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


# what is shown


def state_at(setup: Setup[Any], trial: int, make_step: Callable[[Trial], Any]) -> State:
    plan = catalogue.experiment(setup).make_plan(setup.config, "P01", 1, None)
    state = State(setup=setup, plan=plan)
    state.take(Waiting(step=make_step(plan.trials[trial]), since_s=0.0, until_s=30.0), 0.0)
    return state


def ask(trial: Trial) -> Ask:
    return Ask(trial=trial, attempt=1, question="Which way?", forward="forward", backward="backward")


def shown_texts(state: State) -> list[str]:
    shown = instruction(state, 10.0)
    return [shown.title, shown.detail, place_text(state), *coming(state), gun_text(state.gun)[0]]


@pytest.mark.parametrize("number", range(12))
def test_a_method_is_named_only_where_its_damper_is_set_by_hand(number: int) -> None:
    def prepare(trial: Trial) -> Prepare:
        return Prepare(trial=trial, attempt=2, damper=DIRECTION.gun.methods[trial.method].damper)

    for make_step in (prepare, ask):
        state = state_at(DIRECTION, number, make_step)
        said = "\n".join(shown_texts(state)).lower()
        for name in DIRECTION.config.design.methods:
            method = DIRECTION.gun.methods[name]
            if not (method.damper and state.trial.method == name):
                assert name not in said
                assert method.label.lower() not in said
        assert not CORRECTNESS.search(said)


def test_a_method_without_a_damper_is_a_letter_everywhere() -> None:
    assert any(not method.damper for method in DIRECTION.gun.methods.values())
    for number in range(12):
        state = state_at(DIRECTION, number, ask)
        if not DIRECTION.gun.methods[state.trial.method].damper:
            assert "(Method " in place_text(state)


@pytest.mark.parametrize("name", ["dark", "light"])
def test_text_of_every_mood_stands_out_on_ground_and_panel_seven_to_one(name: theme.Theme) -> None:
    for ground in ("ground", "panel"):
        for colour in (*theme.MOODS, "text", "quiet"):
            assert theme.contrast(name, colour, ground) >= 7, (colour, ground)


@pytest.mark.parametrize("name", ["dark", "light"])
def test_the_text_of_the_stop_button_stands_out(name: theme.Theme) -> None:
    assert theme.contrast(name, "stop_text", "stop") >= 4.5  # WCAG 2 AA; it is large and bold


def test_contrast_is_that_of_the_published_definition(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(theme._COLOURS["light"], "grey", "#767676")
    assert theme.contrast("light", "grey") == pytest.approx(4.54, abs=0.005)
    # WCAG 2: a colour on itself is 1 to 1; #767676 is the lightest grey with 4.5 to 1 on white
    assert theme.contrast("light", "ground", "ground") == 1
    assert theme.contrast("light", "stop_text", "ground") == 1


@given(durations=st.lists(st.floats(1, 300), max_size=11))
def test_the_time_to_go_is_the_trials_left_at_the_median_of_those_measured(durations: list[float]) -> None:
    plan = catalogue.experiment(DIRECTION).make_plan(DIRECTION.config, "P01", 1, None)
    state, now_s = State(setup=DIRECTION, plan=plan), 100.0
    for trial, duration in zip(plan.trials, durations, strict=False):
        state.take(Waiting(step=Prepare(trial=trial, attempt=1, damper=""), since_s=now_s), now_s)
        now_s += duration
        given = Answered(
            response="forward", response_time_s=1.0, response_source="experimenter", response_time_valid=False
        )
        state.take(Saved(step=ask(trial), word=given), now_s)
    config, left = DIRECTION.config, len(plan.trials) - len(durations)
    planned_s = (config.duration_s - config.break_s) / len(plan.trials)
    trial_s = statistics.median(durations) if durations else planned_s
    assert state.remaining_s() == pytest.approx(left * trial_s + config.break_s)


def test_a_trial_presented_again_is_done_when_it_is_answered_again_and_can_be_found_before() -> None:
    state = state_at(DIRECTION, 1, ask)
    first = state.plan.trials[0]
    given = Answered(response="forward", response_time_s=1.0, response_source="experimenter", response_time_valid=False)
    state.take(Saved(step=ask(first), word=given), 1.0)
    state.take(Saved(step=None, word=AnswerCorrected(trial=first, response="backward")), 2.0)
    assert state.said(first) == "BACKWARD"
    prepare = Prepare(trial=state.plan.trials[1], attempt=1, damper="")
    state.take(Saved(step=prepare, word=Repeat(trial=first, reason="noise")), 3.0)
    state.take(Saved(step=None, word=Flagged(trial=first, flag="noise")), 3.0)
    state.take(Saved(step=None, word=Noted(trial=first, text="a dog")), 3.0)
    assert state.said(first) == "BACKWARD"
    state.take(Saved(step=ask(first), word=given), 4.0)
    assert state.said(first) == "FORWARD"
    assert state.answered_in_set() == [first]
