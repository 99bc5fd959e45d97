"""What `import recoil` gives, what it loads, and that the command line answers at once."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import version

import pytest

import recoil
from tests.conftest import Recoil

HEAVY = ("numpy", "scipy", "pandas", "matplotlib", "pydantic", "pyarrow", "numba", "PyQt6", "psychopy", "pingouin")


def loaded(code: str) -> set[str]:
    """The heavy packages that a program has loaded at its end."""
    program = f"{code}\nimport sys\nprint(*(name for name in {HEAVY!r} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split()) if done.stdout.strip() else set()


def test_every_public_name_is_there_and_says_what_it_is() -> None:
    assert dir(recoil) == recoil.__all__
    for name in recoil.__all__:
        assert getattr(recoil, name).__doc__


def test_an_unknown_name_is_refused_with_those_there_are() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'analyse'; it has .*analyze"):
        recoil.analyse  # noqa: B018 - the access is what fails


@pytest.mark.slow
def test_importing_it_loads_nothing_and_a_name_what_it_needs() -> None:
    assert loaded("import recoil") == set()
    assert loaded("import recoil\nrecoil.RecoilError") == set()
    assert "pandas" not in loaded("import recoil\nrecoil.simulate(recoil.GunParameters())")


def test_help_loads_none_of_what_commands_use() -> None:
    code = "from typer.testing import CliRunner\nfrom recoil.cli import app\nCliRunner().invoke(app, ['--help'])"
    assert loaded(code) == set()


def test_the_version_is_the_packages(recoil: Recoil) -> None:
    done = recoil("--version")
    assert (done.returncode, done.stdout.strip()) == (0, version("recoil"))
