"""An experimenter's hands at the console's controls, on a window of paper: a run in a thread, its screen in ours.

What the run tells is drawn when the test says so; keys go down and up when it says so, on a clock of its own.
"""

from __future__ import annotations

import csv
import itertools
import queue
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from device import Gun, GunStatus, LimitError, LinkError, Shot, ShotReport
from device.words import Direction
from experiments import run as runs
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan, Trial
from experiments.live_run import LiveRun, Screen
from experiments.load import load_setup
from experiments.record import storage
from experiments.record.journal import Contents, read_journal
from experiments.record.names import Place
from experiments.record.rebuild import table
from experiments.record.replay import history
from experiments.run import Finished, run
from experiments.run_request import RunRequest
from experiments.screens.console import progress, view, widgets
from experiments.screens.console.controls import Controls, TextField
from experiments.screens.console.instructions import instruction
from experiments.screens.console.keys import Name, Presses
from experiments.screens.console.view import About, GunSeen, Seen
from experiments.session import events
from experiments.session.events import Press
from experiments.session.remarks import EntryCorrected, Remark
from experiments.session.states import Position, State
from experiments.session.steps import Answered, FireShot, Outcome, Step
from experiments.study.folders import place
from experiments.tasks.questions import first_choices
from tests.designs import direction_with
from tests.waiting import PATIENCE_S, wait_for

MOST_DEEDS = 2000
"""More than any run takes."""
BESIDE = "disarm"
"""The name of the thread that disarms beside a run."""
LOOK_S = 0.002
CORRECTNESS = re.compile(r"\b(correct|incorrect|correctly|wrong|right|score|hits?|points?)\b|%", re.IGNORECASE)
"""Words of a running score; what a correction is called is none."""
CORRECTION = re.compile(r"\bcorrect (the|an answer|to)|anything to correct", re.IGNORECASE)


def tells_correctness(text: str) -> bool:
    """Whether a text gives away how good the participant is."""
    return CORRECTNESS.search(CORRECTION.sub("", text)) is not None


def short_direction(sets: int = 2, trials: int = 3, set_break_s: float = 30.0) -> Setup[DesignConfig]:
    """Experiment 1 with two methods, one of them with a damper."""
    breaks = {"between_sets_s": set_break_s, "between_sessions_s": 60.0}
    return direction_with(("vibration", "asymmetric-2"), sets, sets * trials // 2, breaks=breaks)


DIRECTION, PREFERENCE = short_direction(), load_setup("preference")
TOLD = load_setup("voltages")
"""A design whose participants are told something first."""
GUARD_S: float = DIRECTION.config.console.guard_s


class OwnClock:
    """A clock that goes on when the test says so, and by itself while a gun gets ready: nothing there is timed.

    `idle` is set while the run waits on it. What is begun later has a later date.
    """

    name = "test"
    _hours = itertools.count()

    def __init__(self) -> None:
        self._now_s = 1000.0
        self._began_s = 1_790_000_000 + 3600 * next(self._hours)
        self._lock = threading.Lock()
        self.idle = threading.Event()
        self._timed = False
        self.by_itself: Callable[[], bool] = lambda: False

    def now(self) -> float:
        return self._now_s

    def utc(self) -> str:
        return datetime.fromtimestamp(self._began_s + self._now_s, UTC).isoformat(timespec="microseconds")

    def go_on_after(self, utc: str) -> None:
        pass

    def skip(self, seconds: float) -> None:
        """Let time go by."""
        with self._lock:
            self._now_s += seconds
            if self._timed:
                self.idle.clear()  # until the run has looked at the time again

    def sleep(self, seconds: float) -> None:
        self.skip(max(0.0, seconds))

    def wait(self, news: threading.Condition, seconds: float | None) -> None:
        if seconds is not None and self.by_itself():
            self.skip(seconds)
            return
        with self._lock:
            self._timed = seconds is not None
            self.idle.set()
        news.wait(None if seconds is None else LOOK_S)
        with self._lock:
            self._timed = False
            self.idle.clear()


@dataclass(frozen=True)
class GunCall:
    """A word to the gun, and at which position of the run it was said; `disarmed` is the end of a `disarm`.

    `beside`: it was said beside the run.
    """

    word: Literal["arm", "fire", "rendered", "disarm", "disarmed"]
    position: Position
    beside: bool


class WatchedGun:
    """A gun that keeps what is asked of it, and does what the test wants of the next shot.

    `felt`: the trials of the single shots that were felt, or may have been, test shots apart. `fails` are raised by the
    next shots instead of firing. `hang`: the next such word waits in the gun until `release`.
    `stubborn`: a shot that hung is fired although the gun was disarmed meanwhile. `slow`: a disarming beside the run
    hangs as well. `mute`: nothing but the next shot is answered.
    """

    def __init__(self, gun: Gun) -> None:
        self._gun = gun
        self.live: LiveRun | None = None
        self.calls: list[GunCall] = []
        self.felt: list[Trial] = []
        self.fails: list[Exception] = []
        self.hang: Literal["", "arm", "fire"] = ""
        self.stubborn = self.slow = self.mute = False
        self.hangs, self._released = threading.Event(), threading.Event()

    def _asked(self, word: Literal["arm", "fire", "rendered", "disarm", "disarmed"]) -> None:
        position = self.live.position if self.live is not None else Position()
        self.calls.append(GunCall(word, position, beside=threading.current_thread().name == BESIDE))

    @property
    def words(self) -> list[str]:
        """What was asked of the gun, in order."""
        return [call.word for call in self.calls]

    def _answers(self) -> None:
        if self.mute:
            raise LinkError("no answer")

    def arm(self) -> None:
        self._asked("arm")
        self._hangs_at("arm")
        self._answers()
        self._gun.arm()

    def disarm(self) -> None:
        self._asked("disarm")
        self._answers()
        if self.slow and threading.current_thread().name == BESIDE:
            self.slow = False
            self._wait()
        self._gun.disarm()
        self._asked("disarmed")

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        self._asked("fire")
        self._hangs_at("fire")
        step = self.live.position.step if self.live is not None else None
        try:
            if self.fails:
                raise self.fails.pop(0)
            if self.stubborn:
                self._gun.arm()
            report = self._gun.fire(shot, at_s)
        except LimitError:
            raise
        except Exception:
            self._feel(step)
            raise
        self._feel(step)
        self._asked("rendered")
        return report

    def _feel(self, step: Step | None) -> None:
        if isinstance(step, FireShot):
            self.felt.append(step.trial)

    def status(self) -> GunStatus:
        self._answers()
        return self._gun.status()

    def _hangs_at(self, word: str) -> None:
        if self.hang == word:
            self.hang = ""
            self._wait()

    def _wait(self) -> None:
        self._released.clear()
        self.hangs.set()
        assert self._released.wait(PATIENCE_S)

    def release(self) -> None:
        """Let what hangs in the gun go on."""
        self.hangs.clear()
        self._released.set()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._gun, name)


