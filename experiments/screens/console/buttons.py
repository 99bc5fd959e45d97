"""The console's buttons: one a command, those of the answers, and which can be pressed now."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from PyQt6 import QtGui, QtWidgets
from PyQt6.QtCore import QEvent, Qt

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


_AT_ONCE: frozenset[Name] = frozenset(["emergency", "pause"])
"""What stops does so as its button goes down."""


class CommandButton(widgets.ConsoleButton):
    """A button of a command. It never takes the keys."""

    def __init__(self, name: Name, mouse: Mouse, style: str = "") -> None:
        super().__init__()
        self.name, self._press, self._mouse = name, Press(at_s=0.0, serial=-1), mouse
        self.setObjectName(style)
        self.setAccessibleName(BY_NAME[name].text)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setSizePolicy(QtWidgets.QSizePolicy.Policy.Ignored, QtWidgets.QSizePolicy.Policy.Preferred)
        self.went_down.connect(self._keep)
        if name == "rearm":  # it has to be held
            self.went_down.connect(lambda: mouse.hold(self._press))
            self.released.connect(mouse.let_go)
        elif name in _AT_ONCE:
            self.stops = True
            self.went_down.connect(lambda: mouse.do(name, self._press))
        else:
            self.clicked.connect(lambda _: mouse.do(self.name, self._press))
        self.label()

    def _keep(self) -> None:
        self._press = self._mouse.press()

    def label(self, text: str = "", *, letters: bool = False, choices: Sequence[Choice] = ()) -> None:
        """Show what it does, and its key below."""
        key = shown_key(self.name, letters=letters, choices=choices)
        shown = "\n".join(filter(None, (text or BY_NAME[self.name].text, f"[{key}]")))
        if (shown := shown.replace("&", "&&")) != self.text():  # one alone would mark a key of Qt's
            self.setText(shown)


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


_TYPES = ("", "smaller", "smallest")
"""The sizes of an answer's type, as the style sheet has them; capitals are of the largest alone."""


class AnswerButton(CommandButton):
    """A button of an answer in one of the sizes of type. `changed` is called where its room or its type has changed."""

    def __init__(self, name: Name, mouse: Mouse, changed: Callable[[], None], size: str = "") -> None:
        self._changed = changed
        super().__init__(name, mouse, "large")
        self.setProperty("type", size)

    def lines(self, told: str, width_px: int) -> str:
        """An answer as it stands on a button of this type that is so wide; empty if it has no room."""
        room_px, metrics = self._room_px(width_px), self.fontMetrics()
        return button_lines(self._cased(told), lambda line: metrics.size(0, line).width() <= room_px)

    def cut(self, told: str, width_px: int) -> str:
        """As much of an answer as has room in one line."""
        return self.fontMetrics().elidedText(self._cased(told), Qt.TextElideMode.ElideRight, self._room_px(width_px))

    def _cased(self, told: str) -> str:
        return told if self.property("type") else told.upper()

    def _room_px(self, width_px: int) -> int:
        self.ensurePolished()
        option, style = QtWidgets.QStyleOptionButton(), self.style()
        self.initStyleOption(option)
        option.rect.setWidth(width_px)
        inner = QtWidgets.QStyle.SubElement.SE_PushButtonContents
        return width_px if style is None else style.subElementRect(inner, option, self).width()

    def resizeEvent(self, event: QtGui.QResizeEvent | None) -> None:  # noqa: N802 - Qt's name
        """Its room has changed."""
        super().resizeEvent(event)
        self._changed()

    def changeEvent(self, event: QEvent | None) -> None:  # noqa: N802 - Qt's name
        """Its type may have changed."""
        super().changeEvent(event)
        if event is not None and event.type() in {QEvent.Type.FontChange, QEvent.Type.StyleChange}:
            self._changed()


class AnswerButtons:
    """Buttons of the answers, half of them on each of two `sides`, in the largest type that has room for all."""

    def __init__(self, mouse: Mouse) -> None:
        self.sides = QtWidgets.QWidget(), QtWidgets.QWidget()
        self._choices: tuple[Choice, ...] = ()
        self._fits = False
        self._buttons = [[AnswerButton(name, mouse, self._fit) for name in ANSWERS] for _ in self.sides]
        self._sizes = [AnswerButton("help", mouse, self._fit, size) for size in _TYPES]
        for side, buttons in zip(self.sides, self._buttons, strict=True):
            across = widgets.fill(QtWidgets.QHBoxLayout(side))
            for button in buttons:
                across.addWidget(button, 1)
        for size in self._sizes:  # these are only measured
            size.setParent(self.sides[0])
            size.hide()

    def put(self, choices: Sequence[Choice]) -> None:
        """Show the answers."""
        if self._choices == tuple(choices):
            return
        self._choices = tuple(choices)
        half = (len(choices) + 1) // 2
        for buttons, shown in zip(self._buttons, (range(half), range(half, len(choices))), strict=True):
            for place, button in enumerate(buttons):
                button.setVisible(place in shown)
                if place in shown:
                    button.setAccessibleName(choices[place].told)
                    button.setToolTip(choices[place].told)
        self._fit()

    def _fit(self) -> None:
        if self._fits or not self._choices:
            return
        self._fits = True  # a change of type is heard of as well
        half = (len(self._choices) + 1) // 2
        placed = [(self._buttons[place >= half][place], choice.told) for place, choice in enumerate(self._choices)]
        able = [(button, told) for button, told in placed if self._sizes[-1].lines(told, button.width())]
        sizes = (
            self._sizes if len(able) == len(placed) else self._sizes[-1:]
        )  # what has no room is cut where most of it stands
        size = next(one for one in sizes if all(one.lines(told, button.width()) for button, told in able))
        for button, told in placed:
            if button.property("type") != size.property("type"):
                button.setProperty("type", size.property("type"))
                widgets.restyle(button)
                button.updateGeometry()
            width_px = button.width()
            button.label(size.lines(told, width_px) or size.cut(told, width_px), choices=self._choices)
        self._fits = False


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
        self._answers = AnswerButtons(mouse)
        left, middle, right = ([self._large[name] for name in names] for names in (_LEFT, _MIDDLE, _RIGHT))
        answers_left, answers_right = self._answers.sides
        self.slots = Slots([answers_left, *left], middle, [answers_right, *right])
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
        self.slots.show_only(large | set(self._answers.sides if asks else ()))
        if asks:
            self._answers.put(choices)
        for name, button in self._large.items():
            enters = phrase("It was told") if position.state is State.INFORMING else phrase("End the run")
            button.label(enters if name == "enter" else "", letters=letters)
        for name, button in self._row.items():
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
