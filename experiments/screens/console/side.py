"""What stands beside and below the instruction in the console's window, a strip of response times with it."""

from __future__ import annotations

from datetime import datetime

from PyQt6.QtCore import QPointF, QRectF, Qt
from PyQt6.QtGui import QPainter, QPaintEvent
from PyQt6.QtWidgets import QHBoxLayout, QListWidget, QProgressBar, QVBoxLayout, QWidget

from experiments.screens.console import overview, parts
from experiments.screens.console.overview import Pace, clock_text, end_text, progress, remaining_s
from experiments.screens.console.view import About, Seen
from experiments.session.states import State

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


class Side(QWidget):
    """The gun, whose the keys are, the time, what comes next, and the answers of the set."""

    def __init__(self, about: About) -> None:
        super().__init__()
        self._gun, self._times, self._focus = parts.label("quiet"), parts.label("quiet"), parts.label("quiet")
        self._coming, self._answers = parts.quiet_list(), parts.quiet_list()
        self._strip = Strip()
        self._strip.setVisible(about.setup.config.console.response_times)
        down = QVBoxLayout(self)
        down.setContentsMargins(0, 0, 0, 0)
        for widget in (
            parts.panel(self._gun, self._focus),
            parts.panel(self._times),
            parts.label("quiet", "Coming next"),
            self._coming,
            parts.label("quiet", "Answers of this set"),
            self._answers,
            self._strip,
        ):
            down.addWidget(widget)
        for lines in (self._coming, self._answers):
            lines.setMinimumHeight(1)

    def put(self, seen: Seen, pace: Pace, now_s: float) -> None:
        """Show what is so now."""
        for label, (text, mood) in (
            (self._gun, overview.gun_text(seen.gun)),
            (self._focus, overview.focus_text(seen, here=self.isActiveWindow())),
        ):
            label.setText(text)
            label.setVisible(bool(text))
            parts.set_mood(label, mood)
        self._times.setText(_times(seen, pace, now_s))
        _fill(self._coming, overview.coming(seen))
        _fill(self._answers, overview.answers(seen))
        if self._strip.isVisibleTo(self):
            self._strip.put(overview.response_times(seen))


class Bars(QWidget):
    """How far the run is, as bars side by side."""

    def __init__(self, about: About) -> None:
        super().__init__()
        self._rated_last = about.setup.config.rating_s > 0
        self._bars = [QProgressBar() for _ in range(2 if self._rated_last else 3)]
        across = QHBoxLayout(self)
        across.setContentsMargins(0, 0, 0, 0)
        for bar in self._bars:
            across.addWidget(bar)

    def put(self, seen: Seen) -> None:
        """Show what is so now."""
        found = progress(seen.about.plan, seen.told, seen.here, rated_last=self._rated_last)
        for bar, one in zip(self._bars, found, strict=True):
            bar.setAccessibleName(one.what)
            bar.setFormat(f"{one.what}: %v of %m")
            bar.setMaximum(one.planned)
            bar.setValue(one.count)


def _times(seen: Seen, pace: Pace, now_s: float) -> str:
    elapsed = f"Elapsed {clock_text(pace.elapsed_s(now_s))}"
    if seen.ended is not None or seen.position.base is State.HALTED:
        return elapsed
    left_s = remaining_s(seen.about.setup.config, seen.about.plan, seen.told, pace, seen.position, now_s)
    return f"{elapsed}\nEnds {end_text(left_s, datetime.now())}"


def _fill(shown: QListWidget, lines: list[str]) -> None:
    if [item.text() for i in range(shown.count()) if (item := shown.item(i))] != lines:
        shown.clear()
        shown.addItems(lines)
        shown.scrollToBottom()
