"""The line of the console that says what was saved, refused or went wrong last, and how long it stands there."""

from __future__ import annotations

from dataclasses import dataclass

from PyQt6 import QtWidgets

from experiments.live_run import HALT_UNSAVED
from experiments.screens.console import view, widgets
from experiments.screens.phrases import phrase
from experiments.session.remarks import Halted, Noted
from experiments.session.states import Position
from experiments.session.steps import Failed, Prepared, Rested, trial_of

BRIEF_S = 4.0
"""How long it is shown why something was refused."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SaidAt:
    """When something is said: on the run's clock, and at the position of which serial number."""

    now_s: float
    serial: int


class SaidLine:
    """Brief lines stand for a few seconds, or until the next position; lasting ones until the next lasting one.

    It stands on several `labels`, of which one is seen at a time.
    """

    def __init__(self, *labels: QtWidgets.QLabel) -> None:
        self._labels = labels
        self._brief: SaidAt | None = None
        self._lasting, self._failure = ("", "good"), ""
        self._beside: view.Trouble | None = None

    def say(self, text: str, mood: str, at: SaidAt) -> None:
        """Show a brief line."""
        self._brief = at
        self._show(text, mood)

    def tick(self, now_s: float) -> None:
        """Show what lasts again, where a brief line has stood long enough."""
        if self._brief is not None and now_s > self._brief.now_s + BRIEF_S:
            self._last(*self._lasting)

    def at(self, position: Position) -> None:
        """The same where a brief line was said at another position."""
        if self._brief is not None and position.serial != self._brief.serial:
            self._last(*self._lasting)

    def trouble(self, message: view.Trouble, at: SaidAt) -> None:
        """Say what went wrong until something else is to be said; that it is well again for a few seconds."""
        self._beside = message if message.trial is not None else self._beside
        self._last("" if message.mood == "good" else message.text, message.mood)
        if message.mood == "good":
            self.say(message.text, message.mood, at)

    def forget(self, mood: str = "good") -> None:
        """What went well before is not to stand below an emergency stop, or below what is lost."""
        if self._lasting[1] == mood:
            self._last("", "good")

    def saved(self, message: view.Saved, text: str, at: SaidAt) -> None:
        """Say that it is safe, in the words of `text`, if it has any; below them what went wrong beside that trial."""
        if text and isinstance(message.word, Rested | Noted):
            self.say(text, "good", at)  # it may be of what an answer left behind: it does not take its place
        elif text:
            if self._beside and trial_of(message.step) not in (None, self._beside.trial):
                self._beside = None
            text = f"{text}\n{self._beside.text}" if self._beside else text
            self._failure = text if isinstance(message.word, Failed) else ""
            self._last(text, "bad" if self._failure or self._beside else "good")
        elif self._lasting == (self._failure, "bad") and isinstance(message.word, Prepared):
            self._last("", "good")  # it is fired anew: of that a failure before says nothing
        elif HALT_UNSAVED in self._lasting[0] and isinstance(message.word, Halted):
            self._last(phrase("Saved. The emergency stop is on record now."), "good")

    def _last(self, text: str, mood: str) -> None:
        """Show a line until the next."""
        self._lasting, self._brief = (text, mood), None
        self._show(text, mood)

    def _show(self, text: str, mood: str) -> None:
        for label in self._labels:
            label.setText(text)
            widgets.set_mood(label, mood)
