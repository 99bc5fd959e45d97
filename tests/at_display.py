"""A person at a display: a program on a virtual desktop (Xvfb with openbox), worked by real events (XTest)."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, Self

import pytest

from experiments.screens.console.keys import BOUNCE_S, BY_NAME
from tests import watched_participant
from tests.at_runs import RUN, words
from tests.waiting import PATIENCE_S, stand_still, wait_for
from tests.warm_start import warm
from tests.watched_console import Look, Watch

READY = all(map(shutil.which, ("Xvfb", "openbox")))
needs_display = pytest.mark.skipif(not READY, reason="needs Xvfb and openbox")

HAND_S = 1.5 * BOUNCE_S
"""A hand takes longer from what it sees to a press: a key that goes down again sooner has bounced."""
OTHER = "another program's window"
RIGHT_BUTTON = 3
_NO_DOUBLE_S = 0.6
"""Two clicks that far apart are none double."""
BUSY = ("saving", "firing", "stopped")
"""States in which nobody is waited for."""


@contextmanager
def x_server(size: str = "1280x800") -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A virtual screen: its name and its server."""
    read, write = os.pipe()
    words = ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{size}x24", "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(words, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as told:
            yield f":{told.readline().strip()}", server
    finally:
        server.terminate()
        server.wait()


@contextmanager
def window_manager(display: str) -> Iterator[None]:
    """Openbox on a virtual screen, from when it manages windows."""
    from Xlib.display import Display  # here: python-xlib is in the extra `gui`

    manager = subprocess.Popen(
        ["openbox", "--sm-disable"],
        env=os.environ | {"DISPLAY": display},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    looks = Display(display)
    sign = looks.intern_atom("_NET_SUPPORTING_WM_CHECK")
    try:
        wait_for(lambda: looks.screen().root.get_full_property(sign, 0), lambda: "openbox does not start")
        yield
    finally:
        looks.close()
        manager.terminate()
        manager.wait()


@contextmanager
def virtual_display(size: str = "1280x800") -> Iterator[str]:
    """A virtual desktop; its name."""
    with ExitStack() as stack:
        name, _ = stack.enter_context(x_server(size))
        stack.enter_context(window_manager(name))
        yield name


@contextmanager
def another_window(display: str) -> Iterator[None]:
    """A window of another program, which may get the keys."""
    from Xlib import X
    from Xlib.display import Display

    theirs = Display(display)
    screen = theirs.screen()
    window = screen.root.create_window(0, 0, 500, 300, 0, screen.root_depth, X.InputOutput)
    window.set_wm_name(OTHER)
    window.map()
    theirs.sync()
    try:
        yield
    finally:
        theirs.close()


@contextmanager
def taken_keyboard(display: str) -> Iterator[None]:
    """Meanwhile every key goes to another program, whichever window has the focus, as where it asks for a password."""
    from Xlib import X
    from Xlib.display import Display

    theirs = Display(display)
    screen = theirs.screen()
    window = screen.root.create_window(0, 0, 10, 10, 0, screen.root_depth, X.InputOutput, override_redirect=True)
    window.map()
    theirs.sync()
    assert window.grab_keyboard(True, X.GrabModeAsync, X.GrabModeAsync, X.CurrentTime) == X.GrabSuccess
    try:
        yield
    finally:
        theirs.close()


class AtDisplay:
    """A program on a virtual desktop."""

    def __init__(self, words: Sequence[object], folder: Path, display: str, **environment: str) -> None:
        variables = {"DISPLAY": display, "HOME": str(folder), "QT_QPA_PLATFORM": "xcb", **environment}
        self.process = subprocess.Popen(
            warm(*words),
            cwd=folder,
            env=os.environ | variables,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        from tests.typing_hands import TypingHands  # here: python-xlib is in the extra `gui`

        self.keys = TypingHands(display)

    def focus_on(self, title: str = "Recoil") -> tuple[int, int, int, int]:
        """Give the keys to the newest window of a title; its place and size."""
        place = self.keys.focus_on(title, timeout_s=PATIENCE_S)
        if place is None:
            ended = self.process.poll()
            raise AssertionError(f"no window {title!r} was shown (exit code {ended}); the program said: {self.kill()}")
        return place

    def ask_for_menu(self, *places: tuple[int, int]) -> None:
        """Click places of the screen with the mouse's right button."""
        from Xlib import X
        from Xlib.ext import xtest

        display = self.keys.display
        for x, y in places:
            xtest.fake_input(display, X.MotionNotify, x=x, y=y)
            for event in (X.ButtonPress, X.ButtonRelease):
                xtest.fake_input(display, event, RIGHT_BUTTON)
            display.sync()

    @contextmanager
    def dragging(self, x: int, y: int) -> Iterator[None]:
        """Meanwhile the word at a place of the screen is chosen, and dragged if that can be done."""
        from Xlib import X
        from Xlib.ext import xtest

        display = self.keys.display
        xtest.fake_input(display, X.MotionNotify, x=x, y=y)
        for event in (X.ButtonPress, X.ButtonRelease, X.ButtonPress, X.ButtonRelease):
            xtest.fake_input(display, event, 1)
            display.sync()
            time.sleep(HAND_S / 2)
        time.sleep(_NO_DOUBLE_S)
        xtest.fake_input(display, X.ButtonPress, 1)
        for step in range(1, 40, 4):
            xtest.fake_input(display, X.MotionNotify, x=x + step, y=y + step)
            display.sync()
            time.sleep(HAND_S / 5)
        yield
        xtest.fake_input(display, X.ButtonRelease, 1)
        display.sync()

    def kill(self) -> str:
        """`kill -9`; what was said until then."""
        with suppress(ProcessLookupError):  # it may have ended by itself
            os.killpg(self.process.pid, signal.SIGKILL)
        return self.process.communicate()[0]

    def end(self) -> tuple[int, str]:
        """The exit code, and what was said."""
        said, _ = self.process.communicate(timeout=5 * PATIENCE_S)  # a whole run goes by
        return self.process.returncode, said

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        from Xlib.error import ConnectionClosedError

        if self.process.poll() is None:
            self.kill()
        with suppress(ConnectionClosedError):  # its server may be gone
            self.keys.close()


class AtConsole(AtDisplay):
    """An experimenter at the console who looks first: what a key is pressed for stands there, and its time has come.

    `answer` gives the answer to a trial by its number, `rating` what is typed for it.
    """

    def __init__(self, command: list[object], folder: Path, display: str, watch: Watch | None = None) -> None:
        self.watch = watch or Watch(str(folder))
        self.watch.eye.unlink(missing_ok=True)  # of a run before this one
        super().__init__(self.watch.words(command), folder, display)
        self.answer: Callable[[int], str] = lambda trial: "f" if trial % 2 else "b"
        self.rating: Callable[[int], str] = lambda trial: "0" if trial == 1 else "7.5"

    def look(self) -> Look:
        """What stands in the windows now."""
        return self.watch.look()

    def until(self, what: Callable[[Look], object]) -> Look:
        """Wait until something stands in the windows while the program runs, and then as long as a hand takes."""
        look = Look()

        def there() -> bool:
            nonlocal look
            look = self.look()
            return bool(what(look)) or self.process.poll() is not None

        wait_for(there, lambda: f"it does not come to that: {look}")
        assert what(look), f"the program has ended: {self.end()}"
        time.sleep(HAND_S)
        return look

    def stands(self, title: str) -> Look:
        """Wait for a window, and give it the keys."""
        self.until(lambda look: title in look.window)
        self.focus_on(title)
        return self.until(lambda look: look.active)

    def at(self, *states: str) -> Look:
        """Wait until the run stands at a state, and a press counts for it."""
        return self.until(lambda look: look.state in states and look.ready)

    def ready(self) -> Look:
        """Wait until the run waits for somebody."""
        return self.until(lambda look: (look.ready and look.state not in BUSY) or look.ended)

    def to(self, state: str, trial: int = 0) -> Look:
        """Work on as far as a state, of a trial if one is named."""
        while not (look := self.ready()).ended:
            if look.state == state and trial in (0, look.trial):
                return look
            self.go_on(look)
        raise AssertionError(f"{state} is not reached: {look}")

    def to_the_end(self) -> None:
        """Work on until the run has ended."""
        while not (look := self.ready()).ended:
            self.go_on(look)

    def go_on(self, look: Look) -> None:
        """Do what is due at a state, and wait until it is done."""
        if look.state == "rearming":
            self.hold("t", until=lambda now: now.serial != look.serial)
        else:
            self.due(look)
        self.until(lambda now: now.serial != look.serial or now.ended)

    def participant_shows(self, page: str, count: int = 1) -> None:
        """Wait until the participant's screen has shown a page so many times, by its kind or words, now as well."""
        wait_for(
            lambda: (shown := self.pages) and page in shown[-1] and sum(page in one for one in shown) >= count,
            lambda: f"{page} is not shown to the participant: {self.pages}",
        )

    @property
    def pages(self) -> list[str]:
        """The pages that were shown to the participant."""
        return watched_participant.pages(self.watch.pages)

    @property
    def participant_pid(self) -> int:
        """The process of the participant's program that was started last, and not what stands in its stead."""
        return watched_participant.pid(self.watch.pages)

    def due(self, look: Look) -> None:
        """Press what is due at a state."""
        keys = {
            "setting": "m",
            "preparing": "space",
            "train": "space",
            "closing": "Return",
            "paused": "p",
            "informing": "Return",
        }
        keys |= {"informing": "Return", "asking": self.answer(look.trial), "halted": "q", "correcting": "Escape"}
        lines = {"rating": self.rating(look.trial), "describing": "like a toy", "resting": "enough"}
        if look.state in keys:
            self.keys.press(keys[look.state])
        elif look.state == "resting":
            self.line("e", lines["resting"])
        else:
            self.keys.type(f"{lines[look.state]}\n")

    def line(self, key: str, text: str, *held: str) -> None:
        """Ask for a line by its key, type it, and Enter."""
        self.keys.press(key, *held)
        self.until(lambda look: look.line)
        self.keys.type(text)
        self.until(lambda look: look.typed == text)
        self.keys.press("Return")
        self.until(lambda look: not look.line)

    def heard(self) -> Look:
        """Wait until the window has heard every key and click so far: F2 comes after them and changes its colours."""
        before = self.look().theme
        self.keys.press("F2")
        return self.until(lambda look: look.theme != before)

    def hold(self, key: str, until: Callable[[Look], object]) -> None:
        """Hold a key down until something stands in the windows."""
        self.keys.key_down(key)
        try:
            self.until(until)
        finally:
            self.keys.key_up(key)

    def off_and_back(self, name: str) -> None:
        """The pointer leaves a command's button, and comes back."""
        from Xlib import X
        from Xlib.ext import xtest

        x, y = middle(self.look(), name)
        for above_px in (120, 0):
            xtest.fake_input(self.keys.display, X.MotionNotify, x=x, y=y - above_px)
            self.keys.display.sync()
            time.sleep(HAND_S)

    @contextmanager
    def standing_still(self, seconds: float) -> Iterator[None]:
        """The program stands still while something is done, and after it for so long."""
        pid = self.look().pid
        stand_still(pid)
        try:
            yield
            time.sleep(seconds)
        finally:
            os.kill(pid, signal.SIGCONT)

    def click(self, name: str) -> None:
        """Click in the middle of a command's button."""
        self.keys.click(*middle(self.look(), name))

    @contextmanager
    def button_down(self, name: str, mouse: int = 1) -> Iterator[None]:
        """A button of the mouse goes down on a command's, and is let go at the end."""
        from Xlib import X
        from Xlib.ext import xtest

        x, y = middle(self.look(), name)
        display = self.keys.display
        xtest.fake_input(display, X.MotionNotify, x=x, y=y)
        xtest.fake_input(display, X.ButtonPress, mouse)
        display.sync()
        yield
        xtest.fake_input(display, X.ButtonRelease, mouse)
        display.sync()

    def stop(self, reason: str = "enough") -> tuple[int, str]:
        """Stop the run for a reason, close its window, and wait for the program's end."""
        look = self.ready()
        if not look.ended:
            letters = look.state in ("rating", "describing")
            self.line("q", reason, *(["Control_L"] if letters else []))
        return self.close()

    def close(self) -> tuple[int, str]:
        """Close the window of a run that has ended, and wait for the program's end."""
        self.until(lambda look: look.ended)
        self.keys.press(BY_NAME["stop"].key.lower())
        return self.end()


def middle(look: Look, name: str) -> tuple[int, int]:
    """The middle of a command's button."""
    left, top, width, height = look.places[name]
    return left + width // 2, top + height // 2


def records(journal: Path) -> list[dict[str, Any]]:
    """The whole records of a journal that is being written; none if it is not there yet."""
    try:
        lines = journal.read_bytes().split(b"\n")[:-1]
    except FileNotFoundError:
        return []
    return [json.loads(line) for line in lines]


def remarks(journal: Path, *kinds: str) -> list[dict[str, Any]]:
    """The remarks of some kinds, or all, in order."""
    bodies = [record["body"] for record in records(journal) if record["kind"] == "remark"]
    return [body for body in bodies if not kinds or body["kind"] in kinds]


def last_record(journal: Path) -> dict[str, Any]:
    """The last whole record of a journal that is being written, but for a train's shots; empty if there is none yet."""
    try:
        lines = journal.read_bytes().split(b"\n")[:-1]
    except FileNotFoundError:
        return {}
    records = map(json.loads, reversed(lines))
    return next((record for record in records if record["kind"] != "shot"), {})


def run_words(configs: Path, experiment: str = "direction", *more: object) -> list[object]:
    return words(configs, experiment, "--participant", "P01", *more)


def check_disarmed(watch: Watch) -> None:
    """The last that the gun was told is to disarm."""
    calls = [call["call"] for call in watch.calls()]
    assert "disarm" in calls
    assert "armed" not in calls[len(calls) - 1 - calls[::-1].index("disarm") :]


def lose_the_display(configs: Path, folder: Path, experiment: str, state: str) -> float:
    """Kill the X server under a run at a state; how long the program then lives, in seconds."""
    with ExitStack() as stack:
        name, server = stack.enter_context(x_server())
        stack.enter_context(window_manager(name))
        screen = stack.enter_context(AtConsole(run_words(configs, experiment), folder, name))
        screen.stands(RUN)
        screen.to(state, trial=2)
        return killed_s(server, screen)


def killed_s(server: subprocess.Popen[bytes], screen: AtConsole) -> float:
    at_s = time.monotonic()
    server.kill()
    code, said = screen.end()
    assert code == 1, said
    assert "the display was lost" in said
    return time.monotonic() - at_s
