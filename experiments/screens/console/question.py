"""A question at the foot of the start window, with an answer a button; where a reason is wanted, a line for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from PyQt6.QtWidgets import QFrame, QHBoxLayout, QVBoxLayout, QWidget

from experiments.screens.console import parts
from experiments.screens.console.fields import LineEdit, Lines
from experiments.study.register import MAX_REASON, RegisterError, check_reason

WHY = "why? (never a name)"


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """An answer: what its button says, its key, and what it does with the reason that was typed."""

    text: str
    key: str
    do: Callable[[str], None]


class Question(QFrame):
    """Asks one thing, until it is answered or taken back."""

    def __init__(self, text: str, answers: tuple[Answer, ...], *, reason: str = "") -> None:
        super().__init__()
        self.setObjectName("panel")
        down = QVBoxLayout(self)
        self.text = Lines("question")
        self.text.say(text, "ask")
        down.addWidget(self.text)
        self.reason = LineEdit()
        self.reason.setMaxLength(MAX_REASON)
        self.reason.setPlaceholderText(reason)
        self.reason.setAccessibleName(reason)
        self.reason.setVisible(bool(reason))
        down.addWidget(self.reason)
        across = QHBoxLayout()
        for answer in answers:
            across.addWidget(self._button(answer))
        down.addLayout(across)

    def _button(self, answer: Answer) -> QWidget:
        return parts.button(self, answer.text, answer.key, lambda: answer.do(self.reason.text().strip()))


def unfit(reason: str) -> str:
    """Why a reason cannot be kept, in one sentence; empty if it can."""
    if not reason:
        return "Type why, first."
    try:
        check_reason(reason)
    except RegisterError as error:
        return f"{error}."
    return ""
