"""Programs of our own in processes of their own: how they are started, and how they end."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

OWN_GROUP = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
"""How a program is started on Windows that Ctrl+C is not for; elsewhere `start_new_session` keeps it away."""


def own_program(module: str, *words: str) -> list[str]:
    """The command of `python -m MODULE WORD...`; whatever the caller's folder holds is not imported (-P)."""
    return [sys.executable, "-P", "-m", module, *words]


def own_environment() -> dict[str, str]:
    """The environment of such a program, in which it finds the packages that this process finds."""
    paths = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
    return os.environ | {"PYTHONPATH": paths}


def end_program(child: subprocess.Popen[bytes] | subprocess.Popen[str], seconds: float) -> bool:
    """Wait so long for a program's end, then tell it to end, then kill it. Whether it ended by itself."""
    for insist in (child.poll, child.terminate, child.kill):
        insist()
        with suppress(subprocess.TimeoutExpired):
            child.wait(seconds)
            return insist == child.poll
    return False


def how_ended(code: int) -> str:
    """How a program ended that has this return code, as it is said behind its name."""
    return f"was killed by signal {-code}" if code < 0 else f"ended with exit code {code}"
