"""Figures as small PNG alone, which the pages show; as users get them, thrice the work, where a test is about them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import combinations

from matplotlib.axis import Axis, Tick
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from analysis.report import page
from analysis.report.figures import style

ASKED = "RECOIL_TESTS_ALL_FIGURES"
"""A program of `tests/warm_start.py` with this variable saves figures as users get them."""
_NAMES = {"svg": "FigureCanvasSVG", "pdf": "FigureCanvasPdf"}
_CANVASES = {kind: getattr(style, name) for kind, name in _NAMES.items()}
_USERS_DPI, _SMALL_DPI = style.PNG_DPI, 80


class _Undrawn:
    """Instead of a canvas that saves a figure."""

    def __init__(self, figure: object) -> None: ...

    def print_svg(self, *_: object, **__: object) -> None: ...

    print_pdf = print_svg


def leave_out() -> None:
    """From now on this process saves figures as PNG alone, of few pixels."""
    for name in _NAMES.values():
        setattr(style, name, _Undrawn)
    _be_of(_SMALL_DPI)


def draw(*kinds: str) -> None:
    """From now on it saves these kinds too, and PNG of full size; without any, all, as users get them."""
    for kind in kinds or _NAMES:
        setattr(style, _NAMES[kind], _CANVASES[kind])
    _be_of(_USERS_DPI)


def _be_of(dpi: int) -> None:
    for module in (style, page):
        module.PNG_DPI = dpi  # type: ignore[attr-defined]  # each imports it


@contextmanager
def full_size() -> Iterator[None]:
    """In here figures have the pixels that users get, for tests of where things stand in them."""
    _be_of(_USERS_DPI)
    yield
    _be_of(_SMALL_DPI)


@contextmanager
def drawn(*kinds: str) -> Iterator[None]:
    """As `draw` in here."""
    draw(*kinds)
    yield
    leave_out()


def touching(figure: Figure) -> list[tuple[str, str]]:
    """Texts of a figure that overlap; numbers beyond an axis' ends are not drawn."""
    renderer = FigureCanvasAgg(figure).get_renderer()
    axis = [one for axes in figure.axes for one in (axes.xaxis, axes.yaxis)]
    undrawn = {tick.label1 for one in axis for tick in one.get_major_ticks() if not _within(one, tick)}
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    texts = [text for text in texts if text not in undrawn and (text.axes is None or text.axes.get_visible())]
    boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in texts]
    return [(a, b) for (a, box), (b, other) in combinations(boxes, 2) if box.overlaps(other)]


def _within(axis: Axis, tick: Tick) -> bool:
    low, high = sorted(axis.get_view_interval())
    return bool(low <= tick.get_loc() <= high)
