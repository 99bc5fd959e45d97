"""The synthetic participant who works a console's window and the participant's screen, to be looked at."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING, Self

from PyQt6.QtCore import Qt, QTimer
from PyQt6.QtGui import QWindow
from PyQt6.QtTest import QTest

from device.machine_clock import machine_s
from experiments.design.plan import Condition
from experiments.screens.console.app import Console
from experiments.screens.console.view import has_a_page
from experiments.screens.console.window import ConsoleWindow
from experiments.screens.participant.pages import spot_px
from experiments.screens.participant.stage import WINDOW_TITLE
from experiments.session.history import chosen_levels
from experiments.session.states import Position, State
from experiments.session.steps import Ask, Rate
from experiments.study.folders import PlaceError
from experiments.synthetic.answers import SyntheticParticipant
from experiments.tasks.questions import on_scale

if TYPE_CHECKING:
    from experiments.screens.xkeys import Hands  # Linux alone has it

_NO_HANDS = "--visual --participant-screen rates by synthetic events, which only an X display takes"
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
            case State.RATING if isinstance(step, Rate) and has_a_page(step):
                rating = self._synthetic.rate(step.trial, step.question, _chosen(window, step))
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
    def _synthetic(self) -> SyntheticParticipant:
        """The synthetic participant, who is there once the window is."""
        if self._console.synthetic is None:
            raise TypeError("nobody is there to answer")
        return self._console.synthetic

    def _thinks(self, window: ConsoleWindow, position: Position, now_s: float) -> bool:
        """Whether the response time is not over yet."""
        step = position.step
        if position.state is not State.ASKING or not isinstance(step, Ask):
            return False
        onset_s = position.since_s if position.onset_s is None else position.onset_s
        answer = self._synthetic.answer(step.trial, step.question, _chosen(window, step))
        return now_s < onset_s + answer.response_time_s

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
                said = self._synthetic.answer(step.trial, step.question, _chosen(window, step)).response
                QTest.keyClick(handle, next(one.key for one in step.choices if one.answer == said))  # type: ignore[call-overload] # as below
            case State.RESTING:
                _key(handle, Qt.Key.Key_E)
                _type(BREAK_REASON, handle)
            case State.RATING if isinstance(step, Rate):
                self._rate(
                    self._synthetic.rate(step.trial, step.question, _chosen(window, step)),
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
        if machine_s() - self._at_s < RATE_AGAIN_S:
            return None
        self._at_s = machine_s()
        return self._hands.focus_on(WINDOW_TITLE)

    def _confirm(self) -> None:
        """With Ctrl, as Enter alone begins a new line of a description."""
        self._hands.press("Return", "Control_L")


def _spot(step: Rate, rating: float, *, width_px: int, height_px: int) -> tuple[int, int]:
    """Where the rating's grain lies on the window."""
    kept = on_scale(rating, step)
    return spot_px((kept - step.minimum) / (step.maximum - step.minimum), width_px, height_px)


def open_rater(stack: ExitStack) -> Rater:
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
