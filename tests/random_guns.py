"""Random guns about the paper's, shot in lanes and one by one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.physics import GunParameters, ShotBatch, simulate_batch
from tests.extreme_guns import SPREAD
from tests.physics_claims import BARE

ALONE = 15
"""Guns that are too few for lanes."""
NUMBERS = [one.name for one in fields(ShotBatch) if one.name != "status"]
TURNS = ("firing_end_s", "recoil_end_s")
"""When a magnet turns that has all but come to rest under the coil is rounding."""


def drawn(rng: np.random.Generator, count: int, *, factor: float) -> dict[str, NDArray[np.float64]]:
    """The numbers of guns, each between the paper's divided by a factor and times it, evenly in its logarithm."""
    return {name: getattr(BARE, name) * factor ** rng.uniform(-1.0, 1.0, count) for name in SPREAD}


def shot_alone(gun: GunParameters, arrays: Mapping[str, Any]) -> ShotBatch:
    """The same guns as `simulate_batch`, in batches too small for lanes."""
    return by_few(partial(simulate_batch, gun), arrays)


def by_few(batch: Callable[..., Any], arrays: Mapping[str, Any]) -> ShotBatch:
    """Guns in batches too small for lanes, by `simulate_batch` of any version."""
    count = len(next(iter(arrays.values())))
    few = [
        batch(cores=1, **{name: column[start : start + ALONE] for name, column in arrays.items()})
        for start in range(0, count, ALONE)
    ]
    columns = {one.name: np.concatenate([getattr(batch, one.name) for batch in few]) for one in fields(ShotBatch)}
    return ShotBatch(**columns)


def differences(one: ShotBatch, other: ShotBatch, names: Sequence[str] = NUMBERS) -> NDArray[np.float64]:
    """The largest relative difference of each shot's numbers, infinite where only one has a number.

    The impulse m v of a magnet that has all but stopped as the recoil stage ends is what is left of much larger ones:
    it is compared with the peak force times the time that it had.
    """
    worst = np.zeros(len(one.status))
    for name in names:
        a, b = getattr(one, name), getattr(other, name)
        size = np.maximum(np.abs(a), np.abs(b))
        if name == "recoil_impulse_Ns":
            size = np.maximum(size, np.abs(one.peak_force_N * one.recoil_end_s))
        with np.errstate(invalid="ignore", divide="ignore"):
            apart = np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, np.abs(a - b) / size)
        worst = np.maximum(worst, np.where(np.isnan(apart), np.inf, apart))
    return worst
