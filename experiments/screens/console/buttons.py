"""The console's buttons: one a command, those of the answers, and which can be pressed now."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from PyQt6 import QtWidgets
from PyQt6.QtCore import Qt
from PyQt6.QtGui import QMouseEvent

from experiments.screens.console import widgets
from experiments.screens.console.keys import ANSWERS, BY_NAME, Name, button_lines, choices_at, field_at, shown_key
from experiments.screens.phrases import phrase
from experiments.session.events import Press
from experiments.session.states import Position, State
from experiments.session.steps import Rate
from experiments.tasks.questions import Choice


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


class CommandButton(QtWidgets.QPushButton):
    """A button of a command. It never takes the keys, and the second press of a double click is none."""

    def __init__(self, name: Name, mouse: Mouse, style: str = "") -> None:
        super().__init__()
        self.name, self._press, self._mouse = name, Press(at_s=0.0, serial=-1), mouse
        self.setObjectName(style)
        self.setAccessibleName(BY_NAME[name].text)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setSizePolicy(QtWidgets.QSizePolicy.Policy.Ignored, QtWidgets.QSizePolicy.Policy.Preferred)
        self.pressed.connect(self._keep)
        if name == "rearm":  # it has to be held
            self.pressed.connect(lambda: mouse.hold(self._press))
            self.released.connect(mouse.let_go)
        else:
            self.clicked.connect(lambda _: mouse.do(self.name, self._press))
        self.label()

    def _keep(self) -> None:
        self._press = self._mouse.press()

    def label(self, text: str = "", *, letters: bool = False, choices: Sequence[Choice] = ()) -> None:
        """Show what it does, and its key below."""
        key = shown_key(self.name, letters=letters, choices=choices)
        shown = "\n".join(filter(None, (text or BY_NAME[self.name].text, f"[{key}]")))
        if shown != self.text():
            self.setText(shown)

    def mouseDoubleClickEvent(self, event: QMouseEvent | None) -> None:  # noqa: N802 - Qt's name
        """The second press of a double click is the same intent as the first."""
        if event is not None:
            event.accept()


class Slots(QtWidgets.QWidget):
    """Three places side by side, each for buttons of its own: what comes after Fire is never where Fire was."""

    def __init__(
        self, left: Sequence[QtWidgets.QWidget], middle: Sequence[QtWidgets.QWidget], right: Sequence[QtWidgets.QWidget]
    ) -> None:
        super().__init__()
        across = widgets.fill(QtWidgets.QHBoxLayout(self))
        self._widgets = [*left, *middle, *right]
        for place_of in (left, middle, right):
            place = QtWidgets.QWidget()
            stack = QtWidgets.QGridLayout(place)
            stack.setContentsMargins(0, 0, 0, 0)
            for widget in place_of:
                policy = widget.sizePolicy()
                policy.setRetainSizeWhenHidden(True)
                widget.setSizePolicy(policy)
                stack.addWidget(widget, 0, 0)
                widget.hide()
            across.addWidget(place, 1)

    def show_only(self, shown: set[QtWidgets.QWidget]) -> None:
        """Show these buttons and hide the others."""
        for widget in self._widgets:
            if widget.isVisibleTo(self) != (widget in shown):
                widget.setVisible(widget in shown)


class AnswerButtons(QtWidgets.QWidget):
    """Buttons side by side for some of the answers."""

    def __init__(self, mouse: Mouse) -> None:
        super().__init__()
        self._buttons = [CommandButton(name, mouse, "large") for name in ANSWERS]
        across = widgets.fill(QtWidgets.QHBoxLayout(self))
        for button in self._buttons:
            across.addWidget(button, 1)

    def put(self, choices: Sequence[Choice], shown: range) -> None:
        """Show the answers at these places among the choices."""
        for place, button in enumerate(self._buttons):
            button.setVisible(place in shown)
            if place in shown:
                button.label(button_lines(choices[place].told, len(shown)), choices=choices)
                button.setAccessibleName(choices[place].told)
                button.setToolTip(choices[place].told)


_LEFT: tuple[Name, ...] = ("damper", "restart")
_MIDDLE: tuple[Name, ...] = ("fire", "next", "go on", "enter", "rearm", "reason")
_RIGHT: tuple[Name, ...] = ("end break", "no answer")
_ROW: tuple[Name, ...] = ("undo", "repeat", "flag", "note", "list", "pause", "stop", "help")
_OF_STATE: dict[State, tuple[Name, ...]] = {
    State.REARMING: ("rearm",),
    State.SETTING: ("damper",),
    State.PREPARING: ("fire",),
    State.TRAIN: ("next",),
    State.RATING: ("no answer",),
    State.RESTING: ("end break",),
    State.INFORMING: ("enter",),
    State.CLOSING: ("enter",),
    State.PAUSED: ("go on",),
    State.HALTED: ("reason",),
}


class Buttons:
    """`slots` is the place of the large buttons, `row` that of the others and of the emergency stop."""

    def __init__(self, mouse: Mouse) -> None:
        self._large = {name: CommandButton(name, mouse, "large") for name in (*_LEFT, *_MIDDLE, *_RIGHT)}
        self._answers = AnswerButtons(mouse), AnswerButtons(mouse)
        left, middle, right = ([self._large[name] for name in names] for names in (_LEFT, _MIDDLE, _RIGHT))
        self.slots = Slots([self._answers[0], *left], middle, [self._answers[1], *right])
        self._row = {name: CommandButton(name, mouse) for name in _ROW}
        self.row = QtWidgets.QWidget()
        row = [*((button, 2) for button in self._row.values()), (CommandButton("emergency", mouse, "stop"), 5)]
        widgets.fill(QtWidgets.QHBoxLayout(self.row), *row, margins=(10, 0, 10, 2))

    def put(self, position: Position, *, over: bool, letters: bool, idle: Callable[[Name], bool]) -> None:
        """Show what can be done now, and which of the keys below do nothing.

        `over`: the run has ended; `letters`: letters are text, commands take Ctrl as well.
        """
        closes = over or position.base is State.HALTED
        shown = set[str]() if over else set(_shown(position, screen_lost=not idle("restart")))
        choices = () if over else choices_at(position)
        asks = bool(choices) and position.state in (State.ASKING, State.CORRECTING)
        hidden = {"fire"} if idle("fire") else set[str]()  # nobody is shown to fire a gun that does not answer
        large: set[QtWidgets.QWidget] = {button for name, button in self._large.items() if name in shown - hidden}
        self.slots.show_only(large | set(self._answers if asks else ()))
        half = (len(choices) + 1) // 2
        if asks:
            self._answers[0].put(choices, range(half))
            self._answers[1].put(choices, range(half, len(choices)))
        for name, button in self._large.items():
            enters = phrase("It was told") if position.state is State.INFORMING else phrase("End the run")
            button.label(enters if name == "enter" else "", letters=letters)
        for name, button in self._row.items():
            held = name == "pause" and position.state is State.PAUSED
            button.name = "go on" if held else name
            button.label(
                phrase("Close") if name == "stop" and closes else "", letters=letters, choices=choices if asks else ()
            )
            dim = "yes" if idle(button.name) else "no"
            if button.property("dim") != dim:
                button.setProperty("dim", dim)
                widgets.restyle(button)


def _shown(position: Position, *, screen_lost: bool) -> tuple[Name, ...]:
    if position.state is State.CORRECTING:
        shown: tuple[Name, ...] = ("no answer",) if field_at(position) == "number" else ()
    else:
        shown = (*_OF_STATE.get(position.state, ()), *(("restart",) if screen_lost else ()))
    asked = position.correcting or position.step
    needed = isinstance(asked, Rate) and not asked.may_be_skipped
    return tuple(name for name in shown if not (name == "no answer" and needed))
