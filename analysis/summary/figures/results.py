"""Figure 8 (rates and ratings with every participant and the post-hoc tests), and the directions with d′ and c."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from analysis.report.figures.crowd import MANY, draw_histogram, draw_mean, draw_points, places
from analysis.report.figures.style import (
    BLACK,
    BLUE,
    DIRECTION_MARKERS,
    MANY_METHODS,
    VERMILION,
    bounded,
    drawn,
    drawn_name,
    light_grid,
    method_colour,
    name_ticks,
    reference_line,
    stars,
    width_for,
)
from analysis.stats.arrays import FloatArray
from analysis.stats.discrimination import yes_no
from analysis.summary.results import DirectionStatistics, Pair, Scores, StudyStatistics, WithinStatistics


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


def figure_8(statistics: StudyStatistics, path_stem: Path, rated_from: tuple[float, float] | None = None) -> None:
    """Bars (mean, SD), participants as points and lines, brackets from the Tukey tests; PNG, SVG and PDF are written.

    An experiment without a complete participant gets no panel. `ValueError` if none is left. `rated_from`: the ends of
    the scale of another program's ratings, of which nobody knows what they meant.
    """
    found = statistics.analysed
    panels = [_rated_otherwise(panel, rated_from) for panel in _PANELS if panel.experiment in found]
    if not panels:
        raise ValueError("figure 8 needs an experiment with at least one complete participant")
    widest = max(len(found[panel.experiment].methods) for panel in panels)
    if widest > MANY_METHODS:
        _draw_stacked(panels, found, path_stem)
        return
    height_in = 4.5 + 0.16 * max(0, widest * (widest - 1) // 2 - 3)
    with drawn(path_stem, 0.4 + (0.9 + max(widest, 3)) * len(panels), height_in) as figure:
        row = figure.subplots(1, len(panels), squeeze=False)[0]
        for i, (axes, panel) in enumerate(zip(row, panels, strict=True)):
            _draw_panel(axes, panel, found[panel.experiment], _lettered(i, len(panels), panel.title))


def _lettered(i: int, panels: int, title: str) -> str:
    """The title of a panel, with its letter where there are several."""
    return f"({chr(ord('a') + i)}) {title}" if panels > 1 else title


def _rated_otherwise(panel: _Panel, rated_from: tuple[float, float] | None) -> _Panel:
    """A panel of ratings with what is known of another program's scale."""
    if rated_from is None or panel.experiment != "preference":
        return panel
    low, high = rated_from
    as_they_are = (low, high) == (0.0, 10.0)
    return replace(panel, label="rating, 0 to 10" if as_they_are else f"rating, {low:g} to {high:g} as 0 to 10")


def has_matrix(found: WithinStatistics) -> bool:
    """Whether a matrix shows which methods differ, as there are too many of them for brackets."""
    return bool(found.tukey) and len(found.methods) > MANY_METHODS


_ROW_IN = 0.3
_MOST_TEXTS = 30
"""Of more methods the matrix shows colours alone."""


def _draw_stacked(panels: Sequence[_Panel], found: Mapping[str, WithinStatistics], path_stem: Path) -> None:
    """The panels one above the other, below each the matrix of its comparisons, whose columns are the bars'."""
    shown = [(panel, found[panel.experiment]) for panel in panels]
    tall = [height for _, one in shown for height in (3.6, *((_ROW_IN * len(one.methods),) if has_matrix(one) else ()))]
    width = width_for(max(len(one.methods) for _, one in shown))
    with drawn(path_stem, width, sum(tall) + 0.7 * len(shown)) as figure:
        rows = iter(figure.subplots(len(tall), 1, squeeze=False, height_ratios=tall)[:, 0])
        for i, (panel, one) in enumerate(shown):
            _draw_panel(next(rows), panel, one, _lettered(i, len(panels), panel.title))
            if has_matrix(one):
                _draw_matrix(next(rows), one)


_SHADES = {"***": 0.75, "**": 0.5, "*": 0.25}


