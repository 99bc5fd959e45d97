"""The scripts in `docs/notebooks/` run in an empty folder, and print what they say they print."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.warm_start import warm

ROOT = Path(__file__).parent.parent
SCRIPTS = sorted((ROOT / "docs" / "notebooks").glob("*.py"))
SHOWN = "# It prints:\n#\n"
INDENT = "#     "

pytestmark = pytest.mark.slow


def promised(script: Path) -> list[str]:
    """The lines that the last cell of a script shows as its output."""
    _, _, lines = script.read_text(encoding="utf-8").partition(SHOWN)
    return [line.removeprefix(INDENT) for line in lines.splitlines()]


def started(script: Path) -> list[str]:
    """As its user starts it: it may not lean on what another program has imported."""
    return [sys.executable, str(script)]


def started_warm(script: Path) -> list[str]:
    """The same with everything imported, in a third of the time."""
    return warm("-m", f"docs.notebooks.{script.stem}")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
@pytest.mark.parametrize("words", [started_warm, pytest.param(started, marks=pytest.mark.soak)])
def test_a_notebook_prints_what_it_shows(script: Path, words: Callable[[Path], list[str]], tmp_path: Path) -> None:
    done = subprocess.run(words(script), cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == promised(script) != []


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_notebook_has_cells_of_text_and_of_code_and_is_named_in_the_readme(script: Path) -> None:
    text = script.read_text(encoding="utf-8")
    assert text.startswith("# %% [markdown]\n# # ")
    assert text.count("\n# %%\n") >= 2
    assert f"docs/notebooks/{script.name}" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_papers_analysis_takes_ten_lines() -> None:
    text = (ROOT / "docs" / "notebooks" / "paper.py").read_text(encoding="utf-8")
    (cell,) = [cell for cell in text.split("# %%") if "recoil.analyze(" in cell and cell.startswith("\n")]
    assert len(cell.strip().splitlines()) <= 10
