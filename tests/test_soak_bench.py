"""Speed of the gun's physics beside the peers', at equal error, kept as a table."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import Soak

pytestmark = pytest.mark.soak

ROOT = Path(__file__).parent.parent
OURS = ("Recoil, one at a time", "Recoil, batch")
SLOWER = {"scipy DOP853": 500.0, "heyoka": 2.0}
"""So many times as long as ours they take with an open coil, at an error of at most 1e-9."""


@pytest.fixture(scope="module")
def found() -> Any:
    done = subprocess.run([sys.executable, "-m", "tests.benchmarks"], check=True, capture_output=True, cwd=ROOT)
    return json.loads(done.stdout)


def test_the_leads(found: Any, soak: Soak) -> None:
    how = f"medians of {found['repeats']} turns in one run, load {found['load_before']:.1f} before; error {{:.0e}}"
    missed = []
    for lead in found["leads"]:
        coil, family = lead["drive_off"], lead["family"]
        bound = SLOWER.get(family) if coil == "open" else None
        wanted = "stated" if bound is None else f"{bound:g} times ours"
        if (coil, family) == ("open", "Recoil, batch"):
            wanted = "5 us a shot and core"
        figure = f"{lead['us_per_shot']:,.3g} us a shot"
        if family not in OURS:
            figure = f"{lead['times_ours']:,.3g} times ours, {figure}"
        soak(f"coil {coil}, {family}, {lead['setting']}", figure, wanted, how.format(lead["error"]))
        if bound is not None and lead["times_ours"] < bound:
            missed.append(family)
    assert not missed


def test_the_arithmetic_bound(found: Any, soak: Soak) -> None:
    rate = found["flops"]["rate_flop_s"]
    for coil in ("open", "shorted"):
        flops = found["flops"][coil]
        operations = sum(flops["operations"].values())
        times = ", ".join(f"{name} {value:.3g} times that" for name, value in flops["times_the_bound"].items())
        figure = f"{operations:,.0f} operations, {flops['bound_us']:.2g} us; {times}"
        soak(
            f"arithmetic of a shot, coil {coil}", figure, "stated", f"matrix products: {rate / 1e9:.3g} Gflop/s a core"
        )
        assert operations > 0
