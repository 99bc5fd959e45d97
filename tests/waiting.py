"""Waiting for what must come: it ends when it has come, and gives up only when no machine would be so slow."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

PATIENCE_S = 300.0
"""The end of every wait; also of programs that tests start. Only a test that fails ever sees it."""
LOOK_S = 0.005


def wait_for(
    what: Callable[[], Any], why: Callable[[], object] | str = "it did not happen", *, look_s: float = LOOK_S
) -> Any:
    """Look until something holds, and give it back; `AssertionError` with the reason if it never does."""
    end_s = time.monotonic() + PATIENCE_S
    while not (found := what()):
        if time.monotonic() > end_s:
            raise AssertionError(why if isinstance(why, str) else why())
        time.sleep(look_s)
    return found


def stand_still(pid: int) -> None:
    """Make a program stand still, and wait until all of it does: a busy machine lets it hear a key after the signal."""
    os.kill(pid, signal.SIGSTOP)
    wait_for(lambda: all(_state(thread) == "T" for thread in Path(f"/proc/{pid}/task").iterdir()))


def _state(thread: Path) -> str:
    """A thread's state as the system's table of it has it: behind its name, which ends with the last bracket."""
    return (thread / "stat").read_text().rpartition(")")[2].split()[0]
