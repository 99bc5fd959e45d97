"""Programs of our own in processes of their own: how they are started, and how they ended."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

OWN_GROUP = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
"""How a program is started on Windows that Ctrl+C is not for; elsewhere `start_new_session` keeps it away."""


def own_program(module: str, word: str) -> tuple[list[str], dict[str, str]]:
    """The command and the environment of `python -m MODULE WORD`, which finds the packages that this process finds."""
    paths = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
    return [sys.executable, "-P", "-m", module, word], os.environ | {"PYTHONPATH": paths}
