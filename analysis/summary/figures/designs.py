"""What each question of a design gave: curves over a factor of numbers, else marks by level; a panel a question.

Where more series than `_MOST_SERIES` would lie on one another, it has a panel for each level of another factor.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from matplotlib.transforms import ScaledTranslation

from analysis.report.figures.glyphs import is_drawable
from analysis.report.figures.style import (
    MANY_METHODS,
    drawn,
    drawn_name,
    even_ticks,
    left_of,
    legend_columns,
    light_grid,
    method_look,
    name_ticks,
    names_at,
    part_left,
    reference_line,
    width_for,
)
from analysis.report.labels import text_columns
from analysis.summary.question_results import ConditionSummary, QuestionSummary
from analysis.summary.results import DesignSummary
from experiments.design.language import Level, shown_level
from experiments.design.methods_section import factor_words

_ACROSS = 2
_HITS, _ALARMS = "hits", "false alarms"
_NONE = f"none: {_ALARMS}"
"""The tick of catch trials, left of the levels, where they have none of these."""
_UNJOINED = {"linestyle": "none"}
_HOLLOW = {"linestyle": "none", "mfc": "white"}
_MOST_SERIES = 4
_LEGEND_COLUMNS = 3
_TICKS = 10
"""So many levels have a tick each."""
_ASIDE = 0.012
"""So far, as a share of the axis, two series of numbers stand apart: about a mark's width."""
_EVEN_STEPS, _WITH_HALVES = 1.0, 2.5
"""Over fewer decades a logarithmic axis has ticks in even steps, and at 2 and 5 of each decade too."""
_NAMES_IN, _LINE_IN = 0.48, 0.165
"""So high are names of one line below an axis and what the axis is called, and each further line."""
_UPWARD = 36
"""So many columns of text fit beside an axis of numbers."""
_PLAIN = 1e-4, 1e6
"""Numbers between these stand at ticks as they are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanMark:
    """A mean with its ends: over people the SD, of right answers the exact interval."""

    x: float
    mean: float
    low: float
    high: float


def figure_design(found: DesignSummary, path_stem: Path) -> None:
    """A panel or more for each question; PNG, SVG and PDF are written. `ValueError` if no question has a condition."""
    shown = {name: question for name, question in found.questions.items() if question.drawn}
    if not shown:
        raise ValueError("the figure of a design needs a question with an answer")
    panels = [panel for name, question in shown.items() for panel in _panels(name, question, found)]
    width = max(_panel_width(panel.question) for panel in panels)
    columns = min(_ACROSS, len(panels), int(width_for(99) / width))
    rows = -(-len(panels) // columns)
    with drawn(path_stem, 0.8 + width * columns, 0.4 + 3.6 * rows) as figure:
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        first: dict[str, Axes] = {}
        for spare in grid[len(panels) :]:
            spare.set_visible(False)
        for axes, panel in zip(grid, panels, strict=False):
            if first.setdefault(panel.name, axes) is not axes:
                axes.sharey(first[panel.name])
            _draw(axes, panel.name, panel.question, found)
            axes.set_title(panel.title, loc="left", fontweight="bold", parse_math=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Panel:
    """A question, called `name`, or its conditions of one level, which they are without; and what stands above it."""

    name: str
    title: str
    question: QuestionSummary


def _panels(name: str, question: QuestionSummary, found: DesignSummary, title: str = "") -> Iterator[_Panel]:
    """One, or where there are too many series one for each level of the first factor that is not along the axis."""
    if question.preferred:
        question = replace(question, cells=question.preferred)
    title = title or name
    across = _across(question)
    others = [factor for factor in _factors(question) if factor != across]
    series = {tuple(cell.levels.get(factor) for factor in others) for cell in question.pictured}
    if len(others) < 2 or len(series) <= _MOST_SERIES:
        yield _Panel(name=name, title=title, question=question)
        return
    by = others[0]
    for level in dict.fromkeys(cell.levels[by] for cell in question.pictured if by in cell.levels):
        own = [cell for cell in question.cells if cell.levels.get(by, level) == level]
        cells = [
            replace(cell, levels={factor: of for factor, of in cell.levels.items() if factor != by}) for cell in own
        ]
        part = replace(question, cells=tuple(cells), preferred=None)
        yield from _panels(name, part, found, f"{title}, {drawn_name(found.label(by, level))}")


def _panel_width(question: QuestionSummary) -> float:
    """How wide a question's panel is, in inches: for so many names along the axis."""
    factor = _across(question)
    levels = {cell.levels[factor] for cell in question.cells if factor in cell.levels} if factor is not None else set()
    words = len(levels) if any(isinstance(level, str) for level in levels) else 0
    return 4.6 if words <= MANY_METHODS else min(width_for(words), width_for(99) - 0.8)


