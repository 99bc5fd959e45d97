"""The console's end of the participant's screen: questions out, answers in, clocks mapped. Imports no PsychoPy.

Whatever goes wrong there is one exception here, `ParticipantError`; nothing waits for ever on a screen that is gone.
Questions may be asked from any thread but the one that draws the console; `cancel` and `close` from any at all.
"""

from __future__ import annotations

import math
import queue
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Self, TypeVar

from pydantic import ValidationError

from device.messages import RecoilError
from device.own_process import own_program
from experiments.clock import ClockMap, RealClock, RoundTrip, clock_map, surely_moved_s
from experiments.screens.participant import messages
from experiments.screens.participant.messages import NOISE_S, REPLY_S, line
from experiments.screens.participant.process import ParticipantProcess

PINGS = 8
"""Pings of one mapping of the clocks; the shortest counts."""

_BEAT_LOOK_S = 0.5
"""How long one look for a beat takes: should this program stand still itself, that is one look and no more."""

MAX_CLOCK_STEP_S = 0.02
"""How far the clocks may move against each other while a direction is asked; a clock that was set moves further."""

_Asked = messages.AskRating | messages.AskDescription | messages.AskChoice | messages.Noise
_Given = TypeVar("_Given", messages.RatingGiven, messages.DescriptionGiven, messages.ChoiceGiven, messages.NoiseIs)


