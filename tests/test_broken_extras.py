"""Optional packages that are installed and broken: one message, or the slower way; never a traceback."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from tests.conftest import RECOIL

pytestmark = pytest.mark.slow

ERRORS = {
    "missing library": 'ImportError("libEGL.so.1: cannot open shared object file")',
    "of another Python": 'RuntimeError("built for another Python")',
    "of the system": 'OSError(2, "no such library")',
}


@pytest.fixture(params=ERRORS)
def error(request: pytest.FixtureRequest) -> str:
    return ERRORS[request.param]


def with_broken(package: str, error: str, folder: Path, *words: object) -> subprocess.CompletedProcess[str]:
    """A command where a package raises an error as it is imported."""
    stub = folder / "stubs" / package
    stub.mkdir(parents=True)
    (stub / "__init__.py").write_text(f"raise {error}\n")
    environment = {**os.environ, "PYTHONPATH": str(stub.parent), "COLUMNS": "200"}
    command = [RECOIL, *map(str, words)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stderr
    return done


@pytest.mark.parametrize("more", [(), ("--participant", "P01")])
def test_a_console_that_cannot_be_loaded_is_one_message(error: str, more: tuple[str, ...], tmp_path: Path) -> None:
    done = with_broken("PyQt6", error, tmp_path, "run", "direction", "--screen", "console", *more)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1), done.stderr
    assert "--screen console needs the screens (they cannot be loaded: " in done.stderr
    assert "or use --screen terminal; `recoil doctor` says what else is missing" in done.stderr


def test_a_compiler_that_cannot_be_loaded_leaves_shots_interpreted(error: str, tmp_path: Path) -> None:
    varied = ("--vary", "friction_N=0.1:1.2:50", "--vary", "voltage_V=5:20:50", "--table", "shots.csv")
    done = with_broken("numba", error, tmp_path, "simulate", *varied)
    assert done.returncode == 0, done.stderr
    assert "numba cannot be loaded (" in done.stderr
    assert 'install "recoil[fast]" anew' in done.stderr
    assert len((tmp_path / "shots.csv").read_text().splitlines()) == 2501


def test_a_scheduler_whose_library_cannot_be_loaded_is_one_message(error: str, tmp_path: Path) -> None:
    asked = ("direction", "--participants", "8", "--studies", "10", "--scheduler", "tcp://127.0.0.1:9")
    done = with_broken("distributed", error, tmp_path, "power", *asked)
    assert done.returncode == 2
    assert 'install "recoil[dask]" here and on the workers' in done.stderr.splitlines()[-1]
