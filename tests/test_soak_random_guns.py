"""Random guns beside those of an older version, in `RECOIL_OLD` (see tests/test_soak_commands.py): what is other."""

from __future__ import annotations

import itertools
import json
import os
import statistics
import subprocess
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from device.parameters import Emf, GunParameters
from device.physics import ShotBatch
from device.physics.equations import STATUSES
from tests.benchmarks.older import older_batch
from tests.benchmarks.problem import OFF_STATES
from tests.conftest import Soak
from tests.extreme_guns import FAR_SHOTS
from tests.random_guns import NUMBERS, TURNS, by_few, differences, drawn, shot_alone

OLD = Path(os.environ["RECOIL_OLD"]) if os.environ.get("RECOIL_OLD") else None
ROOT = Path(__file__).parent.parent
pytestmark = [pytest.mark.soak, pytest.mark.skipif(OLD is None, reason="RECOIL_OLD names no older version")]
SEED = 77
EXACT = 1e-11


def commit(folder: Path) -> str:
    """The version that is checked out in a folder."""
    asked = ["git", "-C", str(folder), "rev-parse", "--short", "HEAD"]
    return subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip()


Batch = Callable[..., Any]
SHAKEN = ("voltage_V", "inductance_H", "magnet_mass_kg", "resistance_ohm", "back_emf_V_s_m")
COMPARED = [name for name in NUMBERS if name not in TURNS]


def shaken(batch: Batch, arrays: Mapping[str, Any], shots: ShotBatch) -> NDArray[np.float64]:
    """By how much the numbers of these shots change where one of the gun's changes by its last bit."""
    worst = np.zeros(len(shots.status))
    for name, way in itertools.product(SHAKEN, (np.inf, -np.inf)):
        other = by_few(batch, {**arrays, name: np.nextafter(arrays[name], way)})
        worst = np.maximum(worst, differences(shots, other, COMPARED))
    return worst


@pytest.mark.parametrize(("decades", "count"), [(3, 30_000), (6, 5_000), (12, 5_000)])
@pytest.mark.parametrize("emf", ["printed", "reciprocal"])
def test_random_guns_against_those_of_before(emf: Emf, decades: int, count: int, soak: Soak) -> None:
    pytest.importorskip("numba")
    assert OLD is not None
    rng, changes, largest, parts = np.random.default_rng(SEED + decades), Counter[str](), 0.0, list[float]()
    for drive_off in OFF_STATES:
        arrays = drawn(rng, count, factor=10.0 ** (decades / 2.0))
        now = shot_alone(GunParameters(drive_off=drive_off, emf=emf), arrays)
        older = older_batch(OLD, drive_off=drive_off, emf=emf)
        before = by_few(older, arrays)
        for old, new in zip(before.status.tolist(), now.status.tolist(), strict=True):
            changes.update([f"{STATUSES[old]} now {STATUSES[new]}"] if old != new else [])
        home = (now.status == STATUSES.index("home")) & (before.status == now.status)
        apart = np.where(home, differences(now, before, COMPARED), 0.0)
        largest = max(largest, float(apart.max()))
        if (far := apart > EXACT).any():
            few = {name: column[far] for name, column in arrays.items()}
            parts += (apart[far] / shaken(older, few, by_few(older, few))).tolist()
    others = ", ".join(f"{number} {words}" for words, number in changes.most_common()) or "none"
    ill = f", where a last bit of the gun's changes as much: at the most {max(parts):.2g} of that" if parts else ""
    soak(
        f"EMF {emf}, guns of {decades} decades beside those of {commit(OLD)}",
        f"other statuses: {others}; numbers of those that come home: largest relative difference {largest:.1e}, above "
        f"{EXACT:.0e} in {len(parts)}{ill}",
        "stated",
        f"{2 * count:,} guns, each alone and compiled; moments of turning left out",
    )


TIMED = """
import json, statistics, sys, time
from device.physics import GunParameters, simulate
gun, taken = GunParameters(**json.loads(sys.argv[1])), []
simulate(gun)
for _ in range(3):
    begun = time.process_time()
    simulate(gun)
    taken.append(time.process_time() - begun)
print(statistics.median(taken))
"""


def interpreted_s(folder: Path) -> float:
    """The CPU time of one shot of the gun that slips, by the version in a folder."""
    words = [folder / ".venv" / "bin" / "python", "-c", TIMED, json.dumps(FAR_SHOTS[3]["gun"])]
    return float(subprocess.run(words, cwd=folder, check=True, capture_output=True, text=True).stdout)


def test_the_gun_that_slips_takes_a_fiftieth(soak: Soak) -> None:
    assert OLD is not None
    taken = [(interpreted_s(ROOT), interpreted_s(OLD)) for _ in range(5)]
    now_s, before_s = (statistics.median(one) for one in zip(*taken, strict=True))
    soak(
        f"interpreted, the gun of 1,773 slips beside {commit(OLD)}",
        f"{1e3 * now_s:.0f} ms, was {1e3 * before_s:.0f} ms: {now_s / before_s:.4f} of it",
        "50 ms where it was 2.5 s",
        "CPU time, medians of 5 turns",
    )
    assert now_s < 0.02 * before_s
