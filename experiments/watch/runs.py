"""One run as it is watched: where it is, what went wrong, how long still; by its journal alone, and never an answer.

The journal's steps and remarks are led through the same table of states that the run obeyed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Literal

from experiments.record import replay, storage
from experiments.record.head_design import began_with
from experiments.record.journal import Contents, Head, JournalError, Record, read_as
from experiments.record.names import JOURNAL_NAME, misnamed
from experiments.record.tables import DataKind
from experiments.record.tail import JournalTail
from experiments.screens import texts
from experiments.session import events, remarks, steps
from experiments.session.duration import Ahead, RunTiming, remaining_s
from experiments.session.history import done, trial_at
from experiments.session.states import Position, State, after, entered
from experiments.study.folders import data_of

WatchedState = Literal[
    "running",
    "paused",
    "emergency stop",
    "damaged",
    "gone",
    "broken off",
    "stopped",
    "beginning",
    "not begun",
    "finished",
]
"""How a watched run stands.

`gone`: its journal was there and is not any more; `broken off`: neither an end is on record nor does a process of this
machine hold the journal; `beginning`: one holds it, and nothing is on record yet.
"""
UNDER_WAY: tuple[WatchedState, ...] = ("running", "paused")
"""The states in which time goes by that was planned."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """Something that went wrong in a run, and when."""

    utc: str
    what: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SyncTimes:
    """How long records took to be on the disk: the last whose time is known, and the longest of this sitting."""

    last_s: float
    longest_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRow:
    """What the page shows of a run. `problem`: why its journal cannot be trusted, or what else there is to say.

    `last_utc` is empty where nothing is on record. `virtual`: a synthetic run's clock, which runs ahead of the world's.
    """

    name: str
    state: WatchedState
    experiment: str = ""
    practice: bool = False
    data: DataKind | None = None
    doing: str = ""
    where: str = ""
    done: int = 0
    planned: int = 0
    left_s: float | None = None
    faults: int = 0
    last_fault: Fault | None = None
    sync: SyncTimes | None = None
    last_utc: str = ""
    virtual: bool = False
    problem: str = ""


STATE_OF: dict[type[steps.Step], State] = {
    steps.Prepare: State.PREPARING,
    steps.FireShot: State.FIRING,
    steps.Ask: State.ASKING,
    steps.Inform: State.INFORMING,
    steps.Rest: State.RESTING,
    steps.Present: State.TRAIN,
    steps.Rate: State.RATING,
    steps.Describe: State.DESCRIBING,
    steps.Close: State.CLOSING,
}
"""Where a run is when a step was announced."""

DOING: dict[State, str] = {
    State.SAVING: "between two steps",
    State.REARMING: "a test shot comes first, after the emergency stop",
    State.SETTING: "the gun is set and handed over",
    State.PREPARING: "the gun is set and handed over",
    State.FIRING: "a shot",
    State.TRAIN: "shots, until the participant says next",
    State.ASKING: "an answer is awaited",
    State.RATING: "an answer is awaited",
    State.DESCRIBING: "an answer is awaited",
    State.INFORMING: "the participant is told something",
    State.RESTING: "a break",
    State.CLOSING: "everything is answered; the run can be ended",
    State.PAUSED: "",
    State.CORRECTING: "a correction",
    State.HALTED: "nothing fires until the run is closed and resumed",
    State.STOPPED: "",
}
"""What goes on in a state, for somebody who is not in the room."""


class RunSoFar:
    """What the records of one journal come to, taken as they arrive. `JournalError` for records that make no run."""

    def __init__(self, head: Head) -> None:
        self.head, self.plan, self.design = head, head.plan, began_with(head)
        if not self.plan.trials:
            raise JournalError("a plan without trials", at=f"{head.path}: line 1")
        self._told: list[tuple[steps.Step | None, steps.Outcome | remarks.Remark]] = []
        self._timing, self._position = RunTiming(), Position()
        self._open: tuple[Record, ...] = ()
        self.last: Record = head
        self.faults: list[Fault] = []
        self.sync: SyncTimes | None = None
        self.end: Literal["", "stopped", "finished"] = ""
        self.reason, self._halted = "", False
        self.broken = False

    def add(self, records: Sequence[Record]) -> None:
        """Take the next records; `broken` if they make no run, and from then on none is taken."""
        self.broken = True
        told = [one for one in records if not _corrects(one)]  # of entries nothing is shown
        words = iter(replay.history(self._contents((*self._open, *told))))
        for record in records:
            self._synced(record)
            if not _corrects(record):
                self._take(record, words)
            self._timing.at(self._position, record.monotonic_s)
        self.broken = False

    def _contents(self, records: tuple[Record, ...]) -> Contents:
        return Contents(
            path=self.head.path, head=self.head, records=records, whole_bytes=0, cut_bytes=0, link="", sha256=""
        )

    def _take(self, record: Record, words: Iterator[tuple[steps.Step | None, steps.Outcome | remarks.Remark]]) -> None:
        match record.kind:
            case "step":
                self._open = (record,)
                self._enter(read_as(steps.STEP, record.body, f"{self.head.path}: line {record.n + 1}"), record)
            case "outcome":
                self._open = ()
                step, word = next(words)
                self._told.append((step, word))
                self._timing.saved(step, word, record.monotonic_s)
                self._note(word, record)
            case "remark" | "measured":
                _, word = next(words)
                self._told.append((None, word))
                self._moved(word, record)
                self._note(word, record)
            case "resumed":
                self._resumed(record)
            case "stopped" | "finished":
                self.end, self.reason, self._halted = record.kind, record.reason, record.halted

    def _synced(self, record: Record) -> None:
        """How long the record before took to be on the disk, as this one tells."""
        before, self.last = self.last, record
        if record.synced_s is None:
            self.sync = None
            return
        took_s = max(0.0, record.synced_s - before.monotonic_s)
        self.sync = SyncTimes(last_s=took_s, longest_s=max(took_s, self.sync.longest_s if self.sync else 0.0))

    def _enter(self, step: steps.Step, record: Record) -> None:
        until_s = record.monotonic_s + step.duration_s if isinstance(step, steps.Rest) else None
        self._position = entered(self._position, STATE_OF[type(step)], record.monotonic_s, step, until_s)

    def _moved(self, word: object, record: Record) -> None:
        """Stand where a remark leads."""
        match word:
            case remarks.Paused():
                self._offer(events.Pause, record)
            case remarks.Continued():
                self._offer(events.GoOn, record)
            case remarks.Halted():
                self._offer(events.EmergencyStop, record)
            case remarks.Noted(text=remarks.HALTED_BEFORE):
                self._position = Position(states=(State.REARMING,))
            case remarks.TestShot(cause=""):
                self._position = Position()

    def _offer(self, kind: type[events.Event], record: Record) -> None:
        moved = after(self._position, kind, record.monotonic_s)
        self._position = moved if isinstance(moved, Position) else self._position

    def _resumed(self, record: Record) -> None:
        """The run goes on, on a clock that may be another; after an emergency stop a test shot comes first."""
        if not self.end:
            self.faults.append(Fault(utc=record.utc, what="the run had broken off without an end on record; resumed"))
        halted = State.HALTED in self._position.states or self._halted
        self._position = Position(states=(State.REARMING,)) if halted else Position()
        self._timing = RunTiming(measured_s=self._timing.measured_s)
        self._open, self.end, self.reason, self._halted = (), "", "", False

    def _note(self, word: object, record: Record) -> None:
        what = fault_text(word)
        if what:
            self.faults.append(Fault(utc=record.utc, what=what))

    @property
    def state(self) -> State:
        """The state that counts."""
        return self._position.state

    @property
    def done(self) -> int:
        """How many of the planned trials were judged, or felt until next."""
        planned = {trial.place for trial in self.plan.trials}
        return len(planned & {trial.place for trial in done(self._told, self.design)})

    @property
    def where(self) -> str:
        """The trial at hand, with its set and session."""
        trial = trial_at(self.plan, self._told, self._position.step)
        return texts.place_text(self.plan, trial)

    def left_s(self, utc_now: datetime) -> float:
        """Seconds still to go, by the time that went by since the last record."""
        ahead = Ahead(
            design=self.design,
            plan=self.plan,
            told=self._told,
            position=self._position,
            now_s=self.last.monotonic_s + max(0.0, age_s(self.last.utc, utc_now)),
        )
        return remaining_s(ahead, self._timing)


def _corrects(record: Record) -> bool:
    body = record.body
    return record.kind == "remark" and isinstance(body, dict) and body.get("kind") == "corrected"


def age_s(utc: str, utc_now: datetime) -> float:
    """Seconds since a record's date and time; negative on a virtual clock, which runs ahead. 0 for none."""
    try:
        then = datetime.fromisoformat(utc)
        return (utc_now - then).total_seconds()
    except (ValueError, TypeError, OverflowError):
        return 0.0


