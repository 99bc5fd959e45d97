"""Our batch beside what could take its place, on the paper's guns and 200 random ones: heyoka, DOP853, arithmetic."""

from __future__ import annotations

import pytest

from tests.benchmarks.flops import flop_rate
from tests.benchmarks.lanes import HEYOKA_LANES, compare, operations_a_shot
from tests.benchmarks.ours import BATCH, SINGLE
from tests.benchmarks.problem import OFF_STATES
from tests.benchmarks.timing import Row
from tests.conftest import Soak

pytestmark = pytest.mark.soak

REPEATS = 7
EXACT = 1e-11
PACKAGES = {BATCH: "numba", SINGLE: "numba", HEYOKA_LANES: "heyoka", "heyoka": "heyoka", "scipy DOP853": "scipy"}


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    pytest.importorskip("numba")
    return [row for drive_off in OFF_STATES for row in compare(drive_off, REPEATS)]


@pytest.mark.parametrize("family", PACKAGES)
@pytest.mark.parametrize("drive_off", OFF_STATES)
def test_time_and_error(drive_off: str, family: str, rows: list[Row], soak: Soak) -> None:
    pytest.importorskip(PACKAGES[family], reason="uv pip install --python .venv --group peers")
    for row in rows:
        if (row.drive_off, row.family) == (drive_off, family):
            assert row.error is not None, row.note
            figure = f"{row.us_per_shot:,.3g} us a shot; error {row.error:.0e}"
            if family != BATCH:
                figure = f"{row.times_ours:,.3g} times our batch, {figure}"
            bound = f"error {EXACT:.0e}" if family in (BATCH, SINGLE) else "stated"
            how = f"medians of {REPEATS} turns in one process; 202 guns, 7 numbers each, largest relative error"
            soak(f"coil {drive_off}, {family}, {row.setting}", figure, bound, how)
            assert family not in (BATCH, SINGLE) or row.error <= EXACT


def test_the_arithmetic_bound(rows: list[Row], soak: Soak) -> None:
    rate = flop_rate()
    for drive_off in OFF_STATES:
        counted = operations_a_shot(drive_off)
        bound_us = 1e6 * counted / rate
        batch = next(row for row in rows if (row.drive_off, row.family) == (drive_off, BATCH))
        assert batch.us_per_shot is not None
        figure = (
            f"{counted:,.0f} operations, {bound_us:.2g} us; our batch {batch.us_per_shot / bound_us:.3g} times that"
        )
        how = f"mean of the 202 guns; multiply-adds of matrix products: {rate / 1e9:.3g} Gflop/s a core"
        soak(f"coil {drive_off}, arithmetic of a shot", figure, "stated", how)
