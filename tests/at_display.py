"""A person at a display: a program on a virtual screen (Xvfb), worked by real key events (XTest)."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import pytest

from tests.waiting import PATIENCE_S

READY = shutil.which("Xvfb") is not None
LOOK_S, AGAIN_S = 0.05, 3.0
"""How long a person looks at a new question, and after how long they try again."""
needs_display = pytest.mark.skipif(not READY, reason="needs Xvfb")


@contextmanager
def virtual_display() -> Iterator[str]:
    """A virtual screen of 1280 by 800; its name."""
    read, write = os.pipe()
    words = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x800x24", "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(words, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as told:
            yield f":{told.readline().strip()}"
    finally:
        server.terminate()
        server.wait()


class AtDisplay:
    """A program on a virtual screen."""

    def __init__(self, words: Sequence[object], folder: Path, display: str) -> None:
        self.folder = folder
        environment = os.environ | {"DISPLAY": display, "HOME": str(folder), "QT_QPA_PLATFORM": "xcb"}
        self.process = subprocess.Popen(
            [str(word) for word in words],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        from experiments.screens.xkeys import Hands  # here: python-xlib is in the extra `gui`

        self.keys = Hands(display)

    def focus_on(self, title: str = "Recoil") -> None:
        """Give the keys to the newest window of a title: no window manager does it here."""
        assert self.keys.focus_on(title, timeout_s=PATIENCE_S) is not None, f"no window {title!r} was shown"

    def kill(self) -> None:
        """`kill -9`."""
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.communicate()

    def end(self, timeout_s: float = PATIENCE_S) -> tuple[int, str]:
        """The exit code, and what was said."""
        said, _ = self.process.communicate(timeout=timeout_s)
        return self.process.returncode, said

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.kill()
        self.keys.close()


def last_record(journal: Path) -> dict[str, Any]:
    """The last whole record of a journal that is being written, but for a train's shots; empty if there is none yet."""
    try:
        lines = journal.read_bytes().split(b"\n")[:-1]
    except FileNotFoundError:
        return {}
    records = map(json.loads, reversed(lines))
    return next((record for record in records if record["kind"] != "shot"), {})


def work_console(
    screen: AtDisplay, journal: Path, key_for: Callable[[dict[str, Any]], None], timeout_s: float = 4 * PATIENCE_S
) -> dict[str, Any]:
    """Press what `key_for` presses at each step that waits, until the run ends or the program does; the last record.

    A key that came before the window was painted is lost, as it would be for a person; it is pressed again, but not
    so soon that the first may still be on its way.
    """
    deadline, pressed, at = time.monotonic() + timeout_s, -1, 0.0
    while time.monotonic() < deadline and screen.process.poll() is None:
        record = last_record(journal)
        if record.get("kind") in ("finished", "stopped"):
            return record
        again = time.monotonic() - at > AGAIN_S
        if record.get("kind") == "step" and (record["n"] != pressed or again):
            time.sleep(LOOK_S)
            key_for(record["body"])
            pressed, at = record["n"], time.monotonic()
        time.sleep(0.002)
    return last_record(journal)
