"""What is typed in the console's window: a rating, words, or a line that was asked for."""

from __future__ import annotations

from PyQt6.QtWidgets import QLineEdit, QStackedWidget, QWidget

from experiments.screens.console import parts
from experiments.screens.console.controls import Field
from experiments.screens.console.keys import field_of
from experiments.states import Position
from experiments.steps import Rate


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
        self._belongs: tuple[object, ...] = ()

    def at(self, position: Position, said: str) -> None:
        """Take a position: a field that was not there before begins with what was said so far, to be typed over."""
        belongs = (field_of(position), position.number, position.correcting)
        if belongs == self._belongs:
            return
        self._belongs = belongs
        if isinstance(step := position.step, Rate):
            self._ends.setText(f"{step.minimum:g} = {step.minimum_text}     {step.maximum:g} = {step.maximum_text}")
        for field in (self.rating, self.words):
            field.setText(said)
            field.selectAll()

    def focus(self, position: Position, otherwise: QWidget) -> None:
        """Show the field of a position, and put the cursor into it; an open line keeps the cursor."""
        name = field_of(position) or ""
        self.pages.setCurrentIndex({"number": 1, "words": 2}.get(name, 0))
        if self.bar.isHidden():
            {"number": self.rating, "words": self.words}.get(name, otherwise).setFocus()

    def open_line(self, question: str) -> None:
        """Let a line be typed."""
        self._question.setText(question)
        self.line.clear()
        self.bar.show()
        self.line.setFocus()

    def typed(self, field: Field) -> str:
        """What is typed in a field."""
        return {"line": self.line, "number": self.rating, "words": self.words}[field].text()