class SyncGate:
    """Stands where the journal is synced, and holds one sync from a test's word until the next."""

    def __init__(self) -> None:
        self._sync = storage.sync
        self._lock = threading.Lock()
        self._passing = 0
        self._shut = False
        self._opened = threading.Event()
        self.holds = threading.Event()

    def __call__(self, descriptor: int) -> None:
        with self._lock:
            held = self._shut and self._passing == 0
            self._passing = max(0, self._passing - 1)
        if held:
            self.holds.set()
            assert self._opened.wait(PATIENCE_S)
        self._sync(descriptor)

    def shut(self, after: int = 0) -> None:
        """Hold every sync but the next few."""
        with self._lock:
            self._shut, self._passing = True, after
            self._opened.clear()

    def open(self) -> None:
        """Let everything through."""
        with self._lock:
            self._shut = False
        self.holds.clear()
        self._opened.set()


@dataclass
class Offered:
    """An event that was offered by a press, the position it was drawn for, and whether it was taken."""

    event: Any
    press: Press | None
    position: Position
    painted_s: float | None
    taken: bool
    text: str


class PaperWindow:
    """A window that draws nothing but remembers what it would show; the keys reach the controls as in the real one."""

    def __init__(self, setup: Setup[DesignConfig], plan: Plan, clock: OwnClock) -> None:
        self.about = About(setup=setup, plan=plan)
        self._clock = clock
        self._news: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()
        self._presses = Presses()
        self.live: LiveRun | None = None
        self.controls: Controls | None = None
        self.heard: list[str] = []
        self.fields: dict[TextField, str] = {"line": "", "number": "", "words": ""}
        self.painted_s: dict[int, float] = {}
        self.offered: list[Offered] = []
        self.saved: list[tuple[Step | None, Any]] = []
        self.troubles: list[str] = []
        self.gun: GunSeen | None = None

    # the run's side: Screen

    def begin(self, live: LiveRun) -> None:
        self.live = live
        offer = live.offer

        def watched(event: Any, press: Press | None = None) -> Any:
            with live.news:
                waits = self._clock.idle.is_set()
                self._clock.idle.clear()  # what is taken wakes the run, which is then at work until it waits again
                position, painted_s = live.position, self.painted_s.get(live.position.serial)
                verdict = offer(event, press)
                self.offered.append(Offered(event, press, position, painted_s, verdict.taken, verdict.text))
                if waits and not verdict.taken:
                    self._clock.idle.set()
            return verdict

        live.offer = watched  # type: ignore[method-assign]
        choices = first_choices(self.about.setup.config)
        self.controls = Controls(live, self._clock, self, choices=choices)
        self._news.put(("show", live.position))

    def show(self, position: Position) -> None:
        self._news.put(("show", position))

    def act(self, position: Position, until_s: float | None) -> None:
        pass

    def acknowledge(self, step: Step | None, word: Outcome | Remark) -> None:
        self.saved.append((step, word))

    def trouble(self, text: str) -> None:
        self.troubles.append(text)

    def gun_seen(self, status: GunStatus | None, fault: str) -> None:
        self.gun = GunSeen(status=status, asked_s=0.0, fault=fault)

    # the window's side

    def paint(self) -> None:
        """Draw the newest position, as the window's thread does when it gets to it."""
        while not self._news.empty():
            self._news.get()
        if self.live is None or self.controls is None:
            return
        drawn = self.live.position
        changed = drawn.serial != self.controls.drawn.serial
        self.controls.draw(drawn)
        if changed:
            self.fields["number"] = self.fields["words"] = ""
        self._look(drawn)
        if drawn.serial not in self.painted_s:
            self.painted_s[drawn.serial] = self._clock.now()
        self.live.painted(drawn.serial, self._clock.now())

    def _look(self, drawn: Position) -> None:
        assert self.live is not None
        assert self.controls is not None
        seen = Seen(about=self.about, position=drawn, told=self.live.history, gun=self.gun, now_s=self._clock.now())
        shown = instruction(seen)
        self.heard += [shown.title, shown.damper, shown.detail, view.where_text(seen)]
        self.heard += [*progress.coming(seen), *progress.answer_lines(seen), *self.controls.help_lines()]

    def down(self, key: str, *, ctrl: bool = False, repeated: bool = False) -> None:
        """A key goes down, or is repeated by the system."""
        assert self.controls is not None
        at_s = self._clock.now()
        acts = self._presses.down(key, at_s, repeated=repeated)
        name = self.controls.command(key, ctrl=ctrl)
        if name is None and acts and len(key) == 1:
            self.type_text(key.lower())
        elif name is not None and acts:
            self.controls.down(name, at_s)

    def up(self, key: str, *, repeated: bool = False) -> None:
        """A key is let go."""
        assert self.controls is not None
        self._presses.up(key, self._clock.now(), repeated=repeated)
        if not repeated:
            self.controls.up(key)

    def lose_keys(self) -> None:
        """The window loses the keys and gets them back."""
        assert self.controls is not None
        for key in self._presses.lost():
            self.controls.up(key)

    def press(self, key: str, *, ctrl: bool = False) -> None:
        """A key goes down and up, with the pause of a hand before it."""
        self._clock.skip(0.03)
        self.down(key, ctrl=ctrl)
        self._clock.skip(0.03)
        self.up(key)

    def click(self, name: Name, *, moved_on: bool = False) -> None:
        """A click on a button; if it has moved on, its release falls into another position."""
        assert self.controls is not None
        press = self.controls.press()
        if moved_on:
            self.paint()
        self.controls.do(name, press)

    def type(self, text: str) -> None:
        """Type into the field that is open, and Enter."""
        self.type_text(text)
        self.press("Enter")

    def type_text(self, text: str) -> None:
        assert self.controls is not None
        if self.controls.typing.line:
            self.fields["line"] += text
        elif self.controls.typing.field:
            for field_ in ("number", "words"):
                self.fields[field_] += text

    # View

    def say(self, text: str, mood: str) -> None:
        assert mood in widgets.MOODS
        self.heard.append(text)

    def open_line(self, question: str) -> None:
        self.fields["line"] = ""
        self.heard.append(question)

    def close_line(self) -> None:
        self.fields["line"] = ""

    def typed(self, field: TextField) -> str:
        return self.fields[field]

    def take_typed(self) -> str:
        if self.controls is None or self.controls.drawn.correcting is not None:
            return ""  # what was typed before the correction was opened went with it here
        typed = self.fields["number"]
        self.fields["number"] = self.fields["words"] = ""
        return typed

    def show_page(self, title: str, lines: list[str]) -> None:
        self.heard += [title, *lines]

    def close_page(self) -> None:
        pass

    def show_list(self) -> None:
        pass

    def other_theme(self) -> None:
        pass

    def close(self) -> bool:
        return True


