"""Work done beside: by copies of this process, which have at once all that it has in memory, while it goes on.

A copy ("fork") of a process with threads has none of them, and no lock that they held is ever released in it. So a copy
may only compute and write files; and copies are made on Linux alone, whose libraries for arrays allow it.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from analysis.report.terminal import Tell, untold
from device.messages import RecoilError

Work = Callable[[Tell], object]
"""Is given somebody to tell of each part that is done."""
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@dataclass(frozen=True, slots=True)
class _Copy:
    """A copy at work. It says each part that is done, and at its end the error that it met, or nothing."""

    process: BaseProcess
    said: Connection
    tell: Tell


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


def in_copy(work: Work, tell: Tell = untold) -> None:
    """Do some work that only writes files: in a copy where `process_copies` allows it and there are cores, else here.

    It waits while more copies are at work than there are cores: with one more, no core idles while the last ones end.
    `tell` hears of the parts of the work, as late as at the end of `process_copies`.
    """
    begun = _AT_WORK.get()
    if begun is None or sys.platform != "linux" or cores() == 1:
        work(tell)
        return
    while len(alive := [copy.process.sentinel for copy in begun if copy.process.is_alive()]) > cores():
        wait(alive)
    begun.append(_begin(work, tell))


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _begin(work: Work, tell: Tell) -> _Copy:
    said, end = get_context("fork").Pipe(duplex=False)
    process = get_context("fork").Process(target=_work, args=(work, end))
    with no_interrupt():
        process.start()
    end.close()
    return _Copy(process, said, tell)


def _work(work: Work, end: Connection) -> None:
    """In the copy: what a signal means is the first process's affair, which ends its copies, or ends with them."""
    _AT_WORK.set(None)
    end_with_parent()
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    try:
        work(end.send)
    except Exception as error:  # noqa: BLE001 - raised again in the process that waits
        end.send(_as_sent(error))
    else:
        end.send(None)


def end_with_parent() -> None:
    """Have this process end with the one that began it, also if that is killed: whoever begins anew would meet it."""
    parent = parent_process()

    def end() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=end, daemon=True).start()


def _as_sent(error: Exception) -> Exception:
    """An error, or its words where it cannot be sent itself."""
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301 - our own
    except Exception:  # noqa: BLE001 - whatever an error's own constructor raises
        return RecoilError(str(error))
    return error


def _wait_for(copy: _Copy) -> None:
    try:
        while isinstance(error := copy.said.recv(), str):
            copy.tell(error)
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
