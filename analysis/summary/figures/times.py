"""Response times: their cumulative distributions, and boxes by method and direction with everybody's median."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.patches import Patch

from analysis.report.figures.crowd import MANY, places
from analysis.report.figures.style import (
    BLACK,
    DIRECTION_MARKERS,
    INK,
    METHOD_LINES,
    display_name,
    light_grid,
    method_colour,
    new_figure,
    save,
    style,
    wrapped,
)
from analysis.summary.results import DirectionStatistics
from analysis.times.response_times import ResponseTimes

_PLACES = {"forward": -0.19, "backward": 0.19}


def figure_response_times(found: DirectionStatistics, path_stem: Path) -> tuple[Path, Path, Path]:
    """Valid response times as cumulative shares and as boxes (5, 25, 50, 75, 95 %); PNG, SVG and PDF are written.

    `ValueError` if there is no valid time.
    """
    times = found.response_times
    if not times.n:
        raise ValueError("the figure of response times needs at least one valid time")
    with mpl.rc_context(style()):  # type: ignore[arg-type]
        figure = new_figure(8.6 + 1.6 * max(0, len(found.methods) - 3), 3.9)
        left, right = figure.subplots(1, 2, width_ratios=[1.0, 1.15])
        limit = _limit(times)
        _draw_shares(left, times, found.methods, limit)
        _draw_boxes(right, times, found.methods)
        return save(figure, path_stem)


def _limit(times: ResponseTimes) -> float:
    """The end of the time axis: the slowest, but no more than half as much again as 99 in 100 need."""
    spreads = [spread.percentiles for spread in times.methods.values() if spread]
    return float(min(1.05 * max(p[100] for p in spreads), 1.5 * max(p[99] for p in spreads))) or 1.0


def _draw_shares(axes: Axes, times: ResponseTimes, methods: Sequence[str], limit: float) -> None:
    light_grid(axes)
    slowest = 0.0
    for i, method in enumerate(methods):
        spread = times.methods.get(method)
        if spread:
            label = f"{display_name(method)} (n = {spread.n:,})"
            line = METHOD_LINES[i % len(METHOD_LINES)]
            shares = np.arange(len(spread.percentiles))
            axes.plot(spread.percentiles, shares, color=method_colour(i), linestyle=line, linewidth=1.7, label=label)
            slowest = max(slowest, spread.percentiles[-1])
    axes.set_xlim(0.0, limit)
    axes.set_ylim(0.0, 101.0)
    beyond = f"\n(cut: the slowest took {slowest:.1f} s)" if slowest > limit else ""
    axes.set_xlabel(f"response time [s]{beyond}")
    axes.set_ylabel("share of the trials answered by then [%]")
    axes.set_title("(a) Cumulative distribution", loc="left", fontweight="bold")
    axes.legend(loc="best", fontsize=8.0, handlelength=3.2, framealpha=0.9)


def _draw_boxes(axes: Axes, times: ResponseTimes, methods: Sequence[str]) -> None:
    light_grid(axes)
    for i, method in enumerate(methods):
        for direction, place in _PLACES.items():
            spread = times.directions.get(method, {}).get(direction)
            if spread:
                _draw_box(axes, i + place, spread.percentiles, method_colour(i), filled=direction == "forward")
                _draw_medians(axes, i + place, times.participants, method, direction)
    axes.set_xlim(-0.6, len(methods) - 0.4)
    axes.set_ylim(bottom=0.0)
    axes.set_xticks(range(len(methods)), [f"{_counts(times, m)}\n{wrapped(m)}" for m in methods])
    axes.set_xlabel(f"boxes: 5, 25, 50, 75 and 95 % of the trials{_medians_note(times)}", fontsize=8.0, labelpad=8.0)
    axes.set_ylabel("response time [s]")
    axes.set_title("(b) By direction", loc="left", fontweight="bold")
    handles = [
        Patch(facecolor="#bbbbbb", edgecolor=BLACK, label="forward shots"),
        Patch(facecolor="white", edgecolor=BLACK, label="backward shots"),
    ]
    axes.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False, fontsize=8.0)


def _draw_box(axes: Axes, place: float, percentiles: Sequence[float], colour: str, *, filled: bool) -> None:
    names = {"whislo": 5, "q1": 25, "med": 50, "q3": 75, "whishi": 95}
    axes.bxp(
        [{name: percentiles[at] for name, at in names.items()} | {"fliers": []}],
        positions=[place],
        widths=0.32,
        showfliers=False,
        patch_artist=True,
        manage_ticks=False,
        boxprops={"facecolor": to_rgba(colour, 0.35) if filled else "white", "edgecolor": colour, "linewidth": 1.2},
        medianprops={"color": BLACK, "linewidth": 1.8},
        whiskerprops={"color": colour, "linewidth": 1.2},
        capprops={"color": colour, "linewidth": 1.2},
        zorder=2.0,
    )


def _draw_medians(axes: Axes, place: float, participants: Mapping[str, Any], method: str, direction: str) -> None:
    """A point a participant; beyond 200 of them the boxes stand alone."""
    medians = [own[method][direction] for own in participants.values() if direction in own.get(method, {})]
    if len(participants) <= MANY:
        across = place + places(len(medians), 0.11)
        size = 3.2 if len(medians) <= 30 else 2.0
        marker = DIRECTION_MARKERS[direction]
        axes.plot(across, medians, marker, markersize=size, mfc="white", mec=INK, mew=0.6, zorder=3.0)


def _counts(times: ResponseTimes, method: str) -> str:
    spreads = times.directions.get(method, {})
    return "n = " + " / ".join(f"{spreads[d].n if d in spreads else 0:,}" for d in _PLACES)


def _medians_note(times: ResponseTimes) -> str:
    return "" if len(times.participants) > MANY else "; points: participants' medians"