@dataclass
class Sitting:
    """One run at the console, from its start to its end or stop: the run in a thread, the hands in ours."""

    setup: Setup[DesignConfig]
    results: Path
    resumed: bool = False
    clock: OwnClock = field(default_factory=OwnClock)
    gate: SyncGate | None = None

    def __post_init__(self) -> None:
        again = "resume" if self.resumed else "ask"
        self._request = RunRequest(setup=self.setup, participant_id="P01", results=self.results, seed=1, again=again)
        self.error: BaseException | None = None
        self.result: Finished | None = None
        self.ended = threading.Event()
        self._made = threading.Event()
        self._window: PaperWindow | None = None
        self.guns: list[WatchedGun] = []
        self.clock.by_itself = self._gets_ready
        self._thread = threading.Thread(target=self._run, daemon=True)
        with self._watched():
            self._thread.start()
            assert self._made.wait(PATIENCE_S)
        if not self.ended.is_set():
            self.settle()

    def _gets_ready(self) -> bool:
        """Whether nothing but the gun is waited for: its magnet to come home."""
        live = self._window.live if self._window else None
        return live is not None and (live.position.base is State.FIRING or self._no_onset(live.position))

    @staticmethod
    def _no_onset(position: Position) -> bool:
        return position.base is State.TRAIN and position.onset_s is None

    @contextmanager
    def _watched(self) -> Any:
        """From now on, until the run is there, guns that are opened are watched."""
        opened = runs.open_gun

        def open_gun(*where: Any, **how: Any) -> Any:
            self.guns.append(WatchedGun(opened(*where, **how)))
            return self.guns[-1]

        runs.open_gun = open_gun
        try:
            yield
        finally:
            runs.open_gun = opened

    def _make_screen(self, setup: Setup[DesignConfig], plan: Plan, clock: Any) -> Screen:
        self._window = PaperWindow(setup, plan, clock)
        window, guns, made = self._window, self.guns, self._made
        begin = window.begin

        def begun(live: LiveRun) -> None:
            begin(live)
            guns[-1].live = live
            made.set()

        window.begin = begun  # type: ignore[method-assign]
        return window

    def _run(self) -> None:
        try:
            self.result = run(self._request, self._make_screen, self.clock)
        except BaseException as error:  # noqa: BLE001 - looked at by the test
            self.error = error
        finally:
            self.ended.set()
            self._made.set()

    @property
    def window(self) -> PaperWindow:
        assert self._window is not None, self.error
        return self._window

    @property
    def live(self) -> LiveRun:
        assert self.window.live is not None, self.error
        return self.window.live

    @property
    def controls(self) -> Controls:
        assert self.window.controls is not None, self.error
        return self.window.controls

    @property
    def position(self) -> Position:
        return self.live.position

    @property
    def state(self) -> State:
        return self.position.state

    @property
    def gun(self) -> WatchedGun:
        return self.guns[-1]

    def settle(self) -> None:
        """Wait until the run waits for somebody, hangs at the gun or the disk, or has ended."""
        wait_for(self._settled, lambda: f"the run does not settle: {self.position}", look_s=LOOK_S / 4)

    def _settled(self) -> bool:
        if self.ended.is_set() or self.gun.hangs.is_set() or (self.gate is not None and self.gate.holds.is_set()):
            return True
        live = self.live
        moving = live.position.base in (State.SAVING, State.FIRING, State.STOPPED) or self._no_onset(live.position)
        untold = live.inbox and live.position.base is not State.HALTED  # after a halt nobody looks at it any more
        return self.clock.idle.is_set() and not moving and not untold

    def paint(self) -> None:
        """Let the run get where it waits, and draw it."""
        self.settle()
        self.window.paint()

    def ready(self) -> None:
        """Draw, and let the guard's time go by."""
        self.paint()
        self.clock.skip(GUARD_S + 0.01)

    def press(self, key: str, *, ctrl: bool = False) -> None:
        """A press of somebody who looks first and takes their time."""
        self.ready()
        self.window.press(key, ctrl=ctrl)
        self.settle()

    def type(self, text: str) -> None:
        """Type a line and Enter, as somebody who takes their time."""
        self.ready()
        self.window.type(text)
        self.settle()

    def to(self, state: State) -> None:
        """Work on as far as a state, forward being the answer to everything."""
        for _ in range(MOST_DEEDS):
            if self.state is state:
                return
            assert not self.ended.is_set(), self.error
            self.go_on()
        raise AssertionError(f"{state} is not reached from {self.position}")

    def go_on(self) -> None:
        """Do what is due at this state."""
        self.settle()
        match self.state:
            case State.REARMING:
                self.ready()
                self.window.down("T")
                self.look_for(1.1)
                self.window.up("T")
            case State.TRAIN:
                self.clock.skip(2.0)
                self.press("Space")
            case State.RESTING:
                self.clock.skip(400.0)
            case State.RATING:
                self.type("5")
            case State.DESCRIBING:
                self.type("like a toy")
            case State.CORRECTING:
                self.press("Esc")
            case state:
                self.press(_DUE[state])
        self.settle()

    def look_for(self, seconds: float) -> None:
        """Time goes by, and the window looks every 0.1 s, as it does."""
        for _ in range(round(seconds / 0.1)):
            self.clock.skip(0.1)
            self.controls.tick()

    def finish(self) -> None:
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive()

    def stop(self) -> None:
        """Leave in the middle."""
        self.gun.release()
        self.live.offer(events.Stop(reason="enough"))
        self.finish()