def _draw_matrix(axes: Axes, found: WithinStatistics) -> None:
    """A cell a pair: the sign says whether the row's mean is above (+) the column's, stars how surely."""
    methods, few = found.methods, len(found.methods) <= _MOST_TEXTS
    for pair in found.tukey or ():
        row, column, text = *sorted((methods.index(pair.a), methods.index(pair.b)), reverse=True), stars(pair.p)
        above = found.means[methods[row]] > found.means[methods[column]]
        colour = to_rgba(BLUE if above else VERMILION, _SHADES.get(text, 0.0))
        axes.add_patch(Rectangle((column - 0.5, row - 0.5), 1.0, 1.0, facecolor=colour, edgecolor="#cccccc", lw=0.5))
        differs = text in _SHADES
        shown = f"{'+' if above else '−'}{text}" if differs else text
        if few and not math.isnan(pair.p):
            axes.text(column, row, shown, ha="center", va="center", fontsize=7.5, color=BLACK if differs else "#777777")
    axes.set_xlim(-0.6, len(methods) - 0.4)
    axes.set_ylim(len(methods) - 0.45, 0.45)  # with the whole line of the last row and of the first
    axes.set_yticks(range(1, len(methods)), [drawn_name(method) for method in methods[1:]], fontsize=8.0)
    axes.set_xticks([])
    axes.tick_params(length=0.0)
    axes.spines[:].set_visible(False)


def _draw_panel(axes: Axes, panel: _Panel, found: WithinStatistics, title: str) -> None:
    methods = found.methods
    light_grid(axes)
    if panel.chance is not None:
        reference_line(axes, panel.chance, "chance")
    ceiling = max(_draw_bars(axes, panel, found, methods), _draw_people(axes, panel, found, methods))
    pairs = () if has_matrix(found) else found.tukey or ()
    highest = _draw_brackets(axes, pairs, methods, ceiling, 0.075 * panel.top) if pairs else ceiling
    axes.set_ylim(0.0, max(highest, panel.top) + 0.04 * panel.top)
    axes.set_yticks(np.linspace(0.0, panel.top, 6))
    bounded(axes, panel.top)
    name_ticks(axes, methods)
    axes.set_xlabel(found.people, fontsize=8.0, labelpad=8.0)
    axes.set_ylabel(panel.label)
    axes.set_title(title, loc="left", fontweight="bold")


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


_SIDES = {"forward": -1, "backward": 1}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Measure:
    key: Literal["d_prime", "criterion"]
    title: str
    label: str
    zero: str


_MEASURES = (
    _Measure(key="d_prime", title="Sensitivity", label="d′", zero="chance"),
    _Measure(key="criterion", title="Criterion", label="c (below 0: leans towards “forward”)", zero="no bias"),
)


def figure_directions(found: DirectionStatistics, path_stem: Path) -> None:
    """Correct rate by method and direction (mean, SD, everybody), d′ and criterion; PNG, SVG and PDF are written.

    `found` has at least one participant. Where a direction was never presented d′
    and criterion are undefined: without any of them their panels are left out.
    """
    measures = _MEASURES if any(found.sensitivity.values()) else ()
    many = len(found.methods) > MANY_METHODS
    width = 0.8 + 1.1 * len(found.methods) if many else max(8.0, 0.8 + 2.2 * len(found.methods))
    panels = (1 + len(measures)) if many else 2 if measures else 1
    with drawn(path_stem, min(width, width_for(99)), 3.8 * panels if panels > 1 else 4.2) as figure:
        rows = figure.add_gridspec(panels, 1 if many else 2)
        _draw_rates(figure.add_subplot(rows[0, :]), found, _lettered(0, 1 + len(measures), "Correct rate"))
        for i, measure in enumerate(measures):
            place = rows[1 + i, :] if many else rows[1, i]
            _draw_measure(figure.add_subplot(place), found, measure, _lettered(1 + i, 1 + len(measures), measure.title))
        _explain(figure, found)


def _draw_rates(axes: Axes, found: DirectionStatistics, title: str) -> None:
    methods = found.methods
    _frame(axes, methods, title, "correct rate [%]")
    reference_line(axes, 50.0, "chance")
    for i, method in enumerate(methods):
        _draw_pair(axes, found, method, i)
    low, high = axes.dataLim.intervaly  # of an SD that reaches beyond the scale, too
    axes.set_ylim(min(-4.0, low - 2.0), max(106.0, high + 2.0))
    axes.set_yticks(range(0, 101, 20))
    bounded(axes, 100.0)


