"""Response times, and speed against accuracy: conditional accuracy functions and quantile-probability plots."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from analysis.report.figures.crowd import MANY, places
from analysis.report.figures.style import (
    BLACK,
    DIRECTION_MARKERS,
    INK,
    MANY_METHODS,
    drawn,
    drawn_name,
    legend_below,
    legend_columns,
    light_grid,
    method_colour,
    method_line,
    method_look,
    method_marker,
    name_ticks,
    reference_line,
    width_for,
)
from analysis.summary.results import DirectionStatistics
from analysis.times.own_trials import ResponseTimes
from analysis.times.speed_accuracy import CellTrade, NoSpeedAccuracy, SpeedAccuracy

_Cells = Sequence[tuple[int, CellTrade]]
"""One instruction's cells, each with the place of its condition, which has its colour and mark from there."""

_ACROSS = 3
"""So many panels stand side by side."""

FEWEST_A_POINT = 20
"""A point that is drawn rests on so many trials (assumed): the standard error of a rate is then 11 points at most."""


class _Draw(Protocol):
    def __call__(self, axes: Axes, cells: _Cells, trade: SpeedAccuracy, *, last: bool) -> None:
        """Draw one instruction's cells; `last` of its row of panels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Panel:
    """What is drawn in each panel, and how far the axes go that all share.

    `kinds`: fill and name of the marks that the legend explains beside the conditions.
    """

    draw: _Draw
    limit: Callable[[Axes, SpeedAccuracy], None]
    across: str
    upward: str
    lines: bool
    kinds: Sequence[tuple[str, str]] = ()


Trade = SpeedAccuracy | NoSpeedAccuracy | None
"""The measures, or why there are none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TradeNames:
    """What conditions, in their order, and instructions are called."""

    conditions: Mapping[str, str]
    instructions: Mapping[str, str]


def figure_conditional_accuracy(trade: Trade, names: TradeNames, path_stem: Path) -> None:
    """Accuracy over response time, a line a condition, a panel an instruction; PNG, SVG and PDF are written.

    `ValueError` if no condition has enough trials in every bin.
    """
    if not isinstance(trade, SpeedAccuracy) or not has_curve(trade):
        raise ValueError(f"the figure of conditional accuracy needs {FEWEST_A_POINT} trials in each bin of a condition")
    _panels(names, trade, path_stem, _CURVES)


def figure_quantile_probability(trade: Trade, names: TradeNames, path_stem: Path) -> None:
    """Quantiles of the times of errors and correct answers over their probabilities; PNG, SVG and PDF are written.

    `ValueError` if no condition has enough answers of a kind.
    """
    if not isinstance(trade, SpeedAccuracy) or not has_points(trade):
        raise ValueError(f"the quantile-probability plot needs {FEWEST_A_POINT} answers of a kind in a condition")
    _panels(names, trade, path_stem, _POINTS)


def has_curve(trade: Trade) -> bool:
    """Whether there is a conditional accuracy function to draw."""
    return any(map(draws_curve, _cells_of(trade)))


def has_points(trade: Trade) -> bool:
    """Whether there is a point of a quantile-probability plot."""
    return any(any(draws_points(cell)) for cell in _cells_of(trade))


def draws_curve(cell: CellTrade) -> bool:
    """Whether a condition's conditional accuracy is drawn: each of its points rests on enough trials."""
    return cell.conditional_accuracy.trials >= FEWEST_A_POINT


def draws_points(cell: CellTrade) -> tuple[bool, bool]:
    """Whether the time quantiles of a condition's errors, and of its correct answers, are drawn."""
    errors, correct = cell.quantile_probability.answers >= FEWEST_A_POINT
    return bool(errors), bool(correct)


def _cells_of(trade: Trade) -> list[CellTrade]:
    if trade is None:
        return []
    return [cell for by_instruction in trade.methods.values() for cell in by_instruction.values()]