_DUE = {
    State.SETTING: "M",
    State.PREPARING: "Space",
    State.ASKING: "F",
    State.INFORMING: "Enter",
    State.CLOSING: "Enter",
    State.PAUSED: "P",
    State.HALTED: "Q",
}


@contextmanager
def gated() -> Iterator[SyncGate]:
    """A gate before the disk, for as long as it lasts."""
    gate = SyncGate()
    passed, storage.sync = storage.sync, gate
    try:
        yield gate
    finally:
        storage.sync = passed
        gate.open()


@contextmanager
def sat(setup: Setup[DesignConfig], results: Path, *, resumed: bool = False, gate: SyncGate | None = None) -> Any:
    """A sitting that a test leaves in the middle."""
    sitting = Sitting(setup, results, resumed=resumed, gate=gate)
    try:
        yield sitting
    finally:
        if not sitting.ended.is_set():
            sitting.stop()


def kept(results: Path, experiment: str) -> tuple[Place, Contents, list[dict[str, str]]]:
    """Where a run lies, what its journal holds, and the rows of the table that was written."""
    where = place(results, "P01", experiment)
    contents = read_journal(where.journal)
    assert where.table.read_bytes() == table(contents)
    with where.table.open(newline="", encoding="utf-8") as file:
        return where, contents, list(csv.DictReader(file))


