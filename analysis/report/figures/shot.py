"""Figure 5: force, displacement, velocity and drive of one shot over time, a column for each friction."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.report.figures.style import BLACK, BLUE, GREEN, INK, PURPLE, VERMILION, drawn, light_grid, reference_line

STAGES = ("recoil", "bullet firing", "resetting", "ready")
_WIDE = 200.0  # the longest shot in ends of its first stage, from which on time is shown logarithmic
_PANEL_IN = 4.1
_SHOWN_PT = 0.8 * 72.0 * _PANEL_IN  # of a panel's width, its axis
_APART_PT = 17.0  # least distance of two stages' names
_NAMES_PT = 44.0  # so much room their slanted names take
_OPTIONS_WIDTH, _VIBRATION_WIDTH = 86, 98  # letters


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotPanel:
    """One shot to draw. Arrays (samples,); `stage_ends_s` are the ends of recoil, bullet firing and resetting.

    `collision_force_N` = m v^2 / x_k is apart from `force_N`; `contact_depth_m` is x_k (0.5 mm, assumed). An end that
    was not reached is NaN, and so is the collision's force then; `status` says why the magnet is not home.
    """

    title: str
    time_s: NDArray[np.float64]
    force_N: NDArray[np.float64]
    displacement_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]
    drive_V: NDArray[np.float64]
    stage_ends_s: tuple[float, float, float]
    collision_force_N: float
    contact_depth_m: float = 0.0005
    status: str = "home"
    options: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Trace:
    label: str
    values: NDArray[np.float64]
    colour: str


def figure_5(panels: Sequence[ShotPanel], path_stem: Path) -> None:
    """A column a shot, (a), (b), ... if several; rows F, x, dx/dt, u over time in ms; PNG, SVG and PDF are written.

    Stage borders are lines with open circles on the traces, at the values just before. The collision is an arrow at the
    end of the reset, cut at the top of the axis where it is larger. Where a stage would be too narrow to see, time is
    logarithmic. `ValueError` without a panel.
    """
    if not panels:
        raise ValueError("figure 5 needs at least one shot")
    with drawn(path_stem, 0.8 + _PANEL_IN * len(panels), 7.4) as figure:
        grid = figure.subplots(4, len(panels), sharex=True, sharey="row", squeeze=False)
        for column, panel in enumerate(panels):
            _draw_column(list(grid[:, column]), panel)
            letter, pad = (f"({chr(ord('a') + column)}) ", 54.0) if len(panels) > 1 else ("", _NAMES_PT)
            grid[0, column].set_title(f"{letter}{panel.title}", loc="left", pad=pad, fontweight="bold")
        _scale_time(grid[0, 0], panels)
        for row, label in enumerate(trace.label for trace in _traces(panels[0])):
            grid[row, 0].set_ylabel(label)
        _leave_room(grid[0, 0], panels)
        for column, panel in enumerate(panels):
            _name_stages(grid[0, column], panel)
            _draw_collision(grid[0, column], panel)
        figure.align_ylabels(grid[:, 0])
        if len(panels) == 1:
            _write_options(figure, panels[0].options, _OPTIONS_WIDTH)


def _write_options(figure: Figure, options: str, width: int) -> None:
    """What a figure was made with, below it."""
    lines = textwrap.wrap(options, width, break_on_hyphens=False)
    if lines:
        figure.supxlabel("\n".join(lines), x=0.02, ha="left", fontsize=6.5, linespacing=1.4, parse_math=False)


def _traces(panel: ShotPanel) -> tuple[_Trace, ...]:
    return (
        _Trace(label="F [N]", values=panel.force_N, colour=BLUE),
        _Trace(label="x [mm]", values=panel.displacement_m * 1e3, colour=VERMILION),
        _Trace(label="dx/dt [m/s]", values=panel.velocity_m_s, colour=GREEN),
        _Trace(label="u [V]", values=panel.drive_V, colour=PURPLE),
    )


def _draw_column(column: Sequence[Axes], panel: ShotPanel) -> None:
    time_ms = panel.time_s * 1e3
    at_rest = abs(panel.velocity_m_s[-1]) < 1e-3  # so it stays until the longest shot ends
    for axes, trace in zip(column, _traces(panel), strict=True):
        light_grid(axes)
        axes.plot(time_ms, trace.values, color=trace.colour, linewidth=1.3)
        if at_rest:
            axes.plot([time_ms[-1], 1e4], [trace.values[-1]] * 2, color=trace.colour, linewidth=1.3, scalex=False)
        for end_ms in _borders_ms(panel):
            axes.axvline(end_ms, color="#777777", linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
            height = float(trace.values[max(int(np.searchsorted(time_ms, end_ms)) - 1, 0)])
            axes.plot([end_ms], [height], "o", markersize=5.0, mfc="white", mec=BLACK, mew=1.0, zorder=4)
        if not np.ptp(trace.values):
            axes.set_ylim(trace.values[0] - 1.0, trace.values[0] + 1.0)
    column[-1].set_xlabel("time [ms]")


def _borders_ms(panel: ShotPanel) -> list[float]:
    return [end * 1e3 for end in panel.stage_ends_s if math.isfinite(end)]


def _scale_time(axes: Axes, panels: Sequence[ShotPanel]) -> None:
    """From the first sample to the last of all; logarithmic, from well within the first stage, if that is narrow."""
    first_ms, last_ms = (pick(float(panel.time_s[at]) * 1e3 for panel in panels) for pick, at in ((min, 0), (max, -1)))
    shortest_ms = min((border for panel in panels for border in _borders_ms(panel)), default=last_ms)
    if last_ms > _WIDE * shortest_ms > 0:
        axes.set_xscale("log")
        first_ms = shortest_ms / 30.0
    axes.set_xlim(first_ms, last_ms)


def _stages_ms(panel: ShotPanel) -> Iterator[tuple[str, float, float]]:
    """The stages that there were: name, begin and end. The first one that did not end lasts as long as the panel."""
    begin_ms, last_ms = float(panel.time_s[0]) * 1e3, float(panel.time_s[-1]) * 1e3
    if math.isnan(panel.stage_ends_s[0]) and panel.status != "home":
        yield "at rest" if not np.any(panel.velocity_m_s) else panel.status, begin_ms, last_ms
        return
    for name, end_s in zip(STAGES, (*panel.stage_ends_s, math.nan), strict=True):
        end_ms = end_s * 1e3 if math.isfinite(end_s) else last_ms
        if end_ms > begin_ms:
            yield name, begin_ms, end_ms
        if not math.isfinite(end_s):
            return
        begin_ms = end_ms


def _name_stages(axes: Axes, panel: ShotPanel) -> None:
    """Slanted and apart from each other, because the first stages may be narrow."""
    before_pt = -math.inf
    for name, start_ms, end_ms in _stages_ms(panel):
        low, high = (_share(axes, at_ms) for at_ms in (start_ms, end_ms))
        wanted_pt = _SHOWN_PT * (low + high) / 2.0
        before_pt = max(wanted_pt, before_pt + _APART_PT)
        axes.annotate(
            name,
            xy=((low + high) / 2.0, 1.0),
            xycoords="axes fraction",
            xytext=(before_pt - wanted_pt - 2.0, 3.0),
            textcoords="offset points",
            rotation=35.0,
            rotation_mode="anchor",
            annotation_clip=False,
        )


def _share(axes: Axes, at_ms: float) -> float:
    """Where on the axis a time stands, from 0 to 1."""
    first, last = axes.get_xlim()
    if axes.get_xscale() == "log":
        at_ms, first, last = (math.log(max(number, first)) for number in (at_ms, first, last))
    return min(max((at_ms - first) / (last - first), 0.0), 1.0)


def _leave_room(axes: Axes, panels: Sequence[ShotPanel]) -> None:
    """A little more than the traces need, for the arrows of the collisions."""
    low = min(float(panel.force_N.min()) for panel in panels)
    high = max(float(panel.force_N.max()) for panel in panels)
    if low == high:
        return
    axes.set_ylim(low - 0.08 * (high - low), high + 0.15 * (high - low))


def _say_status(axes: Axes, panel: ShotPanel) -> None:
    if panel.status != "home":
        text = panel.status.replace("-", " ")
        axes.annotate(text, xy=(0.98, 0.92), xycoords="axes fraction", ha="right", va="top", fontsize=8.0)


def _draw_collision(axes: Axes, panel: ShotPanel) -> None:
    end_s = panel.stage_ends_s[-1]
    if not math.isfinite(end_s) or not math.isfinite(panel.collision_force_N):
        _say_status(axes, panel)
        return
    bottom, top = axes.get_ylim()
    tip = min(panel.collision_force_N, top)
    cut = " (off scale)" if panel.collision_force_N > top else ""
    arrow = {"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.4, "shrinkA": 0.0, "shrinkB": 0.0}
    if tip > 0.05 * (top - bottom):
        axes.annotate("", xy=(end_s * 1e3, tip), xytext=(end_s * 1e3, 0.0), arrowprops=arrow)
    text = f"collision\n{panel.collision_force_N:.3g} N{cut}\n(xₖ = {panel.contact_depth_m * 1e3:g} mm)"
    to_the_left = _share(axes, end_s * 1e3) > 0.5
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


@dataclass(frozen=True, slots=True, kw_only=True)
class VibrationPanel:
    """One vibration to draw. Arrays (samples,) over time, beyond the duration's end."""

    title: str
    time_s: NDArray[np.float64]
    acceleration_m_s2: NDArray[np.float64]
    envelope_m_s2: NDArray[np.float64]
    peak_m_s2: float
    rms_m_s2: float  # over the duration
    duration_s: float
    options: str = ""