class ParticipantLink:
    """The participant's screen, as a console sees it. Use it as a context manager, or `close` it."""

    def __init__(self, command: Sequence[str]) -> None:
        self._clock = RealClock()
        self._mail = Mailbox()
        self._asking = threading.RLock()
        self._page = threading.Lock()
        self.focused: messages.Focused | None = None
        """Whose the keys are, as far as it was said."""
        self._minimised: messages.Minimised | None = None
        self.noise_ended: messages.NoiseEnded | None = None
        """That the noise has ended, if it has; it may have before anybody listened."""
        self._emergency: messages.EmergencyPressed | None = None
        """That the emergency stop was pressed, if it was: perhaps as the window opened."""
        self._stands = 0
        """The question that was put on the screen last; 0 when something else was."""
        self._heard: Callable[[messages.Heard], None] = lambda _: None
        self._gone: Callable[[str], None] = lambda _: None
        self._beats: queue.SimpleQueue[float] = queue.SimpleQueue()
        try:
            self._process = ParticipantProcess(command, self._said, self._failed)
        except OSError as error:
            raise ParticipantError(f"the participant's screen cannot be started: {error}") from error
        threading.Thread(target=self._watch, name="participant's beats", daemon=True).start()

    @classmethod
    def start(cls, look: messages.Look | None = None, *, command: Sequence[str] | None = None) -> Self:
        """Start the program and return at once; its window takes seconds to open. `command` is another program."""
        own = own_program("experiments.screens.participant", *messages.arguments(look or messages.Look()))
        return cls(command or own)

    @property
    def failure(self) -> str | None:
        """Why the screen is gone, or `None` while it is there."""
        return self._mail.failure

    @property
    def asking(self) -> bool:
        """Whether a question is open; no longer once its answer is here."""
        return self._mail.asking

    @property
    def pid(self) -> int:
        """The process id of the program."""
        return self._process.pid

    def wait_ready(self, timeout_s: float = 60.0) -> messages.Ready:
        """Wait until the window is open, and map the clocks."""
        ready = self._mail.wait(messages.Ready, lambda _: True, timeout_s, None)
        self.map_clocks()
        return ready

    def listen(self, heard: Callable[[messages.Heard], None], gone: Callable[[str], None]) -> None:
        """Have somebody told what is said without a question, or too late, and why the screen is gone if it goes."""
        self._heard, self._gone = heard, gone
        for word in (self.focused, self._minimised, self.noise_ended, self._emergency):
            if word is not None:
                heard(word)
        if self.failure is not None:
            gone(self.failure)

    def show(self, text: str, tell: tuple[str, ...] = (), *, keep_keys: bool = False) -> None:
        """Show a plain message; a question that is being asked is called off. Keys in `tell` are told meanwhile.

        `keep_keys`: keys that the participant's window has stay there for the next question.
        """
        with self._page:
            self._mail.call_off()
            self._stands = 0
            self._process.write(line(messages.Show(text=text, tell=tell, keep_keys=keep_keys)))

    def map_clocks(self) -> ClockMap:
        """Map the clocks anew."""
        with self._alone():
            return clock_map([self._trip() for _ in range(PINGS)])

    def ask_rating(
        self, question: messages.AskRating, timeout_s: float | None = None, *, wanted: Callable[[], bool] = lambda: True
    ) -> messages.RatingGiven:
        """Have a stimulus rated. Waits for the participant.

        `wanted` is looked at just before the question is put on the screen; if it is not, it counts as called off.
        """
        with self._alone():
            return self._answer(replace(question, ask=self._mail.open_ask()), messages.RatingGiven, timeout_s, wanted)

    def ask_description(
        self, question: messages.AskDescription, *, wanted: Callable[[], bool] = lambda: True
    ) -> messages.DescriptionGiven:
        """Have a stimulus described. Waits for the participant. `wanted` as of a rating."""
        with self._alone():
            return self._answer(replace(question, ask=self._mail.open_ask()), messages.DescriptionGiven, None, wanted)

    def ask_choice(
        self, question: messages.AskChoice, *, wanted: Callable[[], bool] = lambda: True
    ) -> messages.ChoiceGiven:
        """Have one of several answers chosen. Waits for the participant. `wanted` as of a rating.

        `onset_s` and `pressed_s` are on this side's clock.
        """
        with self._alone():
            ask, clocks = self._mail.open_ask(), self.map_clocks()
            asked = replace(question, ask=ask, onset_s=clocks.there(question.onset_s))
            given = self._answer(asked, messages.ChoiceGiven, None, wanted)
            after = self.map_clocks()
        if surely_moved_s(clocks, after) > MAX_CLOCK_STEP_S:
            moved_s = after.offset_s - clocks.offset_s
            raise ParticipantError(
                f"a clock was set by {moved_s:.3f} s while {given.response!r} was answered: the key's time is lost"
            )
        return replace(given, pressed_s=clocks.here(given.pressed_s))

    def noise(self, on: bool, level: float = 0.3) -> messages.NoiseIs:
        """Turn the masking noise on or off; the answer says whether it plays, and if it cannot, why."""
        with self._alone():
            asked = messages.Noise(on=on, level=level, ask=self._mail.open_ask())
            return self._answer(asked, messages.NoiseIs, NOISE_S, lambda: True)

    def cancel(self) -> bool:
        """Call off the question that is being asked, from another thread; true if there was one."""
        return self._mail.call_off()

    def close(self) -> None:
        """End the program: by asking, then by force. Who still waits for it is told."""
        self._gone = lambda _: None
        self._process.write(line(messages.CloseScreen()))
        self._mail.fail("the participant's screen was closed by the console")
        self._beats.put(0.0)
        self._process.end()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """One question at a time; one that was just called off has a moment to leave."""
        if not self._asking.acquire(timeout=REPLY_S):
            raise ParticipantError("another question is being asked on the participant's screen")
        try:
            yield
        finally:
            self._asking.release()

    def _answer(self, asked: _Asked, kind: type[_Given], timeout_s: float | None, wanted: Callable[[], bool]) -> _Given:
        """Ask and wait; a question that gets no answer is taken off the screen, if it still stands there."""
        try:
            self._put(asked, wanted)
            return self._mail.wait(kind, lambda given: given.ask == asked.ask, timeout_s, asked.ask)
        except ParticipantError:
            self._take_off(asked)
            raise
        finally:
            self._mail.call_off()

    def _put(self, asked: _Asked, wanted: Callable[[], bool]) -> None:
        with self._page:
            if not wanted():
                raise ParticipantError("the question was called off")
            self._stands = asked.ask
            self._process.write(line(asked))

    def _take_off(self, asked: _Asked) -> None:
        with self._page:
            if self._stands == asked.ask:
                self._process.write(line(messages.Show(text="")))

    def _trip(self) -> RoundTrip:
        """One ping, waited for where its return is stamped."""
        sent_s = self._clock.now()
        self._process.write(line(messages.Ping(sent_s=sent_s)))
        pong = self._mail.wait(messages.Pong, lambda pong: pong.sent_s == sent_s, REPLY_S, None)
        return RoundTrip(sent_s=sent_s, there_s=pong.there_s, back_s=self._clock.now())

    def _said(self, wire: bytes) -> None:
        try:
            word = messages.from_participant_from(wire)
        except ValidationError:
            self._failed(f"the participant's screen said what is no word: {wire[:200]!r}")
            return
        if isinstance(word, messages.ScreenFailed):
            self._failed(f"the participant's screen failed: {word.message}")
        elif isinstance(word, messages.Beat):
            self._beats.put(word.within_s)
        elif isinstance(word, messages.Unasked):
            self.focused = word if isinstance(word, messages.Focused) else self.focused
            self._minimised = word if isinstance(word, messages.Minimised) else self._minimised
            self.noise_ended = word if isinstance(word, messages.NoiseEnded) else self.noise_ended
            self._emergency = word if isinstance(word, messages.EmergencyPressed) else self._emergency
            self._heard(word)
        elif not self._mail.put(word) and isinstance(word, messages.ChoiceGiven):
            self._heard(word)

    def _failed(self, why: str) -> None:
        """Nothing comes from there any more; the first reason stands, and is told once."""
        first = self._mail.fail(why)
        self._beats.put(0.0)
        if first:
            self._gone(why)

    def _watch(self) -> None:
        """Wait for one beat after the other: a screen that gives none draws nothing and hears no emergency stop."""
        within_s = self._beats.get()
        while within_s:
            within_s = self._beat_within(within_s)

    def _beat_within(self, within_s: float) -> float:
        """When the beat after the next one is due; 0 if none comes: the screen is ended then, and counts as gone."""
        for _ in range(math.ceil(within_s / _BEAT_LOOK_S)):
            with suppress(queue.Empty):
                return self._beats.get(timeout=_BEAT_LOOK_S)
        self._failed(f"the participant's screen stood still for {within_s:g} s and was ended")
        self._process.kill()
        return 0.0


