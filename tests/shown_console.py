"""The console's window in every state and at several sizes: what of it is cut, and pictures of where something is.

Called as a program with a folder for the pictures and sizes as 1024x600 in the window's own pixels, under an
environment that says the scaling; the last line is what was cut, in JSON. Whole runs on the simulated gun go by for it.
"""

from __future__ import annotations

import json
import math
import os
import re
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from device import LinkError
from experiments import run as runs
from experiments.clock import RealClock
from experiments.design.language import QuestionConfig
from experiments.earlier_run import LEFT_OUT, UNMEASURED
from experiments.live_run import RunStopped
from experiments.run_request import RunRequest
from experiments.screens.console import app
from experiments.screens.console.keys import ANSWERS
from experiments.screens.console.view import Ended, ParticipantSeen, Trouble
from experiments.session import events, judging
from experiments.session.states import State
from tests.designs import changed, direction_with

LOOK_MS = 5
SETTLE = 8
"""The most rounds of events until a layout stands."""
HURRY = "Answer as fast as you can, but do not guess before you have felt where the shot went."
GONE = (
    "results/sub-P01/sub-P01_task-direction_journal.jsonl: the journal was deleted during the run. Everything up to "
    "record 123 is written again to /home/experimenter/sub-P01_task-direction_journal.jsonl; put it back as "
    "results/sub-P01/sub-P01_task-direction_journal.jsonl, then resume"
)
LOST = "the participant's screen ended with exit code 1; its last words: pyglet.window.NoSuchConfigException"


# what is cut


def cut(window: Any) -> list[str]:
    """The labels, buttons, fields and bars that are to be seen but not as a whole, by their texts.

    An answer's button is whole if all of the answer stands on it.
    """
    from PyQt6.QtWidgets import QLabel, QLineEdit, QProgressBar, QPushButton

    kinds = (QLabel, QPushButton, QLineEdit, QProgressBar)
    seen = [widget for kind in kinds for widget in window.findChildren(kind) if _shown(widget)]
    return [_name(widget) for widget in seen if not _is_whole(widget)] + _smaller_than_said(window.notice)


def _smaller_than_said(notice: Any) -> list[str]:
    """What is to be done, where it stands in smaller type than what was said last."""
    least_px = notice.said.font().pixelSize() if notice.said.text() else 0
    return [_name(label) for label in notice.labels if _shown(label) and label.font().pixelSize() < least_px]


def _shown(widget: Any) -> bool:
    text = widget.text() if hasattr(widget, "text") else ""
    return widget.isVisible() and (bool(text) or not hasattr(widget, "setWordWrap"))


def _name(widget: Any) -> str:
    return (widget.text() or widget.accessibleName()).replace("\n", " / ")


def _is_whole(widget: Any) -> bool:
    from PyQt6.QtWidgets import QLabel, QPushButton

    if widget.visibleRegion().boundingRect() != widget.rect():
        return False
    if isinstance(widget, QLabel):
        needed = widget.fontMetrics().boundingRect(widget.contentsRect(), _flags(widget), widget.text())
        return needed.height() <= widget.contentsRect().height() and needed.width() <= widget.contentsRect().width()
    if isinstance(widget, QPushButton):
        return _button_holds(widget) and _says_its_answer(widget)
    return bool(widget.height() >= widget.fontMetrics().height())


def _flags(label: Any) -> int:
    from PyQt6.QtCore import Qt

    return int(Qt.TextFlag.TextWordWrap.value) if label.wordWrap() else 0


def _button_holds(button: Any) -> bool:
    """Whether a button's text fits what its frame and padding leave."""
    from PyQt6.QtCore import Qt
    from PyQt6.QtWidgets import QStyle, QStyleOptionButton

    option = QStyleOptionButton()
    button.initStyleOption(option)
    room = button.style().subElementRect(QStyle.SubElement.SE_PushButtonContents, option, button)
    needed = button.fontMetrics().size(Qt.TextFlag.TextShowMnemonic.value, button.text())
    return bool(needed.width() <= room.width() and needed.height() <= room.height())


