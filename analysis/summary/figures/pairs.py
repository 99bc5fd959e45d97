"""Scores from paired comparison, each item with its interval."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.report.figures.style import (
    drawn,
    drawn_name,
    legend_below,
    light_grid,
    method_colour,
    method_marker,
    name_ticks,
    width_for,
)
from analysis.summary.pairs import PairedComparison
from analysis.summary.results import DesignSummary


def has_scores(of: PairedComparison) -> bool:
    """Whether some condition has scores."""
    return any(condition.scores[0].scores for condition in of.conditions)


def figure_pairs(found: DesignSummary, of: PairedComparison, path_stem: Path) -> None:
    """A mark and interval an item, beside each other by condition; PNG, SVG and PDF are written."""
    shown = [condition for condition in of.conditions if condition.scores[0].scores]
    width = width_for(len(of.items))
    with drawn(path_stem, width, 3.6) as figure:
        axes = figure.subplots()
        light_grid(axes)
        axes.axhline(0.0, color="#666666", linewidth=0.9, linestyle=(0, (4, 3)), zorder=1.5)
        for i, condition in enumerate(shown):
            scores = condition.scores[0].scores
            ends = np.array([(one.score - one.low, one.high - one.score) for one in scores]).T
            axes.errorbar(
                np.arange(len(scores)) + 0.12 * (i - (len(shown) - 1) / 2),
                [one.score for one in scores],
                yerr=ends,
                color=method_colour(i),
                marker=method_marker(i),
                linestyle="none",
                capsize=3.0,
                label=found.condition(condition.levels, drawn_name),
            )
        name_ticks(axes, [found.label(of.factor, item) for item in of.items])
        axes.set_ylabel("score [logits]")
        if len(shown) > 1:
            legend_below(figure, axes, 3)
