"""Every design's shot, simulated: how it ends, when the next one may follow, and what is felt of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from analysis.predict.design_search.space import Space
from analysis.predict.jobs import RunPieces
from analysis.stats.arrays import FloatArray
from device.parameters import GunParameters
from device.physics import ShotSummary, simulate, simulate_batch
from device.physics.equations import COIL, FREE, HOME, STATUSES, pack
from device.physics.traces import segments
from experiments.synthetic.percept import Percept, percept_of_course, percept_of_summary

COIL_POINTS, FREE_POINTS = 8, 32
"""Points of the force in each stretch of a shot, within and outside the coil.

With four times as many the predicted rates change by less than 0.0005 (`tests/test_design_shots.py`).
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionRow:
    """Shots that differ in their voltage alone, and the leaks under which they are felt; their summaries if known."""

    gun: GunParameters
    voltage_V: tuple[float, ...]
    leaks_s: tuple[float, ...]
    summaries: tuple[ShotSummary, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layer:
    """The shots of one pulse, arrays (frictions, voltages). Without a status `home` all but the status is NaN.

    `felt` of each leak and `by_summary` (of the first leak) have a last axis of first, reaction, second.
    """

    pulse_s: float
    status: NDArray[np.int8]
    period_s: FloatArray  # from one shot to the next: the magnet is home and the pulse over
    felt: dict[float, FloatArray]
    by_summary: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotPercepts:
    """One shot. `felt` for each leak in their order; nothing is said of what is felt if the magnet is not home."""

    status: int
    period_s: float = math.nan
    felt: tuple[Percept, ...] = ()
    by_summary: Percept | None = None


def shots(row: FrictionRow) -> list[ShotPercepts]:
    """The shots of a row."""
    guns = [replace(row.gun, voltage_V=voltage_V) for voltage_V in row.voltage_V]
    summaries = row.summaries or [simulate(gun) for gun in guns]
    return [shot_of(gun, summary, row.leaks_s) for gun, summary in zip(guns, summaries, strict=True)]


def shot_of(gun: GunParameters, summary: ShotSummary, leaks_s: Sequence[float]) -> ShotPercepts:
    """One shot from rest and what is felt of it."""
    status = STATUSES.index(summary.status)
    if status != HOME or summary.reset_end_s is None:
        return ShotPercepts(status=status)
    felt = shot_percepts(gun, summary, leaks_s)
    return ShotPercepts(
        status=status,
        period_s=max(summary.reset_end_s, gun.pulse_s),
        felt=felt,
        by_summary=percept_of_summary(summary, gun.magnet_mass_kg, leaks_s[0]),
    )


def shot_percepts(
    gun: GunParameters,
    summary: ShotSummary,
    leaks_s: Sequence[float],
    points: tuple[int, int] = (COIL_POINTS, FREE_POINTS),
) -> tuple[Percept, ...]:
    """The percept of a shot's full course under each leak. No point falls between two stretches: the force jumps."""
    times, forces = _course(gun, *points)
    return tuple(percept_of_course(times, forces, summary, gun.magnet_mass_kg, leak_s) for leak_s in leaks_s)


def _course(gun: GunParameters, coil_points: int, free_points: int) -> tuple[list[float], list[float]]:
    """Times and the force on the hand at both ends of each stretch and evenly in it; 0 from the last rest on."""
    times: list[float] = []
    forces: list[float] = []
    parts = {COIL: coil_points, FREE: free_points}
    for stretch in segments(pack(gun)):
        lasting = stretch.end_s < math.inf
        count = parts.get(stretch.kind, 1) if lasting else 0
        for n in range(count + 1):
            at_s = stretch.start_s + (stretch.end_s - stretch.start_s) * n / count if n else stretch.start_s
            times.append(at_s)
            forces.append(stretch.force(stretch.at(at_s)))
    return times, forces


def rows_of(space: Space, pulses_s: Sequence[float], leaks_s: tuple[float, ...]) -> list[FrictionRow]:
    """The work: a row for each pulse and friction. Only the gun's own pulse is felt under more than the first leak."""
    return [
        FrictionRow(
            gun=replace(space.gun, friction_N=friction_N, pulse_s=pulse_s),
            voltage_V=space.voltage_V,
            leaks_s=leaks_s if pulse_s == space.gun.pulse_s else leaks_s[:1],
        )
        for pulse_s in pulses_s
        for friction_N in space.friction_N
    ]


def summarised(row: FrictionRow) -> FrictionRow:
    """The row with its summaries from compiled code; the row as it is without the compiler (extra `fast`)."""
    if find_spec("numba") is None:
        return row
    return replace(row, summaries=tuple(simulate_batch(row.gun, voltage_V=row.voltage_V).summaries()))


def simulate_rows(rows: Sequence[FrictionRow], run: RunPieces, tell: Callable[[str], None]) -> list[list[ShotPercepts]]:
    """The shots of each row, in their order, wherever they are worked out; `tell` is told of each row's pulse."""
    found: dict[int, list[ShotPercepts]] = {}

    def done(number: int, what: list[ShotPercepts]) -> None:
        found[number] = what
        tell(f"{1e3 * rows[number].gun.pulse_s:.3g} ms, {rows[number].gun.friction_N:.3g} N")

    run(shots, [summarised(row) for row in rows], done)
    return [found[number] for number in range(len(rows))]


def layers(space: Space, rows: Sequence[FrictionRow], found: Sequence[Sequence[ShotPercepts]]) -> dict[float, Layer]:
    """The shots by their pulse."""
    size = len(space.friction_N)
    starts = range(0, len(rows), size)
    return {
        rows[at].gun.pulse_s: _layer(rows[at].gun.pulse_s, rows[at].leaks_s, found[at : at + size]) for at in starts
    }


def _layer(pulse_s: float, leaks_s: Sequence[float], grid: Sequence[Sequence[ShotPercepts]]) -> Layer:
    return Layer(
        pulse_s=pulse_s,
        status=np.array([[shot.status for shot in row] for row in grid], dtype=np.int8),
        period_s=np.array([[shot.period_s for shot in row] for row in grid]),
        felt={
            leak_s: np.array([[_numbers(shot.felt[n] if shot.felt else None) for shot in row] for row in grid])
            for n, leak_s in enumerate(leaks_s)
        },
        by_summary=np.array([[_numbers(shot.by_summary) for shot in row] for row in grid]),
    )


def _numbers(percept: Percept | None) -> tuple[float, float, float]:
    return (math.nan,) * 3 if percept is None else (percept.first, percept.reaction, percept.second)