def _says_its_answer(button: Any) -> bool:
    words = " ".join(re.sub("&(.)", r"\1", button.text()).split()).casefold()  # as Qt shows it
    return getattr(button, "name", None) not in ANSWERS or words.startswith(button.accessibleName().casefold())


# the run


class Shown:
    """Drives a run by its events, one a turn, and looks at the window at every size whenever it shows another."""

    def __init__(self, console: Any, turns: Iterator[str], look: Callable[[str, Any], None]) -> None:
        from PyQt6.QtCore import QTimer

        self._console, self._turns, self._look = console, turns, look
        self._seen: set[str] = set()
        self._timer = QTimer()
        self._timer.timeout.connect(self._turn)
        self._timer.start(LOOK_MS)

    def stop(self) -> None:
        """Drive no more."""
        self._timer.stop()

    def _turn(self) -> None:
        window = self._console.window
        if window is None or window.live is None:
            return
        self._timer.stop()
        name = next(self._turns, None)
        if name is None:
            window.close()
            return
        if name and name not in self._seen:
            self._seen.add(name)
            self._look(name, window)
        self._timer.start(LOOK_MS)


class SlowGun:
    """A gun whose shot takes until it is released, and that does not answer while it is `dead`."""

    def __init__(self, gun: Any) -> None:
        self._gun = gun
        self.released = threading.Event()
        self.dead = False

    def status(self) -> Any:
        if self.dead:
            raise LinkError("no answer within 1 s on /dev/ttyACM0")
        return self._gun.status()

    def fire(self, shot: Any, at_s: float | None = None) -> Any:
        assert self.released.wait(60)
        return self._gun.fire(shot, at_s)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._gun, name)


