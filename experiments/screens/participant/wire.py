"""The participant's end of the pipe: lines in through a thread, which answers pings at once; lines out under a lock."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import BinaryIO

from pydantic import ValidationError

from experiments.screens.participant.words import (
    Close,
    Failed,
    FromParticipant,
    Ping,
    Pong,
    ToParticipant,
    line,
    to_participant_from,
)


class Wire:
    """Says words to the console and hears its own. `now` is this side's clock."""

    def __init__(self, heard: BinaryIO, said: BinaryIO, now: Callable[[], float]) -> None:
        self._heard, self._said, self._now = heard, said, now
        self._lock = threading.Lock()
        self._words: queue.SimpleQueue[ToParticipant] = queue.SimpleQueue()

    def listen(self) -> None:
        """Begin to hear."""
        threading.Thread(target=self._listen, name="console's words", daemon=True).start()

    def say(self, word: FromParticipant) -> None:
        """Say a word; a console that is gone hears nothing, and its silence ends the program."""
        with self._lock, suppress(OSError):
            self._said.write(line(word))
            self._said.flush()

    def word(self) -> ToParticipant | None:
        """The next word that was heard, if there is one. A console that is gone said `Close`."""
        with suppress(queue.Empty):
            return self._words.get_nowait()
        return None

    def _listen(self) -> None:
        for wire in self._heard:
            there_s = self._now()
            try:
                word = to_participant_from(wire)
            except ValidationError:
                self.say(Failed(message=f"the console said what is no word: {wire[:200]!r}"))
                break
            if isinstance(word, Ping):
                self.say(Pong(sent_s=word.sent_s, there_s=there_s))
            else:
                self._words.put(word)
        self._words.put(Close())
