"""The buttons of the console's window: each shows its key, and a click counts if it began and ended in one state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from PyQt6.QtCore import Qt
from PyQt6.QtGui import QMouseEvent
from PyQt6.QtWidgets import QGridLayout, QHBoxLayout, QPushButton, QSizePolicy, QWidget

from experiments.screens.console import parts
from experiments.screens.console.keys import BY_NAME, Name, field_of, shown_key
from experiments.session.events import Press
from experiments.session.states import Position, State

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


_LEFT: tuple[Name, ...] = ("forward", "damper", "restart")
_MIDDLE: tuple[Name, ...] = ("fire", "next", "go on", "enter", "rearm", "reason")
_RIGHT: tuple[Name, ...] = ("backward", "end break", "no answer")
_ROW: tuple[Name, ...] = ("undo", "repeat", "flag", "note", "list", "pause", "stop", "help")
_OF_STATE: dict[State, tuple[Name, ...]] = {
    State.REARMING: ("rearm",),
    State.SETTING: ("damper",),
    State.PREPARING: ("fire",),
    State.TRAIN: ("next",),
    State.ASKING: ("forward", "backward"),
    State.RATING: ("no answer",),
    State.RESTING: ("end break",),
    State.CLOSING: ("enter",),
    State.PAUSED: ("go on",),
    State.HALTED: ("reason",),
}
_OF_CORRECTION: dict[str | None, tuple[Name, ...]] = {None: ("forward", "backward"), "number": ("no answer",)}


class Mouse(Protocol):
    """What a mouse does with buttons."""

    def press(self) -> Press:
        """A press that begins now."""

    def do(self, name: Name, press: Press) -> None:
        """A button was clicked."""

    def hold(self, press: Press) -> None:
        """The button that has to be held went down."""

    def let_go(self) -> None:
        """It was let go."""


class Buttons:
    """`slots` is the place of the large buttons, `row` that of the others and of the emergency stop."""

    def __init__(self, mouse: Mouse) -> None:
        def large(name: Name) -> CommandButton:
            if name == "rearm":
                return HeldButton(name, mouse.press, mouse.hold, mouse.let_go)
            return CommandButton(name, mouse.press, mouse.do, "large")

        self._large = {name: large(name) for name in (*_LEFT, *_MIDDLE, *_RIGHT)}
        self.slots = Slots(*([self._large[name] for name in names] for names in (_LEFT, _MIDDLE, _RIGHT)))
        self._row = {name: CommandButton(name, mouse.press, mouse.do) for name in _ROW}
        self.row = QWidget()
        across = QHBoxLayout(self.row)
        across.setContentsMargins(10, 0, 10, 2)
        for button in self._row.values():
            across.addWidget(button, 2)
        across.addWidget(CommandButton("emergency", mouse.press, mouse.do, "stop"), 5)

    def put(self, position: Position, *, over: bool, letters: bool, idle: Callable[[Name], bool]) -> None:
        """Show what can be done now, and which of the keys below do nothing.

        `over`: the run has ended; `letters`: letters are text, commands take Ctrl as well.
        """
        closes = over or position.base is State.HALTED
        shown = set[str]() if over else set(_shown(position, screen_lost=not idle("restart")))
        self.slots.show_only({button for name, button in self._large.items() if name in shown})
        for name, button in self._large.items():
            button.label("End the run" if name == "enter" else "", letters=letters)
        for name, button in self._row.items():
            held = name == "pause" and position.state is State.PAUSED
            button.name = "go on" if held else name
            button.label("Close" if name == "stop" and closes else "", letters=letters)
            dim = "yes" if idle(button.name) else "no"
            if button.property("dim") != dim:
                button.setProperty("dim", dim)
                parts.restyle(button)


def _shown(position: Position, *, screen_lost: bool) -> tuple[Name, ...]:
    if position.state is State.CORRECTING:
        return _OF_CORRECTION.get(field_of(position), ())
    return (*_OF_STATE.get(position.state, ()), *(("restart",) if screen_lost else ()))
