"""The figure of trades: over what it costs stands what is bought, a panel a part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter, NullLocator

from analysis.report.figures.style import INK, drawn, legend_columns, light_grid, method_line, method_look

_ACROSS, _PANEL_IN = 2, 4.4
_TURNED = 2
"""The first line of a demand is dotted, so that it is none of the first curves'."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TradeCurve:
    """What is bought (y) over what it costs (x). `place` gives colour, line and mark.

    Without a name it stands in no legend. `down_to`: a thin line goes down to there, to the least of what is told.
    """

    name: str
    place: int
    x: Sequence[float]
    y: Sequence[float]
    filled: bool = True
    down_to: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Demand:
    """A height that a use asks for."""

    name: str
    height: float


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedPoint:
    """A point of a curve that has a name."""

    name: str
    x: float
    y: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TradePanel:
    """Curves on their axes; `ticks` of the x axis where they are numbers of something."""

    title: str
    x_label: str
    y_label: str
    curves: Sequence[TradeCurve]
    scales: tuple[Literal["linear", "log"], Literal["linear", "log"]]
    demands: Sequence[Demand] = ()
    points: Sequence[NamedPoint] = ()
    ticks: Sequence[float] = ()


def figure_of_trades(panels: Sequence[TradePanel], path_stem: Path) -> None:
    """The panels, two beside each other, each with its legend below; PNG, SVG and PDF are written."""
    across = min(_ACROSS, len(panels))
    rows = -(-len(panels) // across)
    with drawn(path_stem, _PANEL_IN * across, 4.1 * rows) as figure:
        grid = figure.subplots(rows, across, squeeze=False).ravel()
        for spare in grid[len(panels) :]:
            spare.set_visible(False)
        for letter, axes, panel in zip("abcdefgh", grid, panels, strict=False):
            _draw(axes, panel)
            axes.set_title(f"({letter}) {panel.title}", loc="left")


def _draw(axes: Axes, panel: TradePanel) -> None:
    light_grid(axes)
    axes.set_xscale(panel.scales[0])
    axes.set_yscale(panel.scales[1])
    for curve in panel.curves:
        _draw_curve(axes, curve)
    for place, demand in enumerate(panel.demands):
        line = method_line(place + _TURNED)
        axes.axhline(demand.height, color=INK, linewidth=0.9, linestyle=line, zorder=1.5, label=demand.name)
    for point in panel.points:
        axes.plot([point.x], [point.y], "o", markersize=9.0, mfc="none", mec=INK, mew=0.8)
        axes.annotate(
            point.name,
            (point.x, point.y),
            xytext=(8.0, -1.0),
            textcoords="offset points",
            va="center",
            fontsize=7.5,
            color=INK,
        )
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    if panel.ticks:
        axes.set_xticks(panel.ticks, [f"{tick:g}" for tick in panel.ticks])
        axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_minor_formatter(NullFormatter())
    names = axes.get_legend_handles_labels()[1]
    axes.legend(
        loc="upper center",
        bbox_to_anchor=(0.45, -0.17),
        ncols=legend_columns(_PANEL_IN, names, 2),
        frameon=False,
        fontsize=7.5,
        handlelength=3.4,
    )


def _draw_curve(axes: Axes, curve: TradeCurve) -> None:
    look = method_look(curve.place)
    fill = look["color"] if curve.filled else "white"
    axes.plot(curve.x, curve.y, **look, mfc=fill, markersize=5.0, linewidth=1.3, label=curve.name or None)
    if curve.down_to is not None:
        axes.vlines(curve.x, curve.down_to, curve.y, color=look["color"], linewidth=0.6, zorder=1.8)
