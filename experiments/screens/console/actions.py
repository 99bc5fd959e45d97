"""The console's buttons: each shows its key, and a click counts if it began and ended on the same position."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PyQt6.QtCore import Qt
from PyQt6.QtGui import QMouseEvent
from PyQt6.QtWidgets import QGridLayout, QHBoxLayout, QPushButton, QSizePolicy, QWidget

from experiments.screens.console.keys import BY_NAME, Name, shown_key
from experiments.session.events import Press

Pressed = Callable[[], Press]
Act = Callable[[Name, Press], None]


class CommandButton(QPushButton):
    """A button of a command. It never takes the keys, and the second press of a double click is none."""

    def __init__(self, name: Name, pressed: Pressed, act: Act, style: str = "") -> None:
        super().__init__()
        self.name, self._press = name, Press(at_s=0.0, serial=-1)
        self._pressed, self._act = pressed, act
        self.setObjectName(style)
        self.setAccessibleName(BY_NAME[name].text)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.pressed.connect(self._keep)
        self.clicked.connect(lambda _: self._act(self.name, self._press))
        self.label()

    def _keep(self) -> None:
        self._press = self._pressed()

    def label(self, text: str = "", *, letters: bool = False) -> None:
        """Show what it does, and its key below."""
        shown = f"{text or BY_NAME[self.name].text}\n[{shown_key(self.name, letters=letters)}]"
        if shown != self.text():
            self.setText(shown)

    def mouseDoubleClickEvent(self, event: QMouseEvent | None) -> None:  # noqa: N802 - Qt's name
        """The second press of a double click is the same intent as the first."""
        if event is not None:
            event.accept()


class HeldButton(CommandButton):
    """A button that does something by being held: `down` and `up` tell when."""

    def __init__(self, name: Name, pressed: Pressed, down: Callable[[Press], None], up: Callable[[], None]) -> None:
        super().__init__(name, pressed, lambda _name, _press: None, "large")
        self.pressed.connect(lambda: down(pressed()))
        self.released.connect(up)


class Slots(QWidget):
    """Three places side by side, each for buttons of its own: what comes after Fire is never where Fire was."""

    def __init__(self, left: Sequence[QWidget], middle: Sequence[QWidget], right: Sequence[QWidget]) -> None:
        super().__init__()
        across = QHBoxLayout(self)
        across.setContentsMargins(0, 0, 0, 0)
        self._widgets = [*left, *middle, *right]
        for widgets in (left, middle, right):
            place = QWidget()
            stack = QGridLayout(place)
            stack.setContentsMargins(0, 0, 0, 0)
            for widget in widgets:
                policy = widget.sizePolicy()
                policy.setRetainSizeWhenHidden(True)
                widget.setSizePolicy(policy)
                stack.addWidget(widget, 0, 0)
                widget.hide()
            across.addWidget(place, 1)

    def show_only(self, shown: set[QWidget]) -> None:
        """Show these buttons and hide the others."""
        for widget in self._widgets:
            if widget.isVisibleTo(self) != (widget in shown):
                widget.setVisible(widget in shown)
