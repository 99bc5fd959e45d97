"""Fitted models: a predicted rate over friction, published numbers among simulated ones, times against their fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.axes import Axes

from analysis.report.figures.style import (
    BLACK,
    drawn,
    drawn_name,
    legend_below,
    light_grid,
    method_colour,
    method_line,
    names_at,
    reference_line,
)

_Numbers = Sequence[float]


@dataclass(frozen=True, slots=True, kw_only=True)
class RatePoint:
    """An observed rate with its interval, shares of 1; `friction_N` None for what has no friction."""

    name: str
    friction_N: float | None
    rate: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RateCurve:
    """A predicted rate over friction; `low` and `high` empty without a band."""

    name: str
    friction_N: _Numbers
    rate: _Numbers
    low: _Numbers = ()
    high: _Numbers = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedSpread:
    """Simulated values of a quantity as histograms (edges, counts) a case, and the published numbers."""

    title: str
    x_label: str
    cases: Mapping[str, tuple[_Numbers, _Numbers]]
    published: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class TimesPanel:
    """The times of a method under an instruction, and shares right and wrong by the times of `grid_s` by two fits.

    `together`: the fit of all trials; `each`: the mean over people's own fits; empty lists where there is none.
    """

    method: str
    instruction: str
    trials: int
    right_s: _Numbers
    wrong_s: _Numbers
    grid_s: _Numbers
    together: tuple[_Numbers, _Numbers]
    each: tuple[_Numbers, _Numbers]


def figure_percept(curves: Sequence[RateCurve], points: Sequence[RatePoint], path_stem: Path) -> None:
    """Predicted forward rate over friction (bands 95 %) with the observed rates; PNG, SVG and PDF are written."""
    with drawn(path_stem, 6.6, 4.3) as figure:
        left, right = figure.subplots(1, 2, width_ratios=[0.16, 1.0], sharey=True)
        apart = [point for point in points if point.friction_N is None]
        for place, point in enumerate(apart):
            _draw_point(left, float(place), point, "o")
        left.set_xlim(-0.6, max(len(apart), 1) - 0.4)
        names_at(left, range(len(apart)), [point.name for point in apart])
        left.set_ylabel("answered “forward” to a forward shot [%]")
        for i, curve in enumerate(curves):
            _draw_curve(right, i, curve)
        for point in points:
            if point.friction_N is not None:
                _draw_point(right, point.friction_N, point, "s")
        right.set_xlabel("friction of the damper [N]")
        lowest = min([0.4, *(point.low - 0.03 for point in points), *(min(curve.rate) - 0.03 for curve in curves)])
        for axes in (left, right):
            light_grid(axes)
            axes.set_ylim(100.0 * max(lowest, -0.02), 101.0)
        reference_line(right, 50.0, "chance")
        legend_below(figure, right, 3)


def figure_places(spreads: Sequence[SimulatedSpread], path_stem: Path) -> None:
    """A panel a quantity: the simulated distributions, a line a case, and where the published numbers stand."""
    with drawn(path_stem, 0.6 + 3.6 * len(spreads), 3.3) as figure:
        row = figure.subplots(1, len(spreads), squeeze=False)[0]
        for axes, spread in zip(row, spreads, strict=True):
            _draw_spread(axes, spread)
        legend_below(figure, row[0], 2)


def figure_times(rows: Sequence[Sequence[TimesPanel]], path_stem: Path) -> None:
    """A row an instruction, a panel a method: right and wrong answers by time; PNG, SVG and PDF are written."""
    with drawn(path_stem, 0.8 + 2.6 * len(rows[0]), 0.7 + 2.3 * len(rows)) as figure:
        grid = figure.subplots(len(rows), len(rows[0]), squeeze=False, sharex="row", sharey=True)
        for place, row in enumerate(rows):
            for axes, panel in zip(grid[place], row, strict=True):
                _draw_times(axes, panel)
                axes.set_xlabel("response time [s]" if place == len(rows) - 1 else "")
            grid[place][0].set_ylabel("share of the trials [%]")
        legend_below(figure, grid[0][0], 3)


def _draw_times(axes: Axes, panel: TimesPanel) -> None:
    light_grid(axes)
    observed = panel.right_s, panel.wrong_s
    for i, (kind, marker) in enumerate((("right", "o"), ("wrong", "^"))):
        colour = method_colour(i)
        lines = (panel.together, "--", "one fit of all"), (panel.each, "-", "mean of people's own fits")
        for fits, line, name in lines:
            if fits[i]:
                share = [100.0 * value for value in fits[i]]
                axes.plot(panel.grid_s, share, color=colour, linestyle=line, linewidth=1.3, label=f"{kind}, {name}")
        times, shares = _thinned(observed[i], panel.trials)
        axes.plot(times, shares, marker, color=colour, markersize=3.5, mfc="white", label=f"{kind}, observed")
    told = "" if panel.instruction == "neutral" else f", {panel.instruction}"
    axes.set_title(f"{drawn_name(panel.method)}{told}", loc="left", fontsize=9.0)
    if len(panel.grid_s):
        axes.set_xlim(0.0, 1.02 * panel.grid_s[-1])  # a mark at the end is whole
    axes.set_ylim(0.0, 102.0)


def _thinned(times_s: _Numbers, trials: int) -> tuple[list[float], list[float]]:
    """At most 20 of the rising times, with the share of all trials answered by then, in percent."""
    step = max(1, len(times_s) // 20)
    places = range(step - 1, len(times_s), step)
    return [times_s[i] for i in places], [100.0 * (i + 1) / trials for i in places]


def _draw_point(axes: Axes, x: float, point: RatePoint, marker: str) -> None:
    rate, low, high = (100.0 * value for value in (point.rate, point.low, point.high))
    axes.errorbar(
        [x],
        [rate],
        yerr=[[rate - low], [high - rate]],
        fmt=marker,
        color=BLACK,
        markersize=5.0,
        capsize=3.0,
        linewidth=1.2,
        zorder=3.0,
    )
    if point.friction_N is not None:
        name = drawn_name(point.name)
        axes.annotate(
            name, (x, rate), xytext=(7.0, -11.0), textcoords="offset points", fontsize=7.5, color="#333333", zorder=3.0
        )


def _draw_curve(axes: Axes, i: int, curve: RateCurve) -> None:
    rate = [100.0 * value for value in curve.rate]
    if curve.low:
        band = [100.0 * value for value in curve.low], [100.0 * value for value in curve.high]
        axes.fill_between(curve.friction_N, *band, color=method_colour(i), alpha=0.2, linewidth=0.0)
        axes.plot(curve.friction_N, rate, color=method_colour(i), linewidth=1.8, label=curve.name)
        return
    line = method_line(i)
    axes.plot(curve.friction_N, rate, color=method_colour(i), linestyle=line, linewidth=1.1, label=curve.name)


def _draw_spread(axes: Axes, spread: SimulatedSpread) -> None:
    light_grid(axes)
    for i, (name, (edges, counts)) in enumerate(spread.cases.items()):
        share = _densities(edges, counts)
        axes.stairs(share, edges, color=method_colour(i), linestyle=method_line(i), linewidth=1.3, label=name)
    top = axes.get_ylim()[1]
    for text, value in spread.published.items():
        axes.axvline(value, color=BLACK, linewidth=1.2)
        axes.annotate(text, (value, top), xytext=(3.0, -9.0), textcoords="offset points", fontsize=7.5, color="#333333")
    axes.set_xlabel(spread.x_label)
    axes.set_ylabel("density of the studies")
    axes.set_yticks([])
    axes.set_title(spread.title, loc="left")


def _densities(edges: _Numbers, counts: _Numbers) -> list[float]:
    total = float(sum(counts)) or 1.0
    return [count / total / (edges[i + 1] - edges[i]) for i, count in enumerate(counts)]
