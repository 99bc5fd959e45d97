"""Nothing is believed: each lie of the table is told about real runs, and what is said of it is heard."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from analysis.logs.reading import read_logs
from tests.lies import LIES, Lie, page, real_runs, said_of

PAGE = Path(__file__).parent.parent / "docs" / "lies.md"


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return real_runs(tmp_path_factory.mktemp("runs"))


@pytest.mark.slow
def test_of_runs_that_do_not_lie_nothing_is_said(runs: Path) -> None:
    assert said_of(read_logs([runs])) == ""


@pytest.mark.slow
@pytest.mark.parametrize("lie", LIES, ids=lambda lie: f"{lie.what}: {lie.how}")
def test_what_lies_is_said(lie: Lie, runs: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(runs, tmp_path / "results"))
    said = lie.tell(folder)
    assert lie.said in said


def test_the_page_lists_them_all() -> None:
    assert len(LIES) >= 60
    assert PAGE.read_text(encoding="utf-8") == page()
