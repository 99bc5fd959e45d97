"""Simulated power over a design's size, and false positives of null participants, with their Monte Carlo intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from analysis.paper.recurrence import ShareOfStudies
from analysis.predict.power.results import DesignPower
from analysis.report.figures.style import (
    bounded,
    drawn,
    have_room,
    legend_below,
    light_grid,
    method_colour,
    method_look,
    method_marker,
    reference_line,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """Shares of studies with their intervals, each over its place on the x axis."""

    name: str
    points: Sequence[tuple[float, ShareOfStudies]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """Curves that share their axes."""

    title: str
    curves: Sequence[Curve]


def figure_power(rows: Sequence[Sequence[Panel]], x_label: str, target: float, path_stem: Path) -> None:
    """Rows of panels, share over `x_label`, bands of 95 %; PNG, SVG and PDF are written."""
    columns = max(map(len, rows))
    with drawn(path_stem, max(3.1 * columns, 4.2), 2.7 * len(rows) + 0.6) as figure:
        grid = figure.subplots(len(rows), columns, squeeze=False, sharex=True, sharey=True)
        for place, row in enumerate(rows):
            for axes, panel in zip(grid[place], row, strict=True):
                _draw_curves(axes, panel, target)
                axes.set_xlabel(x_label if place == len(rows) - 1 else "")
            grid[place][0].set_ylabel("share of studies [%]")
        legend_below(figure, grid[0][0], 3)


def figure_false_positives(panels: Sequence[tuple[str, Sequence[DesignPower]]], level: float, path_stem: Path) -> None:
    """A row of panels (title, designs that differ in their null participants), the nominal level as a line.

    Each claim's share is a point with its interval.
    """
    claims = [share.claim for share in panels[0][1][0].claims]
    with drawn(path_stem, 2.6 + 2.3 * len(panels), 1.3 + 0.27 * len(claims)) as figure:
        grid = figure.subplots(1, len(panels), squeeze=False, sharex=True, sharey=True)[0]
        grid[0].set_xlim(
            0.0, 105.0 * max(share.ci_high for _, designs in panels for one in designs for share in one.claims)
        )
        for axes, (title, designs) in zip(grid, panels, strict=True):
            _draw_rates(axes, claims, designs, level)
            axes.set_title(title, loc="left")
            axes.set_xlabel("false positives [%]")
        grid[0].set_yticks(range(len(claims)), claims)
        grid[0].invert_yaxis()
        legend_below(figure, grid[0], 3)


def _draw_curves(axes: Axes, panel: Panel, target: float) -> None:
    light_grid(axes)
    reference_line(axes, 100.0 * target, f"{100.0 * target:g} %")
    for i, curve in enumerate(panel.curves):
        x, shares = zip(*curve.points, strict=True)
        share, low, high = zip(*(_percents(one) for one in shares), strict=True)
        colour = method_colour(i)
        axes.fill_between(x, low, high, color=colour, alpha=0.2, linewidth=0.0)
        axes.plot(x, share, **method_look(i), markersize=3.5, linewidth=1.3, label=curve.name)
        if len(x) == 1:
            axes.vlines(x, low, high, color=colour, linewidth=1.3)
    axes.set_ylim(-2.0, 103.0)
    axes.set_yticks(range(0, 101, 20))
    sizes = sorted({x for curve in panel.curves for x, _ in curve.points})
    if have_room(sizes):
        axes.set_xticks(sizes)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(nbins=6, integer=True))
    bounded(axes, 100.0)
    axes.set_title(panel.title, loc="left")


def _draw_rates(axes: Axes, claims: Sequence[str], designs: Sequence[DesignPower], level: float) -> None:
    axes.grid(visible=True, axis="x", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.axvline(100.0 * level, color="#666666", linewidth=0.9, linestyle=(0, (4, 3)), zorder=1.5)
    for i, design in enumerate(designs):
        shift = 0.22 * (i - (len(designs) - 1) / 2.0)
        heights = [claims.index(one.claim) + shift for one in design.claims]
        share = [100.0 * one.share for one in design.claims]
        below = [100.0 * (one.share - one.ci_low) for one in design.claims]
        above = [100.0 * (one.ci_high - one.share) for one in design.claims]
        axes.errorbar(
            share,
            heights,
            xerr=[below, above],
            fmt=method_marker(i),
            color=method_colour(i),
            markersize=4.0,
            linewidth=1.3,
            label=design.people,
        )


def _percents(one: ShareOfStudies) -> tuple[float, float, float]:
    return 100.0 * one.share, 100.0 * one.ci_low, 100.0 * one.ci_high
