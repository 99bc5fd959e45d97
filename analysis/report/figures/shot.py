"""Figure 5: force, displacement, velocity and drive of one shot over time, a column for each friction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes

from analysis.core.arrays import FloatArray
from analysis.report.figures.style import BLACK, BLUE, GREEN, PURPLE, VERMILION, light_grid, new_figure, save, style

STAGES = ("recoil", "bullet firing", "resetting", "ready")


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotPanel:
    """One shot to draw. Arrays (samples,); `stage_ends_s` are the ends of recoil, bullet firing and resetting.

    `collision_force_N` = m v^2 / x_k is apart from `force_N`; `contact_depth_m` is x_k (0.5 mm, assumed). An end that
    was not reached is NaN, and so is the collision's force then.
    """

    title: str
    time_s: FloatArray
    force_N: FloatArray
    displacement_m: FloatArray
    velocity_m_s: FloatArray
    drive_V: FloatArray
    stage_ends_s: tuple[float, float, float]
    collision_force_N: float
    contact_depth_m: float = 0.0005


@dataclass(frozen=True, slots=True, kw_only=True)
class _Trace:
    label: str
    values: FloatArray
    colour: str


def figure_5(panels: Sequence[ShotPanel], path_stem: Path) -> tuple[Path, Path, Path]:
    """A column (a), (b), ... for each shot; rows F, x, dx/dt, u over time in ms; PNG, SVG and PDF are written.

    Stage borders are lines with open circles on the traces. The collision is an arrow at the end of the reset, cut at
    the top of the axis where it is larger. `ValueError` without a panel.
    """
    if not panels:
        raise ValueError("figure 5 needs at least one shot")
    with mpl.rc_context(style()):  # type: ignore[arg-type]
        figure = new_figure(0.8 + 4.1 * len(panels), 7.4)
        grid = figure.subplots(4, len(panels), sharex=True, sharey="row", squeeze=False)
        for column, panel in enumerate(panels):
            _draw_column(list(grid[:, column]), panel, chr(ord("a") + column))
        ends = [float(at) * 1e3 for panel in panels for at in (panel.time_s[0], panel.time_s[-1])]
        grid[0, 0].set_xlim(min(ends), max(ends))
        for row, label in enumerate(trace.label for trace in _traces(panels[0])):
            grid[row, 0].set_ylabel(label)
        _leave_room(grid[0, 0], panels)
        for column, panel in enumerate(panels):
            _draw_collision(grid[0, column], panel)
        figure.align_ylabels(grid[:, 0])
        return save(figure, path_stem)


def _traces(panel: ShotPanel) -> tuple[_Trace, ...]:
    return (
        _Trace(label="F [N]", values=panel.force_N, colour=BLUE),
        _Trace(label="x [mm]", values=panel.displacement_m * 1e3, colour=VERMILION),
        _Trace(label="dx/dt [m/s]", values=panel.velocity_m_s, colour=GREEN),
        _Trace(label="u [V]", values=panel.drive_V, colour=PURPLE),
    )


def _draw_column(column: Sequence[Axes], panel: ShotPanel, letter: str) -> None:
    time_ms = panel.time_s * 1e3
    at_rest = abs(panel.velocity_m_s[-1]) < 1e-3  # so it stays until the longest shot ends
    for axes, trace in zip(column, _traces(panel), strict=True):
        light_grid(axes)
        axes.plot(time_ms, trace.values, color=trace.colour, linewidth=1.3)
        if at_rest:
            axes.plot([time_ms[-1], 1e4], [trace.values[-1]] * 2, color=trace.colour, linewidth=1.3, scalex=False)
        for end_ms in _borders_ms(panel):
            axes.axvline(end_ms, color="#777777", linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
            height = float(np.interp(end_ms, time_ms, trace.values))
            axes.plot([end_ms], [height], "o", markersize=5.0, mfc="white", mec=BLACK, mew=1.0, zorder=4)
    column[0].set_title(f"({letter}) {panel.title}", loc="left", pad=54.0, fontweight="bold")
    column[-1].set_xlabel("time [ms]")
    _name_stages(column[0], panel)


def _borders_ms(panel: ShotPanel) -> list[float]:
    return [end * 1e3 for end in panel.stage_ends_s if math.isfinite(end)]


def _name_stages(axes: Axes, panel: ShotPanel) -> None:
    """Slanted, because the first stages are a few milliseconds wide."""
    borders = [float(panel.time_s[0]) * 1e3, *_borders_ms(panel), float(panel.time_s[-1]) * 1e3]
    for name, start, end in zip(STAGES, borders, borders[1:], strict=False):
        axes.annotate(
            name,
            xy=((start + end) / 2.0, 1.0),
            xycoords=axes.get_xaxis_transform(),
            xytext=(-2.0, 3.0),
            textcoords="offset points",
            rotation=35.0,
            rotation_mode="anchor",
            annotation_clip=False,
        )


def _leave_room(axes: Axes, panels: Sequence[ShotPanel]) -> None:
    """A little more than the traces need, for the arrows of the collisions."""
    low = min(float(panel.force_N.min()) for panel in panels)
    high = max(float(panel.force_N.max()) for panel in panels)
    axes.set_ylim(low - 0.08 * (high - low), high + 0.15 * (high - low))


def _draw_collision(axes: Axes, panel: ShotPanel) -> None:
    end_s = panel.stage_ends_s[-1]
    if not math.isfinite(end_s) or not math.isfinite(panel.collision_force_N):
        return
    bottom, top = axes.get_ylim()
    tip = min(panel.collision_force_N, top)
    cut = " (off scale)" if panel.collision_force_N > top else ""
    arrow = {"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.4, "shrinkA": 0.0, "shrinkB": 0.0}
    if tip > 0.05 * (top - bottom):
        axes.annotate("", xy=(end_s * 1e3, tip), xytext=(end_s * 1e3, 0.0), arrowprops=arrow)
    text = f"collision\n{panel.collision_force_N:.3g} N{cut}\n($x_k$ = {panel.contact_depth_m * 1e3:g} mm)"
    to_the_left = end_s > (panel.time_s[0] + panel.time_s[-1]) / 2.0
    axes.annotate(
        text,
        xy=(end_s * 1e3, bottom + 0.92 * (top - bottom)),
        xytext=(-7.0 if to_the_left else 7.0, 0.0),
        textcoords="offset points",
        ha="right" if to_the_left else "left",
        va="top",
        fontsize=8.0,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5},  # over the stage borders
    )
