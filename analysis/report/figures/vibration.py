"""The vibration's acceleration over time, with what the paper says of it: peak, root mean square and duration."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from analysis.report.figures.style import BLACK, BLUE, INK, light_grid, new_figure, reference_line, save, style


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


def figure_vibration(panel: VibrationPanel, path_stem: Path) -> tuple[Path, Path, Path]:
    """Acceleration over time in ms, its envelope, its root mean square and its end; PNG, SVG and PDF are written."""
    with mpl.rc_context(style()):  # type: ignore[arg-type]
        figure = new_figure(5.4, 3.2)
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
        reference_line(axes, panel.rms_m_s2, f"RMS\n{panel.rms_m_s2:.5g}")
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
        return save(figure, path_stem)
