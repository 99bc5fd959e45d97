"""The buttons of the console's window: in large what can be done now, in a row below what can be done at any time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from PyQt6.QtWidgets import QHBoxLayout, QWidget

from experiments.events import Press
from experiments.screens.console import parts
from experiments.screens.console.actions import CommandButton, HeldButton, Slots
from experiments.screens.console.keys import Name, field_of
from experiments.states import Position, State

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
