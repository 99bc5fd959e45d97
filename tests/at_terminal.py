"""A person at a terminal: a real `recoil run --screen terminal` on a pseudo-terminal, read and typed into."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import re
import select
import signal
import subprocess
import termios
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Self

from tests.waiting import PATIENCE_S

FIRES, DAMPER, ENDS = "Enter fires:", "Then type d and Enter:", "Enter ends the run:"
ANSWERS = "fbbffbfb"
"""What the person types, trial after trial, over and over."""
_ASKED = re.compile(r"[^\n]*\n[^\n]*(?:(?<!entered): |in your own words\. )\Z")
"""What stands last on the screen when somebody is waited for, with the line above it; no half of a line."""


def _own_terminal() -> None:
    """Have the terminal be that of the session, as where a shell was started in it: it hears that it is closed."""
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


class AtTerminal:
    """A program on a pseudo-terminal. `seen` is all it has shown so far."""

    def __init__(self, words: Sequence[object], folder: Path) -> None:
        self._ours, theirs = pty.openpty()
        self._leave, self._leaves = os.pipe()
        self.process = subprocess.Popen(
            [str(word) for word in words],
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            cwd=folder,
            start_new_session=True,
            preexec_fn=_own_terminal,  # noqa: PLW1509 - it makes one call of the system, and no thread runs yet
        )
        os.close(theirs)
        self._news = threading.Condition()
        self.seen = ""
        self._dampers = 0
        self._closed = False
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        while True:
            ready, _, _ = select.select([self._ours, self._leave], [], [])  # a read under way would keep it open
            try:
                data = b"" if self._leave in ready else os.read(self._ours, 65536)
            except OSError:
                data = b""
            with self._news:
                self.seen += data.decode(errors="replace").replace("\r\n", "\n")
                self._closed = not data
                self._news.notify_all()
            if not data:
                return

    def press(self, keys: str) -> None:
        """Press keys, and no Enter behind them."""
        os.write(self._ours, keys.encode())

    def type(self, text: str) -> None:
        """Type a line."""
        self.press(f"{text}\n")

    def wait_for(self, text: str, count: int = 1, timeout_s: float = 60) -> None:
        """Wait until the screen has shown `text` so many times; `AssertionError` with the screen if it does not."""
        with self._news:
            self._news.wait_for(lambda: self._closed or self.seen.count(text) >= count, timeout_s)
        assert self.seen.count(text) >= count, f"{text!r} was not shown {count} times:\n{self.seen}"

    def fire(self, count: int = 1) -> None:
        """Fire the n-th shot of what was seen, once its damper is set where it has to be."""
        with self._news:
            self._news.wait_for(lambda: self._closed or self._asked(count), 60)
        if self.seen.count(FIRES) < count:
            self._dampers += 1
            self.type("d")
        self.wait_for(FIRES, count)
        self.type("")

    def prompt(self, after: int) -> str:
        """What is asked for: the last two lines of what was shown after so many letters; empty when the run is over."""
        with self._news:
            found = self._news.wait_for(lambda: _ASKED.search(self.seen, after) or self._closed, PATIENCE_S)
        assert found, f"nothing more was asked for:\n{self.seen}"
        return "" if found is True else found[0]

    def work(self, reply: Callable[[str, int], str], replies: int | None = None) -> int:
        """Reply to whatever is asked for, so many times or until the run is over; how often it was replied.

        `reply`: what is typed, by what is asked for and how often it was replied before.
        """
        done = after = 0
        while done != replies and (asked := self.prompt(after)):
            after = len(self.seen)
            self.type(reply(asked, done))
            done += 1
        return done

    def _asked(self, count: int) -> bool:
        return self.seen.count(FIRES) >= count or self.seen.count(DAMPER) > self._dampers

    def close(self, count: int = 1) -> None:
        """End the run: there is nothing to correct."""
        self.wait_for(ENDS, count)
        self.type("")

    def answer_trials(self, count: int, already: int = 0) -> None:
        """Hand over, fire and answer so many trials of experiment 1, waiting for each to be saved."""
        for trial in range(already, already + count):
            self.fire(trial - already + 1)
            self.wait_for("b = backward:", trial - already + 1)
            self.type(ANSWERS[trial % len(ANSWERS)])
            self.wait_for("Saved.", trial - already + 1)

    def kill(self) -> None:
        """`kill -9`."""
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        self._reader.join(5)

    def hang_up(self) -> None:
        """Close the terminal."""
        os.write(self._leaves, b"!")
        self._reader.join()
        os.close(self._ours)
        self._ours = -1

    def end(self, timeout_s: float = 60) -> int:
        """The exit code."""
        code = self.process.wait(timeout_s)
        self._reader.join(5)
        return code

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.kill()
        if self._ours >= 0:
            self.hang_up()
        os.close(self._leave)
        os.close(self._leaves)


def answer_until_killed(screen: AtTerminal, seconds: float) -> None:
    """Answer as fast as the gun allows, and be killed so many seconds from now."""
    killer = threading.Timer(seconds, screen.kill)
    killer.start()
    with contextlib.suppress(AssertionError, OSError):
        screen.answer_trials(60)
    killer.join()
