"""Error against time of a simulated shot: who gives how much accuracy for how much time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, LogLocator, NullFormatter, NullLocator

from analysis.report.figures.style import METHOD_COLOURS, METHOD_LINES, new_figure, save, style

_LEAST_ERROR, _LARGEST_ERROR = 1e-16, 30.0  # drawn there if beyond; an error of 0 is half a unit of the last place
_RIGHT_OF = 1e-6  # a way that gets this far is named at the right, others at the left
_MARKERS = "os^Dv<>pPXd*"
_LABEL_STEP = 0.052  # of the axes' height: two labels do not touch


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """A setting of a way, with what to write beside it."""

    error: float
    us: float
    note: str = ""

    @property
    def place(self) -> tuple[float, float]:
        """Where it is drawn."""
        return min(max(self.error, _LEAST_ERROR), _LARGEST_ERROR), self.us


@dataclass(frozen=True, slots=True, kw_only=True)
class Trade:
    """One way to a shot, a point a setting. Ours stand out, and are not joined: they are models, not tolerances."""

    name: str
    points: Sequence[Point]
    ours: bool

    @property
    def at_right(self) -> bool:
        """Whether it is named at the right, beyond its most accurate point."""
        return self.ours or min(point.error for point in self.points) <= _RIGHT_OF

    @property
    def leftmost(self) -> tuple[float, float]:
        """Where its largest error is drawn, the fastest such point."""
        return min((point.place for point in self.points), key=lambda place: (-place[0], place[1]))

    @property
    def anchor(self) -> tuple[float, float]:
        """The point that the name is led to."""
        return min(point.place for point in self.points) if self.at_right else self.leftmost


def figure_trade(panels: Sequence[tuple[str, Sequence[Trade]]], path_stem: Path) -> tuple[Path, ...]:
    """A panel (title, trades) above the other, on common axes, each way named once."""
    with mpl.rc_context(style()):  # type: ignore[arg-type]
        names = list(dict.fromkeys(trade.name for _, trades in panels for trade in trades))
        figure = new_figure(7.4, 4.3 * len(panels))
        grid = figure.subplots(len(panels), 1, squeeze=False, sharex=True, sharey=True)[:, 0]
        for axes, (title, trades) in zip(grid, panels, strict=True):
            axes.set_title(title, loc="left")
            axes.set_ylabel("time a shot [µs]")
            for trade in trades:
                _draw(axes, trade, names.index(trade.name))
        _scales(grid[-1], [point.us for _, trades in panels for trade in trades for point in trade.points])
        grid[-1].set_xlabel("largest relative error (more accurate to the right)")
        for axes, (_, trades) in zip(grid, panels, strict=True):
            for side in (True, False):
                _name(axes, [trade for trade in trades if trade.at_right == side], names)
        return save(figure, path_stem)


def _draw(axes: Axes, trade: Trade, place: int) -> None:
    errors, times = zip(*sorted(point.place for point in trade.points), strict=True)
    axes.plot(
        errors,
        times,
        color=_colour(trade, place),
        linestyle="none" if trade.ours else METHOD_LINES[place % len(METHOD_LINES)],
        marker=_MARKERS[place % len(_MARKERS)],
        markersize=6.5 if trade.ours else 4.0,
        markeredgecolor="black" if trade.ours else "none",
        markeredgewidth=0.8,
        linewidth=1.1,
        zorder=3.0 if trade.ours else 2.0,
    )
    for point in trade.points:
        left = point.place == trade.leftmost
        shift, side = (-6.0, "right") if left else (6.0, "left")
        axes.annotate(
            point.note, point.place, (shift, 0.0), textcoords="offset points", ha=side, va="center", fontsize=6.5
        )


def _colour(trade: Trade, place: int) -> str:
    return METHOD_COLOURS[0] if trade.ours else METHOD_COLOURS[1 + place % (len(METHOD_COLOURS) - 2)]


def _scales(axes: Axes, times: Sequence[float]) -> None:
    axes.set(xscale="log", yscale="log")
    axes.set_xlim(3e6, 0.3 * _LEAST_ERROR)
    axes.set_ylim(0.3 * min(times), 3.0 * max(times))
    axes.xaxis.set_major_locator(FixedLocator([10.0**power for power in range(-16, 3, 2)]))
    axes.yaxis.set_major_locator(LogLocator(numticks=20))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_locator(NullLocator())
        axis.set_minor_formatter(NullFormatter())


def _name(axes: Axes, trades: Sequence[Trade], names: Sequence[str]) -> None:
    """Names in a column at one side, in the order of the points' heights, moved apart, each led to its point."""
    axes.grid(visible=True, color="#e4e4e4", linewidth=0.6)
    axes.set_axisbelow(True)
    low, high = (math.log10(limit) for limit in axes.get_ylim())
    trades = sorted(trades, key=lambda trade: trade.anchor[1])
    heights = spread([(math.log10(trade.anchor[1]) - low) / (high - low) for trade in trades], _LABEL_STEP)
    for trade, height in zip(trades, heights, strict=True):
        colour = _colour(trade, names.index(trade.name))
        axes.annotate(
            trade.name,
            xy=trade.anchor,
            xytext=(1.03 if trade.at_right else 0.01, height),
            textcoords="axes fraction",
            va="center",
            fontsize=8.0,
            fontweight="bold" if trade.ours else "normal",
            color="#222222",
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.6, "alpha": 0.7, "shrinkB": 3.0},
        )


def spread(heights: Sequence[float], step: float) -> list[float]:
    """Rising heights moved up until neighbours lie `step` apart, then all down by the mean that they moved.

    >>> [round(height, 2) for height in spread([0.1, 0.1, 0.5], 0.1)]
    [0.07, 0.17, 0.47]
    """
    moved: list[float] = []
    for height in heights:
        moved.append(max(height, moved[-1] + step) if moved else height)
    back = (sum(moved) - sum(heights)) / len(heights) if heights else 0.0
    return [height - back for height in moved]
