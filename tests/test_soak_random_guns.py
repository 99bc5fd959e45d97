"""Random guns beside those of an older version, in `RECOIL_OLD` (see tests/test_soak_commands.py): what is other."""

from __future__ import annotations

import os
import subprocess
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from device.parameters import Emf, GunParameters
from device.physics.equations import STATUSES
from tests.benchmarks.older import older_batch
from tests.benchmarks.problem import OFF_STATES
from tests.conftest import Soak
from tests.random_guns import NUMBERS, TURNS, by_few, differences, drawn, shot_alone

OLD = Path(os.environ["RECOIL_OLD"]) if os.environ.get("RECOIL_OLD") else None
pytestmark = [pytest.mark.soak, pytest.mark.skipif(OLD is None, reason="RECOIL_OLD names no older version")]
SEED = 77
EXACT = 1e-11


def commit(folder: Path) -> str:
    """The version that is checked out in a folder."""
    asked = ["git", "-C", str(folder), "rev-parse", "--short", "HEAD"]
    return subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip()


@pytest.mark.parametrize(("decades", "count"), [(3, 30_000), (6, 5_000), (12, 5_000)])
@pytest.mark.parametrize("emf", ["printed", "reciprocal"])
def test_random_guns_against_those_of_before(emf: Emf, decades: int, count: int, soak: Soak) -> None:
    pytest.importorskip("numba")
    assert OLD is not None
    rng, apart, changes = np.random.default_rng(SEED + decades), list[float](), Counter[str]()
    for drive_off in OFF_STATES:
        arrays = drawn(rng, count, factor=10.0 ** (decades / 2.0))
        now = shot_alone(GunParameters(drive_off=drive_off, emf=emf), arrays)
        before = by_few(older_batch(OLD, drive_off=drive_off, emf=emf), arrays)
        for old, new in zip(before.status.tolist(), now.status.tolist(), strict=True):
            changes.update([f"{STATUSES[old]} now {STATUSES[new]}"] if old != new else [])
        home = (now.status == STATUSES.index("home")) & (before.status == now.status)
        apart += differences(now, before, [name for name in NUMBERS if name not in TURNS])[home].tolist()
    others = ", ".join(f"{number} {words}" for words, number in changes.most_common()) or "none"
    found = f"largest relative difference {max(apart):.1e}, above {EXACT:.0e} in {sum(one > EXACT for one in apart)}"
    soak(
        f"EMF {emf}, guns of {decades} decades beside those of {commit(OLD)}",
        f"other statuses: {others}; numbers of those that come home: {found}",
        "stated",
        f"{2 * count:,} guns, each alone and compiled; moments of turning left out",
    )
