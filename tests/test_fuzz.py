"""Files that nobody meant: every reader reads them or says what is wrong, and nothing else; `make soak` has more."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.fuzz import NAMES, Reader, fuzzed, readers
from tests.lies import real_runs

SOME = 30


@pytest.fixture(scope="module")
def every(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Reader]:
    return readers(real_runs(tmp_path_factory.mktemp("fuzz") / "runs"))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_reader_takes_anything_or_says_what_is_wrong(name: str, every: Mapping[str, Reader], tmp_path: Path) -> None:
    found = [one for _, _, one in fuzzed(name, every[name], tmp_path, range(SOME))]
    assert [one for one in found if one is not None] == []


@pytest.mark.slow
def test_no_reader_is_forgotten(every: Mapping[str, Reader]) -> None:
    assert tuple(every) == NAMES