def _across(question: QuestionSummary) -> str | None:
    """The factor along the axis: the first of three numbers or more, else that of most levels; `None` without one."""
    levels = {name: {cell.levels.get(name) for cell in question.cells} - {None} for name in _factors(question)}
    numeric = [name for name, some in levels.items() if len(some) > 2 and all(isinstance(x, float) for x in some)]
    return next(iter(numeric), max(levels, key=lambda name: len(levels[name]), default=None))


def _factors(question: QuestionSummary) -> list[str]:
    return list(dict.fromkeys(name for cell in question.cells for name in cell.levels))


def _draw(axes: Axes, name: str, question: QuestionSummary, found: DesignSummary) -> None:
    light_grid(axes)
    factor = _across(question)
    cells = [cell for cell in question.pictured if factor is None or factor in cell.levels]
    alarms = question.false_alarms
    aside = [cell for cell in alarms if factor is None or factor in cell.levels]
    apart = () if aside else alarms  # catch trials that have no level along the axis
    levels = [cell.levels[factor] if factor is not None else "all" for cell in cells]
    places = _places([None, *levels] if apart else levels)
    numeric = all(isinstance(level, float) for level in places if level is not None)
    hits = _series(cells, factor, found, _HITS if aside else "") | _series(aside, factor, found, _ALARMS)
    logarithmic = question.kind == "number" and numeric and min(places.values()) > 0
    series = [(label, some, {} if numeric else _UNJOINED) for label, some in hits.items()]
    series += [(label, some, _HOLLOW) for label, some in _series(apart, factor, found, "").items()]
    labels = [*dict.fromkeys(label for label, _, _ in series)]
    for label, some, look in series:
        i = labels.index(label)
        off = i - (len(labels) - 1) / 2  # marks and bars of several series would hide each other
        marks = sorted(_marks(question, some, factor, places), key=lambda mark: mark.x)
        shifted = [replace(mark, x=_shifted(mark.x, off, [*places.values()], numeric, logarithmic)) for mark in marks]
        told = {"label": label} if hits.get(label, some) is some else {}  # once
        _draw_series(axes, shifted, **method_look(i) | look | told)
    if question.kind == "number":
        _logarithmic(axes, both=logarithmic)
    _label(axes, name, question, factor)
    called = found.labels.get(factor or "", {})  # the axis has the unit
    codes = [_NONE if level is None else shown_level(level) for level in places]
    _tick(axes, question, places, [called.get(code, code) for code in codes])


def _places(levels: Sequence[Level | None]) -> dict[Level | None, float]:
    """Where each level stands: numbers at their value, words one after the other; `None`, without any, left of all."""
    there = list(dict.fromkeys(levels))
    numbers = sorted(level for level in there if isinstance(level, float))
    if len(numbers) > 1 and len(numbers) == len({*there} - {None}):
        left: dict[Level | None, float] = {None: left_of(numbers)} if None in there else {}
        return left | {level: level for level in numbers}
    return {level: float(place) for place, level in enumerate(there)}


def _series(
    cells: Sequence[ConditionSummary], factor: str | None, design: DesignSummary, what: str
) -> dict[str, list[ConditionSummary]]:
    """The conditions by `what` they show and the levels of the other factors."""
    found: dict[str, list[ConditionSummary]] = {}
    for cell in cells:
        others = [drawn_name(design.label(name, level)) for name, level in cell.levels.items() if name != factor]
        found.setdefault(", ".join(filter(None, [what, *others])), []).append(cell)
    return found


def _marks(
    question: QuestionSummary,
    cells: Sequence[ConditionSummary],
    factor: str | None,
    places: Mapping[Level | None, float],
) -> Iterator[MeanMark]:
    for cell in cells:
        if cell.mean is None:
            continue
        x, spread = places[cell.levels.get(factor) if factor is not None else "all"], cell.sd or 0.0
        if cell.ci_low is not None and cell.ci_high is not None and cell.right is not None:
            share = cell.right / cell.trials
            yield MeanMark(x=x, mean=100 * share, low=100 * cell.ci_low, high=100 * cell.ci_high)
        elif question.kind == "number":
            yield MeanMark(x=x, mean=cell.mean, low=cell.mean * math.exp(-spread), high=cell.mean * math.exp(spread))
        elif question.kind in ("choice", "yes-no"):
            low, high = max(0.0, cell.mean - spread), min(1.0, cell.mean + spread)
            yield MeanMark(x=x, mean=100 * cell.mean, low=100 * low, high=100 * high)
        else:
            yield MeanMark(x=x, mean=cell.mean, low=cell.mean - spread, high=cell.mean + spread)


