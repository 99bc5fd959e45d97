"""Correct rates on forward and backward shots, and what signal detection makes of them: d′ and criterion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from analysis.report.figures.crowd import MANY, draw_histogram, draw_mean, draw_points, places
from analysis.report.figures.style import (
    BLACK,
    DIRECTION_MARKERS,
    bounded,
    light_grid,
    method_colour,
    new_figure,
    reference_line,
    save,
    style,
    wrapped,
)
from analysis.stats.arrays import FloatArray
from analysis.stats.detection import yes_no
from analysis.summary.results import DirectionStatistics, Scores

_SIDES = {"forward": -1, "backward": 1}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Measure:
    key: Literal["d_prime", "criterion"]
    title: str
    label: str
    zero: str


_MEASURES = (
    _Measure(key="d_prime", title="Sensitivity", label="d′", zero="chance"),
    _Measure(key="criterion", title="Criterion", label="c (below 0: leans towards “forward”)", zero="no bias"),
)


def figure_directions(found: DirectionStatistics, path_stem: Path) -> tuple[Path, Path, Path]:
    """Correct rate by method and direction (mean, SD, everybody), d′ and criterion; PNG, SVG and PDF are written.

    `found` has at least one participant. Where a direction was never presented d′
    and criterion are undefined: without any of them their panels are left out.
    """
    measures = _MEASURES if any(found.sensitivity.values()) else ()
    with mpl.rc_context(style()):  # type: ignore[arg-type]
        figure = new_figure(max(8.0, 0.8 + 2.2 * len(found.methods)), 7.6 if measures else 4.2)
        rows = figure.add_gridspec(2 if measures else 1, 2)
        _draw_rates(figure.add_subplot(rows[0, :]), found)
        for i, measure in enumerate(measures):
            _draw_measure(figure.add_subplot(rows[1, i]), found, measure, chr(ord("b") + i))
        _explain(figure, found)
        return save(figure, path_stem)


def _draw_rates(axes: Axes, found: DirectionStatistics) -> None:
    methods = found.methods
    _frame(axes, methods, "(a) Correct rate", "correct rate [%]")
    reference_line(axes, 50.0, "chance")
    for i, method in enumerate(methods):
        _draw_pair(axes, found, method, i)
    axes.set_ylim(-4.0, 106.0)
    axes.set_yticks(range(0, 101, 20))
    bounded(axes, 0.0, 100.0)


def _draw_pair(axes: Axes, found: DirectionStatistics, method: str, i: int) -> None:
    """Forward left, backward right, the mean of each on its outer side."""
    parts: dict[str, DirectionStatistics | Scores] = {"forward": found, "backward": found.backward}
    codes = found.participants.codes
    columns = [100.0 * part.participants.column(method, codes) for part in parts.values()]
    colour = method_colour(i)
    if len(codes) <= MANY:
        centres = [i + 0.13 * side for side in _SIDES.values()]
        draw_points(
            axes, centres, np.stack(columns, axis=1), places(len(codes), 0.06), list(DIRECTION_MARKERS.values())
        )
    for (direction, part), values in zip(parts.items(), columns, strict=True):
        side = _SIDES[direction]
        if len(codes) > MANY:
            draw_histogram(axes, i, values, bin_width=10.0, half_width=0.24, colour=colour, side=side)
        mean, sd = part.means.get(method, math.nan), part.sds.get(method, math.nan)
        draw_mean(
            axes,
            i + 0.31 * side,
            100.0 * mean,
            100.0 * sd,
            colour=colour if direction == "forward" else "white",
            marker=DIRECTION_MARKERS[direction],
        )


def _draw_measure(axes: Axes, found: DirectionStatistics, measure: _Measure, letter: str) -> None:
    methods = found.methods
    _frame(axes, methods, f"({letter}) {measure.title}", measure.label)
    reference_line(axes, 0.0, measure.zero)
    limit = _largest_d_prime(found) if measure.key == "d_prime" else None
    if limit is not None:
        reference_line(axes, limit, "largest\npossible")
    values = _measured(found, measure.key)
    if len(values) <= MANY:
        draw_points(axes, range(len(methods)), values, places(len(values), 0.26, 0.08), ["o"] * len(methods))
    for i, method in enumerate(methods):
        colour, one = method_colour(i), found.sensitivity[method]
        if len(values) > MANY:
            draw_histogram(axes, i, values[:, i], bin_width=0.25, half_width=0.36, colour=colour)
        if one is not None:
            mean = one.d_prime if measure.key == "d_prime" else one.criterion
            draw_mean(axes, i, mean.mean, mean.sd, colour=colour)
    low, high = _extent(axes, values, limit)
    axes.set_ylim(low, high)


def _measured(found: DirectionStatistics, key: str) -> FloatArray:
    """Everybody's measure with each method (participants, methods); NaN where it is undefined."""
    codes = found.participants.codes
    of = [found.sensitivity[method] for method in found.methods]
    nobody = np.full(len(codes), np.nan)
    return np.stack([nobody if one is None else one.participants.column(key, codes) for one in of], axis=1)


def _extent(axes: Axes, values: FloatArray, limit: float | None) -> tuple[float, float]:
    """At least -1 to 1, and a little more than whiskers, people and limit need."""
    known = [*values[np.isfinite(values)], *axes.dataLim.intervaly, -1.0, 1.0, limit or 0.0]
    low, high = float(min(known)), float(max(known))
    room = 0.04 * (high - low)
    return low - room, high + room


def _largest_d_prime(found: DirectionStatistics) -> float | None:
    """d′ of somebody who is always right; None if the numbers of trials differ or are not known."""
    counts = {
        tuple(tests[direction].trials / found.n for direction in _SIDES if direction in tests)
        for tests in found.binomial.values()
    }
    trials = counts.pop() if len(counts) == 1 else ()
    if len(trials) != 2 or not all(count == int(count) for count in trials):
        return None
    return float(yes_no(trials[0], trials[0], 0, trials[1]).d_prime)


def _frame(axes: Axes, methods: Sequence[str], title: str, label: str) -> None:
    light_grid(axes)
    axes.set_xlim(-0.6, len(methods) - 0.4)
    axes.set_xticks(range(len(methods)), [wrapped(method) for method in methods])
    axes.set_title(title, loc="left", fontweight="bold")
    axes.set_ylabel(label)


def _explain(figure: Figure, found: DirectionStatistics) -> None:
    """The legend below: which mark is which direction, and what stands for whom."""
    handles = [
        Line2D([], [], marker=marker, linestyle="", mfc=fill, mec=BLACK, label=f"{direction} shots")
        for (direction, marker), fill in zip(DIRECTION_MARKERS.items(), (BLACK, "white"), strict=True)
    ]
    figure.legend(handles=handles, loc="outside upper right", ncols=2, frameon=False, fontsize=8.5)
    figure.supxlabel(found.people, fontsize=8.0)
