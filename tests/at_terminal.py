"""A person at a terminal: a real `recoil run --screen terminal` on a pseudo-terminal, read and typed into."""

from __future__ import annotations

import contextlib
import os
import pty
import signal
import subprocess
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Self

from tests.waiting import PATIENCE_S

ANSWERS = "fbbffbfb"
"""What the person types, trial after trial, over and over."""


class AtTerminal:
    """A program on a pseudo-terminal. `seen` is all it has shown so far."""

    def __init__(self, words: Sequence[object], folder: Path) -> None:
        self._ours, theirs = pty.openpty()
        self.process = subprocess.Popen(
            [str(word) for word in words],
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            cwd=folder,
            start_new_session=True,
        )
        os.close(theirs)
        self._news = threading.Condition()
        self.seen = ""
        self._closed = False
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        while True:
            try:
                data = os.read(self._ours, 65536)
            except OSError:
                data = b""
            with self._news:
                self.seen += data.decode(errors="replace").replace("\r\n", "\n")
                self._closed = not data
                self._news.notify_all()
            if not data:
                return

    def type(self, text: str) -> None:
        """Type a line."""
        os.write(self._ours, f"{text}\n".encode())

    def wait_for(self, text: str, count: int = 1, timeout_s: float = PATIENCE_S) -> None:
        """Wait until the screen has shown `text` so many times; `AssertionError` with the screen if it does not."""
        with self._news:
            self._news.wait_for(lambda: self._closed or self.seen.count(text) >= count, timeout_s)
        assert self.seen.count(text) >= count, f"{text!r} was not shown {count} times:\n{self.seen}"

    def answer_trials(self, count: int, already: int = 0) -> None:
        """Hand over, fire and answer so many trials of experiment 1, waiting for each to be saved."""
        for trial in range(already, already + count):
            self.wait_for("Enter fires:", trial - already + 1)
            self.type("")
            self.wait_for("b = backward:", trial - already + 1)
            self.type(ANSWERS[trial % len(ANSWERS)])
            self.wait_for("Saved.", trial - already + 1)

    def kill(self) -> None:
        """`kill -9`."""
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        self._reader.join(PATIENCE_S)

    def hang_up(self) -> None:
        """Close the terminal."""
        os.close(self._ours)
        self._ours = -1

    def end(self, timeout_s: float = PATIENCE_S) -> int:
        """The exit code."""
        code = self.process.wait(timeout_s)
        self._reader.join(PATIENCE_S)
        return code

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.kill()
        if self._ours >= 0:
            os.close(self._ours)


def answer_until_killed(screen: AtTerminal, seconds: float, saved: int = 0) -> None:
    """Answer as fast as the gun allows, and be killed so many seconds after so many answers were saved."""

    def kill() -> None:
        screen.wait_for("Saved.", saved)
        time.sleep(seconds)
        screen.kill()

    killer = threading.Thread(target=kill)
    killer.start()
    with contextlib.suppress(AssertionError, OSError):
        screen.answer_trials(60)
    killer.join()
