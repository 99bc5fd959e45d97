"""How every figure looks and is saved: no global state, the same bytes for the same data."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any, TypedDict

import matplotlib as mpl
from fontTools import subset
from fontTools.ttLib import TTFont
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, MaxNLocator
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from analysis.report.copies import in_copy
from analysis.report.figures.glyphs import OWN_FONT, drawable_text, give_fonts, is_drawable
from analysis.report.labels import cut_names, display_name, lines_of, some_labels, text_columns
from analysis.report.section import MAKER, PNG_DPI
from experiments.record.storage import errors_name

BLUE, ORANGE, GREEN, VERMILION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
PURPLE, SKY, YELLOW, BLACK = "#CC79A7", "#56B4E9", "#F0E442", "#000000"
INDIGO, WINE, OLIVE = "#332288", "#882255", "#999933"
INK, GREY = "#333333", "#666666"
_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, INDIGO, OLIVE, WINE, YELLOW)
"""Okabe and Ito 2008, told apart with any common colour vision, those that stand out most from white first; between
them three of Tol 2021 for the seventh to the ninth."""
_LINES: tuple[str | tuple[int, tuple[float, ...]], ...] = ("-", "--", "-.", ":", (0, (6, 1, 1, 1, 1, 1)))
_DASHES = (9.0, 3.0, 14.0)
_MARKERS = "osD^vPX<>ph*d8H"
DIRECTION_MARKERS = {"forward": "o", "backward": "^"}

_LINE = 10

_STYLE = {
    "font.family": OWN_FONT,
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
    with mpl.rc_context(settings), some_labels():
        layout = ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.07, wspace=0.03, hspace=0.03)  # labels touch by default
        figure = Figure(figsize=(width_in, height_in), dpi=PNG_DPI, layout=layout, facecolor="white")
        yield figure
        give_fonts(figure)
        in_copy(lambda _: save(figure, path_stem))


_AXIS_IN, _DIGIT_IN = 1.6, 0.08
"""So wide are the levels of one of several panels, and at the most a digit below it."""


def have_room(levels: Sequence[float]) -> bool:
    """Whether the numbers of all levels can stand side by side below a panel.

    >>> have_room([17.0, 18.0, 20.0]), have_room([0.1, 0.11, 20.0]), have_room([float(level) for level in range(40)])
    (True, False, False)
    """
    across_in = _AXIS_IN / ((levels[-1] - levels[0]) or 1.0)
    return all(
        (after - before) * across_in > _DIGIT_IN * ((len(f"{before:g}") + len(f"{after:g}")) / 2 + 1)
        for before, after in pairwise(levels)
    )


def even_ticks(levels: Sequence[float], most: int) -> list[float]:
    """At the most about so many even numbers from the first to the last level.

    >>> even_ticks([4.3, 5.0, 20.0], 4)
    [8.0, 12.0, 16.0, 20.0]
    """
    return [
        float(tick)
        for tick in MaxNLocator(most).tick_values(*levels[:: len(levels) - 1])
        if levels[0] <= tick <= levels[-1]
    ]


_LEFT = 0.35
"""So far left of the lowest level, as a share of all, trials without one stand: their tick has room there."""


def left_of(levels: Collection[float]) -> float:
    """Where trials stand that have no level along an axis of numbers."""
    return min(levels) - _LEFT * (max(levels) - min(levels))


def part_left(axes: Axes, levels: Collection[float]) -> None:
    """End the line below an axis at the levels, so that what stands left of them is none."""
    span = (max(levels) - min(levels)) or 2.0
    axes.spines["bottom"].set_bounds(min(levels) - 0.1 * span, max(levels) + 0.07 * span)


def panel_grid(figure: Figure, titles: Sequence[str], across: int) -> list[Axes]:
    """A panel under each title, so many beside each other on shared axes; only the lowest have numbers below."""
    rows = -(-len(titles) // across)
    grid = list(figure.subplots(rows, across, squeeze=False, sharex=True, sharey=True).ravel())
    for place, axes in enumerate(grid):
        axes.set_visible(place < len(titles))
        axes.tick_params(labelbottom=place + across >= len(titles))
    for axes, title in zip(grid, titles, strict=False):
        axes.set_title(drawn_name(title), loc="left", fontsize=9.0, parse_math=False)
    return grid


def save(figure: Figure, path_stem: Path) -> None:
    """`path_stem`.png, .svg and .pdf, with who made them inside, but no dates or versions. Folders are made."""
    path_stem.parent.mkdir(parents=True, exist_ok=True)
    png, svg, pdf = (path_stem.with_name(f"{path_stem.name}.{kind}") for kind in ("png", "svg", "pdf"))
    lay_out(figure)
    with errors_name(path_stem):
        _save_png(figure, png)
        canvas: Any = FigureCanvasSVG(figure)
        canvas.print_svg(svg, metadata={"Date": None, "Creator": MAKER})
        canvas = FigureCanvasPdf(figure)
        with _letters_without_shaping():
            canvas.print_pdf(pdf, metadata={"CreationDate": None, "Creator": MAKER, "Producer": None})


_PNG_EFFORT = 3
"""Without transparency, which no figure has, this takes half the time of more effort with it, for files as large."""


def _save_png(figure: Figure, png: Path) -> None:
    """What is drawn of a figure as PNG."""
    canvas: Any = figure.canvas
    pixels = canvas.buffer_rgba()
    size = pixels.shape[1], pixels.shape[0]
    program = PngInfo()
    program.add_text("Software", MAKER)
    image = Image.frombuffer("RGBA", size, pixels, "raw", "RGBA", 0, 1).convert("RGB")
    image.save(png, "PNG", dpi=(PNG_DPI, PNG_DPI), pnginfo=program, compress_level=_PNG_EFFORT)


@contextmanager
def _letters_without_shaping() -> Iterator[None]:
    """Fonts go into a PDF without the tables that tell how letters are set beside each other.

    They are set already, so nothing reads these tables there, and to read and cut them down took most of the time.
    """
    load = subset.load_font

    def load_letters(*wanted: Any, **options: Any) -> TTFont:
        font = load(*wanted, **options)
        for table in {"GDEF", "GPOS", "GSUB", "kern"} & set(font.keys()):
            del font[table]
        return font

    subset.load_font = load_letters
    try:
        yield
    finally:
        subset.load_font = load


def lay_out(figure: Figure) -> None:
    """Draw a figure once and keep its layout for all files: savefig would lay out each of them twice.

    Where names of methods touch, there is less room than was thought: they are put upright, and all is laid out anew.
    """
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    crowded = [axes for axes in figure.axes if _touch(axes)]
    for axes in crowded:
        _put_upright(axes)
    if crowded:
        canvas.draw()
    figure.set_layout_engine("none")
    key = _key_lines(figure)
    if key:
        _write_key(figure, key)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()


_NAMES_APART_IN = 0.03
"""Names that stand side by side are at least so far apart."""


def _touch(axes: Axes) -> bool:
    """Whether two names below an axis, in words, are hardly apart."""
    names = [tick for tick in axes.get_xticklabels() if tick.get_text() and not tick.get_rotation()]
    if not axes.get_visible() or not any(letter.isalpha() for name in names for letter in name.get_text()):
        return False
    apart, ends = _NAMES_APART_IN * PNG_DPI, [name.get_window_extent() for name in names]
    return any(one.x1 + apart > other.x0 for one, other in pairwise(ends))


def _put_upright(axes: Axes) -> None:
    names = axes.xaxis.get_major_formatter()
    if isinstance(names, _NamesBelow):
        axes.set_xticks(axes.get_xticks(), names.whole, rotation=90.0)


_KEY_PT = 7.5


def _key_lines(figure: Figure) -> list[str]:
    """The whole of each name that is cut in a figure, in lines as wide as the figure."""
    shown = "\n".join(text.get_text() for text in figure.findobj(Text))
    width = int(figure.get_figwidth() * 72.0 / (0.62 * _KEY_PT))
    whole = (f"{mark} {name}" for mark, name in cut_names().items() if mark in shown)
    return [line for text in whole for line in lines_of(text, width)]


def _write_key(figure: Figure, lines: Sequence[str]) -> None:
    """Lines below a figure that is laid out, which grows by them."""
    width, height = figure.get_size_inches()
    left, above = 0.06 / width, 0.5 * _KEY_PT / 72.0
    key = figure.text(left, 0.0, "\n".join(lines), fontsize=_KEY_PT, va="top", linespacing=1.3, parse_math=False)
    give_fonts(figure)
    below = key.get_window_extent().height / figure.dpi + 2.0 * above
    share = below / (height + below)
    for text in figure.texts:
        text.set_y(share + (1.0 - share) * text.get_position()[1])
    for legend in figure.legends:
        legend.set_bbox_to_anchor((0.0, share, 1.0, 1.0 - share), transform=figure.transFigure)
    for axes in figure.axes:
        box = axes.get_position()
        axes.set_position((box.x0, share + (1.0 - share) * box.y0, box.width, (1.0 - share) * box.height))
    figure.set_size_inches(width, height + below)
    key.set_y(share - above / (height + below))


_LEGEND_LINE_IN = 0.19


def legend_below(figure: Figure, axes: Axes, columns: int, x_label: str = "") -> None:
    """One legend below all panels, of what `axes` has; in fewer columns on a higher figure where it is too wide.

    `x_label`, of all panels, stands above it: the layout would put `Figure.supxlabel` where the legend is.
    """
    handles, names = axes.get_legend_handles_labels()
    where: Any = "outside lower center"
    look: Any = {"loc": where, "frameon": False, "fontsize": 8.0, "handlelength": 3.2}
    look |= {"title": x_label, "title_fontsize": 9.0} if x_label else {}
    legend = figure.legend(handles, names, ncols=columns, **look)
    give_fonts(figure)  # which its width is of
    if columns > 1 and legend.get_window_extent().width > figure.bbox.width:
        legend.remove()
        more = -(-len(names) // (columns - 1)) + len(names) // -columns
        figure.set_figheight(figure.get_figheight() + _LEGEND_LINE_IN * more)
        legend_below(figure, axes, columns - 1, x_label)


def method_colour(i: int) -> str:
    """The colour of the method at place `i`, from the start again after the tenth."""
    return _COLOURS[i % len(_COLOURS)]


def method_line(i: int) -> Any:
    """The line of the method at place `i`; no other place has the same.

    >>> method_line(1), len({str(method_line(i)) for i in range(100)})
    ('--', 100)
    """
    if i < len(_LINES):
        return _LINES[i]
    dots, kind = divmod(i - len(_LINES), len(_DASHES))
    return (0, (_DASHES[kind], 2.0, *(1.0, 2.0) * (dots + 3 * (kind == 1))))


def method_marker(i: int) -> str:
    """The mark of the method at place `i`; no other place has the same.

    >>> method_marker(2), method_marker(20)
    ('D', '$21$')
    """
    return _MARKERS[i] if i < len(_MARKERS) else f"${i + 1}$"


class MethodLook(TypedDict):
    """How a method's curve is drawn: keywords of `Axes.plot`."""

    color: str
    linestyle: Any
    marker: str


