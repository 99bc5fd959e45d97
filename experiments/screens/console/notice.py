"""The instruction in large type, which shrinks until all of it is there, and the page of text that may cover it."""

from __future__ import annotations

from PyQt6.QtGui import QResizeEvent, QShowEvent
from PyQt6.QtWidgets import QLabel, QPlainTextEdit, QVBoxLayout, QWidget

from experiments.screens.console import parts
from experiments.screens.console.view import Instruction

SIZES_PX = {"title": 46, "damper": 34, "detail": 23}
FITS = (1.0, 0.88, 0.76, 0.66, 0.56)
"""How far the type shrinks."""
_PAGE_PX, _LEAST_PX = 20, 9


class Notice:
    """What to do now, the damper, and what belongs to it: three labels."""

    def __init__(self) -> None:
        self.title, self.damper, self.detail = self.labels = [parts.label(name) for name in SIZES_PX]

    def put(self, shown: Instruction) -> None:
        """Show an instruction."""
        for label, text in zip(self.labels, (shown.title, shown.damper, shown.detail), strict=True):
            if label.text() != text:
                label.setText(text)
            label.setVisible(bool(text))
        parts.set_mood(self.title, shown.mood)
        parts.set_mood(self.damper, shown.mood)

    def size(self, factor: float) -> None:
        """Give the type so many times its own size."""
        for label, size_px in zip(self.labels, SIZES_PX.values(), strict=True):
            _size(label, round(size_px * factor), bold=label is not self.detail)


class TextPage(QWidget):
    """A page of text that is only looked at, in type that has room for all of it, and below it what was said last."""

    def __init__(self) -> None:
        super().__init__()
        self._title, self.said = parts.label("place"), parts.label("saved")
        self._text = QPlainTextEdit()
        self._text.setReadOnly(True)
        self._text.setFocusPolicy(parts.NO_FOCUS)
        down = QVBoxLayout(self)
        down.setContentsMargins(10, 6, 10, 6)
        for widget in (self._title, self._text, self.said):
            down.addWidget(widget)

    def put(self, title: str, lines: list[str]) -> None:
        """Show lines of text."""
        self._title.setText(title)
        self._text.setPlainText("\n".join(lines))
        self._fit()

    def resizeEvent(self, event: QResizeEvent | None) -> None:  # noqa: N802 - Qt's name
        """Type shrinks with the page."""
        super().resizeEvent(event)
        self._fit()

    def showEvent(self, event: QShowEvent | None) -> None:  # noqa: N802 - Qt's name
        """Its room is known now."""
        super().showEvent(event)
        self._fit()

    def _fit(self) -> None:
        if not self.isVisible():
            return
        for size_px in range(_PAGE_PX, _LEAST_PX - 1, -1):
            self._text.setStyleSheet(f"font-size: {size_px}px;")
            rows, view = self._text.document(), self._text.viewport()
            if (
                rows is None
                or view is None
                or rows.size().height() * self._text.fontMetrics().height() <= view.height()
            ):
                return


def _size(label: QLabel, size_px: int, *, bold: bool) -> None:
    """Give a label's type a size in pixels; the window's style sheet would win over a font."""
    style = f"font-size: {max(8, size_px)}px; font-weight: {'bold' if bold else 'normal'};"
    if label.styleSheet() != style:
        label.setStyleSheet(style)
