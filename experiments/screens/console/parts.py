"""The parts of the console's window: buttons that show their key, the panels, the areas for each kind of step."""

from __future__ import annotations

from collections.abc import Callable

from PyQt6.QtCore import Qt
from PyQt6.QtGui import QKeySequence, QShortcut
from PyQt6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QListWidget,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

Slot = Callable[[], object]
NO_FOCUS = Qt.FocusPolicy.NoFocus


def label(name: str, text: str = "", *, wrap: bool = True) -> QLabel:
    """A label in the style of its name."""
    made = QLabel(text)
    made.setObjectName(name)
    made.setWordWrap(wrap)
    made.setTextFormat(Qt.TextFormat.PlainText)
    return made


def set_mood(widget: QWidget, mood: str) -> None:
    """Give a label the colour of a mood; drawn anew only if it changes."""
    if widget.property("mood") != mood:
        widget.setProperty("mood", mood)
        restyle(widget)


def restyle(widget: QWidget) -> None:
    """Have a widget drawn anew after a property that the style knows has changed."""
    style = widget.style()
    if style is not None:
        style.unpolish(widget)
        style.polish(widget)


def button(parent: QWidget, text: str, key: str, slot: Slot, *, name: str = "") -> QPushButton:
    """A button that shows its key, and the key. Both do the same, and only while the button is there to be seen."""
    made = _button(f"{text}  [{key.replace('Return', 'Enter')}]", text, slot, name)

    def pressed() -> None:
        if made.isVisible():
            slot()

    shortcut = QShortcut(QKeySequence(key), parent)
    shortcut.setAutoRepeat(False)
    shortcut.activated.connect(pressed)
    return made


def _button(shown: str, spoken: str, slot: Slot, name: str) -> QPushButton:
    made = QPushButton(shown)
    made.setObjectName(name)
    made.setAccessibleName(spoken)
    made.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    made.clicked.connect(lambda _: slot())
    return made


def panel(*widgets: QWidget) -> QFrame:
    """A framed column."""
    frame = QFrame()
    frame.setObjectName("panel")
    column = QVBoxLayout(frame)
    for widget in widgets:
        column.addWidget(widget)
    return frame


def row(*widgets: QWidget) -> QWidget:
    """Widgets side by side."""
    made = QWidget()
    across = QHBoxLayout(made)
    across.setContentsMargins(0, 0, 0, 0)
    for widget in widgets:
        across.addWidget(widget)
    return made


def column(*widgets: QWidget) -> QWidget:
    """Widgets below each other."""
    made = QWidget()
    down = QVBoxLayout(made)
    down.setContentsMargins(0, 0, 0, 0)
    for widget in widgets:
        down.addWidget(widget)
    return made


def quiet_list() -> QListWidget:
    """A list that is only looked at; long lines go on below."""
    made = QListWidget()
    made.setWordWrap(True)
    made.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    made.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    made.setSelectionMode(QListWidget.SelectionMode.SingleSelection)
    return made
