"""The page of a test shot: stand clear, the countdown, the emergency stop, and what the gun reported."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtWidgets import QVBoxLayout, QWidget

from experiments.clock import Clock
from experiments.config.setup import Setup
from experiments.screens.console import parts
from experiments.screens.console.fields import Lines
from experiments.screens.console.shot_check import SWITCH_OFF, ShotCheck, Told


class ShotPage(QWidget):
    """Takes the window's place from the press of a button until somebody goes back. One test shot at a time."""

    told = pyqtSignal(object)
    left = pyqtSignal()

    def __init__(self, gun: str, clock: Clock) -> None:
        super().__init__()
        self._gun, self._clock = gun, clock
        self._check: ShotCheck | None = None
        self._setup: Setup[Any] | None = None
        self.stopped = False
        """The emergency stop: nothing is fired from this page until it was left, and entered on purpose."""
        self._method_at = 0
        self.over: Callable[[], None] = lambda: None
        self.told.connect(self._take)
        self._build()

    def _build(self) -> None:
        self.title, self.count, self.detail = parts.label("title"), parts.label("count"), Lines("detail", most_lines=9)
        self.count.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        self.call_off_button = parts.button(self, "Call it off", "Esc", self._escape)
        self.next_button = parts.button(self, "Next test shot", "Ctrl+T", self.begin)
        self.stop_button = parts.button(self, "EMERGENCY STOP", "F12", self.emergency_stop, name="stop")
        down = QVBoxLayout(self)
        down.setContentsMargins(0, 0, 0, 0)
        for part in (self.title, self.detail, self.count):
            down.addWidget(part)
        down.addStretch(1)
        for button in (self.stop_button, self.call_off_button, self.next_button):
            down.addWidget(button)
        # its place stays empty: there the second click of a double click on the window's own button falls
        kept = self.next_button.sizePolicy()
        kept.setRetainSizeWhenHidden(True)
        self.next_button.setSizePolicy(kept)

    @property
    def is_running(self) -> bool:
        """Whether a test shot is under way."""
        return self._check is not None

    def enter(self) -> None:
        """The page was entered anew."""
        self.stopped = False

    def choose(self, setup: Setup[Any]) -> None:
        """Test the methods of an experiment, from the first on."""
        if self._setup is not setup:
            self._setup, self._method_at = setup, 0

    def next_text(self) -> str:
        """What the button of the next test shot says: the method, and the damper that is to be set by hand before."""
        if self._setup is None:
            return "Test shot"
        method = self._setup.gun.methods[self._next_method(self._setup)]
        damper = f", damper {method.damper.upper()}" if method.damper else ""
        return f"Test shot: {method.label}{damper}"

    def _next_method(self, setup: Setup[Any]) -> str:
        methods: tuple[str, ...] = setup.config.design.methods
        return methods[self._method_at % len(methods)]

    def begin(self) -> None:
        """Test the next method."""
        if self._check is not None or self._setup is None or self.stopped:
            return
        method = self._next_method(self._setup)
        self._shown = self.next_text().removeprefix("Test shot: ")
        self._show("One moment", f"Looking for the gun. Test shot of {self._shown}.", "wait")
        self._running(True)
        self._check = ShotCheck(self._setup, method, self._gun, self._clock, self.told.emit)
        self._check.start()

    def emergency_stop(self) -> None:
        """Latch and disarm."""
        if self._check is None:
            return
        self._check.emergency_stop()
        self.stopped = True
        self._show("EMERGENCY STOP", f"Disarming. If the gun does not fall silent: {SWITCH_OFF}", "bad")

    def call_off(self) -> None:
        """Fire no more, if it has not fired."""
        if self._check is not None:
            self._check.call_off()

    def _escape(self) -> None:
        if self._check is None:
            self.left.emit()
        else:
            self.call_off()

    def _take(self, told: Told) -> None:
        """Show how far the test shot is."""
        if told.phase == "over":
            self._end(told)
        elif self.stopped:
            return
        elif told.phase == "counting":
            self._show("STAND CLEAR", f"{self._shown} will be fired. Nobody may hold the gun. Esc calls it off.", "ask")
            self.count.setText(str(told.seconds))
        elif told.phase == "firing":
            self._show("Firing", self._shown, "wait")

    def _end(self, told: Told) -> None:
        self._check = None
        if told.fired:
            self._method_at += 1
        title = "EMERGENCY STOP" if self.stopped else "Fired" if told.fired else "Not fired"
        self._show(title, told.text, told.mood)
        self._running(False)
        self.over()

    def _show(self, title: str, detail: str, mood: str) -> None:
        self.title.setText(title)
        parts.set_mood(self.title, mood)
        self.detail.say(detail, mood)
        self.count.setText("")

    def _running(self, running: bool) -> None:
        self.stop_button.setVisible(running)
        self.next_button.setVisible(not (running or self.stopped))
        self.next_button.setText(f"{self.next_text()}  [Ctrl+T]")
        self.call_off_button.setText("Call it off  [Esc]" if running else "Back  [Esc]")
