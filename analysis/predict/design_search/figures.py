"""The trade of a gun's design: how well a direction would be felt against how fast the gun could shoot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from analysis.predict.design_search.choice import Designs
from analysis.predict.design_search.results import DesignSearch, DrivePrediction
from analysis.report.figures.style import BLACK, BLUE, INK, ORANGE, VERMILION, drawn, light_grid, method_line
from analysis.stats.arrays import FloatArray

BOTH = "both directions alike"
MARKERS = "os^Dv<>"
FAINT, SOFT = "#d6d6d6", "#9db8cc"


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """A design with a name."""

    name: str
    design: DrivePrediction


def shown_up_to_Hz(found: DesignSearch) -> float:  # noqa: N802 - the unit ends the name
    """The rate to which the front reaches the criterion, and no named design or bound lies beyond.

    What is faster stands in `design.json` alone.
    """
    reached = [one for one in found.front if one.predicted is not None and one.predicted >= found.critical.level]
    named = [mark.design for mark in _own_marks(found)] + ([found.best] if found.best else [])
    return max([found.rate_above_Hz, *(one.shooting_rate_Hz for one in (*reached, *named))])


def figure_trade(found: DesignSearch, designs: Designs, path_stem: Path) -> None:
    """Predicted share over shooting rate, the front with its 95 % band, the bound, the gun's own methods, the best."""
    bound_Hz, best = found.rate_above_Hz, _best_mark(found)
    rate_Hz, predicted, low, high = (
        np.array([getattr(one, key) for one in found.front], dtype=np.float64)
        for key in ("shooting_rate_Hz", "predicted", "ci_low", "ci_high")
    )
    with drawn(path_stem, 6.6, 4.6) as figure:
        axes = figure.subplots()
        light_grid(axes)
        _clouds(axes, designs)
        axes.fill_between(rate_Hz, 100.0 * low, 100.0 * high, color=BLUE, alpha=0.18, linewidth=0.0)
        axes.plot(rate_Hz, 100.0 * predicted, color=BLUE, linewidth=1.5, label="Pareto front, 95 % band")
        axes.axvline(bound_Hz, color="#444444", linewidth=0.9, linestyle=(0, (4, 3)), zorder=1.5)
        for place, mark in enumerate(_own_marks(found)):
            _point(axes, mark, VERMILION, MARKERS[place % len(MARKERS)], 6.0)
        if best is not None:
            _point(axes, best, ORANGE, "*", 13.0)
        _scales(axes, found, designs)
        where: Any = "outside lower center"
        figure.legend(loc=where, ncols=3, frameon=False, fontsize=8.0)


def _clouds(axes: Axes, designs: Designs) -> None:
    """All designs with a prediction as dots, with larger ones in the legend."""
    known = np.isfinite(designs.predicted)
    size = 2.0 if known.sum() > 4000 else 4.0
    for mask, colour, name in (
        (known & ~designs.proposable, FAINT, "beyond the device's limits"),
        (known & designs.proposable, SOFT, "a design"),
    ):
        x, y = designs.shooting_rate_Hz[mask], 100.0 * designs.predicted[mask]
        axes.plot(x, y, ".", color=colour, markersize=size, markeredgewidth=0.0, rasterized=True)
        if mask.any():
            axes.plot([], [], ".", color=colour, markersize=9.0, markeredgewidth=0.0, label=name)


def _point(axes: Axes, mark: Mark, colour: str, marker: str, size: float) -> None:
    """Without known limits the prediction stands for them."""
    one = mark.design
    predicted = math.nan if one.predicted is None else one.predicted
    low, high = (predicted if end is None else end for end in (one.ci_low, one.ci_high))
    axes.errorbar(
        [one.shooting_rate_Hz],
        [100.0 * predicted],
        yerr=[[100.0 * (predicted - low)], [100.0 * (high - predicted)]],
        fmt=marker,
        color=colour,
        markersize=size,
        markeredgecolor=BLACK,
        markeredgewidth=0.7,
        ecolor=BLACK,
        elinewidth=1.0,
        capsize=2.5,
        zorder=5,
        label=mark.name,
    )


def _scales(axes: Axes, found: DesignSearch, designs: Designs) -> None:
    """Rates from below the bound to the last that is shown."""
    bound_Hz = found.rate_above_Hz
    rates_Hz = designs.shooting_rate_Hz[designs.proposable & np.isfinite(designs.predicted)]
    slowest = float(rates_Hz.min()) if rates_Hz.size else 0.0
    axes.set_xlim(max(0.0, min(slowest, bound_Hz) - 0.2), 1.03 * shown_up_to_Hz(found))
    axes.set_ylim(48.0, 101.0)
    axes.set_xlabel("highest shooting rate [Hz]")
    axes.set_ylabel("right about a forward shot,\npredicted [%]")
    axes.annotate(
        f"bound {bound_Hz:g} Hz",
        xy=(bound_Hz, 48.0),
        xytext=(3.0, 3.0),
        textcoords="offset points",
        fontsize=7.5,
        color="#444444",
    )


