"""An unfinished run is there: the console shows when it stopped, and asks; and what is waited for is said."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from PyQt6.QtCore import QEventLoop, Qt, QTimer
from PyQt6.QtWidgets import QDialog, QLabel, QPushButton, QVBoxLayout

from experiments.record.journal import JournalError
from experiments.run import Again, Request
from experiments.screens.console import parts, people
from experiments.screens.console.fields import WHY, Answer, Lines, Question, start_sheet, unfit
from experiments.screens.console.keyboard import FreshShortcuts
from experiments.screens.console.windows import let_go, signals_to
from experiments.study.places import place
from experiments.study.progress import run_standing


class Unfinished(QDialog):
    """Go on with a run, set it aside for a reason, or leave it. `decided` is the request with the decision, if any.

    Nothing is chosen by Enter or by closing the window.
    """

    def __init__(self, request: Request) -> None:
        super().__init__()
        self._request = request
        self.decided: Request | None = None
        self.setWindowTitle("Recoil – unfinished run")
        self.setStyleSheet(parts.sheet("dark") + start_sheet())
        answers = (
            Answer(text="Go on with it", key="Ctrl+G", do=lambda _: self._decide("resume", "")),
            Answer(text="Set it aside, start anew", key="Ctrl+N", do=self._fresh),
            Answer(text="Leave it", key="Esc", do=lambda _: self.reject()),
        )
        self.question = Question(_text(request), answers, reason=f"to start anew: {WHY}")
        self.said = Lines("saved")
        down = QVBoxLayout(self)
        down.addWidget(self.question)
        down.addWidget(self.said)
        self.setMinimumWidth(720)
        for button in self.findChildren(QPushButton):
            button.setAutoDefault(False)

    def _fresh(self, reason: str) -> None:
        wrong = unfit(reason)
        if not wrong:
            self._decide("fresh", reason)
            return
        self.said.say(wrong, "bad")
        self.question.reason.setFocus()

    def _decide(self, again: Again, reason: str) -> None:
        self.decided = replace(self._request, again=again, anew_reason=reason)
        self.accept()


def _text(request: Request) -> str:
    where = place(request.results, request.participant_id, request.setup.config.experiment)
    try:
        return people.stopped_text(request.participant_id, run_standing(where))
    except JournalError as error:
        return str(error)


def ask(request: Request) -> Request | None:
    """The request with the decision of the person at the console; `None` if they leave the run as it is.

    `KeyboardInterrupt` if a signal ended the question.
    """
    dialog = Unfinished(request)
    FreshShortcuts(dialog, time.monotonic)
    with signals_to(lambda _: dialog.reject()) as signalled:
        dialog.exec()
    decided = dialog.decided
    let_go(dialog)
    if signalled:
        raise KeyboardInterrupt(signalled[0])
    return decided


LOOK_MS = 30
Made = TypeVar("Made")


def while_shown(text: str, make: Callable[[], Made]) -> Made:
    """What `make` gives back, done in a thread of its own while a window shows the text. Raises what it raises."""
    shown = QLabel(text)
    shown.setWindowTitle("Recoil – please wait")
    shown.setStyleSheet(f"{parts.sheet('dark')} QLabel {{ font-size: 26px; padding: 40px; }}")
    shown.setAlignment(Qt.AlignmentFlag.AlignCenter)
    made: list[Made] = []
    errors: list[BaseException] = []

    def work() -> None:
        try:
            made.append(make())
        except BaseException as error:  # noqa: BLE001 - raised again where it is waited for
            errors.append(error)

    loop, look, thread = QEventLoop(), QTimer(), threading.Thread(target=work, daemon=True, name="waiting")
    look.timeout.connect(lambda: None if thread.is_alive() else loop.quit())
    shown.show()
    thread.start()
    look.start(LOOK_MS)
    loop.exec()
    shown.close()
    if errors:
        raise errors[0]
    return made[0]
