"""The contract of imports in `pyproject.toml` holds, and says so when an import is planted that breaks it."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent
ROOMS = ("device", "experiments", "analysis", "recoil")


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The house, to be changed."""
    folder = tmp_path_factory.mktemp("house")
    shutil.copy(ROOT / "pyproject.toml", folder)
    for room in ROOMS:
        shutil.copytree(ROOT / room, folder / room, ignore=shutil.ignore_patterns("__pycache__", "firmware"))
    return folder


def checked(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", "from importlinter.cli import lint_imports_command; lint_imports_command()"],
        cwd=folder,
        env={"PYTHONPATH": str(folder), "PATH": "", "LINES": "200", "COLUMNS": "200"},
        capture_output=True,
        text=True,
        check=False,
    )


def test_every_contract_is_kept(copy: Path) -> None:
    done = checked(copy)
    assert done.returncode == 0, done.stdout
    assert " 0 broken" in done.stdout


@pytest.mark.parametrize(
    ("module", "planted", "broken"),
    [
        ("device/limits.py", "import experiments.clock", "Three floors and a roof"),
        ("experiments/session/states.py", "import analysis.stats.anova", "Three floors and a roof"),
        ("experiments/session/remarks.py", "import experiments.record.journal", "The rooms of the lab"),
        ("analysis/stats/anova.py", "import analysis.logs.reading", "The rooms of the desk"),
        ("experiments/record/storage.py", "import experiments.record.journal", "No circle"),
        ("analysis/stats/binomial.py", "import time", "Pure rooms touch neither files nor clock, line nor process"),
        ("device/physics/shot.py", "import os", "Pure rooms touch neither files nor clock, line nor process"),
        ("experiments/watch/lsl.py", "import experiments.screens.participant.link", "Who watches runs opens no screen"),
        ("experiments/screens/terminal.py", "from PyQt6.QtCore import QTimer", "Qt is the console's alone"),
        ("recoil/cli.py", "import psychopy", "PsychoPy is the participant's alone"),
        ("experiments/runner.py", "import serial", "The line is the serial gun's alone"),
        ("analysis/predict/jobs.py", "import numba", "The compiler is the physics' alone"),
        ("experiments/study/register.py", "import matplotlib", "Figures are drawn by the desk alone"),
    ],
)
def test_a_planted_import_breaks_its_contract(copy: Path, module: str, planted: str, broken: str) -> None:
    path = copy / module
    before = path.read_text(encoding="utf-8")
    path.write_text(f"{before}\n{planted}\n", encoding="utf-8")
    try:
        done = checked(copy)
    finally:
        path.write_text(before, encoding="utf-8")
    assert done.returncode == 1, done.stdout
    assert f"{broken} BROKEN" in done.stdout
