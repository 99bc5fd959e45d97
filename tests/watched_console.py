"""`recoil` as it is, with an eye on its windows, a book of what its gun is asked, and faults of gun and disk if wanted.

Called as a program with a `Watch` in JSON, then the words of the command. Whenever what stands in the windows changes,
the eye's file gets a line of JSON, a `Look`.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from tests import watched_participant

TAIL_BYTES = 1 << 16


@dataclass(frozen=True)
class Watch:
    """Where eye and book write; at which shots the gun hangs until told to go on; how much longer a sync takes.

    `participants`: how often the participant's screen can be started; `times`: how often the command is carried out.
    """

    folder: str
    hangs: tuple[int, ...] = ()
    sync_s: float = 0.0
    participants: int = 99
    times: int = 1
    look_ms: int = 20

    @property
    def eye(self) -> Path:
        return Path(self.folder) / "eye.jsonl"

    @property
    def book(self) -> Path:
        return Path(self.folder) / "gun.jsonl"

    @property
    def pages(self) -> Path:
        return Path(self.folder) / "pages.txt"

    @property
    def go_on(self) -> Path:
        return Path(self.folder) / "go-on"

    def words(self, command: list[object]) -> list[object]:
        """A `recoil` command, to be carried out under the eye."""
        return ["-m", "tests.watched_console", json.dumps(asdict(self)), *command]

    def looks(self) -> list[Look]:
        """What stood in the windows, from the first look to the last."""
        lines = self.eye.read_bytes().split(b"\n")[:-1] if self.eye.exists() else []
        return [Look(**json.loads(line)) for line in lines]

    def look(self) -> Look:
        """What stands in the windows now."""
        if not self.eye.exists():
            return Look()
        with self.eye.open("rb") as file:
            file.seek(max(0, self.eye.stat().st_size - TAIL_BYTES))
            lines = file.read().split(b"\n")
        return Look(**json.loads(lines[-2])) if len(lines) > 1 else Look()

    def calls(self, name: str = "") -> list[dict[str, Any]]:
        """What the gun was asked, in order."""
        lines = self.book.read_bytes().split(b"\n")[:-1] if self.book.exists() else []
        return [call for line in lines if name in ("", (call := json.loads(line))["call"])]


@dataclass(frozen=True)
class Look:
    """What stands in the windows, and where the run is. `ready`: a press would not come too soon for what stands there.

    `places` are the buttons that are to be seen, by their commands: left, top, width, height on the display.
    """

    window: str = ""
    active: bool = False
    state: str = ""
    base: str = ""
    serial: int = -1
    trial: int = 0
    ready: bool = False
    ended: bool = False
    line: bool = False
    typed: str = ""
    page: bool = False
    theme: str = ""
    texts: list[str] = field(default_factory=list)
    places: dict[str, list[int]] = field(default_factory=dict)
    pid: int = 0

    def says(self, words: str) -> bool:
        return any(words in text for text in self.texts)


# the program


def is_whole(label: Any) -> bool:
    """Whether a label is there to be seen, with room for all its lines."""
    return not label.visibleRegion().isEmpty() and label.height() >= label.heightForWidth(label.width())


class Eye:
    """Looks at the windows of this program; what is laborious to see, only where a widget has changed since."""

    def __init__(self) -> None:
        self._seen: dict[str, tuple[Any, Any]] = {}

    def look(self) -> Look:
        """What stands in the windows; where the run is, by its window where there is one, else by the newest."""
        from PyQt6.QtWidgets import QApplication, QLabel

        from experiments.screens.console.window import ConsoleWindow

        windows = [window for window in QApplication.topLevelWidgets() if window.isVisible() and window.windowTitle()]
        readable = [one for window in windows for one in [*window.findChildren(QLabel), window] if _has_text(one)]
        texts = self._kept("texts", readable, lambda: [one.text() for one in readable if one.text() and is_whole(one)])
        consoles = [window for window in windows if isinstance(window, ConsoleWindow)]
        here = next(iter([*consoles, *reversed(windows)]), None)
        named = {"window": here.windowTitle(), "active": here.isActiveWindow()} if here is not None else {}
        found = self._run(consoles[0]) if consoles else {}
        return Look(texts=texts, pid=os.getpid(), **named, **found)

    def _kept(self, name: str, widgets: list[Any], see: Callable[[], Any]) -> Any:
        """What is seen of some widgets: anew if one of them has another text or place or is shown or hidden."""
        stand = [(one, one.text(), one.isVisible(), one.geometry(), one.window().geometry()) for one in widgets]
        before, seen = self._seen.get(name, (None, None))
        if stand != before:
            seen = see()
            self._seen[name] = stand, seen
        return seen

    def _run(self, window: Any) -> dict[str, Any]:
        """Where the run of a console's window is, as far as it is drawn."""
        from experiments.screens.console.buttons import CommandButton
        from experiments.screens.console.keys import field_at

        if window.live is None:
            return {"ended": window.ended is not None}
        drawn, live, now_s = window.drawn, window.live, window.clock.now()
        not_before_s = live.position.not_before_s
        in_time = not_before_s is None or now_s >= not_before_s
        buttons = window.findChildren(CommandButton)
        return {
            "state": str(drawn.state),
            "base": str(drawn.base),
            "serial": drawn.serial,
            "trial": live.moment.trial.trial,
            "ready": drawn.serial == live.position.serial and live.moment.is_ready(now_s) and in_time,
            "ended": window.ended is not None,
            "line": window.controls.typing.line,
            "typed": window.typed("line" if window.controls.typing.line else field_at(drawn) or "number"),
            "page": window.controls.page,
            "theme": window.theme,
            "places": self._kept("places", buttons, lambda: _places(buttons)),
        }


