"""A strip of the participant's own response times: how long, never how right."""

from __future__ import annotations

from PyQt6.QtCore import QPointF, QRectF, Qt
from PyQt6.QtGui import QPainter, QPaintEvent
from PyQt6.QtWidgets import QWidget

LONGEST_S = 3.0
"""The height of the strip; longer times stand at its upper edge."""
_DOT_PX, _HIGH_PX = 3.0, 70


class Strip(QWidget):
    """One dot an answer, oldest on the left, 0 s at the bottom."""

    def __init__(self) -> None:
        super().__init__()
        self._times_s: list[float] = []
        self.setMinimumHeight(_HIGH_PX)
        self.setAccessibleName("response times")

    def put(self, times_s: list[float]) -> None:
        """Show these times in seconds."""
        if times_s != self._times_s:
            self._times_s = times_s
            last = f"last {times_s[-1]:.2f} s" if times_s else "none yet"
            self.setToolTip(f"The participant's own response times: {last}")
            self.update()

    def paintEvent(self, event: QPaintEvent | None) -> None:  # noqa: N802 - Qt's name
        """Draw the dots, a line at each second, and the last time in digits."""
        del event
        painter, area = QPainter(self), QRectF(self.rect()).adjusted(4, 4, -4, -4)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.GlobalColor.gray)
        for second in range(int(LONGEST_S) + 1):
            y = area.bottom() - area.height() * second / LONGEST_S
            painter.drawLine(QPointF(area.left(), y), QPointF(area.right(), y))
        painter.setBrush(self.palette().text())
        for place, time_s in enumerate(self._times_s):
            x = area.left() + (place + 0.5) * area.width() / max(10, len(self._times_s))
            y = area.bottom() - area.height() * min(time_s, LONGEST_S) / LONGEST_S
            painter.drawEllipse(QPointF(x, y), _DOT_PX, _DOT_PX)
        if self._times_s:
            painter.setPen(self.palette().text().color())
            painter.drawText(
                area, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop, f"{self._times_s[-1]:.2f} s"
            )
        painter.end()