def remarks(contents: Contents, *kinds: type) -> list[Remark]:
    return [word for step, word in history(contents) if step is None and isinstance(word, kinds)]


def raw_answers(contents: Contents) -> list[tuple[str, Trial, Direction]]:
    """Every answer and correction in the order of the journal."""
    found = []
    for step, word in history(contents):
        if isinstance(word, EntryCorrected):
            found.append((word.kind, word.trial, word.value))
        elif isinstance(word, Answered):
            found.append((word.kind, step.trial, word.value))
    return found


RATED = (State.TRAIN, State.RATING, State.DESCRIBING)
"""The states that experiment 2 alone comes to."""


@contextmanager
def sat_at(state: State, results: Path) -> Any:
    """A sitting that has come to a state, whichever it is; after an emergency stop in a run of its own."""
    setup = PREFERENCE if state in RATED else TOLD if state is State.INFORMING else DIRECTION
    if state is State.REARMING:
        with sat(setup, results) as halted:
            halted.to(State.ASKING)
            halted.press("F12")
            halted.press("Q")
    with gated() as gate, sat(setup, results, resumed=state is State.REARMING, gate=gate) as sitting:
        try:
            _bring(sitting, state, gate)
            yield sitting
        finally:
            gate.open()


def _bring(sitting: Sitting, state: State, gate: SyncGate) -> None:
    match state:
        case State.FIRING:
            sitting.to(State.PREPARING)
            sitting.gun.hang = "fire"
            sitting.press("Space")
        case State.SAVING:
            sitting.to(State.ASKING)
            gate.shut()
            sitting.press("F")
        case State.PAUSED | State.CORRECTING | State.HALTED | State.STOPPED:
            sitting.to(State.ASKING)
            sitting.press("F")
            sitting.to(State.ASKING)
            sitting.press({State.PAUSED: "P", State.CORRECTING: "U", State.HALTED: "F12"}.get(state, "Q"))
            if state is State.STOPPED:
                sitting.type("enough")
        case _:
            sitting.to(state)
    assert sitting.state is state, sitting.position


SETUPS = {"direction": DIRECTION, "preference": PREFERENCE}
