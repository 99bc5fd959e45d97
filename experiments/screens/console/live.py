"""Runs at the console with what belongs to them: start window, participant's screen, synthetic participant."""

from __future__ import annotations

import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeVar

from PyQt6.QtCore import QEventLoop, Qt, QTimer
from PyQt6.QtGui import QGuiApplication, QWindow
from PyQt6.QtTest import QTest
from PyQt6.QtWidgets import QDialog, QLabel, QPushButton, QVBoxLayout

from device.words import RecoilError
from experiments.catalogues.catalogue import Language
from experiments.clock import RealClock
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Condition
from experiments.design.shown_texts import setup_in
from experiments.live_run import RunStopped
from experiments.load import load_setup, load_study
from experiments.record.journal import JournalError
from experiments.run import Again, Finished, RunRequest, UnfinishedRun
from experiments.screens.console import people, widgets
from experiments.screens.console.app import Console, application
from experiments.screens.console.form import Opening, monitors
from experiments.screens.console.participant_link import ParticipantSide, check_font, check_own_keys, look_of
from experiments.screens.console.start import choose_run
from experiments.screens.console.view import THANK_PARTICIPANT
from experiments.screens.console.widgets import WHY, Option, QuestionBox, TextLines, start_sheet
from experiments.screens.console.window import ConsoleWindow
from experiments.screens.console.windows import FreshShortcuts, let_go, signals_to
from experiments.screens.participant.link import ParticipantError, ParticipantLink
from experiments.screens.participant.messages import NoiseIs
from experiments.screens.participant.pages import spot_px
from experiments.screens.participant.stage import WINDOW_TITLE
from experiments.session.history import chosen_levels
from experiments.session.states import Position, State
from experiments.session.steps import Ask, Rate
from experiments.study.folders import PlaceError, StudyFolder, progress_of
from experiments.tasks.questions import on_scale

_NO_HANDS = "--visual --participant-screen rates by synthetic events, which only an X display takes"


def run_live(request: RunRequest, *, band: str = "", last: str = THANK_PARTICIPANT) -> Finished:
    """Carry out a run at the console. An unfinished one is shown and asked about, but for a synthetic participant.

    `band` and `last` as of a `Console`. `PlaceError` without a display, or if the participant's screen does not open.
    """
    application()
    try:
        return _carry_out(request, band, last)
    except UnfinishedRun as found:
        decided = None if request.visual else ask_about(request, found)
        if decided is None:
            raise
        return _carry_out(decided, band, last)


def _carry_out(request: RunRequest, band: str, last: str) -> Finished:
    clock = RealClock()
    check_font(request)
    with ExitStack() as stack:
        rater = _rater(stack) if request.visual and request.options.screen else None
        participant = _participant(stack, request) if request.options.any else None
        console = Console(request, clock, participant=participant, band=band, last=last)
        if request.visual:
            stack.enter_context(VisualParticipant(console, rater))
        return console.run()


def lab_day(request: RunRequest, languages: tuple[Language, ...]) -> None:
    """One run after the other from the start window, until it is closed.

    `request` says what all have in common, and what is ticked at first; `languages` which there are to choose from.
    `KeyboardInterrupt` if a signal ended it.
    """
    application()
    check_monitor(request.options.monitor)
    study, named = study_of(request), request.setup.config.experiment
    opening = Opening(
        gun=request.gun, named=named, options=request.options, languages=languages, language=request.language.code
    )
    with signals_to() as signalled:
        while not signalled and (choice := choose_run(study, opening, RealClock())) is not None:
            said = _of_the_day(request, study, replace(choice, sensor="" if choice.training else request.sensor))
            code = "" if choice.training else choice.participant_id
            opening = replace(opening, named="", options=choice.options, language=choice.language.code)
            opening = replace(opening, participant_id=code, said=said)
    if signalled:
        raise KeyboardInterrupt(signalled[0])


def check_monitor(monitor: int | None) -> None:
    """`PlaceError` if there is no such screen."""
    known = monitors()
    if monitor is not None and monitor >= len(known):
        raise PlaceError(f"--participant-monitor {monitor}: there is no such screen; known are {'; '.join(known)}")


