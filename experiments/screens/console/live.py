"""A run at the console with what belongs to it: an unfinished one, participant's screen, synthetic participant."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import ExitStack
from dataclasses import replace
from typing import TypeVar

from PyQt6.QtCore import QEventLoop, Qt, QTimer
from PyQt6.QtGui import QGuiApplication
from PyQt6.QtWidgets import QDialog, QLabel, QPushButton, QVBoxLayout

from experiments.clock import RealClock
from experiments.design.shown_texts import setup_in
from experiments.earlier_run import UnfinishedRun, gone_on_with
from experiments.record.journal import JournalError
from experiments.run import Finished
from experiments.run_request import Again, RunRequest
from experiments.screens.console import people, widgets
from experiments.screens.console.app import Console, application
from experiments.screens.console.form import monitors
from experiments.screens.console.over_all import AnyHeld
from experiments.screens.console.participant_link import ParticipantSide, noise_of
from experiments.screens.console.participant_opening import check_font, check_own_keys, look_of
from experiments.screens.console.view import THANK_PARTICIPANT
from experiments.screens.console.visual_participant import VisualParticipant, open_rater
from experiments.screens.console.widgets import SET_ASIDE, WHY, Option, QuestionBox, TextLines, start_sheet
from experiments.screens.console.windows import FreshShortcuts, let_go, signals_to
from experiments.screens.participant.link import ParticipantError, ParticipantLink
from experiments.screens.phrases import phrase
from experiments.study.folders import PlaceError, progress_of


def run_live(request: RunRequest, *, last: str = THANK_PARTICIPANT, halts: bool = False) -> Finished:
    """Carry out a run at the console. An unfinished one is shown and asked about, but for a synthetic participant.

    `last`: the last sentence of a run that is kept. `halts`: the emergency stop was pressed before it began.
    `PlaceError` without a display, or if the participant's screen does not open.
    """
    application()
    try:
        return _carry_out(request, last, halts=halts)
    except UnfinishedRun as found:
        decided = None if request.visual else ask_about(request, found)
        if decided is None:
            raise
        return _carry_out(gone_on_with(decided), last, halts=halts)


def _carry_out(request: RunRequest, last: str, *, halts: bool) -> Finished:
    clock = RealClock()
    check_font(request)
    with ExitStack() as stack:
        rater = open_rater(stack) if request.visual and request.options.screen else None
        band, said_last = _band_and_last(request, last)
        console = Console(request, clock, band=band, last=said_last)
        if halts:
            console.halt_at_once()
        if request.options.any:
            console.participant = _participant(stack, request, console.halt_at_once)
        if request.visual:
            stack.enter_context(VisualParticipant(console, rater))
        return console.run()


def check_monitor(monitor: int | None) -> None:
    """`PlaceError` if there is no such screen."""
    known = monitors()
    if monitor is not None and monitor >= len(known):
        raise PlaceError(f"--participant-monitor {monitor}: there is no such screen; known are {'; '.join(known)}")


def _band_and_last(request: RunRequest, last: str) -> tuple[str, str]:
    """What the window of a run says of it: its band, and the last sentence, which is `last` where the run is kept."""
    if request.training:
        return phrase("TRAINING – nothing of it is kept"), phrase("The training is over.")
    if request.practice:
        return phrase("PRACTICE – never analysed"), phrase("The practice is over: the run itself comes next.")
    return "", last


def rooms_px() -> list[tuple[int, int]]:
    """The width and height that a window may have on each screen."""
    rooms = [screen.availableSize() * screen.devicePixelRatio() for screen in QGuiApplication.screens()]
    return [(room.width(), room.height()) for room in rooms]


def _participant(stack: ExitStack, request: RunRequest, emergency: Callable[[], None]) -> ParticipantSide:
    """The participant's screen, once it is open: PsychoPy takes its time, and a window says so meanwhile.

    `emergency` is told of F12 in that window.
    """
    options, said = request.options, request.language.messages
    setup, _ = setup_in(request.language, request.setup)
    check_monitor(options.monitor)
    if options.keys:
        check_own_keys(setup, rates=options.screen)
    look = look_of(request, rooms_px())

    def open_link() -> ParticipantLink:
        link = stack.enter_context(ParticipantLink.start(look))
        try:
            link.wait_ready()
        except ParticipantError:
            link.close()  # a window that came later would be nobody's
            raise
        link.show(said.wait)
        return link

    try:
        link = while_shown(phrase("Starting the participant's screen …"), open_link, emergency)
    except ParticipantError as error:
        raise PlaceError(f"--participant-screen: {error}; look at `recoil doctor`, or run without it") from error
    return ParticipantSide(
        link,
        open_link,
        setup,
        rates=options.screen,
        own_keys=options.keys,
        noise=noise_of(link) if options.noise else None,
        hand="synthetic" if request.visual else "participant",
        said=said,
    )


_FRAME = 16
"""What a window manager puts around a window, in pixels, and a little more."""


class Unfinished(QDialog):
    """Go on with a run, set it aside for a reason, or leave it. `decided` is the request with the decision, if any.

    Nothing is chosen by Enter or by closing the window.
    """

    def __init__(self, request: RunRequest, found: UnfinishedRun) -> None:
        super().__init__()
        self._request = request
        self.decided: RunRequest | None = None
        self.setWindowTitle("Recoil – unfinished run")
        self.setStyleSheet(start_sheet())
        answers = (
            Option(text=phrase("Go on with it"), key="Ctrl+G", do=lambda _: self._decide("resume", "")),
            Option(text=SET_ASIDE, key="Ctrl+N", do=self._fresh),
            Option(text=phrase("Leave it"), key="Esc", do=lambda _: self.reject()),
        )
        self.question = QuestionBox(unfinished_text(found), answers, reason=phrase("to start anew: {why}", why=WHY))
        self.said = TextLines("saved")
        widgets.fill(QVBoxLayout(self), self.question, self.said, margins=None)
        screen = self.screen()
        self.setMinimumWidth(720 if screen is None else min(720, screen.availableGeometry().width() - _FRAME))
        for button in self.findChildren(QPushButton):
            button.setAutoDefault(False)

    def _fresh(self, reason: str) -> None:
        if self.question.takes(reason, self.said.say):
            self._decide("fresh", reason)

    def _decide(self, again: Again, reason: str) -> None:
        self.decided = replace(self._request, again=again, anew_reason=reason)
        self.accept()


def unfinished_text(found: UnfinishedRun) -> str:
    """How far somebody's run is that is there already, or why that cannot be told."""
    try:
        return people.stopped_text(found.where.participant_id, progress_of(found.where, found.contents))
    except JournalError as error:
        return str(error)


