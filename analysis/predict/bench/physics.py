"""Error and time of a simulated shot by each of our models, on this machine: what is gained and what is given up."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from analysis.report import apa
from analysis.report.section import Section, Table
from device.methods import FRICTION_I_N, FRICTION_II_N
from device.parameters import DriveOff, GunParameters
from device.physics import FIDELITIES, simulate, simulate_batch
from device.physics.scenes import OUTPUTS, stated_error

Progress = Callable[[str, int], AbstractContextManager[Callable[[str], None]]]
"""Given what is done and in how many parts, takes the name of each part that is done."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchRequest:
    """What to measure with. `figures` is the folder of the page's pictures; a batch holds `batch` shots."""

    seed: int
    repeats: int
    batch: int
    figures: Path
    progress: Progress


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """What a part found: plain JSON values, the section that tells it, and lines for the terminal."""

    values: Any
    section: Section
    lines: tuple[str, ...] = ()


OFF_STATES: tuple[DriveOff, ...] = ("open", "shorted")
SINGLE_SHOTS = 200
"""Of the paper's gun, one after the other, make one measured stretch."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelTime:
    """What a model costs in accuracy and in time. `batch_us` is `None` without the compiler (extra `fast`).

    `error` is the largest relative one over all outputs and the paper's two guns, against the full model; `stated` is
    what the model promises near the paper's gun.
    """

    drive_off: DriveOff
    fidelity: str
    error: float
    stated: float
    single_us: float
    batch_us: float | None


def physics(asked: BenchRequest) -> Measured:
    """Each model with the coil open and shorted after the pulse, one shot at a time and in a batch on one core."""
    cases = [(drive_off, fidelity) for drive_off in OFF_STATES for fidelity in FIDELITIES]
    with asked.progress("bench physics", len(cases)) as tell:
        rows = [row for case in cases if (row := _measured(*case, asked)) and not tell(" ".join(case))]
    return Measured(values=[asdict(row) for row in rows], section=_section(rows, asked), lines=tuple(_lines(rows)))


def _measured(drive_off: DriveOff, fidelity: str, asked: BenchRequest) -> ModelTime:
    guns = [GunParameters(friction_N=friction, drive_off=drive_off) for friction in (FRICTION_I_N, FRICTION_II_N)]

    def single() -> None:
        for _ in range(SINGLE_SHOTS // 2):
            for gun in guns:
                simulate(gun, fidelity)

    def batch() -> None:
        simulate_batch(guns[0], fidelity=fidelity, cores=1, friction_N=[guns[0].friction_N] * asked.batch)

    return ModelTime(
        drive_off=drive_off,
        fidelity=fidelity,
        error=max(_errors(guns, fidelity)),
        stated=max(stated_error(fidelity, output, drive_off, "printed") for output in OUTPUTS),
        single_us=_median_us(single, SINGLE_SHOTS, asked.repeats),
        batch_us=_median_us(batch, asked.batch, asked.repeats) if find_spec("numba") else None,
    )


def _errors(guns: list[GunParameters], fidelity: str) -> Iterator[float]:
    for gun in guns:
        full, found = simulate(gun), simulate(gun, fidelity)
        yield from (abs(getattr(found, name) / getattr(full, name) - 1.0) for name in OUTPUTS)


def _median_us(run: Callable[[], None], shots: int, repeats: int) -> float:
    """Microseconds a shot, after a first run that compiles and loads."""
    run()
    taken_s = []
    for _ in range(repeats):
        start_s = time.perf_counter()
        run()
        taken_s.append(time.perf_counter() - start_s)
    return 1e6 * statistics.median(taken_s) / shots


def _section(rows: list[ModelTime], asked: BenchRequest) -> Section:
    table = Table(
        caption=f"Medians of {asked.repeats} runs on this machine; a batch holds {asked.batch:,} shots on one core",
        header=("Coil", "Model", "Error", "Stated for guns near the paper's", "One at a time [us]", "Batch [us]"),
        rows=tuple(_cells(row) for row in rows),
    )
    text = (
        "The error is the largest relative one over all outputs and both of the paper's guns, against the full model, "
        "which itself is within 1e-12 of 50 digits. Sessions use the full model; sweeps that bear it may use another."
    )
    return Section(title="Error against time of a simulated shot", paragraphs=(text,), tables=(table,))


def _cells(row: ModelTime) -> tuple[str, ...]:
    batch = apa.NONE if row.batch_us is None else f"{row.batch_us:.3g}"
    return (row.drive_off, row.fidelity, f"{row.error:.1e}", f"{row.stated:.2g}", f"{row.single_us:.3g}", batch)


def _lines(rows: list[ModelTime]) -> Iterator[str]:
    for row in rows:
        batch = "" if row.batch_us is None else f", in a batch {row.batch_us:.3g} us"
        what = f"coil {row.drive_off}, {row.fidelity}: error {row.error:.1e}"
        yield f"{what}, one at a time {row.single_us:.3g} us{batch}"
