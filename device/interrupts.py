"""Ctrl+C and its like: the signals that end a command, threads that they leave alone, waiting that they break off."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

from device.machine_clock import machine_s
from device.messages import said_by

_ENDING = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGBREAK")  # the last two: Ctrl+\, Ctrl+Break on Windows
INTERRUPTS = [getattr(signal, name) for name in _ENDING if hasattr(signal, name)]
"""The signals that end a command in order; no system knows all of them."""
AWAKE_S = 0.2
"""Who may wait long looks up so often. On Linux a thread that is being started may take a signal that was meant for the
main thread, which then sleeps on: Ctrl+C would do nothing until it wakes.
"""

_Answer = TypeVar("_Answer")


def answer_within(seconds: float, act: Callable[[], _Answer]) -> _Answer:
    """What an act gives back, or raises. `TimeoutError`: it takes longer; it is then left to itself."""
    done: Future[_Answer] = Future()
    begin_aside(done, act, "plug-in")
    return answer_of(done, seconds)


def answer_of(done: Future[_Answer], seconds: float) -> _Answer:
    """What an act that has begun gives back, or raises; as `answer_within`."""
    wait_awake(done, seconds)
    if not done.done():
        raise TimeoutError(f"no answer within {seconds:g} s")
    return done.result()


def begin_aside(done: Future[_Answer], act: Callable[[], _Answer], name: str) -> None:
    """Carry an act out in a thread of its own; `done` is told what it gives back or raises.

    An interrupt may come here when it has begun: who must know of its end holds `done` already.
    """

    def carry_out() -> None:
        try:
            done.set_result(act())
        except Exception as error:  # noqa: BLE001 - raised again where it is waited for
            done.set_exception(error)
        except BaseException as error:  # noqa: BLE001 - SystemExit and the like end no program of ours
            done.set_exception(RuntimeError(f"it tried to end the program ({said_by(error)})"))

    start_aside(carry_out, name)


def start_aside(act: Callable[[], None], name: str) -> None:
    """A thread that ends with the program, and takes no signal that is meant for the main thread (see `AWAKE_S`).

    Threads that it starts take none either.
    """
    thread = threading.Thread(target=act, daemon=True, name=name)
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        thread.start()
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPTS)
    try:
        thread.start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def interrupts_held() -> Iterator[None]:
    """Let a gun be let go of, however often Ctrl+C is pressed: what comes meanwhile acts at the end.

    It does not where the end is an error, which has more to say. Threads other than the main one are never interrupted.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came, before = list[int](), dict[int, Callable[[int, FrameType | None], object] | int | None]()
    try:
        for number in INTERRUPTS:
            before[number] = signal.signal(number, lambda it, _: came.append(it))
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
    if came:
        signal.raise_signal(came[0])


def wait_awake(done: Future[_Answer], seconds: float) -> None:
    """Wait for a result, at most for so long; interrupts come through."""
    end_s = machine_s() + seconds
    while not done.done() and (left_s := end_s - machine_s()) > 0:
        wait([done], min(left_s, AWAKE_S))
