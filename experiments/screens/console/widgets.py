"""The look of the console's windows, dark and light, and widgets that Qt has almost.

Text keeps a contrast of at least 7 to 1 against its ground.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, inf
from pathlib import Path
from string import Template
from typing import TypeVar

from PyQt6 import QtGui, QtWidgets
from PyQt6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, pyqtSignal

from experiments.screens.participant.messages import Theme
from experiments.screens.phrases import phrase
from experiments.study.register import MAX_REASON, RegisterError, check_reason

MOODS = ("act", "ask", "rest", "wait", "good", "bad")
"""What a line is about, which chooses its colour; the words say it as well."""

_COLOURS = {
    "stop": ("#b3261e", "#b3261e"),
    "stop_text": ("#ffffff", "#ffffff"),
    "practice": ("#5b2a86", "#5b2a86"),
    "practice_text": ("#ffffff", "#ffffff"),
    "simulated": ("#ffb000", "#ffb000"),
    "simulated_text": ("#000000", "#000000"),
    "ground": ("#101418", "#ffffff"),
    "panel": ("#1b2229", "#f0f3f6"),
    "line": ("#4a5764", "#7a8794"),
    "filled": ("#34414d", "#c3ccd5"),
    "text": ("#f2f5f7", "#10161c"),
    "quiet": ("#b9c4ce", "#3c4852"),
    "dim": ("#8593a1", "#66727e"),
    "act": ("#8fd0ff", "#00497a"),
    "ask": ("#ffd479", "#6b4300"),
    "rest": ("#9fe0b5", "#0b5028"),
    "wait": ("#c8d0d8", "#3c4852"),
    "good": ("#9fe0b5", "#0b5028"),
    "bad": ("#ffb3a7", "#8c1d18"),
}
"""Each by what it is for, in the dark theme and in the light one."""


def colour(theme: Theme, name: str) -> str:
    """A colour by what it is for."""
    return _COLOURS[name][theme == "light"]


def sheet(theme: Theme) -> str:
    """The Qt style sheet of a theme, in the sizes of the window that it was designed for."""
    # labels that have a colour by their name are named, or that colour would win over the mood's
    return _styled("console.qss", theme, [f"QLabel{name}" for name in ("", "#saved", "#quiet", "#title", "#damper")])


def start_sheet() -> str:
    """The same of the windows before a run, which are dark."""
    return sheet("dark") + _styled("start.qss", "dark", ["QTextEdit", "QLabel#gun", "QLabel#count"])


def _styled(file: str, theme: Theme, kinds: Sequence[str]) -> str:
    """A style sheet beside this module in the colours of a theme, some kinds of widgets in the colour of each mood."""
    selectors = {mood: ", ".join(f'{kind}[mood="{mood}"]' for kind in kinds) for mood in MOODS}
    moods = "\n".join(f"{selector} {{ color: {colour(theme, mood)}; }}" for mood, selector in selectors.items())
    template = Template(Path(__file__).with_name(file).read_text(encoding="utf-8"))
    return template.substitute({name: colour(theme, name) for name in _COLOURS}, moods=moods)


Slot = Callable[[], object]
NO_FOCUS = Qt.FocusPolicy.NoFocus


def text_label(name: str, text: str = "", *, wrap: bool = True) -> QtWidgets.QLabel:
    """A label in the style of its name."""
    made = QtWidgets.QLabel(text)
    made.setObjectName(name)
    made.setWordWrap(wrap)
    made.setTextFormat(Qt.TextFormat.PlainText)
    return made


def set_mood(widget: QtWidgets.QWidget, mood: str) -> None:
    """Give a label the colour of a mood; drawn anew only if it changes."""
    if widget.property("mood") != mood:
        widget.setProperty("mood", mood)
        restyle(widget)


def restyle(widget: QtWidgets.QWidget) -> None:
    """Have a widget drawn anew after a property that the style knows has changed."""
    style = widget.style()
    if style is not None:
        style.unpolish(widget)
        style.polish(widget)


class ConsoleButton(QtWidgets.QPushButton):
    """A button that says when it went down: once, also where a held pointer slides off it and back.

    The second press of a double click is none; but of a button that `stops` it is one, if the first missed it. Such a
    button takes any button of the mouse: in haste it may be the wrong one.
    """

    went_down = pyqtSignal()
    stops = False
    _pressed_ms = -inf

    def mousePressEvent(self, event: QtGui.QMouseEvent | None) -> None:  # noqa: N802 - Qt's name
        """Go down by the mouse."""
        if event is None:
            return
        self._pressed_ms = event.timestamp()
        if event.button() == Qt.MouseButton.LeftButton:
            self.setDown(False)  # nobody hears that it is let go while its window is minimised
        elif self.stops:
            event.accept()
            self.went_down.emit()
            return
        was_down = self.isDown()
        super().mousePressEvent(event)
        if self.isDown() and not was_down:  # another button of the mouse may be pressed beside
            self.went_down.emit()

    def keyPressEvent(self, event: QtGui.QKeyEvent | None) -> None:  # noqa: N802 - Qt's name
        """Go down by Space."""
        was_down = self.isDown()
        super().keyPressEvent(event)
        if self.isDown() and not was_down:
            self.went_down.emit()

    def mouseDoubleClickEvent(self, event: QtGui.QMouseEvent | None) -> None:  # noqa: N802 - Qt's name
        """It is the same intent as the first, which may have missed the button."""
        if event is None:
            return
        event.accept()
        if self.stops and event.timestamp() - self._pressed_ms > QtWidgets.QApplication.doubleClickInterval():
            self.mousePressEvent(event)


def button(
    parent: QtWidgets.QWidget,
    text: str,
    key: str,
    slot: Slot,
    *,
    name: str = "",
    at_once: bool = False,
    clicked: Slot | None = None,
    unseen: Slot = lambda: None,
) -> ConsoleButton:
    """A button that shows its key, and the key. Both do the same, and only while the button is there to be seen.

    `at_once`: what stops acts as the button goes down, the others as it is let go. `clicked` is what that does where it
    is not what the key does; `unseen` what the key does while the button is not there.
    """
    made = ConsoleButton(f"{text}  [{key.replace('Return', 'Enter')}]")
    made.setObjectName(name)
    made.setAccessibleName(text)
    made.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    made.stops = at_once
    if at_once:
        made.went_down.connect(slot)
    else:
        made.clicked.connect(lambda _: (clicked or slot)())

    def pressed() -> None:
        (slot if made.isVisible() else unseen)()

    shortcut = QtGui.QShortcut(QtGui.QKeySequence(key), parent)
    shortcut.setAutoRepeat(False)
    shortcut.activated.connect(pressed)
    return made


_Box = TypeVar("_Box", bound=QtWidgets.QBoxLayout)
Part = QtWidgets.QWidget | QtWidgets.QLayout


def fill(
    layout: _Box, *parts: Part | tuple[Part, int], margins: tuple[int, int, int, int] | None = (0, 0, 0, 0)
) -> _Box:
    """Put widgets and layouts into a layout, each with its stretch where it has one. No margins: those of the style."""
    if margins is not None:
        layout.setContentsMargins(*margins)
    for part, stretch in (part if isinstance(part, tuple) else (part, 0) for part in parts):
        if isinstance(part, QtWidgets.QWidget):
            layout.addWidget(part, stretch)
        else:
            layout.addLayout(part, stretch)
    return layout


def panel(*widgets: QtWidgets.QWidget) -> QtWidgets.QFrame:
    """A framed column."""
    frame = QtWidgets.QFrame()
    frame.setObjectName("panel")
    fill(QtWidgets.QVBoxLayout(frame), *widgets, margins=None)
    return frame


def column(*widgets: QtWidgets.QWidget) -> QtWidgets.QWidget:
    """Widgets below each other."""
    fill(QtWidgets.QVBoxLayout(made := QtWidgets.QWidget()), *widgets)
    return made


def quiet_list() -> QtWidgets.QListWidget:
    """A list that is only looked at; long lines go on below."""
    made = QtWidgets.QListWidget()
    made.setWordWrap(True)
    made.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    made.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    made.setSelectionMode(QtWidgets.QListWidget.SelectionMode.SingleSelection)
    return made


class TextLines(QtWidgets.QTextEdit):
    """Text to read and to copy. A word that is too long, such as a path, is broken; a text that is too long scrolls."""

    def __init__(self, name: str, text: str = "", most_lines: int = 4) -> None:
        super().__init__()
        self._most_lines = most_lines
        self.setObjectName(name)
        self.setReadOnly(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setFrameShape(QtWidgets.QFrame.Shape.NoFrame)
        self.setWordWrapMode(QtGui.QTextOption.WrapMode.WrapAtWordBoundaryOrAnywhere)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setSizePolicy(QtWidgets.QSizePolicy.Policy.Expanding, QtWidgets.QSizePolicy.Policy.Fixed)
        self.say(text)

    def say(self, text: str, mood: str = "") -> None:
        """Show a text, in the colour of a mood."""
        self.setPlainText(text)
        self.setAccessibleName(text)
        set_mood(self, mood)
        self._fit()

    def resizeEvent(self, event: QtGui.QResizeEvent | None) -> None:  # noqa: N802 - Qt's name
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


class TickBox(QtWidgets.QCheckBox):
    """A box that shows a tick when it is ticked: colour alone does not say it."""

    def paintEvent(self, event: QtGui.QPaintEvent | None) -> None:  # noqa: N802 - Qt's name
        """The box as its style has it, with the tick on top."""
        super().paintEvent(event)
        style = self.style()
        if not self.isChecked() or style is None:
            return
        option = QtWidgets.QStyleOptionButton()
        self.initStyleOption(option)
        box = QRectF(style.subElementRect(QtWidgets.QStyle.SubElement.SE_CheckBoxIndicator, option, self))
        painter = QtGui.QPainter(self)
        painter.setRenderHint(QtGui.QPainter.RenderHint.Antialiasing)
        painter.setPen(QtGui.QPen(QtGui.QColor(colour("dark", "ground")), box.width() / 7))
        painter.drawPolyline(QtGui.QPolygonF([_at(box, 0.22, 0.52), _at(box, 0.43, 0.74), _at(box, 0.79, 0.28)]))
        painter.end()


def _at(box: QRectF, across: float, down: float) -> QPointF:
    return QPointF(box.left() + across * box.width(), box.top() + down * box.height())


class ListBox(QtWidgets.QComboBox):
    """One of several. The wheel that scrolls the form does not turn it, nor does its longest entry widen the form."""

    def __init__(self, entries: Sequence[str]) -> None:
        super().__init__()
        self.addItems(entries)
        self.setSizeAdjustPolicy(QtWidgets.QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(10)
        self.setSizePolicy(QtWidgets.QSizePolicy.Policy.Expanding, QtWidgets.QSizePolicy.Policy.Fixed)

    def wheelEvent(self, event: QtGui.QWheelEvent | None) -> None:  # noqa: N802 - Qt's name
        """Leave the wheel to what is scrolled."""
        if event is not None:
            event.ignore()


class LineEdit(QtWidgets.QLineEdit):
    """A line of text. Enter goes on to the next field, and a held Enter no further."""

    def keyPressEvent(self, event: QtGui.QKeyEvent | None) -> None:  # noqa: N802 - Qt's name
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


class ReasonLine(LineEdit):
    """A line for the reason of an answer. Enter stays in it: behind it are buttons, which a typed blank would press."""

    def focusNextChild(self) -> bool:  # noqa: N802 - Qt's name
        """Go nowhere."""
        return False


WHY = phrase("why? (never a name)")
SET_ASIDE = phrase("Set it aside, start anew")


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """An answer: what its button says, its key, and what it does with the reason that was typed."""

    text: str
    key: str
    do: Callable[[str], None]


class QuestionBox(QtWidgets.QFrame):
    """Asks one thing, until it is answered or taken back."""

    def __init__(self, text: str, answers: tuple[Option, ...], *, reason: str = "") -> None:
        super().__init__()
        self.setObjectName("panel")
        self.text = TextLines("question")
        self.text.say(text, "ask")
        self.reason = ReasonLine()
        self.reason.setMaxLength(MAX_REASON)
        self.reason.setPlaceholderText(reason)
        self.reason.setAccessibleName(reason)
        self.reason.setVisible(bool(reason))
        across = fill(QtWidgets.QHBoxLayout(), *map(self._button, answers))
        fill(QtWidgets.QVBoxLayout(self), self.text, self.reason, across, margins=None)

    def _button(self, answer: Option) -> QtWidgets.QWidget:
        return button(self, answer.text, answer.key, lambda: answer.do(self.reason.text().strip()))

    def takes(self, reason: str, say: Callable[[str, str], None]) -> bool:
        """Whether a reason can be kept; if not, it is said why in one sentence, and its line gets the keys."""
        try:
            check_reason(reason)
        except RegisterError as error:
            say(f"{error}." if reason else phrase("Type why, first."), "bad")
            self.reason.setFocus()
            return False
        return True
