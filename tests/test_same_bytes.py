"""The same logs give the same statistics and the same page, byte for byte, in whatever order, place and language."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from analysis.logs.files import find_logs
from analysis.summary.origins import origin_of
from tests.surroundings import ELSEWHERE, HERE, write_sites

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
data = ReportData(title=report_title(logs), statistics=statistics, **parts)
sys.stdout.buffer.write(as_json(statistics) + repr((data.title, sections(data))).encode())
"""


@pytest.fixture(scope="module")
def sites(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return write_sites(tmp_path_factory.mktemp("sites"))


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


def test_hands_that_answered_equally_often_stand_in_one_order() -> None:
    rows = pd.DataFrame({"hand": ["experimenter", "participant"] * 3, "gun": ["b", "a"] * 3})
    assert list(origin_of(rows, "hand").answers) == list(origin_of(rows[::-1], "hand").answers)
    assert list(origin_of(rows, "hand").guns) == list(origin_of(rows[::-1], "hand").guns) == ["a", "b"]


@pytest.mark.slow
def test_files_are_read_in_one_order_whatever_the_order_they_are_named_in(sites: list[Path]) -> None:
    files = [path for site in sites for path in site.rglob("*_trials.csv")]
    found, other = find_logs(files), find_logs([*files[::-1], files[0]])
    assert list(found.logs.items()) == list(other.logs.items())
    assert list(found.logs) == sorted(found.logs)
    assert not found.problems