def _has_text(widget: Any) -> bool:
    return hasattr(widget, "heightForWidth") and hasattr(widget, "text")


def _places(buttons: list[Any]) -> dict[str, list[int]]:
    found = {}
    for button in buttons:
        if button.isVisible():
            corner = button.mapToGlobal(button.rect().topLeft())
            found[button.name] = [corner.x(), corner.y(), button.width(), button.height()]
    return found


def watch_windows(watch: Watch) -> Any:
    """Look from now on, as long as the timer that is given back lives."""
    from PyQt6.QtCore import QTimer

    eye, last = Eye(), Look()

    def look() -> None:
        nonlocal last
        if (now := eye.look()) != last:
            last = now
            with watch.eye.open("a", encoding="utf-8") as out:
                out.write(json.dumps(asdict(now)) + "\n")

    timer = QTimer()
    timer.timeout.connect(look)
    timer.start(watch.look_ms)
    return timer


class WatchedGun:
    """A gun that writes into a book what it is asked and when, and hangs at some of its shots until a file is there."""

    def __init__(self, gun: Any, watch: Watch) -> None:
        self._gun, self._watch = gun, watch
        self.shots = 0

    def arm(self) -> None:
        self._gun.arm()
        self._write("armed")

    def disarm(self) -> None:
        self._write("disarm")
        self._gun.disarm()

    def fire(self, shot: Any, at_s: float | None = None) -> Any:
        self.shots += 1
        self._write("fire", at=at_s)
        if self.shots in self._watch.hangs:
            self._hang()
        report = self._gun.fire(shot, at_s)
        self._write("fired", start_s=report.pulse_start_s)
        return report

    def _hang(self) -> None:
        self._write("hangs")
        while not self._watch.go_on.exists():
            time.sleep(0.002)

    def _write(self, call: str, **how: Any) -> None:
        write_down(self._watch, {"call": call, "s": time.monotonic(), "shot": self.shots, **how})

    def __getattr__(self, name: str) -> Any:
        return getattr(self._gun, name)


_writing = threading.Lock()


def write_down(watch: Watch, call: dict[str, Any]) -> None:
    with _writing, watch.book.open("a", encoding="utf-8") as out:
        out.write(json.dumps(call) + "\n")


def watch_lines(watch: Watch) -> None:
    """From now on it is written down when a gun's line has taken the bytes of `ABOR`."""
    from device.serial_gun.lines import SerialPort

    write = SerialPort.write

    def watched(port: SerialPort, data: bytes) -> None:
        write(port, data)
        at_s = time.monotonic()
        if b"ABOR" in data:
            write_down(watch, {"call": "ABOR", "s": at_s})

    SerialPort.write = watched


def watch_guns(watch: Watch) -> None:
    """From now on every gun that is opened is watched."""
    from experiments import run

    opened = run.open_gun
    run.open_gun = lambda *where, **how: WatchedGun(opened(*where, **how), watch)


def watch_participants(watch: Watch) -> None:
    """From now on every participant's screen that is started is watched."""
    from experiments.screens.participant.link import ParticipantLink
    from experiments.screens.participant.messages import Look, arguments

    start, left = ParticipantLink.start, watch.participants

    def watched(look: Look | None = None, **how: Any) -> ParticipantLink:
        nonlocal left
        left -= 1
        words = watched_participant.words(watch.pages, arguments(look or Look())) if left >= 0 else ["false"]
        return start(look, **how, command=words)

    ParticipantLink.start = watched


def slow_disk(sync_s: float) -> None:
    """From now on a sync takes its time."""
    from experiments.record import storage

    sync = storage.sync

    def slow(descriptor: int) -> None:
        time.sleep(sync_s)
        sync(descriptor)

    storage.sync = slow


if __name__ == "__main__":
    from experiments.screens.console.app import application
    from recoil.cli import main

    watch = Watch(**json.loads(sys.argv.pop(1)))
    watch_guns(watch)
    watch_lines(watch)
    watch_participants(watch)
    if watch.sync_s:
        slow_disk(watch.sync_s)
    application()
    eye = watch_windows(watch)
    for _ in range(watch.times - 1):
        with suppress(SystemExit):
            main()
    main()
