"""Psychometric functions: the points that were answered, sized by their trials, and the curves fitted to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.psychometric.fit import Credible
from analysis.psychometric.people import PersonFit, ShareAtLevel, mean_curve
from analysis.report.figures.style import (
    GREY,
    drawn,
    drawn_name,
    even_ticks,
    have_room,
    left_of,
    legend_below,
    light_grid,
    method_colour,
    method_line,
    method_look,
    method_marker,
    panel_grid,
    part_left,
    reference_line,
)
from analysis.stats.arrays import FloatArray
from analysis.stats.binomial import binomial_test
from analysis.summary.results import DesignSummary
from analysis.summary.thresholds import ConditionFit, Thresholds
from experiments.design.methods_section import factor_words

MOST_PANELS = 19
"""So many participants have a panel: with that of all people a page is full."""
_ACROSS, _WIDE_IN, _HIGH_IN = 4, 2.3, 2.1
_CURVE = 101
_MOST_POINTS, _JOINED = 12, 8
"""Of more levels than this, neighbours are joined into so many points: those of an adaptive run have a trial each."""
_AREA = 90.0
"""Of the point with most trials, in square points."""
_MOST_CURVES = 8
_ASIDE, _ALL_ASIDE = 0.03, 0.12
"""So far, as a share of the levels, points of two conditions stand apart, about a mark's width; and those of all."""

