"""The reduced models' stated errors over the whole box in which they are stated: `make soak`."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from device.parameters import DriveOff, Emf
from device.physics import FIDELITIES, GunParameters, simulate_batch
from device.physics.scenes import FRICTION_N, NEAR, OUTPUTS, stated_error
from tests.conftest import Soak
from tests.extreme_guns import NUMBERS, OPTIONS, PAPER

pytestmark = pytest.mark.soak


@pytest.mark.parametrize(("drive_off", "emf"), OPTIONS)
def test_the_stated_errors_hold_in_the_box_and_at_its_corners(drive_off: DriveOff, emf: Emf, soak: Soak) -> None:
    gun, arrays = GunParameters(drive_off=drive_off, emf=emf), box(np.random.default_rng(2026), 200_000)
    full = simulate_batch(gun, **arrays)
    for fidelity in FIDELITIES[1:]:
        shots = simulate_batch(gun, fidelity=fidelity, **arrays)
        parts = []
        for output in OUTPUTS:
            error = float(np.abs(getattr(shots, output) / getattr(full, output) - 1).max())
            parts.append(error / stated_error(fidelity, output, drive_off, emf))
        how = f"{len(full.status):,} guns, corners included; largest share of a stated error"
        soak(f"{fidelity}, coil {drive_off}, EMF {emf}", f"{max(parts):.2f}", "1", how)
        assert max(parts) <= 1


def box(rng: np.random.Generator, count: int) -> dict[str, Any]:
    """Random guns of the box in which errors are stated, and its corners at twelve frictions."""
    corners = np.array(list(itertools.product((1.0 - NEAR, 1.0 + NEAR), repeat=len(NUMBERS))))
    frictions = np.linspace(*FRICTION_N, 12)
    factors = np.concatenate(
        [
            rng.uniform(1.0 - NEAR, 1.0 + NEAR, (count, len(NUMBERS))),
            np.repeat(corners, len(frictions), axis=0),
        ]
    )
    friction = np.concatenate([rng.uniform(*FRICTION_N, count), np.tile(frictions, len(corners))])
    return {name: getattr(PAPER, name) * factors[:, n] for n, name in enumerate(NUMBERS)} | {"friction_N": friction}
