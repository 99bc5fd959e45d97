"""The console's rules over thousands of drawn experimenters: `make soak`."""

from __future__ import annotations

import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

from tests.at_controls import SETUPS
from tests.conftest import Soak
from tests.experimenters import MOVES, Experimenter, check

pytestmark = pytest.mark.soak
RUNS = 1000


@pytest.mark.parametrize("name", SETUPS)
def test_no_drawn_experimenter_breaks_a_rule(name: str, soak: Soak) -> None:
    found, runs = Counter[str](), []

    @settings(max_examples=RUNS, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(moves=MOVES)
    def whatever(moves: list[tuple[Any, ...]]) -> None:
        with tempfile.TemporaryDirectory() as folder:
            someone = Experimenter(SETUPS[name], Path(folder), moves)
            someone.work()
            found.update(check(someone))
            runs.append(someone)

    whatever()
    events = sum(count for word, count in found.items() if word not in ("refused", "sittings"))
    how = (
        f"{len(runs)} drawn experimenters in {found['sittings']} sittings: {events} events taken, {found['refused']} "
        f"acts refused, {found['EmergencyStop']} emergency stops, {found['Pause']} pauses, {found['Stop']} stops, "
        f"{found['GunFault'] + found['LinkLost']} faults of the gun, {found['Correct']} corrections"
    )
    soak(f"rules broken over {RUNS} runs of {name}", 0, "0", how)
