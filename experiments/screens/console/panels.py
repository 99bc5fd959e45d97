"""What the console's window is made of: the instruction, fields to type in, buttons, what stands beside and below."""

from __future__ import annotations

from datetime import datetime

from PyQt6 import QtWidgets
from PyQt6.QtCore import QPointF, QRectF, Qt
from PyQt6.QtGui import QPainter, QPaintEvent, QResizeEvent, QShowEvent

from experiments.screens import texts
from experiments.screens.console import progress, widgets
from experiments.screens.console.controls import TextField
from experiments.screens.console.instructions import Instruction
from experiments.screens.console.keys import field_at
from experiments.screens.console.view import About, Seen
from experiments.screens.console.windows import has_keys
from experiments.screens.phrases import phrase
from experiments.session.duration import Ahead, RunTiming, clock_text, end_text, remaining_s
from experiments.session.states import Position, State
from experiments.session.steps import Asking, Rate

SIZES_PX = {"title": 46, "damper": 34, "detail": 23}
SAID_PX = 22
FITS = ((1.0, 1.0), (1.0, 0.76), (0.88, 0.76), (0.88, 0.66), (0.76, 0.66), (0.66, 0.56), (0.56, 0.5))
"""How far the type shrinks: that of the instruction, and that of what was said last, which goes first."""
_PAGE_PX, _LEAST_PX = 20, 9


class Notice:
    """What to do now, the damper, and what belongs to it: three labels. And `said`, for what was said last."""

    def __init__(self) -> None:
        self.said = widgets.text_label("saved")
        self.title, self.damper, self.detail = self.labels = [widgets.text_label(name) for name in SIZES_PX]

    def put(self, shown: Instruction) -> None:
        """Show an instruction."""
        for label, text in zip(self.labels, (shown.title, shown.damper, shown.detail), strict=True):
            if label.text() != text:
                label.setText(text)
            label.setVisible(bool(text))
        widgets.set_mood(self.title, shown.mood)
        widgets.set_mood(self.damper, shown.mood)

    def size(self, scale: float, fit: tuple[float, float]) -> None:
        """Give the type its own size by the window's scale, shrunk to a fit."""
        for label, size_px in zip(self.labels, SIZES_PX.values(), strict=True):
            _size(label, round(size_px * scale * fit[0]), bold=label is not self.detail)
        _size(self.said, round(SAID_PX * scale * fit[1]), bold=False)


class TextPage(QtWidgets.QWidget):
    """A page of text that is only looked at, in type that has room for all of it, and below it what was said last."""

    def __init__(self) -> None:
        super().__init__()
        self._title, self.said = widgets.text_label("place"), widgets.text_label("saved")
        self._text = QtWidgets.QPlainTextEdit()
        self._text.setReadOnly(True)
        self._text.setFocusPolicy(widgets.NO_FOCUS)
        widgets.fill(QtWidgets.QVBoxLayout(self), self._title, self._text, self.said, margins=(10, 6, 10, 6))

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
            text, view = self._text.document(), self._text.viewport()
            if text is None or view is None:
                return
            rows = text.size().height()  # of such a widget's document, which trials_done in lines
            if rows * self._text.fontMetrics().lineSpacing() + 2 * text.documentMargin() < view.height():
                return


def _size(label: QtWidgets.QLabel, size_px: int, *, bold: bool) -> None:
    """Give a label's type a size in pixels; the window's style sheet would win over a font."""
    style = f"font-size: {max(8, size_px)}px; font-weight: {'bold' if bold else 'normal'};"
    if label.styleSheet() != style:
        label.setStyleSheet(style)


_Belongs = tuple[TextField | None, int, Asking | None]
"""What a field is for: its kind, the number of the step, and the entry that is corrected."""


class TextFields:
    """The field of the state at hand, and below it the line for a reason, a note or a flag."""

    def __init__(self) -> None:
        self.rating, self.words, self.line = QtWidgets.QLineEdit(), QtWidgets.QLineEdit(), QtWidgets.QLineEdit()
        self._fields: dict[TextField, QtWidgets.QLineEdit] = {
            "number": self.rating,
            "words": self.words,
            "line": self.line,
        }
        self._ends, self._question = widgets.text_label("quiet"), widgets.text_label("quiet")
        self.rating.setPlaceholderText(phrase("type a number, Enter saves"))
        self.words.setPlaceholderText(phrase("type the participant's words, Enter saves"))
        self.line.setAccessibleName("line of text")
        self.pages = QtWidgets.QStackedWidget()
        for page in (QtWidgets.QWidget(), widgets.column(self._ends, self.rating), widgets.column(self.words)):
            self.pages.addWidget(page)
        self.bar = widgets.column(self._question, self.line)
        self.bar.hide()
        self._belongs: _Belongs = (None, -1, None)
        self._drafts: dict[_Belongs, str] = {}

    def at(self, position: Position, said: str) -> None:
        """Take a position: a new field begins with what was half typed there before, else with what was said so far."""
        belongs = (field_at(position), position.number, position.correcting)
        if belongs == self._belongs:
            return
        self._keep(self._belongs)
        self._belongs = belongs
        draft = self._drafts.pop(belongs, "") if position.correcting is None else ""
        if isinstance(step := position.correcting or position.step, Rate):
            self._ends.setText(texts.ends_text(step))
        for field in (self.rating, self.words):
            field.setAccessibleName(step.question if isinstance(step, Asking) else "")
            field.setText(draft or said)
            if not draft:
                field.selectAll()

    def _keep(self, belongs: _Belongs) -> None:
        """Keep what is half typed in the field that is left; of other steps nothing is kept any more."""
        name, number, _ = belongs
        typed = "" if name is None else self.typed(name)
        self._drafts = {one: text for one, text in self._drafts.items() if one[1] == number} | {belongs: typed}

    def focus(self, position: Position, otherwise: QtWidgets.QWidget) -> None:
        """Show the field of a position, and put the cursor into it; an open line keeps the cursor."""
        self.pages.setCurrentIndex((None, "number", "words").index(field_at(position)))
        if self.bar.isHidden():
            self._field(position, otherwise).setFocus()

    def close_line(self, position: Position, otherwise: QtWidgets.QWidget) -> None:
        """Take the line away; the cursor goes back to where it was."""
        self._field(position, otherwise).setFocus()
        self.bar.hide()

    def _field(self, position: Position, otherwise: QtWidgets.QWidget) -> QtWidgets.QWidget:
        name = field_at(position)
        return otherwise if name is None else self._fields[name]

    def open_line(self, question: str) -> None:
        """Let a line be typed."""
        self._question.setText(question)
        self.line.clear()
        self.bar.show()
        self.line.setFocus()

    def typed(self, field: TextField) -> str:
        """What is typed in a field."""
        return self._fields[field].text()

    def take_typed(self) -> str:
        """What was typed for the step at hand, its corrections apart, also before a pause; it is taken away."""
        self._keep(self._belongs)
        found = [text for (name, _, entry), text in self._drafts.items() if name is not None and entry is None and text]
        self._drafts.clear()
        if self._belongs[2] is None:
            self.rating.clear()
            self.words.clear()
        return found[-1] if found else ""


