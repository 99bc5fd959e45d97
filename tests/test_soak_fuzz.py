"""The full figures behind "only declared errors, none over 5 s or 1 GB", kept as a table: `make soak`."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import Soak
from tests.fuzz import MOST_MB, MOST_S, NAMES
from tests.lies import real_runs

pytestmark = pytest.mark.soak

ROOT = Path(__file__).parent.parent
INPUTS = dict.fromkeys(NAMES, 10_000) | {"the wire": 60_000}
ALONE = """
import json, sys, warnings
from pathlib import Path
from tests.fuzz import fuzzed, peak_MB, readers
warnings.simplefilter("ignore")
name, count, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
place = folder / name.replace(" ", "-")
place.mkdir()
slowest = taken = 0
findings = []
for seconds, was_taken, finding in fuzzed(name, readers(folder / "runs")[name], place, range(count)):
    slowest, taken = max(slowest, seconds), taken + was_taken
    if finding is not None and len(findings) < 20:
        findings.append(f"{finding.number}: {finding.what}")
print(json.dumps({"slowest": slowest, "taken": taken, "findings": findings, "peak": peak_MB()}))
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("fuzz")
    real_runs(place / "runs")
    return place


@pytest.mark.parametrize("name", NAMES)
def test_a_reader_says_declared_errors_only(name: str, folder: Path, soak: Soak) -> None:
    words = [sys.executable, "-c", ALONE, name, str(INPUTS[name]), folder]
    done = subprocess.run(words, cwd=ROOT, check=True, capture_output=True, text=True)
    found = json.loads(done.stdout)
    how = f"{found['taken']} taken, slowest {found['slowest']:.2f} s of the processor, at most {found['peak']:.0f} MB"
    soak(f"{name}: undeclared errors of {INPUTS[name]} damaged inputs", len(found["findings"]), "0", how)
    assert found["findings"] == []
    assert found["slowest"] < MOST_S
    assert found["peak"] < MOST_MB


def test_they_are_two_hundred_thousand() -> None:
    assert sum(INPUTS.values()) >= 200_000
    assert min(INPUTS.values()) >= 5_000
