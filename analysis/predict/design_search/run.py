"""`recoil design`: which damper, voltage and pulse would be felt best, and where a direction is felt at all."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.predict.design_search.choice import (
    LEAKS,
    Designs,
    alternatives,
    best_design,
    contour_of,
    designs_of,
    front,
    joined_designs,
    summary_error,
)
from analysis.predict.design_search.page import in_short, sections
from analysis.predict.design_search.results import (
    DesignSearch,
    SweptAxes,
    best_of,
    counted,
    critical_of,
    design_of,
    own_of,
    percept_behind,
    plane_of,
    search_assumptions,
)
from analysis.predict.design_search.space import (
    DesignRequest,
    FrictionRow,
    Layer,
    Space,
    layers,
    make_space,
    rows_of,
    simulate_rows,
)
from analysis.predict.fit.percept_model import PAPER_RATES, PerceptFit, fit_percept
from analysis.predict.jobs import RunPieces, on_processes
from analysis.report import placing
from analysis.report.copies import cores, process_copies
from analysis.report.page import write_page
from analysis.report.serial import as_csv, as_json
from analysis.report.terminal import Progress
from device.limits import TRAIN_LIMITS
from device.methods import Method, paper_methods
from device.parameters import GunParameters
from device.physics.batch import compiler_note, no_compiler
from device.physics.equations import STATUSES
from experiments.record import storage
from experiments.record.provenance import provenance

PASSES = 3
"""Closer looks, each around the best of the one before and at half its distances."""

OpenWorkers = Callable[[], AbstractContextManager[RunPieces]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Searched:
    """All designs that were looked at, the place of the best one (None: none may be proposed), and whole layers.

    `layers` has the swept pulses, the gun's own and that of the best design.
    """

    designs: Designs
    chosen: int | None
    layers: dict[float, Layer]


def search(space: Space, fit: PerceptFit, rate_Hz: float, workers: OpenWorkers, progress: Progress) -> Searched:
    """Sweep the space, then look closer around the best design that shoots at `rate_Hz` or faster."""
    by_pulse = _simulated(space, rows_of(space, space.pulses_s, LEAKS), workers, progress, "sweep")
    designs = designs_of(space, by_pulse, fit, rate_Hz)
    chosen = best_design(designs, rate_Hz)
    if chosen is None:
        return Searched(designs=designs, chosen=None, layers=by_pulse)
    for number in range(PASSES):
        around = closer(space, designs, chosen, 0.5**number)
        rows = rows_of(around, around.pulse_s, LEAKS[:1])
        found = _simulated(around, rows, _here, progress, f"closer look {number + 1}")
        designs = joined_designs(designs, designs_of(around, found, fit, rate_Hz))
        chosen = best_design(designs, rate_Hz) or chosen
    pulse_s = float(designs.pulse_s[chosen])
    if pulse_s not in by_pulse:
        by_pulse |= _simulated(space, rows_of(space, (pulse_s,), LEAKS[:1]), workers, progress, "map")
    return Searched(designs=designs, chosen=chosen, layers=by_pulse)


def closer(space: Space, designs: Designs, place: int, share: float) -> Space:
    """The space around a design: its own values, and those a share of the sweep's step and half of that away."""
    return replace(
        space,
        friction_N=around(space.friction_N, float(designs.friction_N[place]), share),
        voltage_V=around(space.voltage_V, float(designs.voltage_V[place]), share),
        pulse_s=around(space.pulse_s, float(designs.pulse_s[place]), share),
    )


def around(axis: tuple[float, ...], value: float, share: float) -> tuple[float, ...]:
    """A value with those around it that lie within an axis.

    >>> around((0.0, 1.0, 2.0, 3.0), 1.0, 0.5), around((0.0, 1.0), 0.0, 1.0), around((5.0,), 5.0, 1.0)
    ((0.5, 0.75, 1.0, 1.25, 1.5), (0.0, 0.5, 1.0), (5.0,))
    """
    place = min(max(bisect_right(axis, value) - 1, 0), len(axis) - 2)
    step = axis[place + 1] - axis[place] if len(axis) > 1 else 0.0
    near = (value + step * share * n / 2.0 for n in range(-2, 3))
    return tuple(sorted({value, *(x for x in near if axis[0] <= x <= axis[-1])}))


def _here() -> AbstractContextManager[RunPieces]:
    """For work that is too little for processes of its own."""
    return on_processes(1)


def _simulated(
    space: Space, rows: list[FrictionRow], workers: OpenWorkers, progress: Progress, name: str
) -> dict[float, Layer]:
    with workers() as run, progress(name, len(rows)) as tell:
        return layers(space, rows, simulate_rows(rows, run, tell))


