"""Figures as PNG alone, which the pages show; SVG and PDF, over half of the drawing, where a test is about them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from analysis.report.figures import style

ASKED = "RECOIL_TESTS_ALL_FIGURES"
"""A program of `tests/warm_start.py` with this variable saves figures as users get them."""
_NAMES = {"svg": "FigureCanvasSVG", "pdf": "FigureCanvasPdf"}
_CANVASES = {kind: getattr(style, name) for kind, name in _NAMES.items()}


class _Undrawn:
    """Instead of a canvas that saves a figure."""

    def __init__(self, figure: object) -> None: ...

    def print_svg(self, *_: object, **__: object) -> None: ...

    print_pdf = print_svg


def leave_out() -> None:
    """From now on this process saves figures as PNG alone."""
    for name in _NAMES.values():
        setattr(style, name, _Undrawn)


def draw(*kinds: str) -> None:
    """From now on it saves these kinds too; without any, all, as users get them."""
    for kind in kinds or _NAMES:
        setattr(style, _NAMES[kind], _CANVASES[kind])


@contextmanager
def drawn(*kinds: str) -> Iterator[None]:
    """As `draw` in here."""
    draw(*kinds)
    yield
    leave_out()
