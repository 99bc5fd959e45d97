"""A signal that another thread takes, as happens on Linux where one is just being started: nobody is woken by it."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

SOON_S = 0.1


class Told(Exception):  # noqa: N818 - what a handler raises
    """The main thread heard of the signal."""


def _tell(*_: object) -> None:
    raise Told


@contextmanager
def stolen_signal() -> Iterator[None]:
    """A signal that is taken soon, by a thread of its own."""
    over = threading.Event()

    def take() -> None:
        time.sleep(SOON_S)
        signal.pthread_kill(threading.get_ident(), signal.SIGUSR1)
        over.wait()

    before = signal.signal(signal.SIGUSR1, _tell)
    thread = threading.Thread(target=take, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        signal.signal(signal.SIGUSR1, before)
