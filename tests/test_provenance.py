"""Where a number comes from: the version and the commit of the code."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from experiments.record import provenance
from experiments.record.provenance import git_commit

CHECKOUT = Path(__file__).parent.parent


@pytest.mark.skipif(not (CHECKOUT / ".git").exists(), reason="no checkout")
def test_a_checkout_names_its_commit() -> None:
    done = subprocess.run(["git", "rev-parse", "HEAD"], cwd=CHECKOUT, capture_output=True, text=True, check=True)
    assert git_commit().removesuffix("+changes") == done.stdout.strip()


def test_a_checkout_is_looked_at_without_a_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Looking for changes, git would write down which files it found unchanged, under a lock."""
    module = tmp_path / "experiments" / "record" / "provenance.py"
    module.parent.mkdir(parents=True)
    module.touch()
    me = ["-c", "user.name=nobody", "-c", "user.email=nobody@localhost"]
    for words in (["init", "--quiet"], ["add", "."], [*me, "commit", "--quiet", "--message", "first"]):
        subprocess.run(["git", *words], cwd=tmp_path, check=True)
    os.utime(module, (0, 0))  # unchanged, but for the time that git knows
    index = (tmp_path / ".git" / "index").read_bytes()
    monkeypatch.setattr(provenance, "__file__", str(module))
    assert len(git_commit.__wrapped__()) == 40
    assert (tmp_path / ".git" / "index").read_bytes() == index
