"""How every figure looks and is saved: no global state, the same bytes for the same data."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.image import imsave
from matplotlib.layout_engine import ConstrainedLayoutEngine

from analysis.report.section import PNG_DPI

BLUE, ORANGE, GREEN, VERMILION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, YELLOW, BLACK = "#CC79A7", "#56B4E9", "#F0E442", "#000000"
INK = "#333333"
METHOD_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, YELLOW)
"""Okabe and Ito 2008: told apart with any common colour vision; those that stand out most from white first."""
METHOD_LINES: tuple[str | tuple[int, tuple[float, ...]], ...] = ("-", "--", "-.", ":", (0, (6, 1, 1, 1, 1, 1)))
"""The methods' lines without colour."""
DIRECTION_MARKERS = {"forward": "o", "backward": "^"}


_STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.hashsalt": "recoil",
    "pdf.fonttype": 42,  # whole letters: journals refuse outlines of type 3
}


@contextmanager
def drawn(path_stem: Path, width_in: float, height_in: float) -> Iterator[Figure]:
    """An empty figure to draw in, saved at the end as PNG, SVG and PDF.

    It lays its axes out so that nothing is clipped, and no pyplot knows of it.
    """
    settings: Any = dict(mpl.rcParamsDefault) | _STYLE | {"backend": "agg"}
    with mpl.rc_context(settings):
        layout = ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.07, wspace=0.03, hspace=0.03)  # labels touch by default
        figure = Figure(figsize=(width_in, height_in), dpi=PNG_DPI, layout=layout, facecolor="white")
        yield figure
        save(figure, path_stem)


def save(figure: Figure, path_stem: Path) -> None:
    """`path_stem`.png, .svg and .pdf, without dates or versions inside. Folders are made."""
    path_stem.parent.mkdir(parents=True, exist_ok=True)
    png, svg, pdf = (path_stem.with_name(f"{path_stem.name}.{kind}") for kind in ("png", "svg", "pdf"))
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    no_program: Any = {"Software": None}
    imsave(png, canvas.buffer_rgba(), format="png", dpi=PNG_DPI, metadata=no_program)
    figure.set_layout_engine("none")  # all three in the one layout; savefig would draw each of them twice
    canvas = FigureCanvasSVG(figure)
    canvas.print_svg(svg, metadata={"Date": None, "Creator": None})
    canvas = FigureCanvasPdf(figure)
    canvas.print_pdf(pdf, metadata={"CreationDate": None, "Creator": None, "Producer": None})


def legend_below(figure: Figure, axes: Axes, columns: int) -> None:
    """One legend below all panels, of what `axes` has."""
    handles, names = axes.get_legend_handles_labels()
    where: Any = "outside lower center"
    figure.legend(handles, names, loc=where, ncols=columns, frameon=False, fontsize=8.0, handlelength=3.2)


def method_colour(i: int) -> str:
    """The colour of the method at place `i`, from the start again after the last."""
    return METHOD_COLOURS[i % len(METHOD_COLOURS)]


def light_grid(axes: Axes) -> None:
    """Horizontal lines behind the data."""
    axes.grid(visible=True, axis="y", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)


def bounded(axes: Axes, low: float, high: float) -> None:
    """The axis ends with the scale: what stands above it (brackets) has no values."""
    axes.spines["left"].set_bounds(low, high)


def reference_line(axes: Axes, height: float, text: str) -> None:
    """A dashed line across, named at its right."""
    axes.axhline(height, color="#666666", linewidth=0.9, linestyle=(0, (4, 3)), zorder=1.5)
    axes.annotate(
        text,
        xy=(1.0, height),
        xycoords=axes.get_yaxis_transform(),
        xytext=(3.0, 0.0),
        textcoords="offset points",
        ha="left",
        va="center",
        fontsize=7.5,
        color="#444444",
    )


_DISPLAY_NAMES = {
    "vibration": "Vibration",
    "asymmetric-1": "Asymmetric Force I",
    "asymmetric-2": "Asymmetric Force II",
}


def display_name(method: str) -> str:
    """The method's name in print; a method the paper does not know keeps its own.

    >>> display_name("asymmetric-2"), display_name("ramp")
    ('Asymmetric Force II', 'ramp')
    """
    return _DISPLAY_NAMES.get(method, method)


def wrapped(method: str) -> str:
    r"""The method's name in short lines, broken at spaces and hyphens.

    >>> wrapped("asymmetric-2"), wrapped("ramp-up-slowly")
    ('Asymmetric\nForce II', 'ramp-up-\nslowly')
    """
    return "\n".join(textwrap.wrap(display_name(method), 10))


def named(text: str) -> str:
    """`text` with the paper's methods under the paper's names.

    >>> named("asymmetric-2 above vibration, asymmetric-10 below")
    'Asymmetric Force II above Vibration, asymmetric-10 below'
    """
    return re.sub(r"(?<![\w-])(vibration|asymmetric-[12])(?![\w-])", lambda found: display_name(found[1]), text)


def stars(p: float) -> str:
    """Significance as the paper marks it.

    >>> stars(0.0004), stars(0.004), stars(0.04), stars(0.4)
    ('***', '**', '*', 'n.s.')
    """
    return "***" if p < 0.001 else "**" if p < 0.01 else "*" if p < 0.05 else "n.s."
