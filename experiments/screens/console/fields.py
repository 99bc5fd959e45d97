"""Widgets that Qt has almost: text that always has room, boxes with a tick, lists, a question with its answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil

from PyQt6.QtCore import QEvent, QPointF, QRectF, QSize, Qt
from PyQt6.QtGui import (
    QColor,
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
    QResizeEvent,
    QTextOption,
    QWheelEvent,
)
from PyQt6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFrame,
    QHBoxLayout,
    QLineEdit,
    QSizePolicy,
    QStyle,
    QStyleOptionButton,
    QTextEdit,
    QVBoxLayout,
    QWidget,
)

from experiments.screens.console import parts
from experiments.study.register import MAX_REASON, RegisterError, check_reason


class Lines(QTextEdit):
    """Text to read and to copy. A word that is too long, such as a path, is broken; a text that is too long scrolls."""

    def __init__(self, name: str, text: str = "", most_lines: int = 4) -> None:
        super().__init__()
        self._most_lines = most_lines
        self.setObjectName(name)
        self.setReadOnly(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setWordWrapMode(QTextOption.WrapMode.WrapAtWordBoundaryOrAnywhere)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.say(text)

    def say(self, text: str, mood: str = "") -> None:
        """Show a text, in the colour of a mood."""
        self.setPlainText(text)
        self.setAccessibleName(text)
        parts.set_mood(self, mood)
        self._fit()

    def resizeEvent(self, event: QResizeEvent | None) -> None:  # noqa: N802 - Qt's name
        """Take the height that the text needs at this width."""
        super().resizeEvent(event)
        self._fit()

    def changeEvent(self, event: QEvent | None) -> None:  # noqa: N802 - Qt's name
        """Take the height that the text needs in this type."""
        super().changeEvent(event)
        if event is not None and event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self._fit()

    def _fit(self) -> None:
        text = self.document()
        if text is None:
            return
        text.setDocumentMargin(0)
        # half a line more: a letter that another font has to lend may be higher than the rest
        needed, most = ceil(text.size().height()), int(self.fontMetrics().lineSpacing() * (self._most_lines + 0.5))
        never, always = Qt.ScrollBarPolicy.ScrollBarAlwaysOff, Qt.ScrollBarPolicy.ScrollBarAlwaysOn
        self.setVerticalScrollBarPolicy(always if needed > most else never)
        self.setFixedHeight(min(needed, most) if self.toPlainText() else 0)


class TickBox(QCheckBox):
    """A box that shows a tick when it is ticked: colour alone does not say it."""

    def paintEvent(self, event: QPaintEvent | None) -> None:  # noqa: N802 - Qt's name
        """The box as its style has it, with the tick on top."""
        super().paintEvent(event)
        style = self.style()
        if not self.isChecked() or style is None:
            return
        option = QStyleOptionButton()
        self.initStyleOption(option)
        box = QRectF(style.subElementRect(QStyle.SubElement.SE_CheckBoxIndicator, option, self))
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(QColor(parts.colour("dark", "ground")), box.width() / 7))
        painter.drawPolyline(QPolygonF([_at(box, 0.22, 0.52), _at(box, 0.43, 0.74), _at(box, 0.79, 0.28)]))
        painter.end()


def _at(box: QRectF, across: float, down: float) -> QPointF:
    return QPointF(box.left() + across * box.width(), box.top() + down * box.height())


class ListBox(QComboBox):
    """One of several. The wheel that scrolls the form does not turn it, nor does its longest entry widen the form."""

    def __init__(self, entries: Sequence[str]) -> None:
        super().__init__()
        self.addItems(entries)
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(10)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def wheelEvent(self, event: QWheelEvent | None) -> None:  # noqa: N802 - Qt's name
        """Leave the wheel to what is scrolled."""
        if event is not None:
            event.ignore()


class LineEdit(QLineEdit):
    """A line of text. Enter goes on to the next field, and a held Enter no further."""

    def keyPressEvent(self, event: QKeyEvent | None) -> None:  # noqa: N802 - Qt's name
        """Take a key."""
        if event is None:
            return
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            if not event.isAutoRepeat():
                self.focusNextChild()
            return
        super().keyPressEvent(event)

    def minimumSizeHint(self) -> QSize:  # noqa: N802 - Qt's name
        """Narrow windows squeeze the line, not what stands beside it."""
        return QSize(40, super().minimumSizeHint().height())


def start_sheet() -> str:
    """What these widgets, and the windows made of them, add to the style of all."""
    moods = "\n".join(
        f'QTextEdit[mood="{mood}"], QLabel#gun[mood="{mood}"], QLabel#count[mood="{mood}"] '
        f"{{ color: {parts.colour('dark', mood)}; }}"
        for mood in parts.MOODS
    )
    return f"""
    QTextEdit {{ background: transparent; border: none; font-size: 19px; }}
    QTextEdit#place {{ font-size: 22px; color: {parts.colour("dark", "quiet")}; }}
    QLabel#title {{ font-size: 56px; font-weight: bold; }}
    QTextEdit#detail {{ font-size: 26px; }}
    QTextEdit#saved, QTextEdit#question {{ font-size: 22px; }}
    QLabel#gun {{ font-size: 22px; font-weight: bold; }}
    QLabel#count {{ font-size: 160px; font-weight: bold; color: {parts.colour("dark", "ask")}; }}
    QPushButton#stop {{ font-size: 34px; padding: 26px; }}
    QScrollArea {{ background: transparent; }}
    QTableWidget::item {{ padding: 3px 8px; }}
    QScrollBar {{ background: transparent; border: none; width: 14px; height: 14px; }}
    QScrollBar::handle {{ background: {parts.colour("dark", "line")}; border-radius: 5px; min-height: 30px; }}
    QScrollBar::add-line, QScrollBar::sub-line {{ width: 0px; height: 0px; }}
    {moods}
    """


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
