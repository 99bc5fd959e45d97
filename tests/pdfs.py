"""Figures without their PDF, a third of their drawing, but where a test is about it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from matplotlib.backends.backend_pdf import FigureCanvasPdf

_print_pdf = FigureCanvasPdf.print_pdf


def leave_out() -> None:
    """From now on this process saves figures as PNG and SVG alone."""
    FigureCanvasPdf.print_pdf = lambda *_, **__: None


@contextmanager
def drawn() -> Iterator[None]:
    """All three kinds, as users get them."""
    FigureCanvasPdf.print_pdf = _print_pdf
    yield
    leave_out()