_LABELS = {"right": "right [%]", "yes": "yes [%]", "chosen": "chosen over the standard [%]"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Curve:
    """What one panel shows of one condition: points, a curve with its band, a threshold with its interval.

    `caught`: how often yes was said in catch trials, and their number.
    """

    points: tuple[ShareAtLevel, ...]
    shares: tuple[FloatArray, FloatArray, FloatArray] | None
    threshold: Credible | None
    caught: tuple[int, int] | None


def figure_functions(found: DesignSummary, of: Thresholds, path_stem: Path) -> None:
    """A panel for all people, if there are several, and one for each of the first; PNG, SVG and PDF are written."""
    levels = np.linspace(*_span(of), _CURVE)
    conditions = of.conditions[:_MOST_CURVES]
    people = list(dict.fromkeys(one.participant for condition in conditions for one in condition.people))
    panels = [(who, [_own(condition, who, levels) for condition in conditions]) for who in people[:MOST_PANELS]]
    if len(people) > 1:
        panels.insert(0, (f"all {of.people:,} people", [_of_all(condition, levels) for condition in conditions]))
    across = min(_ACROSS, len(panels))
    rows = -(-len(panels) // across)
    with drawn(path_stem, max(0.6 + _WIDE_IN * across, 4.2), 0.7 + _HIGH_IN * rows) as figure:
        grid = panel_grid(figure, [title for title, _ in panels], across)
        for axes, (_, curves) in zip(grid, panels, strict=False):
            _draw(axes, curves, levels)
        _label(figure, grid, found, of)


def _span(of: Thresholds) -> tuple[float, float]:
    levels = [point.level for condition in of.conditions for point in condition.points]
    return min(levels), max(levels)


def _own(condition: ConditionFit, who: str, levels: FloatArray) -> _Curve:
    one = next((one for one in condition.people if one.participant == who), None)
    if one is None or one.fit is None:
        points = () if one is None else one.points
        return _Curve(points=points, shares=None, threshold=None, caught=caught_of([one] if one else []))
    within = one.fit.threshold if one.fit.where == "within" else None
    return _Curve(points=one.points, shares=one.fit.curve(levels), threshold=within, caught=caught_of([one]))


def caught_of(people: Sequence[PersonFit]) -> tuple[int, int] | None:
    """How often they said yes in all their catch trials, and the number of these; `None` without any."""
    caught = [one.catch for one in people if one.catch is not None]
    return (sum(yes for yes, _ in caught), sum(trials for _, trials in caught)) if caught else None


def _of_all(condition: ConditionFit, levels: FloatArray) -> _Curve:
    """All people together; no mean threshold is marked where nobody has one within the levels."""
    fits = [one.fit for one in condition.people if one.fit is not None]
    group = condition.group if any(fit.where == "within" for fit in fits) else None
    return _Curve(
        points=condition.points,
        shares=mean_curve(fits, levels) if fits else None,
        threshold=None if group is None else group.threshold,
        caught=caught_of(condition.people),
    )


def _draw(axes: Axes, curves: Sequence[_Curve], levels: FloatArray) -> None:
    light_grid(axes)
    apart = (levels[-1] - levels[0]) * min(_ASIDE, _ALL_ASIDE / max(1, len(curves) - 1))
    for i, curve in enumerate(curves):
        colour, aside = method_colour(i), apart * (i - (len(curves) - 1) / 2)  # marks of several would hide each other
        if curve.shares is not None:
            middle, low, high = (100 * share for share in curve.shares)
            axes.fill_between(levels, low, high, color=colour, alpha=0.15, linewidth=0)
            axes.plot(levels, middle, color=colour, linestyle=method_line(i), linewidth=1.3)
        points = neighbours_joined(curve.points)
        if curve.caught is not None:
            yes, trials = curve.caught
            points.insert(0, ShareAtLevel(level=left_of(levels), right=yes, trials=trials))
        _draw_points(axes, points, i, aside, lowest=levels[0])
        if curve.threshold is not None:
            _draw_threshold(axes, curve.threshold, i, alone=len(curves) == 1)
    if any(curve.caught is not None for curve in curves):
        part_left(axes, levels)


def _draw_threshold(axes: Axes, found: Credible, i: int, *, alone: bool) -> None:
    """At the foot; of several conditions each has its own mark, as colours alone are alike in grey."""
    colour, foot = method_colour(i), 2.5 + 4.5 * i
    axes.plot([found.low, found.high], [foot, foot], color=colour, linewidth=2.0)
    if alone:
        axes.plot([found.median], [foot], "|", color=colour, markersize=9.0, mew=1.6)
    else:
        axes.plot([found.median], [foot], method_marker(i), color=colour, markersize=5.5, mec="white", mew=0.5)


def _draw_points(axes: Axes, points: Sequence[ShareAtLevel], i: int, aside: float, *, lowest: float) -> None:
    """Hollow and of one size where they are below the lowest level: of catch trials."""
    if not points:
        return
    level, right, trials = (np.array([getattr(one, name) for one in points]) for name in ("level", "right", "trials"))
    at, hollow = level + aside, level < lowest
    exact = binomial_test(right, trials)
    axes.vlines(
        at, 100 * np.asarray(exact.ci_low), 100 * np.asarray(exact.ci_high), color=method_colour(i), linewidth=0.8
    )
    axes.scatter(
        at,
        100 * right / trials,
        s=np.where(hollow, 0.5 * _AREA, np.maximum(_AREA * trials / trials[~hollow].max(initial=1), 6.0) * 0.5),
        marker=method_marker(i),
        color=np.where(hollow, "white", method_colour(i)).tolist(),
        edgecolors=np.where(hollow, method_colour(i), "white").tolist(),
        linewidths=np.where(hollow, 1.1, 0.4).tolist(),
        zorder=3.0,
        clip_on=False,
    )


def neighbours_joined(points: Sequence[ShareAtLevel]) -> list[ShareAtLevel]:
    """The points, neighbours joined where there are too many; each at the mean level of its trials.

    >>> of = [ShareAtLevel(level=float(level), right=1, trials=1) for level in range(16)]
    >>> [(one.level, one.trials) for one in neighbours_joined(of)][:2]
    [(0.5, 2), (2.5, 2)]
    """
    if len(points) <= _MOST_POINTS:
        return list(points)
    trials = np.array([point.trials for point in points])
    before = np.cumsum(trials) - trials / 2
    bins = np.minimum((before * _JOINED / trials.sum()).astype(int), _JOINED - 1)
    some = ([point for point, of in zip(points, bins, strict=True) if of == place] for place in range(_JOINED))
    return [
        ShareAtLevel(
            level=sum(one.level * one.trials for one in of) / sum(one.trials for one in of),
            right=sum(one.right for one in of),
            trials=sum(one.trials for one in of),
        )
        for of in some
        if of
    ]


def _label(figure: Figure, grid: Sequence[Axes], found: DesignSummary, of: Thresholds) -> None:
    for axes in grid:
        if of.guess is not None:
            reference_line(axes, 100 * of.guess, "").set_label("chance")
        if of.share == "chosen" and isinstance(of.standard, float):
            line = axes.axvline(of.standard, color=GREY, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1.5)
            line.set_label("standard")
    grid[0].set_ylim(-3.0, 103.0)
    levels = sorted({point.level for condition in of.conditions for point in condition.points})
    ticks = {level: f"{level:g}" for level in (levels if have_room(levels) else even_ticks(levels, 4))}
    if any(one.catch is not None for condition in of.conditions for one in condition.people):
        ticks = {left_of(levels): "none", **ticks}
    grid[0].set_xticks([*ticks], [*ticks.values()])
    figure.supylabel(_LABELS[of.share], fontsize=9.0)
    if len(of.conditions) > 1:
        for i, condition in enumerate(of.conditions[:_MOST_CURVES]):
            name = found.condition(condition.levels, drawn_name)
            grid[0].plot([], [], **method_look(i), markersize=4.5, linewidth=1.3, label=name)
    if grid[0].get_legend_handles_labels()[1]:
        legend_below(figure, grid[0], 3, factor_words(of.factor))
    else:
        figure.supxlabel(factor_words(of.factor), fontsize=9.0)