def _band_and_last(study: StudyFolder, choice: RunRequest) -> tuple[str, str]:
    """What the window of a chosen run says of it: its band, and the last sentence."""
    if choice.training:
        return "TRAINING – nothing of it is kept", "The training is over."
    if choice.practice:
        return "PRACTICE – never analysed", "The practice is over: the run itself comes next."
    names = study.experiments
    later = names[names.index(choice.setup.config.experiment) + 1 :]
    return "", f"Next: {later[0]}." if later else THANK_PARTICIPANT


def _of_the_day(request: RunRequest, study: StudyFolder, choice: RunRequest) -> str:
    """Carry out what was chosen; what went wrong, for the start window, which it must not end."""
    with ExitStack() as stack:
        results = Path(stack.enter_context(tempfile.TemporaryDirectory())) if choice.training else request.results
        try:
            band, last = _band_and_last(study, choice)
            run_live(replace(choice, seed=request.seed, results=results), band=band, last=last)
        except RunStopped as stop:
            return _stopped(choice, str(stop))
        except RecoilError as error:
            return str(error)
    return ""


def _stopped(choice: RunRequest, reason: str) -> str:
    if choice.training:
        return f"The training stopped: {reason}."
    if choice.practice:
        return f"The practice of {choice.participant_id} stopped: {reason}. It can be done again."
    return f"{choice.participant_id} stopped: {reason}. Start asks whether to go on there or to start anew."


def study_of(request: RunRequest) -> StudyFolder:
    """The study that the config lies in, if the study names it; else this experiment alone, by the rules of that study.

    Where there is no study beside the config, they are those of the shipped one.
    """
    own = request.setup.source.parent / "study.toml"
    config, folder = load_study(str(own) if own.is_file() else "study")
    setups: tuple[Setup[DesignConfig], ...] = (request.setup,)
    if request.setup.source.resolve() in [(folder / name).resolve() for name in config.experiments]:
        setups = tuple(load_setup(folder / name) for name in config.experiments)
    return StudyFolder(config=config, source=folder / "study.toml", setups=setups, results=request.results)


def _participant(stack: ExitStack, request: RunRequest) -> ParticipantSide:
    """The participant's screen, once it is open: PsychoPy takes its time, and a window says so meanwhile."""
    options, said = request.options, request.language.messages
    setup, _ = setup_in(request.language, request.setup)
    check_monitor(options.monitor)
    if options.keys:
        check_own_keys(setup)
    look = look_of(request, len(QGuiApplication.screens()))

    def open_link() -> ParticipantLink:
        link = stack.enter_context(ParticipantLink.start(look))
        link.wait_ready()
        link.show(said.wait)
        return link

    try:
        link = while_shown("Starting the participant's screen …", open_link)
    except ParticipantError as error:
        raise PlaceError(f"--participant-screen: {error}; look at `recoil doctor`, or run without it") from error
    return ParticipantSide(
        link,
        open_link,
        setup,
        rates=options.screen,
        own_keys=options.keys,
        noise=_noise(link) if options.noise else None,
        hand="synthetic" if request.visual else "participant",
        said=said,
    )


def _noise(link: ParticipantLink) -> NoiseIs:
    """Masking noise, which ends with the participant's process; why it stays off, if it does."""
    try:
        return link.noise(on=True)
    except ParticipantError as error:
        return NoiseIs(on=False, message=f"Masking noise stays off: {error}")


