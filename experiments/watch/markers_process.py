"""Markers beside a run: a process of its own that begins before the run and ends with it, however that ends."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from pathlib import Path
from typing import IO

from device.own_process import OWN_GROUP, end_program, own_environment, own_program
from experiments.watch.lsl import MarkerStreams, NoStreams, send_markers

READY_S, _SOON_S = 20.0, 5.0
"""How long a run waits for the streams before it begins, and after how long it says that it waits."""
_END_S, _STOPPED_S = 5.0, 1.0
"""How long the streams have for what is still to be sent, and again to end when they are told to; and where the run was
broken off."""
_Tell = Callable[[str], None]
_READY, _PROBLEM = "ready", "markers: "


@contextmanager
def markers_beside(results: Path, say: _Tell) -> Iterator[None]:
    """Have the runs of a results folder sent meanwhile. Whatever is in the way is said once, and nothing else."""
    try:
        child = subprocess.Popen(
            own_program(__name__, str(results.absolute())),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            env=own_environment(),
            start_new_session=True,  # Ctrl+C is for the run
            creationflags=OWN_GROUP,
        )
    except OSError as error:
        say(f"no markers: {error}")
        yield
        return
    lines, left_s, there = _lines(child), _STOPPED_S, True
    try:
        there = _wait_ready(lines, say)
        yield
        left_s = _END_S
    finally:
        _end(child, lines, say if there else _nothing, left_s)


def _nothing(_: str) -> None:
    """It was said that there are no markers."""


def _lines(child: subprocess.Popen[str]) -> queue.SimpleQueue[str]:
    """What a child says, line by line; empty at its end."""
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read(pipe: IO[str]) -> None:
        with pipe:
            for line in pipe:
                lines.put(line.rstrip("\n"))
        lines.put("")

    threading.Thread(target=read, args=(child.stdout,), daemon=True, name="markers").start()
    return lines


def _wait_ready(lines: queue.SimpleQueue[str], say: _Tell) -> bool:
    """Wait until a child is ready, or it is late; whether there may be markers."""
    try:
        with suppress(queue.Empty):
            return _is_ready(lines.get(timeout=_SOON_S), say)
        say(f"the run waits for the streams of its markers, at most {READY_S:g} s")
        return _is_ready(lines.get(timeout=READY_S - _SOON_S), say)
    except queue.Empty:
        say(f"no markers yet: their streams are not there after {READY_S:g} s; the run begins without them")
        return True


def _is_ready(said: str, say: _Tell) -> bool:
    """Whether a child that said this first may send; what else it says is told."""
    if said != _READY:
        say(said or "no markers: their process ended at once")
    return said == _READY or said.startswith(_PROBLEM)


def _end(child: subprocess.Popen[str], lines: queue.SimpleQueue[str], tell: _Tell, left_s: float) -> None:
    """Let the child send the rest and end, and say what it said since, or that it hung or died."""
    with suppress(OSError):
        assert child.stdin is not None  # noqa: S101 - a pipe
        child.stdin.close()
    hung = not end_program(child, left_s)
    with suppress(queue.Empty):
        while said := lines.get(timeout=left_s):
            if said != _READY:
                tell(said)
    if hung:
        tell("markers: their process hung and was ended; some may not have been sent, and the journal is whole")
    elif child.returncode not in (0, 2):
        tell(f"markers: their process broke off (exit code {child.returncode}); its journal is whole")


def _until_left(over: threading.Event) -> None:
    """Wait for the end of standard input: the run is over, or was killed."""
    while os.read(0, 1024):  # not `sys.stdin`, whose lock the end of the program would wait for
        pass
    over.set()
    time.sleep(2 * _END_S)
    os._exit(1)  # the library hangs, and nobody is left who could end this


def send_beside() -> int:
    """Send the markers of the folder that is named, until whoever started this is gone."""
    os.umask(0o077)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    over = threading.Event()
    threading.Thread(target=_until_left, args=(over,), daemon=True).start()

    def tell(made: MarkerStreams) -> None:
        print(f"{_PROBLEM}{made.problem}" if made.problem else _READY, flush=True)  # noqa: T201 - to the run

    for stream, encoding in ((sys.stdout, "utf-8"), (sys.stderr, None)):  # the run reads the first, people the second
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(encoding=encoding, errors="backslashreplace")  # names of files may be no text

    def say(text: str) -> None:
        with suppress(OSError):  # where the terminal is gone, nobody reads it
            sys.stderr.write(f"recoil: markers: {text}\n")

    try:
        send_markers(Path(sys.argv[1]), tell, say, over)
    except NoStreams as error:
        print(f"no markers: {error}", flush=True)  # noqa: T201 - to the run
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(send_beside())
