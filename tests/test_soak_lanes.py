"""Our batch beside what could take its place, on the paper's guns and 200 random ones: heyoka, DOP853, arithmetic.

With the folder of an older version in `RECOIL_OLD` (see tests/test_soak_commands.py) its batch is one of them.
"""

from __future__ import annotations

import os
import statistics
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from device.parameters import DriveOff, GunParameters
from device.physics import simulate_batch
from tests.benchmarks.flops import flop_rate
from tests.benchmarks.lanes import HEYOKA_LANES, compare, numbers_of, operations_a_shot
from tests.benchmarks.older import older_batch
from tests.benchmarks.ours import BATCH, SINGLE
from tests.benchmarks.problem import OFF_STATES, random_shots
from tests.benchmarks.timing import Row
from tests.conftest import Soak
from tests.physics_claims import VARIANTS
from tests.random_guns import NUMBERS, TURNS, differences, drawn, shot_alone

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


OLD = Path(os.environ["RECOIL_OLD"]) if os.environ.get("RECOIL_OLD") else None
SHOTS = 40_000


def batches(drive_off: DriveOff) -> dict[str, tuple[dict[str, Any], float]]:
    """The parameters of many shots by what they are, and how many times faster than before they are to be."""
    random = {name: np.tile(column, SHOTS // 202) for name, column in numbers_of(random_shots(drive_off).guns).items()}
    sweep = {"friction_N": np.linspace(0.1, 1.2, SHOTS)}
    bound = {"open": 4.0, "shorted": 3.0}[drive_off]
    return {"a sweep of friction": (sweep, bound), "the 202 guns": (random, bound)}


@pytest.mark.skipif(OLD is None, reason="RECOIL_OLD names no older version")
@pytest.mark.parametrize("kind", ["a sweep of friction", "the 202 guns"])
@pytest.mark.parametrize("drive_off", OFF_STATES)
def test_against_the_batch_of_before(drive_off: DriveOff, kind: str, soak: Soak) -> None:
    pytest.importorskip("numba")
    assert OLD is not None
    arrays, bound = batches(drive_off)[kind]
    older, gun = older_batch(OLD, drive_off=drive_off), GunParameters(drive_off=drive_off)
    ways: dict[str, Callable[[], Any]] = {
        "new": lambda: simulate_batch(gun, cores=1, **arrays),
        "old": lambda: older(cores=1, **arrays),
    }
    count, us = len(next(iter(arrays.values()))), dict[str, list[float]](new=[], old=[])
    for run in ways.values():
        run()  # compiled
    for _ in range(REPEATS * 3):
        for name, run in ways.items():
            begun = time.process_time()
            run()
            us[name].append(1e6 * (time.process_time() - begun) / count)
    times = statistics.median(old / new for old, new in zip(us["old"], us["new"], strict=True))
    new, old = (statistics.median(us[name]) for name in ("new", "old"))
    how = f"CPU time on one core, medians of {REPEATS * 3} turns in one process, load {os.getloadavg()[0]:.1f} after"
    soak(
        f"coil {drive_off}, {kind}: lanes against the batch of before",
        f"{times:.2f} times faster: {new:.2f} us a shot, was {old:.2f}",
        f"{bound:g} times",
        how,
    )


def test_a_hundred_thousand_random_guns(soak: Soak) -> None:
    pytest.importorskip("numba")
    rng, worst, statuses = np.random.default_rng(19), 0.0, Counter[str]()
    alike = turns = shots = 0
    for factor, count in ((2.0, 12_500), (10**1.5, 10_000), (10**6.0, 2_500)):
        for drive_off, emf in VARIANTS:
            gun, arrays = GunParameters(drive_off=drive_off, emf=emf), drawn(rng, count, factor=factor)
            found, alone = simulate_batch(gun, **arrays), shot_alone(gun, arrays)
            assert np.array_equal(found.status, alone.status)
            apart = differences(found, alone, [name for name in NUMBERS if name not in TURNS])
            worst, shots = max(worst, float(apart.max())), shots + count
            turned = differences(found, alone, TURNS)
            alike += int(((apart == 0.0) & (turned == 0.0)).sum())
            turns += int((turned > EXACT).sum())
            statuses.update(found.names().tolist())
    each = ", ".join(f"{number:,} {name}" for name, number in statuses.most_common())
    soak(
        "random guns in lanes against each alone: largest relative difference",
        f"{worst:.1e}; {100 * alike / shots:.1f} % alike to the last bit; all statuses alike; {turns} with another "
        "moment of turning, magnets that have all but come to rest under the coil",
        "1e-11",
        f"{shots:,} guns within a factor of 2, 32 and a million of the paper's, in all options; {each}",
    )
    assert worst < EXACT
    assert turns < 1e-4 * shots
