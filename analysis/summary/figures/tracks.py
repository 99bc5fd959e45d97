"""The tracks of a procedure: the level of each trial, and how it was answered."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from analysis.report.figures.style import (
    drawn,
    drawn_name,
    legend_below,
    light_grid,
    method_colour,
    method_line,
    method_marker,
    panel_grid,
)
from analysis.summary.results import DesignSummary
from analysis.summary.thresholds import Thresholds
from analysis.summary.tracks import TrackAnswers
from experiments.design.methods_section import factor_words
from experiments.design.plan import Condition

MOST_TRACK_PANELS = 20
"""So many participants have a panel: a page is full."""
_ACROSS, _WIDE_IN, _HIGH_IN = 4, 2.3, 1.8
_X_LABEL = "trial of the track"


def figure_tracks(found: DesignSummary, of: Thresholds, path_stem: Path) -> None:
    """A panel for each of the first participants: level by trial, filled for a success, ringed where it turned."""
    people = list(dict.fromkeys(track.participant for track in of.tracks))[:MOST_TRACK_PANELS]
    conditions = list(dict.fromkeys(track.condition for track in of.tracks))
    across = min(_ACROSS, len(people))
    rows = -(-len(people) // across)
    with drawn(path_stem, max(0.6 + _WIDE_IN * across, 4.2), 0.7 + _HIGH_IN * rows) as figure:
        grid = panel_grid(figure, people, across)
        for axes, who in zip(grid, people, strict=False):
            _draw(axes, [track for track in of.tracks if track.participant == who], conditions)
            _draw_threshold(axes, of, who)
        grid[0].xaxis.set_major_locator(MaxNLocator(4, integer=True))
        figure.supylabel(factor_words(of.factor), fontsize=9.0)
        if len(conditions) > 1:
            for i, levels in enumerate(conditions):
                name = found.condition(dict(levels), drawn_name)
                grid[0].plot([], [], color=method_colour(i), marker=method_marker(i), label=name)
            legend_below(figure, grid[0], 3, _X_LABEL)
        else:
            figure.supxlabel(_X_LABEL, fontsize=9.0)


def _draw_threshold(axes: Axes, of: Thresholds, who: str) -> None:
    """A participant's threshold, if there is one condition and it lies within the levels."""
    fits = [one.fit for condition in of.conditions for one in condition.people if one.participant == who]
    if len(of.conditions) == 1 and fits and fits[0] is not None and fits[0].where == "within":
        found = fits[0].threshold
        axes.axhspan(found.low, found.high, color="#666666", alpha=0.15, linewidth=0)
        axes.axhline(found.median, color="#666666", linewidth=0.9, linestyle=(0, (4, 3)))


def _draw(axes: Axes, tracks: Sequence[TrackAnswers], conditions: Sequence[Condition]) -> None:
    """A condition has its colour and mark, a track of it its line."""
    light_grid(axes)
    for track in tracks:
        i = conditions.index(track.condition)
        colour, trials, levels = method_colour(i), np.arange(1, len(track.levels) + 1), np.array(track.levels)
        axes.plot(trials, levels, color=colour, linestyle=method_line(track.track - 1), linewidth=0.8, zorder=2.0)
        turned = list(track.reversals)
        axes.scatter(trials[turned], levels[turned], s=46.0, facecolor="none", edgecolors="#222222", linewidths=0.7)
        right = np.array(track.successes)
        for some, fill in ((right, colour), (~right, "white")):
            axes.scatter(
                trials[some],
                levels[some],
                s=14.0,
                marker=method_marker(i),
                facecolor=fill,
                edgecolors=colour,
                linewidths=0.9,
                zorder=3.0,
            )
