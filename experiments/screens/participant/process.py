"""The participant's program as a child that is spoken to in lines."""

from __future__ import annotations

import os
import queue
import subprocess
import tempfile
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import IO

from device.own_process import end_program, how_ended, own_environment

_LAST_BYTES = 4_000

END_S = 3.0
"""How long a child has to end by itself, and again once it was told to."""


class ParticipantProcess:
    """A child that is spoken to in lines. Neither writing nor ending ever hangs."""

    def __init__(self, command: Sequence[str], said: Callable[[bytes], None], gone: Callable[[str], None]) -> None:
        self._said, self._gone = said, gone
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed in end()
        try:
            self._child = subprocess.Popen(
                list(command),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                env=own_environment(),
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

    def kill(self) -> None:
        """End it by force, without waiting for that."""
        self._child.kill()

    def end(self) -> None:
        """Close its input, then ask it to end, then kill it."""
        self._out.put(None)
        end_program(self._child, END_S)
        for thread in self._threads:
            thread.join(END_S)
        self._errors.close()

    def _fate(self) -> str:
        """How the child ended, with its last words."""
        with suppress(subprocess.TimeoutExpired):
            self._child.wait(END_S)
        code = self._child.returncode
        fate = "closed its output" if code is None else how_ended(code)
        return f"the participant's screen {fate}{self._last_words()}"

    def _last_words(self) -> str:
        """The end of what the child wrote as errors; its file position is the child's too, so it stays where it is."""
        errors = self._errors.fileno()
        start = max(0, os.fstat(errors).st_size - _LAST_BYTES)
        lines = _read_at(errors, start).decode(errors="replace").strip().splitlines()
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


def _read_at(descriptor: int, start: int) -> bytes:
    """The last bytes from there on, with the position left as it stands."""
    if hasattr(os, "pread"):
        return os.pread(descriptor, _LAST_BYTES, start)
    position = os.lseek(descriptor, 0, os.SEEK_CUR)  # Windows: it is moved and put back, as nobody writes any more
    os.lseek(descriptor, start, os.SEEK_SET)
    try:
        return os.read(descriptor, _LAST_BYTES)
    finally:
        os.lseek(descriptor, position, os.SEEK_SET)
