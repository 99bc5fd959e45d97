"""Figure 8: mean and SD of the correct rate and of the ratings, with every participant and the post-hoc tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes

from analysis.figures.style import BLACK, METHOD_COLOURS, light_grid, new_figure, save, style

_DISPLAY_NAMES = {
    "vibration": "Vibration",
    "asymmetric-1": "Asymmetric Force I",
    "asymmetric-2": "Asymmetric Force II",
}
Statistics = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Panel:
    """What is drawn of one experiment; `scale` turns the stored values into those of the axis."""

    experiment: str
    title: str
    label: str
    scale: float
    top: float


_PANELS = (
    _Panel(experiment="direction", title="Direction", label="correct rate, forward [%]", scale=100.0, top=100.0),
    _Panel(
        experiment="preference", title="Preference", label="rating (0 dislike, 10 like very much)", scale=1.0, top=10.0
    ),
)


def display_name(method: str) -> str:
    """The method's name in print; a method the paper does not know keeps its own.

    >>> display_name("asymmetric-2"), display_name("ramp")
    ('Asymmetric Force II', 'ramp')
    """
    return _DISPLAY_NAMES.get(method, method)


def named(text: str) -> str:
    """`text` with the paper's methods under the paper's names.

    >>> named("asymmetric-2 above vibration")
    'Asymmetric Force II above Vibration'
    """
    for method, name in _DISPLAY_NAMES.items():
        text = text.replace(method, name)
    return text


def stars(p: float | None) -> str:
    """Significance as the paper marks it.

    >>> stars(0.0004), stars(0.004), stars(0.04), stars(0.4)
    ('***', '**', '*', 'n.s.')
    """
    if p is None:
        return "n.s."
    return "***" if p < 0.001 else "**" if p < 0.01 else "*" if p < 0.05 else "n.s."


def figure_8(statistics: Statistics, path_stem: Path) -> tuple[Path, Path]:
    """Bars (mean, SD), participants as points, brackets from the Tukey tests; PNG and SVG are written.

    `statistics` is the content of `statistics.json`; an experiment it does not hold, or that holds no complete
    participant, gets no panel. `ValueError` if none is left.
    """
    panels = [panel for panel in _PANELS if statistics.get(panel.experiment, {}).get("n", 0) > 0]
    if not panels:
        raise ValueError("figure 8 needs an experiment with at least one complete participant")
    with mpl.rc_context(style()):  # type: ignore[arg-type]
        figure = new_figure(0.4 + 3.9 * len(panels), 4.3)
        row = figure.subplots(1, len(panels), squeeze=False)[0]
        for i, (axes, panel) in enumerate(zip(row, panels, strict=True)):
            _draw_panel(axes, panel, statistics[panel.experiment], chr(ord("a") + i))
        return save(figure, path_stem)


def _draw_panel(axes: Axes, panel: _Panel, found: Statistics, letter: str) -> None:
    methods: list[str] = found["methods"]
    light_grid(axes)
    ceiling = max(_draw_bars(axes, panel, found, methods), _draw_people(axes, panel, found, methods))
    highest = _draw_brackets(axes, found["tukey"] or [], methods, ceiling, 0.075 * panel.top)
    axes.set_ylim(0.0, max(highest, panel.top) + 0.04 * panel.top)
    axes.set_yticks(np.linspace(0.0, panel.top, 6))
    axes.set_xlim(-0.6, len(methods) - 0.4)
    axes.set_xticks(range(len(methods)), [_wrapped(display_name(method)) for method in methods])
    axes.set_xlabel(f"bars: mean and SD; points: participants (n = {found['n']})", fontsize=8.0, labelpad=8.0)
    axes.set_ylabel(panel.label)
    axes.set_title(f"({letter}) {panel.title}", loc="left", fontweight="bold")


def _draw_bars(axes: Axes, panel: _Panel, found: Statistics, methods: Sequence[str]) -> float:
    """The bars; gives back the top of the highest whisker."""
    means = [panel.scale * found["means"][method] for method in methods]
    spreads = [panel.scale * (found["sds"][method] or 0.0) for method in methods]
    colours = [METHOD_COLOURS[i % len(METHOD_COLOURS)] for i in range(len(methods))]
    axes.bar(range(len(methods)), means, width=0.62, color=colours, edgecolor=BLACK, linewidth=0.8)
    axes.errorbar(range(len(methods)), means, yerr=spreads, fmt="none", ecolor=BLACK, capsize=5.0, linewidth=1.2)
    return float(max(mean + spread for mean, spread in zip(means, spreads, strict=True)))


def _draw_people(axes: Axes, panel: _Panel, found: Statistics, methods: Sequence[str]) -> float:
    """A point a participant, each at the same place beside every bar; gives back the highest."""
    people = list(found["participants"].values())
    places = np.linspace(-0.22, 0.22, len(people)) if len(people) > 1 else np.zeros(1)
    highest = 0.0
    for i, method in enumerate(methods):
        values = panel.scale * np.array([person[method] for person in people])
        axes.plot(i + places, values, "o", markersize=3.2, mfc="white", mec="#333333", mew=0.8, zorder=3, clip_on=False)
        highest = max(highest, float(values.max()))
    return highest


def _draw_brackets(
    axes: Axes, comparisons: Sequence[Statistics], methods: Sequence[str], floor: float, step: float
) -> float:
    """Short brackets low, long ones above them; gives back the height that they need."""
    spans = [_span(comparison, methods) for comparison in comparisons]
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


def _span(comparison: Statistics, methods: Sequence[str]) -> tuple[int, int, str]:
    ends = [methods.index(comparison["a"]), methods.index(comparison["b"])]
    return min(ends), max(ends), stars(comparison["p"])


def _wrapped(name: str) -> str:
    """In two lines, broken before the second word."""
    return name.replace(" ", "\n", 1)