class Turns:
    """What is done to a run so that it comes through its states; a name is given back where it is to be looked at."""

    def __init__(self, guns: list[SlowGun]) -> None:
        self._guns = guns
        self.console: Any = None

    @property
    def window(self) -> Any:
        return self.console.window

    def at(self, state: State) -> Iterator[str]:
        """Until a state is drawn."""
        while self.window.drawn.state is not state or self.window.drawn.serial != self.window.live.position.serial:
            yield ""

    def offer(self, event: events.Event, state: State) -> Iterator[str]:
        while not self.window.live.offer(event):
            yield ""  # too soon
        yield from self.at(state)

    def fire(self, then: State) -> Iterator[str]:
        gun = self._guns[-1]
        if self.window.live.position.state is State.SETTING:
            yield from self.offer(events.DamperSet(), State.PREPARING)
        gun.released.clear()
        yield from self.offer(events.Fire(), State.FIRING if then is State.ASKING else State.TRAIN)
        yield "firing" if then is State.ASKING else ""
        gun.released.set()
        yield from self.at(then)

    def key(self, name: str) -> None:
        """What a key does."""
        self.window.controls.do(name, self.window.controls.press())

    def direction(self) -> Iterator[str]:
        self._guns[-1].released.set()
        yield from self.at(State.SETTING)
        yield "setting"
        yield from self.offer(events.DamperSet(), State.PREPARING)
        yield "preparing"
        yield from self._beside()
        yield from self.fire(State.ASKING)
        yield "asking"
        yield from self.offer(events.Answer(response="forward", at_s=self.console.clock.now()), State.PREPARING)
        yield from self._pauses()
        yield from self.offer(events.Undo(), State.CORRECTING)
        yield "correcting an answer"
        yield from self.offer(events.Leave(), State.PREPARING)
        yield from self.fire(State.ASKING)
        yield from self.offer(events.Repeat(reason="noise"), State.PREPARING)
        yield "preparing again"
        for then in (State.PREPARING, State.RESTING):
            yield from self.fire(State.ASKING)
            yield from self.offer(events.Answer(response="backward", at_s=self.console.clock.now()), then)
        yield "resting"
        self.key("end break")
        yield "resting, why it ends"
        self.key("leave")
        self.window.live.offer(events.EndBreak(reason="enough"))
        while self.window.live.position.state is not State.CLOSING:
            yield from self._any_trial()
        yield from self.at(State.CLOSING)
        yield "closing"
        yield from self.offer(events.EmergencyStop(), State.HALTED)
        self._guns[-1].dead = True
        yield from self._until(lambda: self.window.gun.status is None)
        yield "halted, and the gun says nothing"
        self._guns[-1].dead = False
        yield from self._until(lambda: self.window.gun.status is not None)
        yield "halted"
        self.key("reason")
        yield "halted, why"
        self.key("leave")
        yield from self._ends()

    def _until(self, what: Callable[[], bool]) -> Iterator[str]:
        while not what():
            yield ""

    def _beside(self) -> Iterator[str]:
        """What can stand beside a hand-over: a line, a page, the other colours, another window that has the keys."""
        self.key("note")
        yield "a note"
        self.key("leave")
        self.key("help")
        yield "keys"
        self.key("leave")
        self.key("list")
        yield "list"
        self.key("leave")
        self.window.take(ParticipantSeen(focused=True))
        self.window.say("That was pressed for what stood there before: press again.", "bad")
        yield "the participant has the keys"
        self.key("theme")
        yield "light"
        self.key("theme")

    def _pauses(self) -> Iterator[str]:
        yield from self.offer(events.Pause(), State.PAUSED)
        yield "paused"
        yield from self.offer(events.GoOn(), State.PREPARING)
        yield from self.offer(events.ParticipantLost(cause=LOST), State.PAUSED)
        yield "paused, as the participant's screen is gone"
        yield from self.offer(events.GoOn(), State.PREPARING)

    def _any_trial(self) -> Iterator[str]:
        live = self.window.live
        for event in (
            events.DamperSet(),
            events.Fire(),
            events.Answer(response="forward", at_s=self.console.clock.now()),
            events.EndBreak(reason="enough"),
        ):
            if live.offer(event):
                break
        yield ""

    def _ends(self) -> Iterator[str]:
        """Stopped, with the longest that there is to say, and what else stands there at the end."""
        self.window.live.offer(events.Stop(reason="enough"))
        yield from self._until(lambda: self.window.ended is not None)
        yield "stopped"
        self.window.take(Ended(reason=GONE))
        yield "stopped, as the journal is gone"
        self.window.take(Ended(reason=None, saved=60))
        yield "finished"

    def preference(self) -> Iterator[str]:
        self._guns[-1].released.set()
        yield from self._until(lambda: self.window.drawn.state in (State.SETTING, State.PREPARING))
        for trial in range(3):
            yield from self.fire(State.TRAIN)
            yield "train" if trial == 0 else ""
            while not self.window.live.offer(events.Next()):
                yield ""
            yield from self._until(lambda: self.window.drawn.state not in (State.TRAIN, State.SAVING))
        yield from self.at(State.RATING)
        yield "rating"
        yield from self.offer(events.Rating(rating=7.5), State.DESCRIBING)
        yield "describing"
        yield from self.offer(events.Undo(), State.CORRECTING)
        yield "correcting a rating"
        yield from self.offer(events.Leave(), State.DESCRIBING)
        yield from self.offer(events.Description(text="like a toy"), State.RATING)
        yield from self.offer(events.Undo(), State.CORRECTING)
        yield "correcting a description"
        yield from self.offer(events.EmergencyStop(), State.HALTED)
        self.window.live.offer(events.Stop(reason="emergency stop"))
        yield from self._until(lambda: self.window.ended is not None)

    def many_answers(self) -> Iterator[str]:
        self._guns[-1].released.set()
        yield from self._until(lambda: self.window.drawn.state in (State.SETTING, State.PREPARING))
        yield from self.fire(State.ASKING)
        yield "asking for one of six"
        self.window.live.offer(events.Stop(reason="enough"))
        yield from self._until(lambda: self.window.ended is not None)

    def rearming(self) -> Iterator[str]:
        yield from self.at(State.REARMING)
        yield "rearming"
        self.window.take(Trouble(text="\n".join((UNMEASURED, *LEFT_OUT.values()))))
        yield "rearming, and nothing beside the gun is as it was"
        self.window.live.offer(events.Stop(reason="enough"))
        yield from self._until(lambda: self.window.ended is not None)


