"""The trade of a gun's design: how well a direction would be felt against how fast the gun could shoot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes

from analysis.report.figures.style import BLACK, BLUE, ORANGE, VERMILION, light_grid, new_figure, save, style
from analysis.stats.arrays import FloatArray

MARKERS = "os^Dv<>"
FAINT, SOFT = "#d6d6d6", "#9db8cc"


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """A design with a name: where it stands, and its predicted share of 1 with its limits."""

    name: str
    friction_N: float
    voltage_V: float
    shooting_rate_Hz: float
    predicted: float
    ci_low: float
    ci_high: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trade:
    """All designs by rate and predicted share; those within the limits; the front, from the fastest on, with limits."""

    rate_Hz: FloatArray
    predicted: FloatArray
    allowed: Any  # booleans
    front_rate_Hz: FloatArray
    front: FloatArray
    front_low: FloatArray
    front_high: FloatArray


def figure_trade(trade: Trade, bound_Hz: float, best: Mark | None, own: Sequence[Mark], path_stem: Path) -> None:
    """Predicted share over shooting rate, the front with its 95 % band, the bound, the gun's own methods, the best."""
    with mpl.rc_context(style()):  # type: ignore[arg-type]
        figure = new_figure(6.6, 4.6)
        axes = figure.subplots()
        light_grid(axes)
        _clouds(axes, trade)
        low, high = 100.0 * trade.front_low, 100.0 * trade.front_high
        axes.fill_between(trade.front_rate_Hz, low, high, color=BLUE, alpha=0.18, linewidth=0.0)
        axes.plot(trade.front_rate_Hz, 100.0 * trade.front, color=BLUE, linewidth=1.5, label="Pareto front, 95 % band")
        axes.axvline(bound_Hz, color="#444444", linewidth=0.9, linestyle=(0, (4, 3)), zorder=1.5)
        for place, mark in enumerate(own):
            _point(axes, mark, VERMILION, MARKERS[place % len(MARKERS)], 6.0)
        if best is not None:
            _point(axes, best, ORANGE, "*", 13.0)
        _scales(axes, bound_Hz, trade)
        where: Any = "outside lower center"
        figure.legend(loc=where, ncols=3, frameon=False, fontsize=8.0)
        save(figure, path_stem)


def _clouds(axes: Axes, trade: Trade) -> None:
    """All designs as dots, with larger ones in the legend."""
    size = 2.0 if len(trade.rate_Hz) > 4000 else 4.0
    for mask, colour, name in (
        (~trade.allowed, FAINT, "beyond the device's limits"),
        (trade.allowed, SOFT, "a design"),
    ):
        x, y = trade.rate_Hz[mask], 100.0 * trade.predicted[mask]
        axes.plot(x, y, ".", color=colour, markersize=size, markeredgewidth=0.0, rasterized=True)
        if mask.any():
            axes.plot([], [], ".", color=colour, markersize=9.0, markeredgewidth=0.0, label=name)


def _point(axes: Axes, mark: Mark, colour: str, marker: str, size: float) -> None:
    axes.errorbar(
        [mark.shooting_rate_Hz],
        [100.0 * mark.predicted],
        yerr=[[100.0 * (mark.predicted - mark.ci_low)], [100.0 * (mark.ci_high - mark.predicted)]],
        fmt=marker,
        color=colour,
        markersize=size,
        markeredgecolor=BLACK,
        markeredgewidth=0.7,
        ecolor=BLACK,
        elinewidth=1.0,
        capsize=2.5,
        zorder=5,
        label=mark.name,
    )


def _scales(axes: Axes, bound_Hz: float, trade: Trade) -> None:
    """Rates from below the bound to three times it: what is faster is hardly felt."""
    widest = 3.0 * bound_Hz
    slowest = float(trade.rate_Hz[trade.allowed].min()) if trade.allowed.any() else 0.0
    axes.set_xlim(max(0.0, min(slowest, bound_Hz) - 0.2), widest)
    axes.set_ylim(48.0, 101.0)
    axes.set_xlabel("highest shooting rate [Hz]")
    axes.set_ylabel("right about a forward shot,\npredicted [%]")
    axes.annotate(
        f"bound {bound_Hz:g} Hz",
        xy=(bound_Hz, 48.0),
        xytext=(3.0, 3.0),
        textcoords="offset points",
        fontsize=7.5,
        color="#444444",
    )
