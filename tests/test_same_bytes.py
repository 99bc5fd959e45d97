"""The same logs give the same statistics and the same page, byte for byte, in whatever order, place and language."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from analysis.logs.files import find_logs
from experiments.clock import VirtualClock
from experiments.load import load_setup
from experiments.run import RunRequest, run
from experiments.screens.synthetic import synthetic_screen
from tests.conftest import RECOIL, Soak
from tests.log_files import trial_rows, trials_path, write_rows, write_study

HERE = {"LC_ALL": "C.utf8", "TZ": "UTC", "PYTHONHASHSEED": "0", "OMP_NUM_THREADS": "4", "OPENBLAS_NUM_THREADS": "4"}
ELSEWHERE = {
    "LC_ALL": "tr_TR.UTF-8",
    "LANG": "de_DE",
    "TZ": "Asia/Kathmandu",
    "PYTHONHASHSEED": "4711",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
}

ALL_BUT_FIGURES = """
import sys
from pathlib import Path
from analysis.logs.reading import read_logs
from analysis.report.serial import as_json
from analysis.summary.analyze import report_title, with_everybody
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.sections import sections
from analysis.summary.summary import summarize
paths = [Path(path) for path in sys.argv[1:]]
logs = read_logs(paths)
statistics = with_everybody(summarize(logs, fits=True), logs)
parts = {"files": logs.files, "problems": logs.problems, "remarks": logs.remarks}
data = ReportData(title=report_title(paths), statistics=statistics, **parts)
sys.stdout.buffer.write(as_json(statistics) + repr((data.title, sections(data))).encode())
"""


@pytest.fixture(scope="module")
def sites(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two sites with the same codes and a third with a design; hands in equal numbers, broken files, one log twice."""
    folder = tmp_path_factory.mktemp("sites")
    for seed, name in enumerate(("oslo", "kyoto")):
        write_study(folder / name, participants=4, seed=seed)
        (folder / name / "sub-P09_task-direction_trials.csv").write_bytes(b"")
    rows = trial_rows("P05", 5)
    for i, row in enumerate(rows):
        row["response_source"] = ("participant", "experimenter")[i % 2]
    write_rows(trials_path(folder / "oslo", "P05"), rows)
    write_rows(folder / "oslo" / "again" / "old_trials.csv", rows)
    setup = load_setup("stronger")
    for code in ("P01", "P02"):
        request = RunRequest(setup=setup, participant_id=code, results=folder / "design", seed=1)
        run(request, synthetic_screen, VirtualClock())
    return [folder / "oslo", folder / "kyoto", folder / "design"]


def _computed(paths: list[Path], environment: dict[str, str], folder: Path) -> bytes:
    words = [sys.executable, "-c", ALL_BUT_FIGURES, *map(str, paths)]
    root = str(Path(__file__).parent.parent)
    place = {"PATH": os.environ["PATH"], "HOME": str(folder), "PYTHONPATH": root}
    return subprocess.run(words, cwd=folder, env=place | environment, capture_output=True, check=True).stdout


@pytest.mark.slow
def test_statistics_and_sections_are_alike_in_any_order_locale_zone_threads_and_hash_seed(
    sites: list[Path], tmp_path: Path
) -> None:
    assert _computed(sites, HERE, tmp_path) == _computed(sites[::-1], ELSEWHERE, tmp_path)


def test_files_are_read_in_one_order_whatever_the_order_they_are_named_in(sites: list[Path]) -> None:
    files = [path for site in sites for path in site.rglob("*_trials.csv")]
    found, other = find_logs(files), find_logs([*files[::-1], files[0]])
    assert list(found.logs.items()) == list(other.logs.items())
    assert list(found.logs) == sorted(found.logs)
    assert not found.problems


@pytest.mark.soak
def test_every_file_of_an_analysis_is_alike_byte_for_byte(sites: list[Path], tmp_path: Path, soak: Soak) -> None:
    changes = {
        "as it is": ({}, sites),
        "paths in another order": ({}, sites[::-1]),
        **{f"{name} = {value}": ({name: value}, sites) for name, value in ELSEWHERE.items()},
        "all at once": (ELSEWHERE, sites[::-1]),
    }
    found: dict[str, dict[str, bytes]] = {}
    for name, (environment, paths) in changes.items():
        out = tmp_path / f"out{len(found)}"
        place = {"PATH": os.environ["PATH"], "HOME": str(tmp_path)}
        words = [RECOIL, "analyze", *paths, "--out", out, "--fits"]
        done = subprocess.run(words, cwd=tmp_path, env=place | HERE | environment, capture_output=True, check=False)
        assert done.returncode == 1, done.stderr
        files = (path for path in out.rglob("*") if path.is_file())
        found[name] = {path.relative_to(out).as_posix(): path.read_bytes() for path in files}
    first = found["as it is"]
    for name, files in found.items():
        alike = [path for path, content in files.items() if first.get(path) == content]
        soak("alike byte for byte", f"{len(alike)} of {len(first)} files", "all", name)
        assert files == first, name