def figure_vibration(panel: VibrationPanel, path_stem: Path) -> None:
    """Acceleration over time in ms, its envelope, its root mean square and its end; PNG, SVG and PDF are written."""
    with drawn(path_stem, 5.4, 3.2) as figure:
        axes = figure.subplots()
        light_grid(axes)
        time_ms = panel.time_s * 1e3
        for side in (panel.envelope_m_s2, -panel.envelope_m_s2):
            axes.plot(time_ms, side, color=INK, linewidth=0.8, linestyle=":")
        axes.plot(time_ms, panel.acceleration_m_s2, color=BLUE, linewidth=1.3)
        top = int(np.abs(panel.acceleration_m_s2).argmax())
        axes.plot(time_ms[top], panel.acceleration_m_s2[top], "o", markersize=5.0, mfc="white", mec=BLACK, zorder=4)
        at_peak = (time_ms[top], float(panel.acceleration_m_s2[top]))
        words = f"peak {panel.peak_m_s2:g} m/s²"
        box = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}  # over the envelope
        axes.annotate(words, xy=at_peak, xytext=(7.0, 0.0), textcoords="offset points", va="center", bbox=box)
        reference_line(axes, panel.rms_m_s2, f"RMS\n{panel.rms_m_s2:.5g}\nm/s²")
        axes.axvline(panel.duration_s * 1e3, color="#777777", linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
        left = float(np.interp(panel.duration_s, panel.time_s, panel.envelope_m_s2)) / panel.peak_m_s2
        axes.annotate(
            f"end at {panel.duration_s * 1e3:g} ms:\n{left:.2g} of the peak left",
            xy=(panel.duration_s * 1e3, 0.98),
            xycoords=axes.get_xaxis_transform(),
            xytext=(-4.0, 0.0),
            textcoords="offset points",
            ha="right",
            va="top",
            fontsize=8.0,
        )
        axes.set_xlim(0.0, float(time_ms[-1]))
        axes.set_ylim(-1.15 * panel.peak_m_s2, 1.15 * panel.peak_m_s2)
        axes.set_title(panel.title, loc="left", fontweight="bold")
        axes.set_xlabel("time [ms]")
        axes.set_ylabel("acceleration [m/s²]")
        _write_options(figure, panel.options, _VIBRATION_WIDTH)
