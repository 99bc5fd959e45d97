"""Where a number comes from: the version and the commit of the code."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from experiments.record.provenance import git_commit

CHECKOUT = Path(__file__).parent.parent


@pytest.mark.skipif(not (CHECKOUT / ".git").exists(), reason="no checkout")
def test_a_checkout_names_its_commit() -> None:
    done = subprocess.run(["git", "rev-parse", "HEAD"], cwd=CHECKOUT, capture_output=True, text=True, check=True)
    assert git_commit().removesuffix("+changes") == done.stdout.strip()