def method_look(i: int) -> MethodLook:
    """Colour, line and mark of the method at place `i`."""
    return MethodLook(color=method_colour(i), linestyle=method_line(i), marker=method_marker(i))


_APART_IN = 0.76
"""So wide is the place of a method whose name stands below it in lines."""
_WIDEST_IN = 16.0
MANY_METHODS = 5
"""With more methods panels stand one above the other, and a matrix shows which methods differ."""


def width_for(methods: int) -> float:
    """How wide a figure is, in inches, whose panels have so many methods side by side."""
    return min(max(7.0, 2.2 + _APART_IN * methods), _WIDEST_IN)


def name_ticks(axes: Axes, methods: Sequence[str], above: Sequence[str] = (), room_in: float | None = None) -> None:
    """A tick with its name for each method, upright where there is no room; `above`: a line over each name.

    `room_in`: how wide the panel is, where that is not the whole figure.
    """
    names_at(axes, range(len(methods)), methods, above)
    if (room_in or axes.figure.bbox.width / PNG_DPI) < _APART_IN * len(methods):
        _put_upright(axes)
    axes.set_xlim(-0.6, len(methods) - 0.4)


class _NamesBelow(FixedFormatter):
    """Names in short lines, and `whole` in one for where they stand upright: joined lines would part broken words."""

    def __init__(self, names: Sequence[str], above: Sequence[str]) -> None:
        named = [*zip(above or [""] * len(names), names, strict=True)]
        super().__init__([f"{line}\n{wrapped(name)}".strip() for line, name in named])
        self.whole = [f"{' '.join(line.split())}  {drawn_name(name)}".strip() for line, name in named]


