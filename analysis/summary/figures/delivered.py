"""What was delivered over a run: peak and friction of each shot, as parts of what was expected, with the marks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from analysis.report.figures.style import (
    drawn,
    drawn_name,
    legend_below,
    light_grid,
    method_colour,
    method_marker,
    panel_grid,
)
from analysis.summary.delivered import DeliveredCourse
from experiments.session.remarks import NOT_DELIVERED

MOST_RUN_PANELS = 20
_ACROSS, _WIDE_IN, _HIGH_IN = 3, 2.9, 1.9


def figure_delivered(courses: Sequence[DeliveredCourse], path_stem: Path) -> None:
    """A panel for each of the first runs: peaks filled, frictions open, what is marked in a ring; PNG, SVG and PDF."""
    runs = list(dict.fromkeys((one.participant, one.experiment) for one in courses))[:MOST_RUN_PANELS]
    methods = list(dict.fromkeys(one.method for one in courses))
    across = min(_ACROSS, len(runs))
    with drawn(path_stem, max(0.7 + _WIDE_IN * across, 4.6), 0.9 + _HIGH_IN * -(-len(runs) // across)) as figure:
        grid = panel_grid(figure, [f"{who}, {experiment}" for who, experiment in runs], across)
        for axes, run in zip(grid, runs, strict=False):
            light_grid(axes)
            axes.axhline(100.0, color="#666666", linewidth=0.8)
            for one in courses:
                if (one.participant, one.experiment) == run:
                    _draw(axes, one, methods.index(one.method))
        grid[0].xaxis.set_major_locator(MaxNLocator(4, integer=True))
        for axes in grid[-across:]:
            axes.set_xlabel("shot of the run", fontsize=9.0)
        figure.supylabel("% of what is expected", fontsize=9.0)
        for i, name in enumerate(methods):
            grid[0].plot([], [], color=method_colour(i), marker=method_marker(i), linestyle="", label=drawn_name(name))
        legend_below(figure, grid[0], 3)


def _draw(axes: Axes, course: DeliveredCourse, i: int) -> None:
    """A method's shots; a ring around what was not as it should be, peak or friction."""
    numbers, colour = np.array(course.numbers), method_colour(i)
    bad = np.array([mark in NOT_DELIVERED for mark in course.marks])
    of_friction = np.array([reason.startswith("friction") for reason in course.reasons])
    for parts, fill, ringed in (
        (course.peaks, colour, bad & ~of_friction),
        (course.frictions, "white", bad & of_friction),
    ):
        values = 100 * np.array(parts)
        mark: dict[str, Any] = {"marker": method_marker(i), "edgecolors": colour, "linewidths": 0.7}
        axes.scatter(numbers, values, s=9.0, facecolor=fill, zorder=3.0, **mark)
        axes.scatter(
            numbers[ringed], values[ringed], s=34.0, facecolor="none", edgecolors="#333333", linewidths=0.8, zorder=4.0
        )