__all__ = ["DesignRequest", "design", "in_short", "search_time_s", "waiting_note"]

_RECORD = "design.json"
COLUMNS = (
    *("friction_N", "voltage_V", "pulse_s", "status", "limit", "shooting_rate_Hz"),
    *("evidence", "predicted", "ci_low", "ci_high", "predicted_by_summary"),
)
"""Of `designs.csv`; an empty cell means that there is no prediction, or that no limit is broken."""


def design(request: DesignRequest, workers: int | None, out: Path, progress: Progress) -> DesignSearch:
    """Sweep, choose, write `design.json`, `designs.csv`, report and figures into `out`.

    The same request gives the same bytes however many workers there are. `ConfigError`: a request that cannot be met.
    """
    space = make_space(request)
    with placing.results_in(out, _RECORD) as part:
        fit = fit_percept(PAPER_RATES, readings(space.gun))
        found = search(space, fit, request.rate_above_Hz, lambda: on_processes(workers or cores()), progress)
        with progress("report", 3) as tell:
            result = _results(request, space, fit, found, tell)
            _write(part, result, found.designs)
            tell("written")
    return result


_SHOT_S, _COMPILED_SHOT_S = 0.0028, 0.0001  # of one core, with what is felt of it
_AROUND_S, _COMPILED_AROUND_S = 7.0, 4.0  # fit, contour and report


def search_time_s(request: DesignRequest, workers: int | None) -> float:
    """About how long a search takes."""
    space = make_space(request)
    shots = len(space.friction_N) * len(space.voltage_V) * len(space.pulses_s)
    if no_compiler():
        return _AROUND_S + _SHOT_S * shots / (workers or cores())
    return _COMPILED_AROUND_S + _COMPILED_SHOT_S * shots


def waiting_note() -> str:
    """What to say before a search: how its shots are worked out."""
    return compiler_note("about three milliseconds a shot; compiled it takes a tenth of one", "a minute")


def readings(gun: GunParameters) -> dict[str, Method]:
    """The paper's methods under this gun's reading of what the paper leaves open: the coil after the pulse, the EMF."""
    return paper_methods(replace(GunParameters(), drive_off=gun.drive_off, emf=gun.emf))


def _results(
    request: DesignRequest, space: Space, fit: PerceptFit, found: Searched, tell: Callable[[str], None]
) -> DesignSearch:
    """The content of `design.json`."""
    designs, chosen, rate_Hz, own = found.designs, found.chosen, request.rate_above_Hz, found.layers[space.gun.pulse_s]
    contour = contour_of(space, own, fit, request.seed)
    tell("contour")
    others = tuple(alternatives(readings(space.gun), own, space.voltage_V))
    tell("assumptions")
    map_pulse_s = space.pulse_s[-1] if chosen is None else float(designs.pulse_s[chosen])
    return DesignSearch(
        title=space.title,
        gun=space.source.name,
        parameters=space.gun,
        seed=request.seed,
        rate_above_Hz=rate_Hz,
        axes=SweptAxes(friction_N=space.friction_N, voltage_V=space.voltage_V, pulse_s=space.pulse_s),
        designs=counted(designs, rate_Hz),
        best=None if chosen is None else best_of(space, designs, chosen, rate_Hz, others),
        own=tuple(own_of(space, label, fit, rate_Hz) for label in space.own),
        front=tuple(design_of(designs, place, space.gun, rate_Hz) for place in front(designs)),
        map=plane_of(space, found.layers[map_pulse_s], fit, rate_Hz),
        critical=critical_of(space, own, fit, contour, others),
        percept=percept_behind(fit, summary_error(designs)),
        assumptions=search_assumptions(space, rate_Hz),
        provenance=provenance(),
    )


def _write(out: Path, found: DesignSearch, designs: Designs) -> None:
    storage.write_whole(out / _RECORD, as_json(found))
    storage.write_whole(out / "designs.csv", as_csv(COLUMNS, (_cells(designs, place) for place in range(len(designs)))))
    with process_copies():
        parts = sections(found, designs, out / "figures")
    write_page(out, f"Design search: {found.title}", parts)


def _cells(designs: Designs, place: int) -> Sequence[object]:
    numbers = (designs.shooting_rate_Hz, designs.evidence, designs.predicted, designs.ci_low, designs.ci_high)
    limit = int(designs.limit[place])
    return (
        *(float(axis[place]) for axis in (designs.friction_N, designs.voltage_V, designs.pulse_s)),
        STATUSES[int(designs.status[place])],
        TRAIN_LIMITS[limit] if limit >= 0 else "",
        *("" if np.isnan(array[place]) else float(array[place]) for array in (*numbers, designs.by_summary)),
    )