def carry_out(folder: Path, sizes: list[tuple[int, int]]) -> dict[str, list[str]]:
    """All runs; what was cut, by size and state."""
    judging.STANDSTILL_S = math.inf  # on a busy machine the run would pause, and never come to its other states
    found: dict[str, list[str]] = {}
    guns: list[SlowGun] = []
    opened = runs.open_gun

    def open_slow(*where: Any, **how: Any) -> SlowGun:
        guns.append(SlowGun(opened(*where, **how)))
        return guns[-1]

    runs.open_gun = open_slow

    def look(name: str, window: Any) -> None:
        for width, height in sizes:
            settle(window, width, height)
            found[f"{width}x{height}, {name}"] = cut(window)
            if found[f"{width}x{height}, {name}"]:
                file = f"{width}x{height} {re.sub('[^a-z]+', '-', name)}.png"
                window.grab().save(str(folder / file))

    with tempfile.TemporaryDirectory() as results:
        for experiment, turns, again in (
            ("direction", Turns.direction, "ask"),
            ("preference", Turns.preference, "ask"),
            ("preference", Turns.rearming, "resume"),
            ("many answers", Turns.many_answers, "fresh"),
        ):
            one_run(experiment, Path(results) / experiment, again, Turns(guns), turns, look)
    return found


def settle(window: Any, width: int, height: int) -> None:
    from PyQt6.QtWidgets import QApplication, QWidget

    window.showNormal()
    window.resize(width, height)
    places: list[Any] = []
    for _ in range(SETTLE):
        before = places
        QApplication.processEvents()
        window.refresh()
        places = [(one.geometry(), one.isVisible()) for one in window.findChildren(QWidget)]
        if places == before:
            return


def one_run(  # noqa: PLR0917 - each is needed once
    experiment: str,
    results: Path,
    again: Any,
    turns: Turns,
    states: Callable[[Turns], Iterator[str]],
    look: Callable[[str, Any], None],
) -> None:
    setup = _setup(experiment)
    request = RunRequest(setup=setup, participant_id="P" * 8, results=results, seed=1, again=again)
    console = app.Console(request, RealClock(), band="PRACTICE – nothing of it is analysed")
    turns.console = console
    shown = Shown(console, states(turns), look)
    with suppress(RunStopped):
        console.run()
    shown.stop()


def _setup(experiment: str) -> Any:
    """A short run of an experiment, with an instruction that takes two lines."""
    if experiment == "preference":
        return changed("preference", console={"guard_s": 0.0})
    if experiment == "many answers":
        felt = {answer: f"a {answer}" for answer in ("kick", "knock", "push", "tap", "buzz")}
        felt |= {"nothing": "on & off"}
        setup = direction_with(sets=1, console={"guard_s": 0.0})
        asked = QuestionConfig(kind="choice", text="What did it feel like?", answers=tuple(felt), labels=felt)
        return replace(setup, config=setup.config.model_copy(update={"questions": {"response": asked}}))
    return direction_with(
        ("vibration", "asymmetric-2"),
        sets=2,
        repetitions=3,
        factors={"instruction": {"levels": ("speed",), "texts": {"speed": HURRY}}},
        order={"set": ("instruction",)},
        breaks={"between_sets_s": 600.0, "between_sessions_s": 60.0},
        console={"guard_s": 0.0, "response_times": True},
    )


def sizes_from(words: list[str]) -> list[tuple[int, int]]:
    return [(int(width), int(height)) for width, height in (word.split("x") for word in words)]


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    found = carry_out(folder, sizes_from(sys.argv[2:]))
    sys.stdout.write(json.dumps(found) + "\n")
    sys.stdout.flush()
    os._exit(0)
