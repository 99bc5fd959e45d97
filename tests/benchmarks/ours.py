"""Our own ways to a shot, as `bench physics` times them: from Python one at a time, and in batches."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from analysis.report.copies import cores
from device.parameters import GunParameters
from device.physics import FIDELITIES, ShotSummary, compiled_simulator, simulate, simulate_batch
from device.physics.scenes import FRICTION_N, NEAR, OUTPUTS
from tests.benchmarks.problem import Outputs, Peer, Shots

SINGLE, INTERPRETED, BATCH = "Recoil, one at a time", "Recoil, interpreted", "Recoil, batch"
_FIXED = ("friction_N", "return_friction_N", "pulse_s", "contact_depth_m", "drive_off", "emf")


@dataclass(frozen=True, slots=True, kw_only=True)
class Ready:
    """A prepared way to the shots. `run` does `shots` of them; `found` gives the outputs to be checked."""

    run: Callable[[], object]
    shots: float
    found: Callable[[], Sequence[Outputs]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Contender:
    """One way at one setting: a row of the table. `package` must be there for it."""

    family: str
    setting: str
    package: str
    models: str
    prepare: Callable[[Shots], Ready]
    is_peer: bool = False


def one_at_a_time(shots: Shots) -> Ready:
    """`compiled_simulator`, as a program calls it."""
    asked, simulate = shots.guns, compiled_simulator()

    def run() -> list[ShotSummary]:
        return [simulate(gun) for gun in asked]

    return Ready(run=run, shots=len(asked), found=lambda: [_outputs(shot) for shot in run()])


def contenders(batch: int, seed: int) -> Iterator[Contender]:
    """Ours. A batch holds so many random guns near the paper's; its time is that of a shot and core."""
    yield Contender(family=SINGLE, setting="full, compiled", package="numba", models="all", prepare=one_at_a_time)
    for fidelity in FIDELITIES:
        yield Contender(
            family=INTERPRETED,
            setting=fidelity,
            package="recoil",
            models="all" if fidelity == "full" else "reduced",
            prepare=lambda shots, fidelity=fidelity: _interpreted(shots.guns, fidelity),  # type: ignore[misc]
        )
    for fidelity, used in [*((fidelity, 1) for fidelity in FIDELITIES), ("full", cores())]:
        yield Contender(
            family=BATCH,
            setting=f"{fidelity}, {used} core{'s' if used > 1 else ''}",
            package="numba",
            models="all" if fidelity == "full" else "reduced",
            prepare=lambda shots, fidelity=fidelity, used=used: _batch(shots, fidelity, used, batch, seed),  # type: ignore[misc]
        )


def contender_of(peer: Peer) -> Contender:
    """A peer as a row."""

    def prepare(shots: Shots) -> Ready:
        shoot, asked = peer.build(shots.drive_off), shots.guns

        def run() -> list[Outputs]:
            return [shoot(gun) for gun in asked]

        return Ready(run=run, shots=len(asked), found=run)

    return Contender(
        family=peer.family,
        setting=peer.setting,
        package=peer.package,
        models=peer.models,
        prepare=prepare,
        is_peer=True,
    )


def _interpreted(asked: Sequence[GunParameters], fidelity: str) -> Ready:
    def run() -> list[ShotSummary]:
        return [simulate(gun, fidelity) for gun in asked]

    return Ready(run=run, shots=len(asked), found=lambda: [_outputs(shot) for shot in run()])


def _batch(shots: Shots, fidelity: str, used: int, count: int, seed: int) -> Ready:
    gun = GunParameters(drive_off=shots.drive_off)
    arrays = near_guns(np.random.default_rng(seed), count)

    def found() -> list[Outputs]:
        few = simulate_batch(gun, fidelity=fidelity, friction_N=[one.friction_N for one in shots.guns])
        return list(zip(*(getattr(few, name).tolist() for name in OUTPUTS), strict=True))

    return Ready(
        run=lambda: simulate_batch(gun, fidelity=fidelity, cores=used, **arrays), shots=count / used, found=found
    )


def near_guns(rng: np.random.Generator, count: int) -> dict[str, Any]:
    """Random guns within the bounds for which the reduced models state their errors."""
    plain = GunParameters()
    varied = [field.name for field in fields(GunParameters) if field.name not in _FIXED]
    numbers = {name: getattr(plain, name) * rng.uniform(1.0 - NEAR, 1.0 + NEAR, count) for name in varied}
    return numbers | {"friction_N": rng.uniform(*FRICTION_N, count)}


def _outputs(shot: ShotSummary) -> Outputs:
    return tuple(getattr(shot, name) for name in OUTPUTS)