def fault_text(word: object) -> str:
    """What went wrong by an outcome or remark, without anybody's typed words; empty if nothing did."""
    match word:
        case steps.Failed():
            return f"the gun failed: {word.cause}"
        case remarks.Paused(cause=cause) if cause:
            return f"paused: {cause}"
        case remarks.Halted():
            return f"emergency stop, by the {word.by}"
        case remarks.TestShot(cause=cause) if cause:
            return f"the test shot failed: {cause}"
        case remarks.ShotMeasured(mark=mark) if mark in remarks.NOT_DELIVERED:
            return f"trial {word.trial.trial}: not delivered: {word.because}"
        case _:
            return ""


def _named(path: Path) -> tuple[str, str, bool]:
    """Code, experiment and whether it is a practice, by a journal's name; the name itself, where it is none."""
    name = JOURNAL_NAME.fullmatch(path.name)
    return (name[1], name[2], name[3] is not None) if name else (path.name, "", False)


def damage_shown(path: Path, error: Exception) -> str:
    """What is wrong with a journal, for people who must see no answer: nothing of what stands in it."""
    if isinstance(error, JournalError):
        return error.shown or f"{path}: makes no run; it was changed"
    return f"{path}: makes no run ({type(error).__name__}); it was changed"


class WatchedRun:
    """A journal in the folder that is watched, and what is to be shown of its run. Never raises."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.gone = False
        """Whether the journal was there and is not any more."""
        self._tail = JournalTail(path)
        self._so_far: RunSoFar | None = None
        self._problem = ""
        self._held = False
        self._row: RunRow | None = None
        self._finished: RunRow | None = None
        """All that is kept of a run that is over."""

    @property
    def over(self) -> bool:
        """Whether the run was finished when it was last shown."""
        return self._finished is not None

    def look(self) -> bool:
        """Take what is new on the disk; whether there was anything."""
        if self.gone:
            return False
        try:
            return self._take_news()
        except Exception as error:  # noqa: BLE001 - whatever one journal does, the others are shown
            problem = damage_shown(self.path, error)
        before, self._problem, self._row = self._problem, problem, None
        return problem != before

    def _take_news(self) -> bool:
        news = self._tail.look()
        if not (news.anew or news.records):
            return False
        if news.anew:
            self._so_far, self._finished, self._problem = None, None, ""
        self._add(news.records)
        self._row = None
        return True

    def _add(self, records: Sequence[Record]) -> None:
        if records and isinstance(records[0], Head):
            self._so_far = RunSoFar(records[0])
            wrong = misnamed(self.path, self._so_far.plan)
            self._problem = f"{self.path}: {wrong}" if wrong else ""
        if self._so_far is not None and not self._so_far.broken:
            self._so_far.add([one for one in records if not isinstance(one, Head)])

    def check(self) -> None:
        """Have it noticed at the next look if what was read is not there any more."""
        self._tail.check()

    def ask_who_holds(self) -> bool:
        """See whether a process holds the journal of a run that has no end on record; whether that is new.

        A journal that a run holds is not touched by the question; another is held for a moment, for which a run that
        is resumed just then has patience.
        """
        before = self._held
        if self.gone:
            return False
        try:
            self._held = not (self._so_far and self._so_far.end) and not self.over and storage.is_held(self.path)
        except OSError:
            self._held = False
        if self._held != before:
            self._row = None
        return self._held != before

    def row(self, utc_now: datetime) -> RunRow:
        """What there is to show; of a journal that is gone, what was read before."""
        if self.gone:
            return replace(self._finished or self._made(utc_now), state="gone", doing="", left_s=None, problem="")
        if self._row is None or self._row.state in UNDER_WAY:
            self._row = self._made(utc_now)
            if self._row.state == "finished":
                self._so_far, self._finished = None, self._row
        return self._row

    def _made(self, utc_now: datetime) -> RunRow:
        run, state = self._so_far, self._state()
        if self._finished is not None:
            return replace(self._finished, state=state, problem=self._said(state))
        if run is None:
            name, experiment, practice = _named(self.path)
            said = self._said(state)
            return RunRow(name=name, state=state, experiment=experiment, practice=practice, problem=said)
        real = (run.head.clock or "real") == "real"
        return RunRow(
            name=run.plan.participant_id,
            state=state,
            experiment=run.plan.experiment,
            practice=run.plan.practice,
            data=data_of(run.head),
            doing=run.reason if run.end else "" if state == "broken off" else DOING[run.state],
            where=run.where,
            done=run.done,
            planned=len(run.plan.trials),
            left_s=run.left_s(utc_now) if real and state in UNDER_WAY else None,
            faults=len(run.faults),
            last_fault=run.faults[-1] if run.faults else None,
            sync=run.sync,
            last_utc=run.last.utc,
            virtual=not real,
            problem=self._said(state),
        )

    def _said(self, state: WatchedState) -> str:
        """What there is to say of the journal."""
        if self._problem:
            return self._problem + ("; a run still writes it" if self._held else "")
        if state == "broken off" and self._tail.cut_bytes:
            return f"the last record is cut off after {self._tail.cut_bytes} bytes and was never acknowledged"
        return ""

    def _state(self) -> WatchedState:
        run = self._so_far
        if self._problem:
            return "damaged"
        if self._finished is not None:
            return "finished"
        if run is None:
            return "beginning" if self._held else "not begun"
        if run.end:
            return run.end
        if not self._held:
            return "broken off"
        if run.state is State.PAUSED:
            return "paused"
        return "emergency stop" if run.state in (State.HALTED, State.REARMING) else "running"