def names_at(axes: Axes, places: Sequence[float], names: Sequence[str], above: Sequence[str] = ()) -> None:
    """A tick with its name below it at each place; `above`: a line over each name."""
    below = _NamesBelow(names, above)
    axes.set_xticks(places, below.seq)  # whose letters are known at once, to find fonts for
    axes.xaxis.set_major_formatter(below)


def legend_columns(width_in: float, names: Sequence[str], most: int = 3) -> int:
    """How many names of a legend fit side by side into so many inches."""
    widest = max(map(text_columns, names), default=1)
    return max(1, min(most, len(names), int(width_in / (0.5 + 0.073 * widest))))


def drawn_name(code: str) -> str:
    r"""What a method or level is called in a figure: its code where no font here has the letters of its label.

    Letters of the code that no font has either are escaped.

    >>> drawn_name("asymmetric-1"), drawn_name("2 $ a shot")
    ('Asymmetric Force I', '2 \\$ a shot')
    """
    name = display_name(code)
    return drawable_text(name if is_drawable(name) else code).replace("$", r"\$")  # which begins no formula here


def wrapped(code: str) -> str:
    r"""The name of a method or level in short lines, broken at spaces and hyphens where it can be.

    >>> wrapped("asymmetric-2"), wrapped("ramp-up-slowly")
    ('Asymmetric\nForce II', 'ramp-up-\nslowly')
    """
    return "\n".join(lines_of(drawn_name(code), _LINE))


def light_grid(axes: Axes) -> None:
    """Horizontal lines behind the data."""
    axes.grid(visible=True, axis="y", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)


def bounded(axes: Axes, high: float) -> None:
    """The axis goes from 0 to the end of the scale: what stands above it (brackets) has no values."""
    axes.spines["left"].set_bounds(0.0, high)


def reference_line(axes: Axes, height: float, text: str) -> Line2D:
    """A dashed line across, named at its right."""
    line = axes.axhline(height, color=GREY, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1.5)
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
    return line


def stars(p: float) -> str:
    """Significance as the paper marks it.

    >>> stars(0.0004), stars(0.004), stars(0.04), stars(0.4)
    ('***', '**', '*', 'n.s.')
    """
    return "***" if p < 0.001 else "**" if p < 0.01 else "*" if p < 0.05 else "n.s."