def ask_about(request: RunRequest, found: UnfinishedRun) -> RunRequest | None:
    """The request with the decision of the person at the console; `None` if they leave the run as it is.

    `KeyboardInterrupt` if a signal ended the question.
    """
    dialog = Unfinished(request, found)
    FreshShortcuts(dialog)
    with signals_to(lambda _: dialog.reject()) as signalled:
        dialog.exec()
    decided = dialog.decided
    let_go(dialog)
    if signalled:
        raise KeyboardInterrupt(signalled[0])
    return decided


_LOOK_MS = 30
Made = TypeVar("Made")


def while_shown(text: str, make: Callable[[], Made], emergency: Callable[[], None] = lambda: None) -> Made:
    """What `make` gives back, done in a thread of its own while a window shows the text. Raises what it raises.

    `emergency` is told of F12, as is whoever pressed it. `KeyboardInterrupt` behind it if a signal came meanwhile.
    """
    shown = QLabel(text)
    shown.setWindowTitle("Recoil – please wait")
    shown.setStyleSheet(f"{widgets.sheet('dark')} QLabel {{ font-size: 26px; padding: 40px; }}")
    shown.setAlignment(Qt.AlignmentFlag.AlignCenter)

    def stop() -> None:
        shown.setText(phrase("EMERGENCY STOP"))
        emergency()

    AnyHeld(shown, "F12", stop)
    made: Future[Made] = Future()

    def work() -> None:
        try:
            made.set_result(make())
        except BaseException as error:  # noqa: BLE001 - raised again where it is waited for
            made.set_exception(error)

    loop, look = QEventLoop(), QTimer()
    look.timeout.connect(lambda: loop.quit() if made.done() else None)
    shown.show()
    threading.Thread(target=work, daemon=True, name="waiting").start()
    look.start(_LOOK_MS)
    with signals_to(lambda _: None) as signalled:
        loop.exec()
    shown.close()
    if signalled:  # once it is made: whoever made room for it closes it
        raise KeyboardInterrupt(signalled[0])
    return made.result()
