"""Error against time of the gun's models on this machine, and what each use of them asks for."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from analysis.predict.bench.figure import Demand, TradeCurve, TradePanel
from analysis.predict.bench.measured import BenchRequest, Bought, Measured
from analysis.report import apa
from analysis.report.section import Section, Table
from device.methods import FRICTION_I_N, FRICTION_II_N
from device.parameters import DriveOff, GunParameters
from device.physics import FIDELITIES, simulate, simulate_batch
from device.physics.batch import no_compiler
from device.physics.scenes import OUTPUTS, SCENES, Scene, choose_model, stated_error

OFF_STATES: tuple[DriveOff, ...] = ("open", "shorted")
SINGLE_SHOTS = 200
"""Of the paper's gun, one after the other, make one measured stretch."""
_GAIN = 0.5
"""So many digits more make a model better than another."""
_EXACT = 1e-12
"""What the full model is within, of fifty digits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelTime:
    """What a model costs in accuracy and in time. `batch_us` is `None` without the compiler (extra `fast`).

    `error` is the largest relative one over all outputs and the paper's two guns, against the full model; `least` that
    of the best output; `stated` is what the model promises near the paper's gun.
    """

    drive_off: DriveOff
    fidelity: str
    error: float
    least: float
    stated: float
    single_us: float
    batch_us: float | None

    @property
    def digits(self) -> float:
        """How many digits are right in every output, at most those of the full model."""
        return -math.log10(max(self.error, _EXACT))

    @property
    def times_us(self) -> dict[str, float]:
        """What a shot takes, by how it is asked for."""
        batch = {} if self.batch_us is None else {"in a batch": self.batch_us}
        return {"one at a time": self.single_us} | batch


def physics(request: BenchRequest) -> Measured:
    """Each model with the coil open and shorted after the pulse, one shot at a time and in a batch on one core."""
    cases = [(drive_off, fidelity) for drive_off in OFF_STATES for fidelity in FIDELITIES]
    rows = []
    with request.progress("bench physics", len(cases)) as tell:
        for drive_off, fidelity in cases:
            rows.append(_measured(drive_off, fidelity, request))
            tell(f"{drive_off} {fidelity}")
    return Measured(
        rows=rows, section=_model_section(rows, request), bought=tuple(_digits_bought(rows)), panel=_model_panel(rows)
    )


def _measured(drive_off: DriveOff, fidelity: str, request: BenchRequest) -> ModelTime:
    guns = [GunParameters(friction_N=friction, drive_off=drive_off) for friction in (FRICTION_I_N, FRICTION_II_N)]

    def single() -> None:
        for _ in range(SINGLE_SHOTS // 2):
            for gun in guns:
                simulate(gun, fidelity)

    def batch() -> None:
        simulate_batch(guns[0], fidelity=fidelity, cores=1, friction_N=[guns[0].friction_N] * request.batch)

    errors = list(_largest_errors(guns, fidelity))
    return ModelTime(
        drive_off=drive_off,
        fidelity=fidelity,
        error=max(errors),
        least=min(errors),
        stated=max(stated_error(fidelity, output, drive_off, "printed") for output in OUTPUTS),
        single_us=_median_us(single, SINGLE_SHOTS, request.repeats),
        batch_us=_median_us(batch, request.batch, request.repeats) if not no_compiler() else None,
    )


def _largest_errors(guns: list[GunParameters], fidelity: str) -> Iterator[float]:
    """Of each output, the largest relative error over the guns."""
    shots = [(simulate(gun), simulate(gun, fidelity)) for gun in guns]
    for name in OUTPUTS:
        yield max(abs(getattr(found, name) / getattr(full, name) - 1.0) for full, found in shots)


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
    serving = Table(
        caption="The model that each use can bear and that is cheapest one shot at a time; another may be in a batch",
        header=("Use", "Bears", "Needs", *(f"Coil {drive_off}" for drive_off in OFF_STATES)),
        rows=tuple(_scene_cells(scene, rows) for scene in SCENES.values()),
    )
    text = (
        "The error is the largest relative one over all outputs and both of the paper's guns, against the full model, "
        "which itself is within 1e-12 of 50 digits. Sessions use the full model; sweeps that bear it may use another."
    )
    return Section(title="Error against time of a simulated shot", paragraphs=(text,), tables=(serving, table))


def _model_cells(row: ModelTime) -> tuple[str, ...]:
    batch = apa.NO_NUMBER if row.batch_us is None else _three_digits(row.batch_us)
    return (row.drive_off, row.fidelity, f"{row.error:.1e}", f"{row.stated:.2g}", _three_digits(row.single_us), batch)


def _scene_cells(scene: Scene, rows: Sequence[ModelTime]) -> tuple[str, ...]:
    served = [_served(scene, drive_off, rows) for drive_off in OFF_STATES]
    return (scene.name, _borne(scene), "the course over time" if scene.curves else ", ".join(scene.needs), *served)


def _served(scene: Scene, drive_off: DriveOff, rows: Sequence[ModelTime]) -> str:
    chosen = choose_model(scene, GunParameters(drive_off=drive_off)).fidelity
    row = next(row for row in rows if (row.drive_off, row.fidelity) == (drive_off, chosen))
    return f"{chosen}: " + ", ".join(f"{_us(time_us)} {how}" for how, time_us in row.times_us.items())


def _borne(scene: Scene) -> str:
    return f"{100.0 * min(scene.needs.values()):g} %"


def _model_panel(rows: Sequence[ModelTime]) -> TradePanel:
    """A line from a shot in a batch to a shot alone, one a model and coil; down to the error of the best output."""
    return TradePanel(
        title="a shot's model (filled: coil open, empty: shorted)",
        x_label="time a shot [µs]: left in a batch, right one at a time",
        y_label="relative error, largest of the outputs",
        curves=[
            TradeCurve(
                name=row.fidelity if row.drive_off == OFF_STATES[0] else "",
                place=FIDELITIES.index(row.fidelity),
                x=sorted(row.times_us.values()),
                y=[max(row.error, _EXACT)] * len(row.times_us),
                filled=row.drive_off == OFF_STATES[0],
                down_to=max(row.least, _EXACT),
            )
            for row in rows
        ],
        demands=[
            Demand(name=f"{one.name} bears {_borne(one)}", height=min(one.needs.values())) for one in SCENES.values()
        ],
        scales=("log", "log"),
    )


def _digits_bought(rows: Sequence[ModelTime]) -> Iterator[Bought]:
    """From each model that is right to a digit, and that no faster one equals, to the next."""
    for drive_off in OFF_STATES:
        own = [row for row in rows if row.drive_off == drive_off and row.digits > 0.0]
        for how in own[0].times_us:
            for less, more in pairwise(_front(own, how)):
                gained, longer_us = more.digits - less.digits, more.times_us[how] - less.times_us[how]
                yield Bought(
                    more="digit of a shot",
                    where=f"coil {drive_off}, {how}: {more.fidelity}, not {less.fidelity}",
                    costs=f"{_us(longer_us / gained)} a digit",
                    buys=f"{gained:.1f} digits for {_us(longer_us)}: an error of {max(more.error, _EXACT):.1g}, "
                    f"not {less.error:.1g}",
                )


def _front(rows: Sequence[ModelTime], how: str) -> Iterator[ModelTime]:
    least = 0.0
    for row in sorted(rows, key=lambda row: row.times_us[how]):
        if row.digits > least:
            least = row.digits + _GAIN
            yield row


def _us(time_us: float) -> str:
    return f"{_three_digits(time_us)} us"  # not µs: a terminal may have ASCII alone


def _three_digits(number: float) -> str:
    """Three digits, without a power of ten.

    >>> _three_digits(3373.2), _three_digits(0.16923)
    ('3,370', '0.169')
    """
    return f"{float(f'{number:.3g}'):,g}"
