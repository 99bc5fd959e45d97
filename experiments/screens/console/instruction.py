"""The instruction in large type, the fields and the line that are typed in, and the page of text over them."""

from __future__ import annotations

from PyQt6.QtGui import QResizeEvent, QShowEvent
from PyQt6.QtWidgets import QLabel, QLineEdit, QPlainTextEdit, QStackedWidget, QVBoxLayout, QWidget

from experiments.screens.console import parts
from experiments.screens.console.keys import field_of
from experiments.screens.console.messages import Field
from experiments.screens.console.view import Instruction
from experiments.session.history import Entry
from experiments.session.states import Position
from experiments.session.steps import Rate

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
            text, view = self._text.document(), self._text.viewport()
            if text is None or view is None:
                return
            rows = text.size().height()  # of such a widget's document, which counts in lines
            if rows * self._text.fontMetrics().lineSpacing() + 2 * text.documentMargin() < view.height():
                return


def _size(label: QLabel, size_px: int, *, bold: bool) -> None:
    """Give a label's type a size in pixels; the window's style sheet would win over a font."""
    style = f"font-size: {max(8, size_px)}px; font-weight: {'bold' if bold else 'normal'};"
    if label.styleSheet() != style:
        label.setStyleSheet(style)


_Belongs = tuple[str | None, int, Entry | None]
"""What a field is for: its kind, the number of the step, and the entry that is corrected."""


class TextFields:
    """The field of the state at hand, and below it the line for a reason, a note or a flag."""

    def __init__(self) -> None:
        self.rating, self.words, self.line = QLineEdit(), QLineEdit(), QLineEdit()
        self._ends, self._question = parts.label("quiet"), parts.label("quiet")
        for field, name, how in (
            (self.rating, "rating", "type a number, Enter saves"),
            (self.words, "description", "type the participant's words, Enter saves"),
            (self.line, "line of text", ""),
        ):
            field.setAccessibleName(name)
            field.setPlaceholderText(how)
        self.pages = QStackedWidget()
        for page in (QWidget(), parts.column(self._ends, self.rating), parts.column(self.words)):
            self.pages.addWidget(page)
        self.bar = parts.column(self._question, self.line)
        self.bar.hide()
        self._belongs: _Belongs = (None, -1, None)
        self._drafts: dict[_Belongs, str] = {}

    def at(self, position: Position, said: str) -> None:
        """Take a position: a new field begins with what was half typed there before, else with what was said so far."""
        belongs = (field_of(position), position.number, position.correcting)
        if belongs == self._belongs:
            return
        self._keep(self._belongs)
        self._belongs = belongs
        draft = self._drafts.pop(belongs, "") if position.correcting is None else ""
        if isinstance(step := position.step, Rate):
            self._ends.setText(f"{step.minimum:g} = {step.minimum_text}     {step.maximum:g} = {step.maximum_text}")
        for field in (self.rating, self.words):
            field.setText(draft or said)
            if not draft:
                field.selectAll()

    def _keep(self, belongs: _Belongs) -> None:
        """Keep what is half typed in the field that is left; of other steps nothing is kept any more."""
        name, number, _ = belongs
        typed = {"number": self.rating.text(), "words": self.words.text()}.get(name or "", "")
        self._drafts = {one: text for one, text in self._drafts.items() if one[1] == number} | {belongs: typed}

    def focus(self, position: Position, otherwise: QWidget) -> None:
        """Show the field of a position, and put the cursor into it; an open line keeps the cursor."""
        name = field_of(position) or ""
        self.pages.setCurrentIndex({"number": 1, "words": 2}.get(name, 0))
        if self.bar.isHidden():
            self._field(position, otherwise).setFocus()

    def close_line(self, position: Position, otherwise: QWidget) -> None:
        """Take the line away; the cursor goes back to where it was."""
        self._field(position, otherwise).setFocus()
        self.bar.hide()

    def _field(self, position: Position, otherwise: QWidget) -> QWidget:
        return {"number": self.rating, "words": self.words}.get(field_of(position) or "", otherwise)

    def open_line(self, question: str) -> None:
        """Let a line be typed."""
        self._question.setText(question)
        self.line.clear()
        self.bar.show()
        self.line.setFocus()

    def typed(self, field: Field) -> str:
        """What is typed in a field."""
        return {"line": self.line, "number": self.rating, "words": self.words}[field].text()