def _panels(names: TradeNames, trade: SpeedAccuracy, path_stem: Path, panel: _Panel) -> None:
    """A panel an instruction on shared axes, the conditions' legend above all."""
    places = {name: place for place, name in enumerate(names.conditions)}
    instructions = [i for i in trade.instructions if any(i in one for one in trade.methods.values())]
    columns = min(_ACROSS, len(instructions))
    rows = -(-len(instructions) // columns)
    shown = [(places[name], called) for name, called in names.conditions.items() if name in trade.methods]
    width = 5.8 if columns == 1 else 0.6 + 3.3 * columns
    handles = [*_handles(shown, lines=panel.lines), *_kinds(panel)]
    across = legend_columns(width, [str(handle.get_label()) for handle in handles])
    legend_rows = -(-len(handles) // across)
    with drawn(path_stem, width, 0.5 + 3.7 * rows + 0.19 * (legend_rows - 1)) as figure:
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
        for spare in grid[len(instructions) :]:
            spare.set_visible(False)
        for k, (axes, instruction) in enumerate(zip(grid, instructions, strict=False)):
            light_grid(axes)
            told = [(places[m], one[instruction]) for m, one in trade.methods.items() if instruction in one]
            panel.draw(axes, told, trade, last=(k + 1) % columns == 0)
            axes.tick_params(labelbottom=True)
            axes.set_xlabel(panel.across)
            axes.set_ylabel("" if k % columns else panel.upward)
            if len(instructions) > 1:
                title = textwrap.shorten(
                    f"({chr(ord('a') + k)}) {names.instructions[instruction]}", 36, placeholder=" ..."
                )
                axes.set_title(title, loc="left", fontweight="bold", parse_math=False)
        panel.limit(grid[0], trade)
        long = 4.5 if len(shown) > MANY_METHODS else None
        figure.legend(handles=handles, loc="outside upper center", ncols=across, frameon=False, handlelength=long)


def _handles(names: Sequence[tuple[int, str]], *, lines: bool) -> list[Line2D]:
    """The conditions by colour, mark and, where there are lines, line."""
    return [
        Line2D([], [], **look, markersize=5.5, label=name)
        for i, name in names
        for look in [method_look(i) if lines else method_look(i) | {"linestyle": "none"}]
    ]


def _kinds(panel: _Panel) -> list[Line2D]:
    marks: dict[str, Any] = {"ls": "none", "marker": "o", "ms": 5.5, "mec": INK}
    return [Line2D([], [], mfc=fill, label=name, **marks) for fill, name in panel.kinds]


def _draw_curves(axes: Axes, cells: _Cells, trade: SpeedAccuracy, *, last: bool) -> None:  # noqa: ARG001 - one of two
    for i, cell in cells:
        curve = cell.conditional_accuracy
        if draws_curve(cell):
            axes.plot(
                curve.mean_time_s,
                100.0 * np.array(curve.accuracy),
                **method_look(i),
                markersize=5.5,
                linewidth=1.7,
                zorder=3.0,
                clip_on=False,
            )
    reference_line(axes, 50.0, "chance" if last else "")


def _limit_curves(axes: Axes, trade: SpeedAccuracy) -> None:
    slowest = max(max(cell.conditional_accuracy.mean_time_s) for cell in _cells_of(trade) if draws_curve(cell))
    axes.set_xlim(0.0, 1.05 * slowest)
    axes.set_ylim(0.0, 100.0)


def _draw_points(axes: Axes, cells: _Cells, trade: SpeedAccuracy, *, last: bool) -> None:  # noqa: ARG001 - one of two
    """Each kind of answer of each method as a column of quantiles; grey lines join equal quantiles."""
    columns: list[tuple[float, Sequence[float]]] = []
    for i, cell in cells:
        points = cell.quantile_probability
        for kind, fill in ((0, "white"), (1, method_colour(i))):
            if draws_points(cell)[kind]:
                probability, quantiles = points.probability[kind], points.quantiles_s[kind]
                columns.append((probability, quantiles))
                axes.plot(
                    [probability] * len(quantiles),
                    quantiles,
                    linestyle="none",
                    marker=method_marker(i),
                    markersize=5.5,
                    mfc=fill,
                    mec=method_colour(i),
                    mew=1.2,
                    zorder=3.0,
                    clip_on=False,
                )
    _join(axes, columns, trade)
    axes.axvline(0.5, color="#666666", linewidth=0.9, linestyle=(0, (4, 3)), zorder=1.5)


def _limit_points(axes: Axes, trade: SpeedAccuracy) -> None:
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, _highest(trade))


def _highest(trade: SpeedAccuracy) -> float:
    """The end of the axis of quantiles."""
    cells = _cells_of(trade)
    shown = [max(cell.quantile_probability.quantiles_s[k]) for cell in cells for k in (0, 1) if draws_points(cell)[k]]
    return float(1.05 * max(shown))


def _join(axes: Axes, columns: Sequence[tuple[float, Sequence[float]]], trade: SpeedAccuracy) -> None:
    """Lines through equal quantiles in the order of their probabilities, named where there is room for it."""
    ordered = sorted(columns, key=lambda column: column[0])
    for k in range(len(trade.quantiles)):
        heights = [quantiles[k] for _, quantiles in ordered]
        axes.plot([probability for probability, _ in ordered], heights, color="#999999", linewidth=0.8, zorder=2.0)
    if not ordered:
        return
    probability, ends = ordered[-1]
    for k in _named_lines(ends, _LINE_OF_TEXT * _highest(trade)):
        axes.annotate(
            f"{100.0 * trade.quantiles[k]:.0f} %",
            xy=(probability, ends[k]),
            xytext=(6.0, 0.0),
            textcoords="offset points",
            va="center",
            fontsize=7.5,
            color=BLACK,
            annotation_clip=False,
        )


_LINE_OF_TEXT = 0.05
"""A line of small text is so much of the height of a panel."""


def _named_lines(ends: Sequence[float], apart: float) -> list[int]:
    """Which of some lines are named at their ends: the lowest, then each that is far enough above the last one.

    >>> _named_lines([0.1, 0.2, 0.5, 0.6], 0.2)
    [0, 2]
    """
    named = [0]
    for k in range(1, len(ends)):
        if ends[k] - ends[named[-1]] >= apart:
            named.append(k)
    return named


_CURVES = _Panel(
    draw=_draw_curves,
    limit=_limit_curves,
    across="mean response time of the bin [s]",
    upward="correct answers of the bin [%]",
    lines=True,
)
_POINTS = _Panel(
    draw=_draw_points,
    limit=_limit_points,
    across="probability of the answer",
    upward="response time quantile [s]",
    lines=False,
    kinds=(("white", "errors"), (INK, "correct answers")),
)

_PLACES = {"forward": -0.19, "backward": 0.19}


def figure_response_times(found: DirectionStatistics, path_stem: Path) -> None:
    """Valid response times as cumulative shares and as boxes (5, 25, 50, 75, 95 %); PNG, SVG and PDF are written.

    `ValueError` if there is no valid time.
    """
    times = found.response_times
    if not times.n:
        raise ValueError("the figure of response times needs at least one valid time")
    many = len(found.methods) > MANY_METHODS
    width = width_for(len(found.methods)) if many else 8.6 + 1.6 * max(0, len(found.methods) - 3)
    known = [method for method in found.methods if times.methods.get(method)]
    across = legend_columns(width - 0.6, [_counted(times, method) for method in known], 4)
    height = (8.2 if many else 3.9) + 0.17 * -(-len(known) // across)
    with drawn(path_stem, width, height) as figure:
        one, other = figure.subplots(2, 1) if many else figure.subplots(1, 2, width_ratios=[1.0, 1.15])
        _draw_shares(one, times, found.methods, _limit(times))
        _draw_boxes(other, times, found.methods)
        legend_below(figure, one, across)  # beside the curves there is no place that none of them may cross


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
            label, line = _counted(times, method), method_line(i)
            shares = np.arange(len(spread.percentiles))
            axes.plot(spread.percentiles, shares, color=method_colour(i), linestyle=line, linewidth=1.7, label=label)
            slowest = max(slowest, spread.percentiles[-1])
    axes.set_xlim(0.0, limit)
    axes.set_ylim(0.0, 101.0)
    beyond = f"\n(cut: the slowest took {slowest:.1f} s)" if slowest > limit else ""
    axes.set_xlabel(f"response time [s]{beyond}")
    axes.set_ylabel("share of the trials answered by then [%]")
    axes.set_title("(a) Cumulative distribution", loc="left", fontweight="bold")


def _counted(times: ResponseTimes, method: str) -> str:
    """A method with the number of its times, for the legend."""
    spread = times.methods.get(method)
    return f"{drawn_name(method)} (n = {spread.n if spread else 0:,})"


def _draw_boxes(axes: Axes, times: ResponseTimes, methods: Sequence[str]) -> None:
    light_grid(axes)
    for i, method in enumerate(methods):
        for direction, place in _PLACES.items():
            spread = times.directions.get(method, {}).get(direction)
            if spread:
                _draw_box(axes, i + place, spread.percentiles, method_colour(i), filled=direction == "forward")
                _draw_medians(axes, i + place, times, method, direction)
    axes.set_ylim(bottom=0.0)
    counts = [_counts(times, method) for method in methods]
    if len(methods) <= MANY_METHODS:
        apart = " / " if max(map(len, counts)) <= _SIDE_BY_SIDE else " /\n"
        counts = [f"n = {one.replace(' / ', apart)}" for one in counts]
    name_ticks(axes, methods, counts)
    axes.set_ylabel("response time [s]")
    axes.set_title("(b) By direction", loc="left", fontweight="bold")
    handles = [
        Patch(facecolor="#bbbbbb", edgecolor=BLACK, label="forward shots"),
        Patch(facecolor="white", edgecolor=BLACK, label="backward shots"),
    ]
    beside: Any = {"loc": "lower right", "bbox_to_anchor": (1.02, 1.0), "borderpad": 0.2, "columnspacing": 1.0}
    axes.legend(handles=handles, ncols=2, frameon=False, fontsize=8.0, handlelength=1.6, **beside)


_SIDE_BY_SIDE = len("1,000 / 1,000")
"""Longer counts of a few methods stand one above the other: side by side they would touch those of the next."""


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


def _draw_medians(axes: Axes, place: float, times: ResponseTimes, method: str, direction: str) -> None:
    """A point a participant; beyond 200 of them the boxes stand alone."""
    medians = [own[method][direction] for own in times.participants.values() if direction in own.get(method, {})]
    if len(times.participants) <= MANY:
        across = place + places(len(medians), 0.11)
        size = 3.2 if len(medians) <= 30 else 2.0
        marker = DIRECTION_MARKERS[direction]
        axes.plot(across, medians, marker, markersize=size, mfc="white", mec=INK, mew=0.6, zorder=3.0)


def _counts(times: ResponseTimes, method: str) -> str:
    spreads = times.directions.get(method, {})
    return " / ".join(f"{spreads[d].n if d in spreads else 0:,}" for d in _PLACES)