def _rater(stack: ExitStack) -> Rater:
    """The hands that rate on the participant's screen. `PlaceError` where nothing gives them."""
    try:
        from experiments.screens.xkeys import Hands, NoDisplay  # noqa: PLC0415 - Linux alone has it
    except ModuleNotFoundError as error:
        raise PlaceError(f"{_NO_HANDS} ({error.name} is missing)") from error
    try:
        hands = Hands()
    except NoDisplay as error:
        raise PlaceError(f"{_NO_HANDS}: {error}") from error
    stack.callback(hands.close)
    return Rater(hands)


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
            Option(text="Go on with it", key="Ctrl+G", do=lambda _: self._decide("resume", "")),
            Option(text="Set it aside, start anew", key="Ctrl+N", do=self._fresh),
            Option(text="Leave it", key="Esc", do=lambda _: self.reject()),
        )
        self.question = QuestionBox(_text(found), answers, reason=f"to start anew: {WHY}")
        self.said = TextLines("saved")
        widgets.fill(QVBoxLayout(self), self.question, self.said, margins=None)
        self.setMinimumWidth(720)
        for button in self.findChildren(QPushButton):
            button.setAutoDefault(False)

    def _fresh(self, reason: str) -> None:
        if self.question.takes(reason, self.said.say):
            self._decide("fresh", reason)

    def _decide(self, again: Again, reason: str) -> None:
        self.decided = replace(self._request, again=again, anew_reason=reason)
        self.accept()


def _text(found: UnfinishedRun) -> str:
    try:
        return people.stopped_text(found.where.participant_id, progress_of(found.where, found.contents))
    except JournalError as error:
        return str(error)


def ask_about(request: RunRequest, found: UnfinishedRun) -> RunRequest | None:
    """The request with the decision of the person at the console; `None` if they leave the run as it is.

    `KeyboardInterrupt` if a signal ended the question.
    """
    dialog = Unfinished(request, found)
    FreshShortcuts(dialog, time.monotonic)
    with signals_to(lambda _: dialog.reject()) as signalled:
        dialog.exec()
    decided = dialog.decided
    let_go(dialog)
    if signalled:
        raise KeyboardInterrupt(signalled[0])
    return decided


_LOOK_MS = 30
Made = TypeVar("Made")


def while_shown(text: str, make: Callable[[], Made]) -> Made:
    """What `make` gives back, done in a thread of its own while a window shows the text. Raises what it raises."""
    shown = QLabel(text)
    shown.setWindowTitle("Recoil – please wait")
    shown.setStyleSheet(f"{widgets.sheet('dark')} QLabel {{ font-size: 26px; padding: 40px; }}")
    shown.setAlignment(Qt.AlignmentFlag.AlignCenter)
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
    loop.exec()
    shown.close()
    return made.result()


if TYPE_CHECKING:
    from experiments.screens.xkeys import Hands  # Linux alone has it

_WATCH_MS = 10
AGAIN_S = 0.5
"""A key that was refused, because it came too soon, is pressed again after so long."""
BREAK_REASON = "synthetic participant"