def _draw_pair(axes: Axes, found: DirectionStatistics, method: str, i: int) -> None:
    """Forward left, backward right, the mean of each on its outer side."""
    parts: dict[str, DirectionStatistics | Scores] = {"forward": found, "backward": found.backward}
    codes = found.participants.codes
    columns = [100.0 * part.participants.column(method, codes) for part in parts.values()]
    colour = method_colour(i)
    if len(codes) <= MANY:
        centres = [i + 0.13 * side for side in _SIDES.values()]
        draw_points(
            axes, centres, np.stack(columns, axis=1), places(len(codes), 0.06), list(DIRECTION_MARKERS.values())
        )
    for (direction, part), values in zip(parts.items(), columns, strict=True):
        side = _SIDES[direction]
        if len(codes) > MANY:
            draw_histogram(axes, i, values, bin_width=10.0, half_width=0.24, colour=colour, side=side)
        mean, sd = part.means.get(method, math.nan), part.sds.get(method, math.nan)
        draw_mean(
            axes,
            i + 0.31 * side,
            100.0 * mean,
            100.0 * sd,
            colour=colour if direction == "forward" else "white",
            marker=DIRECTION_MARKERS[direction],
        )


def _draw_measure(axes: Axes, found: DirectionStatistics, measure: _Measure, title: str) -> None:
    methods = found.methods
    _frame(axes, methods, title, measure.label)
    reference_line(axes, 0.0, measure.zero)
    limit = largest_d_prime(found) if measure.key == "d_prime" else None
    if limit is not None:
        reference_line(axes, limit, "largest\npossible")
    values = _measured(found, measure.key)
    if len(values) <= MANY:
        draw_points(axes, range(len(methods)), values, places(len(values), 0.26, 0.08), ["o"] * len(methods))
    for i, method in enumerate(methods):
        colour, one = method_colour(i), found.sensitivity[method]
        if len(values) > MANY:
            draw_histogram(axes, i, values[:, i], bin_width=0.25, half_width=0.36, colour=colour)
        if one is not None:
            mean = one.d_prime if measure.key == "d_prime" else one.criterion
            draw_mean(axes, i, mean.mean, mean.sd, colour=colour)
    low, high = _extent(axes, values, limit)
    axes.set_ylim(low, high)


def _measured(found: DirectionStatistics, key: str) -> FloatArray:
    """Everybody's measure with each method (participants, methods); NaN where it is undefined."""
    codes = found.participants.codes
    of = [found.sensitivity[method] for method in found.methods]
    nobody = np.full(len(codes), np.nan)
    return np.stack([nobody if one is None else one.participants.column(key, codes) for one in of], axis=1)


def _extent(axes: Axes, values: FloatArray, limit: float | None) -> tuple[float, float]:
    """At least -1 to 1, and a little more than whiskers, people and limit need."""
    known = [*values[np.isfinite(values)], *axes.dataLim.intervaly, -1.0, 1.0, limit or 0.0]
    low, high = float(min(known)), float(max(known))
    room = 0.04 * (high - low)
    return low - room, high + room


def largest_d_prime(found: DirectionStatistics) -> float | None:
    """d′ of somebody who is always right; None if the numbers of trials differ or are not known."""
    if any(test.fewest_and_most is not None for tests in found.binomial.values() for test in tests.values()):
        return None
    counts = {
        tuple(tests[direction].trials / found.n for direction in _SIDES if direction in tests)
        for tests in found.binomial.values()
    }
    trials = counts.pop() if len(counts) == 1 else ()
    if len(trials) != 2 or not all(count == int(count) for count in trials):
        return None
    return float(yes_no(trials[0], trials[0], 0, trials[1]).d_prime)


def _frame(axes: Axes, methods: Sequence[str], title: str, label: str) -> None:
    light_grid(axes)
    name_ticks(axes, methods)
    axes.set_title(title, loc="left", fontweight="bold")
    axes.set_ylabel(label)


def _explain(figure: Figure, found: DirectionStatistics) -> None:
    """The legend below: which mark is which direction, and what stands for whom."""
    handles = [
        Line2D([], [], marker=marker, linestyle="", mfc=fill, mec=BLACK, label=f"{direction} shots")
        for (direction, marker), fill in zip(DIRECTION_MARKERS.items(), (BLACK, "white"), strict=True)
    ]
    figure.legend(handles=handles, loc="outside upper right", ncols=2, frameon=False, fontsize=8.5)
    figure.supxlabel(found.people, fontsize=8.0)
