"""Many people in one picture: a point and a thin line each, and beyond 200 of them the shape of their distribution."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from numpy.typing import NDArray

from analysis.report.figures.style import BLACK, INK

_Floats = NDArray[np.float64]

MANY = 200
"""More people than this are drawn as histograms: points and lines would be a grey wall."""


def places(people: int, half_width: float, gap: float = 0.0) -> _Floats:
    """Where a column's people stand, left and right of its centre, which `gap` keeps free for a whisker.

    >>> places(4, 0.2, 0.1).tolist()
    [-0.2, -0.1, 0.1, 0.2]
    """
    left = (people + 1) // 2
    return np.concatenate([np.linspace(-half_width, -gap, left), np.linspace(gap, half_width, people - left)])


def draw_points(
    axes: Axes,
    centres: Sequence[float],
    values: _Floats,
    where: _Floats,
    markers: Sequence[str],
) -> None:
    """A point a person and column, joined from column to column; `values` (people, columns), NaN for none."""
    few = len(values) <= 30
    across = np.asarray(centres)[None, :] + where[:, None]
    lines = LineCollection(
        list(np.stack([across, values], axis=-1)),
        colors=INK,
        linewidths=0.6,
        alpha=0.45 if few else 0.18,
        zorder=2.5,
        clip_on=False,
    )
    axes.add_collection(lines, autolim=False)
    for column, marker in enumerate(markers):
        axes.plot(
            across[:, column],
            values[:, column],
            marker,
            markersize=3.6 if few else 2.2,
            mfc="white",
            mec=INK,
            mew=0.7,
            zorder=3.0,
            clip_on=False,
        )


def draw_histogram(
    axes: Axes,
    centre: float,
    values: _Floats,
    *,
    bin_width: float,
    half_width: float,
    colour: str,
    side: int = 0,
) -> None:
    """Bars around `centre`, as wide as their share of people; `side` -1 or 1 for a half to the left or right."""
    kept = values[np.isfinite(values)]
    if not kept.size:
        return
    levels, counts = np.unique(np.round(kept / bin_width), return_counts=True)
    widths = half_width * counts / counts.max()
    left = centre - widths if side <= 0 else np.full(len(widths), centre)
    axes.barh(
        levels * bin_width,
        widths if side else 2.0 * widths,
        left=left,
        height=bin_width,
        color=colour,
        edgecolor="white",
        linewidth=0.5,
        alpha=0.75,
        zorder=2.5,
        clip_on=False,
    )


def draw_mean(axes: Axes, place: float, mean: float, sd: float, *, colour: str, marker: str = "D") -> None:
    """Mean with a whisker of one SD either way; nothing where the mean is NaN, no whisker where the SD is."""
    if math.isnan(mean):
        return
    axes.errorbar(
        [place],
        [mean],
        yerr=None if math.isnan(sd) else [sd],
        fmt=marker,
        markersize=6.0,
        mfc=colour,
        mec=BLACK,
        mew=0.8,
        ecolor=BLACK,
        capsize=3.5,
        linewidth=1.3,
        zorder=4.0,
        clip_on=False,
    )
