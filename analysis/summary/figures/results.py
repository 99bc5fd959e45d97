"""Figure 8: mean and SD of the correct rate and of the ratings, with every participant and the post-hoc tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba

from analysis.report.figures.crowd import MANY, draw_histogram, draw_mean, draw_points, places
from analysis.report.figures.style import (
    BLACK,
    bounded,
    light_grid,
    method_colour,
    new_figure,
    reference_line,
    save,
    stars,
    style,
    wrapped,
)
from analysis.summary.results import Pair, StudyStatistics, WithinStatistics


@dataclass(frozen=True, slots=True, kw_only=True)
class _Panel:
    """What is drawn of one experiment; `scale` turns the stored values into those of the axis, as the rest is."""

    experiment: str
    title: str
    label: str
    scale: float
    top: float
    bin_width: float
    chance: float | None = None


_PANELS = (
    _Panel(
        experiment="direction",
        title="Direction",
        label="correct rate, forward [%]",
        scale=100.0,
        top=100.0,
        bin_width=10.0,
        chance=50.0,
    ),
    _Panel(
        experiment="preference",
        title="Preference",
        label="rating (0 dislike, 10 like very much)",
        scale=1.0,
        top=10.0,
        bin_width=0.5,
    ),
)


def figure_8(statistics: StudyStatistics, path_stem: Path) -> tuple[Path, Path, Path]:
    """Bars (mean, SD), participants as points and lines, brackets from the Tukey tests; PNG, SVG and PDF are written.

    An experiment without a complete participant gets no panel. `ValueError` if none is left.
    """
    found = statistics.analysed
    panels = [panel for panel in _PANELS if panel.experiment in found]
    if not panels:
        raise ValueError("figure 8 needs an experiment with at least one complete participant")
    widest = max(len(found[panel.experiment].methods) for panel in panels)
    with mpl.rc_context(style()):  # type: ignore[arg-type]
        figure = new_figure(
            0.4 + (0.9 + max(widest, 3)) * len(panels), 4.5 + 0.16 * max(0, widest * (widest - 1) // 2 - 3)
        )
        row = figure.subplots(1, len(panels), squeeze=False)[0]
        for i, (axes, panel) in enumerate(zip(row, panels, strict=True)):
            _draw_panel(axes, panel, found[panel.experiment], chr(ord("a") + i))
        return save(figure, path_stem)


def _draw_panel(axes: Axes, panel: _Panel, found: WithinStatistics, letter: str) -> None:
    methods = found.methods
    light_grid(axes)
    axes.set_xlim(-0.6, len(methods) - 0.4)
    if panel.chance is not None:
        reference_line(axes, panel.chance, "chance")
    ceiling = max(_draw_bars(axes, panel, found, methods), _draw_people(axes, panel, found, methods))
    highest = _draw_brackets(axes, found.tukey or (), methods, ceiling, 0.075 * panel.top)
    axes.set_ylim(0.0, max(highest, panel.top) + 0.04 * panel.top)
    axes.set_yticks(np.linspace(0.0, panel.top, 6))
    bounded(axes, 0.0, panel.top)
    axes.set_xticks(range(len(methods)), [wrapped(method) for method in methods])
    axes.set_xlabel(found.people, fontsize=8.0, labelpad=8.0)
    axes.set_ylabel(panel.label)
    axes.set_title(f"({letter}) {panel.title}", loc="left", fontweight="bold")


def _draw_bars(axes: Axes, panel: _Panel, found: WithinStatistics, methods: Sequence[str]) -> float:
    """The bars; gives back the top of the highest whisker."""
    means = [panel.scale * found.means[method] for method in methods]
    spreads = [panel.scale * found.sds[method] for method in methods]
    for i, (mean, spread) in enumerate(zip(means, spreads, strict=True)):
        colour = method_colour(i)
        axes.bar(i, mean, width=0.64, color=to_rgba(colour, 0.35), edgecolor=colour, linewidth=1.2, zorder=2.0)
        draw_mean(axes, i, mean, spread, colour=colour)
    return float(np.max(np.array(means) + np.nan_to_num(spreads)))


def _draw_people(axes: Axes, panel: _Panel, found: WithinStatistics, methods: Sequence[str]) -> float:
    """Everybody at the same place in every bar; gives back the highest value."""
    values = panel.scale * found.participants.array
    if len(values) > MANY:
        for i in range(len(methods)):
            draw_histogram(axes, i, values[:, i], bin_width=panel.bin_width, half_width=0.27, colour=method_colour(i))
        return float(values.max()) + panel.bin_width / 2.0
    draw_points(axes, range(len(methods)), values, places(len(values), 0.26, 0.08), ["o"] * len(methods))
    return float(values.max())


def _draw_brackets(axes: Axes, comparisons: Sequence[Pair], methods: Sequence[str], floor: float, step: float) -> float:
    """Short brackets low, long ones above them; gives back the height that they need."""
    spans = [_span(comparison, methods) for comparison in comparisons if not math.isnan(comparison.p)]
    height, level_end = floor + 0.6 * step, -1
    for left, right, text in sorted(spans, key=lambda span: (span[1] - span[0], span[0])):
        if left < level_end:
            height += 1.15 * step
        level_end = right
        inset, foot = 0.06, height - 0.25 * step
        axes.plot(
            [left + inset, left + inset, right - inset, right - inset],
            [foot, height, height, foot],
            color=BLACK,
            linewidth=1.0,
        )
        offset = 2.0 if text == "n.s." else -1.0  # stars sit high in their line
        axes.annotate(
            text,
            ((left + right) / 2.0, height),
            xytext=(0.0, offset),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=8.5,
        )
    return height + 0.8 * step


def _span(comparison: Pair, methods: Sequence[str]) -> tuple[int, int, str]:
    ends = [methods.index(comparison.a), methods.index(comparison.b)]
    return min(ends), max(ends), stars(comparison.p)
