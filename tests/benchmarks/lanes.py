"""Our batch beside what could take its place, over the paper's guns and 200 random ones: time, error, arithmetic."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from device.parameters import DriveOff, GunParameters
from device.physics import simulate_batch
from device.physics.scenes import OUTPUTS
from tests.benchmarks import by_heyoka, by_scipy
from tests.benchmarks.flops import operations
from tests.benchmarks.ours import BATCH, SINGLE, Contender, Ready, contender_of, one_at_a_time
from tests.benchmarks.problem import Outputs, Shots, random_shots
from tests.benchmarks.timing import Row, measure

HEYOKA_LANES = "heyoka, batch mode"
_TOLERANCES = (1e-9, 1e-12)
_DOP853 = ("rtol 1e-09", "rtol 1e-12")
_COPIES = 20
"""So often a batch holds each gun: enough shots that what a call costs is nothing beside them."""


def compare(drive_off: DriveOff, repeats: int) -> list[Row]:
    """A row each; `times_ours` sets them against our batch."""
    shots = random_shots(drive_off)
    return measure(list(_entrants()), shots, repeats, clock=_batch_of(shots))


def operations_a_shot(drive_off: DriveOff) -> float:
    """Of the full model, interpreted: the mean of the same guns."""
    return sum(operations(random_shots(drive_off).guns).values())


def _entrants() -> Iterator[Contender]:
    yield Contender(family=BATCH, setting="full, 1 core", package="numba", models="all", prepare=_batch_of)
    yield Contender(family=SINGLE, setting="full, compiled", package="numba", models="all", prepare=one_at_a_time)
    for tol in _TOLERANCES:
        yield Contender(
            family=HEYOKA_LANES,
            setting=f"tol {tol:.0e}",
            package="heyoka",
            models="all",
            prepare=lambda shots, tol=tol: _in_lanes(shots, tol),  # type: ignore[misc]
            is_peer=True,
        )
    settings = {f"tol {tol:.0e}" for tol in _TOLERANCES}
    yield from (contender_of(peer) for peer in by_heyoka.peers() if peer.setting in settings)
    yield from (
        contender_of(peer) for peer in by_scipy.peers() if peer.family == "scipy DOP853" and peer.setting in _DOP853
    )


def numbers_of(guns: Sequence[GunParameters]) -> dict[str, Any]:
    """Each parameter that is a number, as a column."""
    names = [one.name for one in fields(GunParameters) if isinstance(getattr(guns[0], one.name), float)]
    return {name: np.array([getattr(one, name) for one in guns]) for name in names}


def _batch_of(shots: Shots) -> Ready:
    gun, count, each = GunParameters(drive_off=shots.drive_off), len(shots.guns), numbers_of(shots.guns)
    arrays = {name: np.tile(column, _COPIES) for name, column in each.items()}

    def found() -> list[Outputs]:
        few = simulate_batch(gun, **each)
        return list(zip(*(getattr(few, name).tolist() for name in OUTPUTS), strict=True))

    return Ready(run=lambda: simulate_batch(gun, cores=1, **arrays), shots=count * _COPIES, found=found)


def _in_lanes(shots: Shots, tol: float) -> Ready:
    run = by_heyoka.in_lanes(shots.guns, tol)
    return Ready(run=run, shots=len(shots.guns), found=run)
