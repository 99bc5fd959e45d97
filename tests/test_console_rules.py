"""The console's rules without its window: whatever an experimenter does in whatever order, the record stays whole."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings

from tests.at_controls import SETUPS
from tests.experimenters import MOVES, Experimenter, check

pytestmark = pytest.mark.slow
RUNS = 10
"""Of each experiment; `make soak` makes 1,000 of each."""


def work(name: str, moves: list[tuple[Any, ...]]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        someone = Experimenter(SETUPS[name], Path(folder), moves)
        someone.work()
        check(someone)


@pytest.mark.parametrize("name", SETUPS)
def test_whatever_an_experimenter_does_nothing_fires_that_must_not_and_nothing_is_recorded_that_was_not_said(
    name: str,
) -> None:
    @settings(max_examples=RUNS, deadline=None)
    @given(moves=MOVES)
    def whatever(moves: list[tuple[Any, ...]]) -> None:
        work(name, moves)

    whatever()
