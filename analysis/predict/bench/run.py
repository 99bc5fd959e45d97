"""`recoil bench`: trades of our own methods measured on this machine, as JSON and as a page. Parts can be run alone."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from analysis.report import apa
from analysis.report.page import write_page
from analysis.report.section import Section, Table, origin_table
from analysis.report.serial import as_json
from analysis.report.terminal import Progress
from analysis.stats import operating
from device.methods import FRICTION_I_N, FRICTION_II_N
from device.parameters import DriveOff, GunParameters
from device.physics import FIDELITIES, simulate, simulate_batch
from device.physics.scenes import OUTPUTS, stated_error
from experiments.record import storage
from experiments.record.provenance import provenance

OFF_STATES: tuple[DriveOff, ...] = ("open", "shorted")
SINGLE_SHOTS = 200
"""Of the paper's gun, one after the other, make one measured stretch."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchRequest:
    """What to measure with. A batch holds `batch` shots."""

    seed: int
    repeats: int
    batch: int
    progress: Progress


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """What a part found: its rows, the section that tells them, and lines for the terminal."""

    rows: Sequence[ModelTime] | Sequence[operating.Characteristics]
    section: Section
    lines: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """What was measured, by part, with the seed and where the numbers come from."""

    seed: int
    provenance: dict[str, str]
    parts: dict[str, Measured]

    @property
    def content(self) -> Mapping[str, object]:
        """The content of `bench.json`: a key for each part beside those of the whole."""
        rows = {name: part.rows for name, part in self.parts.items()}
        return {"seed": self.seed, "provenance": self.provenance, **rows}


def bench(out: Path, chosen: Sequence[str], request: BenchRequest) -> Bench:
    """Measure the chosen parts (all of `PARTS` if none is named); `out` gets `bench.json` and the report."""
    storage.make_folder(out)
    parts = {name: PARTS[name](request) for name in chosen or PARTS}
    found = Bench(seed=request.seed, provenance=provenance(), parts=parts)
    storage.write_whole(out / "bench.json", as_json(found.content))
    write_page(out, "Measured trades of Recoil", (*(one.section for one in parts.values()), _origin(found)))
    return found


def physics(request: BenchRequest) -> Measured:
    """Each model with the coil open and shorted after the pulse, one shot at a time and in a batch on one core."""
    cases = [(drive_off, fidelity) for drive_off in OFF_STATES for fidelity in FIDELITIES]
    rows = []
    with request.progress("bench physics", len(cases)) as tell:
        for drive_off, fidelity in cases:
            rows.append(_measured(drive_off, fidelity, request))
            tell(f"{drive_off} {fidelity}")
    return Measured(rows=rows, section=_model_section(rows, request), lines=tuple(_lines(rows)))


def _measured(drive_off: DriveOff, fidelity: str, request: BenchRequest) -> ModelTime:
    guns = [GunParameters(friction_N=friction, drive_off=drive_off) for friction in (FRICTION_I_N, FRICTION_II_N)]

    def single() -> None:
        for _ in range(SINGLE_SHOTS // 2):
            for gun in guns:
                simulate(gun, fidelity)

    def batch() -> None:
        simulate_batch(guns[0], fidelity=fidelity, cores=1, friction_N=[guns[0].friction_N] * request.batch)

    return ModelTime(
        drive_off=drive_off,
        fidelity=fidelity,
        error=max(_relative_errors(guns, fidelity)),
        stated=max(stated_error(fidelity, output, drive_off, "printed") for output in OUTPUTS),
        single_us=_median_us(single, SINGLE_SHOTS, request.repeats),
        batch_us=_median_us(batch, request.batch, request.repeats) if find_spec("numba") else None,
    )


def _relative_errors(guns: list[GunParameters], fidelity: str) -> Iterator[float]:
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


def _model_section(rows: list[ModelTime], request: BenchRequest) -> Section:
    table = Table(
        caption=f"Medians of {request.repeats} runs on this machine; a batch holds {request.batch:,} shots on one core",
        header=("Coil", "Model", "Error", "Stated for guns near the paper's", "One at a time [us]", "Batch [us]"),
        rows=tuple(_model_cells(row) for row in rows),
    )
    text = (
        "The error is the largest relative one over all outputs and both of the paper's guns, against the full model, "
        "which itself is within 1e-12 of 50 digits. Sessions use the full model; sweeps that bear it may use another."
    )
    return Section(title="Error against time of a simulated shot", paragraphs=(text,), tables=(table,))


def _model_cells(row: ModelTime) -> tuple[str, ...]:
    batch = apa.NO_NUMBER if row.batch_us is None else f"{row.batch_us:.3g}"
    return (row.drive_off, row.fidelity, f"{row.error:.1e}", f"{row.stated:.2g}", f"{row.single_us:.3g}", batch)


def _lines(rows: list[ModelTime]) -> Iterator[str]:
    for row in rows:
        batch = "" if row.batch_us is None else f", in a batch {row.batch_us:.3g} us"
        what = f"coil {row.drive_off}, {row.fidelity}: error {row.error:.1e}"
        yield f"{what}, one at a time {row.single_us:.3g} us{batch}"


def post_hocs(request: BenchRequest) -> Measured:
    """Error rates and power of the post-hoc tests at three departures from sphericity."""
    with request.progress("bench post-hocs", 1) as tell:
        rows = operating.characteristics(request.seed)
        tell("data sets")
    table = Table(
        caption=(
            f"Shares of {rows[0].data_sets} simulated data sets of {operating.STUDY_SIZE} participants by three "
            f"conditions (standard error at most {max(_errors(rows)):.4f}), at the nominal level {operating.ALPHA}"
        ),
        header=(
            "Post-hoc test",
            "Epsilon",
            "Claimed at most",
            "Any false finding, no difference",
            "Any false finding beside a true difference",
            "Power: any true difference found",
        ),
        rows=tuple(_post_hoc_cells(row) for row in rows),
    )
    section = Section(
        title="Post-hoc tests within participants",
        paragraphs=(
            "The first two conditions have equal means; the third differs by "
            f"{operating.SHIFT:g} standard deviations of a difference, or not at all. Epsilon is Box's, of the "
            "population: 1 is sphericity, 0.5 the least with three conditions. The pooled error claims its level at "
            "sphericity alone; Holm's paired t-tests keep it everywhere; Tukey's test with paired errors stays near "
            "it. Tukey's test between participants, run on such data, gives most of the power away.",
        ),
        tables=(table,),
    )
    return Measured(rows=rows, section=section)


def _errors(rows: tuple[operating.Characteristics, ...]) -> list[float]:
    return [row.monte_carlo_error(share) for row in rows for share in (row.null_error, row.partial_error, row.power)]


def _post_hoc_cells(row: operating.Characteristics) -> tuple[str, ...]:
    claimed = apa.NO_NUMBER if row.claimed is None else apa.number(row.claimed)
    shares = (apa.number(share, 4) for share in (row.null_error, row.partial_error, row.power))
    return (row.post_hoc, apa.number(row.epsilon, 3), claimed, *shares)


def _origin(found: Bench) -> Section:
    return Section(title="Provenance", tables=(origin_table({"seed": found.seed, **found.provenance}),))


def bench_time_s(chosen: Sequence[str], request: BenchRequest) -> float:
    """About how long these parts take, with the compiler's code made before."""
    shots = request.batch * (request.repeats + 1)
    taken = {"post-hocs": 8.0, "physics": 8.0 + 2e-5 * shots}
    return sum(taken[name] for name in chosen)


PARTS: dict[str, Callable[[BenchRequest], Measured]] = {"post-hocs": post_hocs, "physics": physics}