class VisualParticipant:
    """Watches a console's window and presses a key at every position that waits, as long as it is open."""

    def __init__(self, console: Console, rater: Rater | None = None) -> None:
        self._console, self._clock, self._rater = console, console.clock, rater
        self._done, self._done_s = -1, 0.0
        self._timer = QTimer()
        self._timer.timeout.connect(self._look)

    def __enter__(self) -> Self:
        self._timer.start(_WATCH_MS)
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.stop()

    def _look(self) -> None:
        window = self._console.window
        if window is None or window.live is None or self._answers_there(window):
            return
        if not window.isActiveWindow():
            window.activateWindow()  # keys reach the window that has the focus
            return
        if window.ended is not None:
            self._timer.stop()
            window.close()
            return
        position, now_s = window.drawn, self._clock.now()
        done = position.serial == self._done and now_s - self._done_s < AGAIN_S
        if not done and window.live.moment.is_ready(now_s) and not self._thinks(window, position, now_s):
            self._done, self._done_s = position.serial, now_s
            self._press(window, position)

    def _answers_there(self, window: ConsoleWindow) -> bool:
        """Whether a rating or description is being given on the participant's screen. No answer has no place there."""
        step = window.drawn.step
        if self._rater is None or self._console.participant is None:
            return False
        asking = self._console.participant.asking  # only then: what comes later would be done to the next question
        match window.drawn.state:
            case State.RATING if isinstance(step, Rate):
                rating = self._observer.rate(step.trial, step.question, _chosen(window, step))
                if rating is not None and asking:
                    self._rater.rate(step, rating)
                return rating is not None
            case State.DESCRIBING:
                if asking:
                    self._rater.describe()
                return True
            case _:
                return False

    @property
    def _observer(self) -> Any:
        """The observer, which is there once the window is."""
        return self._console.observer

    def _thinks(self, window: ConsoleWindow, position: Position, now_s: float) -> bool:
        """Whether the response time is not over yet."""
        step = position.step
        if position.state is not State.ASKING or not isinstance(step, Ask):
            return False
        onset_s = position.since_s if position.onset_s is None else position.onset_s
        return bool(
            now_s < onset_s + self._observer.answer(step.trial, step.question, _chosen(window, step)).response_time_s
        )

    def _press(self, window: ConsoleWindow, position: Position) -> None:
        step, handle = position.step, window.windowHandle()
        if handle is None:
            return
        match position.state:
            case State.SETTING:
                _key(handle, Qt.Key.Key_M)
            case State.PREPARING | State.TRAIN:
                _key(handle, Qt.Key.Key_Space)
            case State.ASKING if isinstance(step, Ask):
                said = self._observer.answer(step.trial, step.question, _chosen(window, step)).response
                QTest.keyClick(handle, next(one.key for one in step.choices if one.answer == said))  # type: ignore[call-overload] # as below
            case State.RESTING:
                _key(handle, Qt.Key.Key_E)
                _type(BREAK_REASON, handle)
            case State.RATING if isinstance(step, Rate):
                self._rate(
                    self._observer.rate(step.trial, step.question, _chosen(window, step)),
                    window,
                    handle,
                )
            case State.DESCRIBING | State.INFORMING | State.CLOSING:
                _key(handle, Qt.Key.Key_Return)
            case _:
                pass

    def _rate(self, rating: float | None, window: ConsoleWindow, handle: QWindow) -> None:
        if rating is None:
            _key(handle, Qt.Key.Key_X, Qt.KeyboardModifier.ControlModifier)
        else:
            window.fields.rating.clear()
            _type(repr(rating), handle)


def _chosen(window: ConsoleWindow, step: Ask | Rate) -> Condition:
    """The levels that a procedure chose for what was felt."""
    return () if window.live is None else chosen_levels(window.live.history, step.trial)


def _key(window: QWindow, key: Qt.Key, modifier: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
    QTest.keyClick(window, key, modifier)  # type: ignore[call-overload] # its stubs take it for a method


def _type(text: str, window: QWindow) -> None:
    for letter in text:
        QTest.keyClick(window, letter)  # type: ignore[call-overload] # as above
    _key(window, Qt.Key.Key_Return)


RATE_AGAIN_S = 0.2
"""How long hands wait before they try again: what is done before the page stands is lost, as a person's would be."""


class Rater:
    """Rates on the participant's screen. Whatever it does may be done again, on whichever page stands, to no harm."""

    def __init__(self, hands: Hands) -> None:
        self._hands = hands
        self._at_s = 0.0

    def rate(self, step: Rate, rating: float) -> None:
        """Click the rating and confirm it. A page that asks for a description takes the same for an empty one."""
        if (place := self._place()) is not None:
            x_px, y_px = _spot(step, rating, width_px=place[2], height_px=place[3])
            self._hands.click(place[0] + x_px, place[1] + y_px)
            self._confirm()

    def describe(self) -> None:
        """Confirm an empty description. A page that asks for a rating takes none by that, as none is clicked on it."""
        if self._place() is not None:
            self._confirm()

    def _place(self) -> tuple[int, int, int, int] | None:
        """Where the participant's window lies, now that it has the keys; `None` if there is none, or it is too soon."""
        if time.monotonic() - self._at_s < RATE_AGAIN_S:
            return None
        self._at_s = time.monotonic()
        return self._hands.focus_on(WINDOW_TITLE)

    def _confirm(self) -> None:
        """With Ctrl, as Enter alone begins a new line of a description."""
        self._hands.press("Return", "Control_L")


def _spot(step: Rate, rating: float, *, width_px: int, height_px: int) -> tuple[int, int]:
    """Where the rating's grain lies on the window."""
    kept = on_scale(rating, step)
    return spot_px((kept - step.minimum) / (step.maximum - step.minimum), width_px, height_px)