AREAS = {"no-break-away": "#ececec", "stuck": "#8f8f8f", "not-home": "#c4b5a0"}
"""Where there is no prediction, by the status of the shot."""
AREA_NAMES = {
    "no-break-away": "no break-away: nothing is felt",
    "stuck": "stuck: friction holds the magnet off its stop",
    "not-home": "not home within the model's horizon",
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MapField:
    """What a map of one pulse stands on: its axes, and the status of the shots (frictions, voltages)."""

    pulse_s: float
    friction_N: FloatArray
    voltage_V: FloatArray
    status: Any  # words
    beyond: Any  # booleans over the voltages: a limit of the device would be broken


def figure_maps(found: DesignSearch, path_stem: Path) -> None:
    """Two maps over friction and voltage: predicted share and shooting rate, each with the line of what is asked."""
    plane, bound_Hz, best = found.map, found.rate_above_Hz, _best_mark(found)
    marks = [*_own_marks(found, swept=True, pulse_s=plane.pulse_s), *([best] if best else [])]
    beyond = [words is not None for words in plane.limit_of_voltage]
    field = _field_of(found, plane.pulse_s, plane.status, beyond)
    predicted = 100.0 * plane.predicted
    with drawn(path_stem, 8.6, 4.7) as figure:
        left, right = figure.subplots(1, 2, sharex=True, sharey=True)
        shares = _mesh(left, field, predicted, "viridis", (50.0, 100.0))
        _level(left, field, predicted, 100.0 * found.critical.level, "%")
        _level(left, field, plane.shooting_rate_Hz, bound_Hz, "Hz")
        figure.colorbar(shares, ax=left, label="right about a forward shot, predicted [%]")
        rates = _mesh(right, field, plane.shooting_rate_Hz, "cividis", (0.0, 4.0 * bound_Hz))
        _level(right, field, plane.shooting_rate_Hz, bound_Hz, "Hz")
        figure.colorbar(rates, ax=right, extend="max", label="highest shooting rate [Hz]")
        for axes, title in ((left, "felt"), (right, "fast")):
            axes.set_title(f"{title}, pulse {1e3 * field.pulse_s:.3g} ms", loc="left")
            _beyond(axes, field)
            _marks(axes, field, marks, best)
            axes.set_xlabel("damper friction [N]")
        left.set_ylabel("voltage [V]")
        _legend(figure, left, field)


def figure_critical(found: DesignSearch, path_stem: Path) -> None:
    """The contour of the level over friction and voltage with its band, and the contours under other assumptions."""
    critical, band = found.critical, found.critical.band
    field = _field_of(found, critical.pulse_s, critical.status, [False] * len(found.axes.voltage_V))
    others = {one.name: one.voltage_V for one in critical.alternatives} | {BOTH: critical.both_directions_V}
    with drawn(path_stem, 6.6, 5.2) as figure:
        axes = figure.subplots()
        _areas(axes, field)
        x, bottom, top = field.friction_N, float(field.voltage_V[0]), float(field.voltage_V[-1])
        low, high = (np.clip(part, bottom, top) for part in (band.low_V, band.high_V))
        if (high[:-1] + high[1:] > low[:-1] + low[1:]).any():
            axes.fill_between(x, low, high, color=BLUE, alpha=0.18, linewidth=0.0, label="95 % of the contours drawn")
        for n, (name, voltage_V) in enumerate(others.items()):
            dashes = method_line(n + 1)
            colour = (INK, INK, VERMILION, VERMILION, ORANGE)[n % 5]
            _contour(axes, x, voltage_V, "x+123"[n % 5], color=colour, linewidth=1.1, linestyle=dashes, label=name)
        name = f"{100.0 * critical.level:g} % right"
        _contour(axes, x, critical.voltage_V, "o", color=BLUE, linewidth=2.0, label=name)
        _marks(axes, field, _own_marks(found, swept=True), None)
        axes.set_xlim(float(x[0]), float(x[-1]))
        axes.set_ylim(bottom, top)
        axes.set_xlabel("damper friction [N]")
        axes.set_ylabel("voltage [V]")
        axes.set_title(f"Pulse {1e3 * field.pulse_s:.3g} ms", loc="left")
        _legend(figure, axes, field)


def _contour(axes: Axes, x: FloatArray, values: FloatArray, marker: str, **look: Any) -> None:
    """A line where neighbours are known, a mark where one alone is; without any nothing, in the legend neither."""
    known = np.isfinite(values)
    alone = known & ~np.append(known[1:], False) & ~np.append(False, known[:-1])
    if known.any():
        marks = {"marker": marker, "markersize": 6.0, "markevery": alone, "clip_on": False} if alone.any() else {}
        axes.plot(x, np.where(known, values, np.nan), **look, **marks)


def _mesh(axes: Axes, field: MapField, values: FloatArray, map_name: str, ends: tuple[float, float]) -> Any:
    """The values as coloured cells between the ends of the scale; gives back what a colour bar needs."""
    _areas(axes, field)
    return axes.pcolormesh(
        field.friction_N,
        field.voltage_V,
        np.ma.masked_invalid(values).T,
        cmap=map_name,
        vmin=ends[0],
        vmax=ends[1],
        shading="nearest",
        rasterized=True,
    )


def _areas(axes: Axes, field: MapField) -> None:
    number = np.full(field.status.shape, np.nan)
    for n, status in enumerate(AREAS):
        number[field.status == status] = n
    axes.pcolormesh(
        field.friction_N,
        field.voltage_V,
        np.ma.masked_invalid(number).T,
        cmap=ListedColormap(list(AREAS.values())),
        norm=BoundaryNorm(np.arange(-0.5, len(AREAS)), len(AREAS)),
        shading="nearest",
        rasterized=True,
    )


def _level(axes: Axes, field: MapField, values: FloatArray, height: float, unit: str) -> None:
    """A line at a height of the values, if they reach it."""
    known = values[np.isfinite(values)]
    if not known.size or not known.min() < height < known.max():
        return
    numbers = np.ma.masked_invalid(values).T
    dashes = "--" if unit == "Hz" else "-"
    line = axes.contour(field.friction_N, field.voltage_V, numbers, levels=[height], colors="white", linestyles=dashes)
    axes.clabel(line, fmt={height: f"{height:g} {unit}"}, fontsize=8.0)


def _beyond(axes: Axes, field: MapField) -> None:
    """Hatches over the voltages at which a limit of the device would be broken."""
    volts, half = field.voltage_V, 0.5 * np.diff(field.voltage_V)
    lows, highs = volts - np.append(half[:1], half), volts + np.append(half, half[-1:])
    for low, high in zip(lows[field.beyond], highs[field.beyond], strict=True):
        axes.axhspan(low, high, facecolor="none", edgecolor=INK, hatch="////", linewidth=0.0)


def _marks(axes: Axes, field: MapField, marks: Sequence[Mark], best: Mark | None) -> None:
    """The designs with a name that lie on the plane."""
    for n, mark in enumerate(marks):
        if not _holds(field, mark):
            continue
        is_best = mark is best
        axes.plot(
            [mark.design.friction_N],
            [mark.design.voltage_V],
            "*" if is_best else MARKERS[n % len(MARKERS)],
            color=ORANGE if is_best else VERMILION,
            markersize=13.0 if is_best else 6.5,
            markeredgecolor=BLACK if is_best else "white",
            markeredgewidth=0.8,
            linestyle="none",
            label=mark.name,
            zorder=6,
            clip_on=False,
        )


def _holds(field: MapField, mark: Mark) -> bool:
    x, y = field.friction_N, field.voltage_V
    return bool(x[0] <= mark.design.friction_N <= x[-1] and y[0] <= mark.design.voltage_V <= y[-1])


def _legend(figure: Figure, axes: Axes, field: MapField) -> None:
    handles, names = axes.get_legend_handles_labels()
    patches = [
        Patch(facecolor=colour, label=AREA_NAMES[status])
        for status, colour in AREAS.items()
        if (field.status == status).any()
    ]
    if field.beyond.any():
        patches.append(Patch(facecolor="white", edgecolor=INK, hatch="////", label="beyond the device's limits"))
    where: Any = "outside lower center"
    figure.legend(
        [*handles, *patches],
        [*names, *(str(patch.get_label()) for patch in patches)],
        loc=where,
        ncols=2,
        frameon=False,
        fontsize=8.0,
        handlelength=3.0,
    )


def _field_of(found: DesignSearch, pulse_s: float, status: Sequence[Sequence[str]], beyond: Sequence[bool]) -> MapField:
    return MapField(
        pulse_s=pulse_s,
        friction_N=np.array(found.axes.friction_N),
        voltage_V=np.array(found.axes.voltage_V),
        status=np.array(status),
        beyond=np.array(beyond),
    )


def _own_marks(found: DesignSearch, *, swept: bool = False, pulse_s: float | None = None) -> list[Mark]:
    """The gun's own methods that have a prediction; those alone that the sweep could come upon, if asked.

    With the pulse of a map, a method of another pulse has its own beside its name.
    """
    own = [one for one in found.own if one.predicted is not None and (one.swept or not swept)]
    other_pulse = {
        one.name: f" (pulse {1e3 * one.pulse_s:.3g} ms)" for one in own if pulse_s not in (None, one.pulse_s)
    }
    return [Mark(name=one.name + other_pulse.get(one.name, ""), design=one) for one in own]


def _best_mark(found: DesignSearch) -> Mark | None:
    """The best design, if one may be proposed."""
    name = f"best at {found.rate_above_Hz:g} Hz or faster"
    return None if found.best is None else Mark(name=name, design=found.best)