LONGEST_S = 3.0
"""The height of the strip; longer times stand at its upper edge."""
_DOT_PX, _HIGH_PX = 3.0, 70


class Strip(QtWidgets.QWidget):
    """One dot an answer, oldest on the left, 0 s at the bottom."""

    def __init__(self) -> None:
        super().__init__()
        self._times_s: list[float] = []
        self.setMinimumHeight(_HIGH_PX)
        self.setAccessibleName(phrase("response times"))

    def put(self, times_s: list[float]) -> None:
        """Show these times in seconds."""
        if times_s != self._times_s:
            self._times_s = times_s
            last = phrase("last {times_s:.2f} s", times_s=times_s[-1]) if times_s else phrase("none yet")
            self.setToolTip(phrase("The participant's own response times: {last}", last=last))
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


class SidePanel(QtWidgets.QWidget):
    """The gun, whose the keys are, the time, what comes next, and the answers of the set."""

    def __init__(self, about: About) -> None:
        super().__init__()
        self._gun, self._times, self._focus = (widgets.text_label("quiet") for _ in range(3))
        self._coming, self._answers = widgets.quiet_list(), widgets.quiet_list()
        self._strip = Strip()
        self._strip.setVisible(about.setup.config.console.response_times)
        widgets.fill(
            QtWidgets.QVBoxLayout(self),
            widgets.panel(self._gun, self._focus),
            widgets.panel(self._times),
            widgets.text_label("quiet", phrase("Coming next")),
            self._coming,
            widgets.text_label("quiet", phrase("Answers of this set")),
            self._answers,
            self._strip,
        )
        for lines in (self._coming, self._answers):
            lines.setMinimumHeight(1)

    def put(self, seen: Seen, timing: RunTiming) -> None:
        """Show what is so now."""
        for label, (text, mood) in (
            (self._gun, progress.gun_text(seen)),
            (self._focus, progress.focus_text(seen, here=has_keys(self))),
        ):
            label.setText(text)
            label.setVisible(bool(text))
            widgets.set_mood(label, mood)
        self._times.setText(_times(seen, timing))
        _fill(self._coming, progress.coming(seen))
        _fill(self._answers, progress.answer_lines(seen))
        if self._strip.isVisibleTo(self):
            self._strip.put(progress.own_times_s(seen))


class Bars(QtWidgets.QWidget):
    """How far the run is, as bars side by side."""

    def __init__(self, about: About) -> None:
        super().__init__()
        self._bars = [QtWidgets.QProgressBar() for _ in range(2 if about.rated_last else 3)]
        widgets.fill(QtWidgets.QHBoxLayout(self), *self._bars)

    def put(self, seen: Seen) -> None:
        """Show what is so now."""
        for bar, one in zip(self._bars, progress.trials_done(seen), strict=True):
            bar.setAccessibleName(one.what)
            at_most = phrase("at most ") if one.at_most else ""
            bar.setFormat(phrase("{what}: %v of {at_most}%m", what=one.what, at_most=at_most))
            bar.setMaximum(one.planned)
            bar.setValue(one.count)


def _times(seen: Seen, timing: RunTiming) -> str:
    elapsed = phrase("Elapsed {clock}", clock=clock_text(timing.elapsed_s(seen.now_s)))
    if seen.ended is not None or seen.position.base is State.HALTED:
        return elapsed
    about = seen.about
    ahead = Ahead(design=about.setup.config, plan=about.plan, told=seen.told, position=seen.position, now_s=seen.now_s)
    ends = end_text(remaining_s(ahead, timing), datetime.now(), at_most=about.plan.may_end_early)
    return phrase("{elapsed}\nEnds {ends}", elapsed=elapsed, ends=ends)


def _fill(shown: QtWidgets.QListWidget, lines: list[str]) -> None:
    if [item.text() for i in range(shown.count()) if (item := shown.item(i))] != lines:
        shown.clear()
        shown.addItems(lines)
        shown.scrollToBottom()
