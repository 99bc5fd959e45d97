"""Runs that are killed, and disks that are full."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from experiments.record.journal import Contents
from experiments.record.replay import history
from experiments.session.steps import Answered
from tests.conftest import RECOIL


def words(configs: Path, *more: object) -> list[object]:
    return [
        RECOIL,
        "run",
        configs / "direction.toml",
        "--participant",
        "P01",
        "--seed",
        1,
        "--results",
        "results",
        *more,
    ]


def answers(contents: Contents) -> str:
    return "".join(outcome.response[0] for _, outcome in history(contents) if isinstance(outcome, Answered))


def in_small_disk(script: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """A script in a private mount namespace, where it can mount a disk as small as it likes."""
    flags = ["-m"] if os.getuid() == 0 else ["-rm"]
    return subprocess.run(
        ["unshare", *flags, "sh", "-c", script], cwd=folder, capture_output=True, text=True, timeout=120, check=False
    )


def can_mount(folder: Path) -> bool:
    return in_small_disk("mkdir -p m && mount -t tmpfs none m", folder).returncode == 0
