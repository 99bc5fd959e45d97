"""The sweep, and a closer look around the design that it finds best."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

from analysis.predict.design_search.assumed import LEAKS
from analysis.predict.design_search.choice import Designs, best, designs_of, joined
from analysis.predict.design_search.shots import Layer, layers, rows_of, simulate_rows
from analysis.predict.design_search.space import Space
from analysis.predict.fit.percept_model import PerceptFit
from analysis.predict.jobs import Run, on_processes
from analysis.report.terminal import Progress

PASSES = 3
"""Closer looks, each around the best of the one before and at half its distances."""

Workers = Callable[[], AbstractContextManager[Run]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Search:
    """All designs that were looked at, the place of the best one (None: none may be proposed), and whole layers.

    `layers` has the swept pulses, the gun's own and that of the best design.
    """

    designs: Designs
    chosen: int | None
    layers: dict[float, Layer]


def search(space: Space, fit: PerceptFit, rate_Hz: float, workers: Workers, progress: Progress) -> Search:
    """Sweep the space, then look closer around the best design that shoots at `rate_Hz` or faster."""
    by_pulse = _swept(space, workers, progress)
    designs = designs_of(space, by_pulse, fit, rate_Hz)
    chosen = best(designs, rate_Hz)
    if chosen is None:
        return Search(designs=designs, chosen=None, layers=by_pulse)
    for number in range(PASSES):
        around = closer(space, designs, chosen, 0.5**number)
        found = _simulated(around, around.pulse_s, _here, progress, f"closer look {number + 1}")
        designs = joined(designs, designs_of(around, found, fit, rate_Hz))
        chosen = best(designs, rate_Hz) or chosen
    pulse_s = float(designs.pulse_s[chosen])
    if pulse_s not in by_pulse:
        by_pulse |= _simulated(space, (pulse_s,), workers, progress, "map")
    return Search(designs=designs, chosen=chosen, layers=by_pulse)


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


def _here() -> AbstractContextManager[Run]:
    """For work that is too little for processes of its own."""
    return on_processes(1)


def _swept(space: Space, workers: Workers, progress: Progress) -> dict[float, Layer]:
    rows = rows_of(space, space.pulses_s, LEAKS)
    with workers() as run, progress("sweep", len(rows)) as tell:
        return layers(space, rows, simulate_rows(rows, run, tell))


def _simulated(
    space: Space, pulses_s: tuple[float, ...], workers: Workers, progress: Progress, name: str
) -> dict[float, Layer]:
    rows = rows_of(space, pulses_s, LEAKS[:1])
    with workers() as run, progress(name, len(rows)) as tell:
        return layers(space, rows, simulate_rows(rows, run, tell))
