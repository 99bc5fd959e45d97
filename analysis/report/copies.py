"""Work done beside: by copies of this process, which have at once all that it has in memory, while it goes on.

A copy ("fork") of a process with threads has none of them, and no lock that they held is ever released in it. So a copy
may only compute and write files; and copies are made on Linux alone, whose libraries for arrays allow it.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

from device.words import RecoilError

Work = Callable[[], object]
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@dataclass(frozen=True, slots=True)
class _Copy:
    """A copy at work; what it says at its end is the error that it met, or nothing."""

    process: BaseProcess
    said: Connection


_AT_WORK: ContextVar[list[_Copy] | None] = ContextVar("copies", default=None)


@contextmanager
def process_copies() -> Iterator[None]:
    """Let `in_copy` make copies in here; all that was begun is done at the end. Raises what was raised in a copy."""
    begun: list[_Copy] = []
    before = _AT_WORK.set(begun)
    try:
        yield
        for copy in begun:
            _wait_for(copy)
    finally:
        _AT_WORK.reset(before)
        for copy in begun:
            copy.process.terminate()
            copy.process.join()


def in_copy(work: Work) -> None:
    """Do some work that only writes files: in a copy where `process_copies` allows it and a core is idle, else here."""
    begun = _AT_WORK.get()
    if begun is None or sys.platform != "linux" or sum(not copy.said.poll() for copy in begun) >= cores() - 1:
        work()
    else:
        begun.append(_begin(work))


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _begin(work: Work) -> _Copy:
    said, tell = get_context("fork").Pipe(duplex=False)
    process = get_context("fork").Process(target=_work, args=(work, tell))
    with no_interrupt():
        process.start()
    tell.close()
    return _Copy(process, said)


def _work(work: Work, tell: Connection) -> None:
    """In the copy: what a signal means is the first process's affair, which ends its copies."""
    _AT_WORK.set(None)
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    try:
        work()
    except Exception as error:  # noqa: BLE001 - raised again in the process that waits
        tell.send(error)
    else:
        tell.send(None)


def _wait_for(copy: _Copy) -> None:
    try:
        error = copy.said.recv()
    except EOFError:
        raise RecoilError("a process that worked beside this one was killed (too little memory?); run again") from None
    copy.process.join()
    if error is not None:
        raise error


@contextmanager
def no_interrupt() -> Iterator[None]:
    """Starting processes is not cut in half by a signal: it is told afterwards. They themselves never hear a Ctrl-C.

    They inherit the mask of this thread; another thread may still take the signal, so the handlers wait as well.
    """
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    heard: list[int] = []

    def hear(number: int, _: object) -> None:
        heard.append(number)

    handlers = {number: signal.signal(number, hear) for number in _SIGNALS}
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if heard:
            signal.raise_signal(heard[0])