_Kind = TypeVar("_Kind", bound=messages.FromParticipant)


class ParticipantError(RecoilError):
    """The participant's screen did not do it; the message says what and why."""


class Mailbox:
    """The last word of each kind, and the one question that is open. Safe to use from any thread."""

    def __init__(self) -> None:
        self._news = threading.Condition()
        self._last: dict[type, messages.FromParticipant] = {}
        self._asked = 0
        self._open: int | None = None
        self.failure: str | None = None

    def put(self, word: messages.FromParticipant) -> bool:
        """Keep a word for who waits for it; false of a choice for which nobody waits any more."""
        with self._news:
            if isinstance(word, messages.ChoiceGiven) and word.ask != self._open:
                return False
            self._last[type(word)] = word
            self._news.notify_all()
            return True

    @property
    def asking(self) -> bool:
        """Whether a question is open."""
        return self._open is not None

    def fail(self, message: str) -> bool:
        """Nothing comes any more; the first reason stands. Whether this is it."""
        with self._news:
            first = self.failure is None
            self.failure = message if first else self.failure
            self._news.notify_all()
            return first

    def open_ask(self) -> int:
        """The number of a new question."""
        with self._news:
            self._asked += 1
            self._open = self._asked
            return self._asked

    def call_off(self) -> bool:
        """Whoever waits for the open question waits no longer; true if there was one."""
        with self._news:
            was_open, self._open = self._open is not None, None
            self._news.notify_all()
            return was_open

    def wait(self, kind: type[_Kind], fits: Callable[[_Kind], bool], timeout_s: float | None, ask: int | None) -> _Kind:
        """The word of a kind that fits, once it is here. `ParticipantError` if it does not come."""

        def here() -> _Kind | None:
            word = self._last.get(kind)
            return word if isinstance(word, kind) and fits(word) else None

        with self._news:
            self._news.wait_for(lambda: here() or self.failure or ask != (self._open if ask else None), timeout_s)
            word = here()
            if word is None:
                raise ParticipantError(self._why_not(ask, timeout_s))
            return word

    def _why_not(self, ask: int | None, timeout_s: float | None) -> str:
        if self.failure:
            return self.failure
        if ask and ask != self._open:
            return "the question was called off"
        return f"the participant's screen gave no answer within {timeout_s:g} s"
