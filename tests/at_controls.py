"""An experimenter's hands at the console's controls, without its window: a run in a thread, every message taken."""

from __future__ import annotations

import csv
import queue
import re
import threading
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from device.words import Direction
from experiments.clock import VirtualClock
from experiments.journal import Contents, read
from experiments.load import load_setup
from experiments.places import Place, place
from experiments.plan import Plan, Trial
from experiments.remarks import AnswerCorrected, Remark
from experiments.replay import told
from experiments.run import Request, run, table
from experiments.runner import Screen
from experiments.screens.console import theme
from experiments.screens.console.controls import Controls
from experiments.screens.console.messages import Began, Ended, Message, Saved, Trouble, Waiting
from experiments.screens.console.screen import ConsoleScreen
from experiments.screens.console.state import State, coming, instruction, place_text
from experiments.setup import Setup
from experiments.steps import Answered
from tests.waiting import PATIENCE_S

BREAK_S = 0.02
LONG_BREAK_S = 30.0
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


@contextmanager
def stopped_at_the_end(sitting: Sitting) -> Any:
    """Stops a sitting that a test leaves in the middle."""
    try:
        yield sitting
    finally:
        sitting.controls.stop_for("enough")
        sitting.until(lambda message: isinstance(message, Ended))
        sitting.finish()


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