def _shifted(x: float, aside: float, places: Sequence[float], numeric: bool, logarithmic: bool) -> float:
    """Where a mark of a series stands that is so many places aside of the middle one."""
    if not numeric:
        return x + 0.06 * aside
    low, high = min(places), max(places)
    return x * (high / low) ** (_ASIDE * aside) if logarithmic else x + _ASIDE * (high - low) * aside


def _draw_series(axes: Axes, marks: Sequence[MeanMark], **look: Any) -> None:
    if marks:
        axes.errorbar(
            [mark.x for mark in marks],
            [mark.mean for mark in marks],
            yerr=[[mark.mean - mark.low for mark in marks], [mark.high - mark.mean for mark in marks]],
            markersize=5.0,
            capsize=2.5,
            linewidth=1.2,
            **look,
        )


def _logarithmic(axes: Axes, *, both: bool) -> None:
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    decades = math.log10(high) - math.log10(low)
    if decades < _EVEN_STEPS:
        axes.yaxis.set_major_locator(MaxNLocator(5))
    else:
        subs = (1.0, 2.0, 5.0) if decades < _WITH_HALVES else (1.0,)
        axes.yaxis.set_major_locator(LogLocator(subs=subs, numticks=7))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: _numbered(value)))
    axes.yaxis.set_minor_formatter(NullFormatter())  # all of them would lie on one another
    if both:
        axes.set_xscale("log")


def _numbered(value: float) -> str:
    """A number at a tick as it is; a power of ten where it would be long."""
    if _PLAIN[0] <= value < _PLAIN[1]:
        return f"{value:.6g}"
    digits, power = f"{value:.6e}".split("e")
    times = "" if float(digits) == 1.0 else rf"{float(digits):g} \cdot "
    return rf"${times}10^{{{int(power)}}}$"


def _label(axes: Axes, name: str, question: QuestionSummary, factor: str | None) -> None:
    scored = any(cell.right is not None for cell in question.cells)
    hits = f"hits and {_ALARMS}" if question.false_alarms else "hits"
    of = hits if question.detected else "right" if scored else "chosen"
    counted = question.counted or ""
    label = question.label(counted)
    share = f"share of {drawn_name(label if is_drawable(label) else counted)} [%]" if counted else f"{of} [%]"
    axes.set_ylabel(share if question.kind in ("choice", "yes-no") else _with_scale(name, question))
    axes.set_xlabel(factor_words(factor) if factor else "")
    if scored and question.chance is not None and question.kind == "choice":
        reference_line(axes, 100.0 * question.chance, "chance")
    if question.kind in ("choice", "yes-no"):
        axes.set_ylim(-3.0, 103.0)


def _with_scale(name: str, question: QuestionSummary) -> str:
    """A rating or ranking with what its numbers mean, below it where both take more than a line, if it fits there."""
    scale = f"({question.scale})" if question.scale else ""
    if not scale or text_columns(scale) > _UPWARD:
        return name
    apart = " " if text_columns(f"{name} {scale}") <= _UPWARD else "\n"
    return f"{name}{apart}{scale}".replace("$", r"\$")  # which begins no formula here


def _tick(axes: Axes, question: QuestionSummary, places: Mapping[Level | None, float], names: Sequence[str]) -> None:
    """A tick with its name for each level, or of many numbers at some; then the legend."""
    levels = [level for level in places if level is not None]
    if None in places:
        part_left(axes, [places[level] for level in levels])
    numbers = [level for level in levels if isinstance(level, float)]
    if len(levels) == 1 or numbers != levels:
        name_ticks(axes, names, room_in=_panel_width(question))
    elif len(levels) <= _TICKS:
        names_at(axes, [*places.values()], names)
        axes.xaxis.minorticks_off()
    elif None in places:
        some = even_ticks(numbers, _TICKS)
        names_at(axes, [places[None], *some], [_NONE, *(f"{at:g}" for at in some)])
    _add_legend(axes, question)


def _add_legend(axes: Axes, question: QuestionSummary) -> None:
    """The legend of several series, below the axis and the names there, where no mark can lie."""
    labels = axes.get_legend_handles_labels()[1]
    others = ", ".join(factor_words(one) for one in _factors(question) if one != _across(question))
    if labels:
        ticks = axes.get_xticklabels()
        upright = any(tick.get_rotation() for tick in ticks)
        lines = [text_columns(tick.get_text()) / 2.0 if upright else tick.get_text().count("\n") for tick in ticks]
        below = _NAMES_IN + _LINE_IN * max([0.0, *lines])  # however low the panel is
        axes.legend(
            frameon=False,
            fontsize=8.0,
            title=others,
            title_fontsize=8.0,
            loc="upper center",
            bbox_to_anchor=(0.5, 0.0),
            bbox_transform=axes.transAxes + ScaledTranslation(0.0, -below, axes.figure.dpi_scale_trans),
            ncols=legend_columns(_panel_width(question), labels, _LEGEND_COLUMNS),
        )
