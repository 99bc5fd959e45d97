"""The participant's program as a child: lines out and in, and what it said until somebody asks for it."""

from __future__ import annotations

import os
import queue
import subprocess
import tempfile
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, TypeVar

from device.words import RecoilError
from experiments.screens.participant.words import FromParticipant

_ROOT = Path(__file__).parents[3]
"""Where `experiments` lies: started there, the child runs the same code, whatever the console's folder holds."""

_LAST_BYTES = 4_000

_END_S = 3.0
"""How long a child has to end by itself, and again once it was told to."""


class ParticipantProcess:
    """A child that is spoken to in lines. Neither writing nor ending ever hangs."""

    def __init__(self, command: Sequence[str], said: Callable[[bytes], None], gone: Callable[[str], None]) -> None:
        self._said, self._gone = said, gone
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed in end()
        try:
            self._child = subprocess.Popen(
                list(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, cwd=_ROOT
            )
        except OSError:
            self._errors.close()
            raise
        self._out: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._threads = [
            threading.Thread(target=target, args=(pipe,), name=name, daemon=True)
            for target, pipe, name in (
                (self._read, self._child.stdout, "participant's words"),
                (self._write, self._child.stdin, "words to participant"),
            )
        ]
        for thread in self._threads:
            thread.start()

    @property
    def pid(self) -> int:
        """The child's process id."""
        return self._child.pid

    def write(self, line: bytes) -> None:
        """Hand over a line; a child that reads nothing keeps nobody waiting."""
        self._out.put(line)

    def end(self) -> None:
        """Close its input, then ask it to end, then kill it."""
        self._out.put(None)
        for insist in (self._child.poll, self._child.terminate, self._child.kill):
            insist()
            with suppress(subprocess.TimeoutExpired):
                self._child.wait(_END_S)
                break
        for thread in self._threads:
            thread.join(_END_S)
        self._errors.close()

    def _fate(self) -> str:
        """How the child ended, with its last words."""
        with suppress(subprocess.TimeoutExpired):
            self._child.wait(_END_S)
        return f"the participant's screen {_ending(self._child.returncode)}{self._last_words()}"

    def _last_words(self) -> str:
        """The end of what the child wrote as errors; its file position is the child's too, so it stays where it is."""
        errors = self._errors.fileno()
        start = max(0, os.fstat(errors).st_size - _LAST_BYTES)
        lines = os.pread(errors, _LAST_BYTES, start).decode(errors="replace").strip().splitlines()
        return f"; its last words: {lines[-1].strip()}" if lines else ""

    def _read(self, pipe: IO[bytes]) -> None:
        with pipe:
            for line in pipe:
                self._said(line)
        self._gone(self._fate())

    def _write(self, pipe: IO[bytes]) -> None:
        with suppress(OSError), pipe:  # the reader tells of a child that is gone
            while (line := self._out.get()) is not None:
                pipe.write(line)
                pipe.flush()


def _ending(code: int | None) -> str:
    if code is None:
        return "closed its output"
    return f"was killed by signal {-code}" if code < 0 else f"ended with exit code {code}"


Word = TypeVar("Word", bound=FromParticipant)


class ParticipantError(RecoilError):
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
