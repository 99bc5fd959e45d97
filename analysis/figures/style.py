"""How every figure looks and is saved: no global state, the same bytes for the same data."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

BLUE, ORANGE, GREEN, VERMILION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, YELLOW, BLACK = "#CC79A7", "#56B4E9", "#F0E442", "#000000"
METHOD_COLOURS = (SKY, ORANGE, GREEN, BLUE, PURPLE, VERMILION, YELLOW)
"""Okabe and Ito 2008: told apart with any common colour vision."""

PNG_DPI = 200

_STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.hashsalt": "recoil",
}


def style() -> dict[str, object]:
    """Settings to draw and to save under, for `matplotlib.rc_context`."""
    return dict(mpl.rcParamsDefault) | _STYLE | {"backend": "agg"}


def new_figure(width_in: float, height_in: float) -> Figure:
    """An empty figure that lays its axes out so that nothing is clipped, and that no pyplot knows of."""
    figure = Figure(figsize=(width_in, height_in), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path_stem: Path) -> tuple[Path, Path]:
    """`path_stem`.png and `path_stem`.svg, without dates or versions inside. Folders are made."""
    path_stem.parent.mkdir(parents=True, exist_ok=True)
    png, svg = (path_stem.with_name(f"{path_stem.name}.{kind}") for kind in ("png", "svg"))
    figure.savefig(png, dpi=PNG_DPI, metadata={"Software": None})
    figure.savefig(svg, metadata={"Date": None, "Creator": None})
    return png, svg


def light_grid(axes: Axes) -> None:
    """Horizontal lines behind the data."""
    axes.grid(visible=True, axis="y", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
