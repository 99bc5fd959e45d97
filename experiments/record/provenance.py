"""Where numbers come from: the versions, the commit and the machine's kind behind a run or a report."""

from __future__ import annotations

import platform
import subprocess
from functools import lru_cache
from importlib import metadata
from pathlib import Path

_PACKAGES = ("numpy", "scipy", "pandas", "pydantic")


def recoil_version() -> str:
    """The version of this product."""
    try:
        return metadata.version("recoil")
    except metadata.PackageNotFoundError:
        return "unknown"


@lru_cache(maxsize=1)
def git_commit() -> str:
    """The commit of the checkout this code runs from, `+changes` if it was changed since; `none` outside of one."""
    checkout = Path(__file__).resolve().parents[2]
    if not (checkout / ".git").exists():
        return "none"
    try:
        commit = _git(checkout, "rev-parse", "HEAD")
        changes = _git(checkout, "status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return f"{commit}+changes" if changes else commit


def _git(checkout: Path, *words: str) -> str:
    """What git says; it locks nothing, as one that is killed with its run would leave the checkout locked."""
    command = ["git", "--no-optional-locks", *words]
    done = subprocess.run(command, cwd=checkout, capture_output=True, text=True, timeout=10, check=True)
    return done.stdout.strip()


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """Versions of Python and of the packages that numbers depend on."""
    return {"recoil": recoil_version(), "python": platform.python_version()} | {
        name: metadata.version(name) for name in _PACKAGES
    }


def provenance() -> dict[str, str]:
    """What stands at the head of a journal beside plan and setup."""
    return versions() | {"git_commit": git_commit(), "system": f"{platform.system()} {platform.machine()}"}
