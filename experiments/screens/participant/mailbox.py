"""Where what the participant's screen said waits for who asked, and who waits is told why nothing comes any more."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

from experiments.screens.participant.words import FromParticipant

Word = TypeVar("Word", bound=FromParticipant)


class ParticipantError(Exception):
    """The participant's screen did not do it; the message says what and why."""


class Mailbox:
    """The last word of each kind, and the one question that is open. Safe to use from any thread."""

    def __init__(self) -> None:
        self._news = threading.Condition()
        self._last: dict[type, FromParticipant] = {}
        self._asked = 0
        self._open: int | None = None
        self.failure: str | None = None

    def put(self, word: FromParticipant) -> None:
        """Keep a word for who waits for it."""
        with self._news:
            self._last[type(word)] = word
            self._news.notify_all()

    @property
    def asking(self) -> bool:
        """Whether a question is open."""
        return self._open is not None

    def fail(self, message: str) -> None:
        """Nothing comes any more; the first reason stands."""
        with self._news:
            self.failure = self.failure or message
            self._news.notify_all()

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

    def wait(self, kind: type[Word], fits: Callable[[Word], bool], timeout_s: float | None, ask: int | None) -> Word:
        """The word of a kind that fits, once it is here. `ParticipantError` if it does not come."""

        def here() -> Word | None:
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
