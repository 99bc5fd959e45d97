"""Programs without their start: children of a server that has everything imported, for tests that start many.

A child is a process with its own folder, environment, streams and session. Only the imports, seconds of each start, are
done once for all tests. Who starts it holds a small process in its stead (`tests/warm_client.py`), which hands on
signals and the exit code; if that one is killed, so is the child. How programs really start is for `tests/test_cli.py`.

A child saves figures as small PNG alone, unless it is asked for more (`tests/figure_files.py`).
"""

from __future__ import annotations

import atexit
import fcntl
import importlib
import io
import os
import runpy
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import NoReturn

import typer.main

from analysis.report import page
from tests import figure_files
from tests.waiting import PATIENCE_S
from tests.warm_client import ask

FOLDER = "RECOIL_TESTS_WARM_START"
"""The variable that names the folder of the server's socket."""
OWNER = "RECOIL_TESTS_WARM_OWNER"
"""The variable that names the process with whose end the server ends."""
CLIENT = Path(__file__).with_name("warm_client.py")
PRELOADED = [
    "PIL.PngImagePlugin",
    "analysis.archive.bids_export",
    "analysis.predict.check",
    "analysis.predict.design_search.run",
    "analysis.predict.fit.percept",
    "analysis.predict.fit.times",
    "analysis.predict.power.run",
    "analysis.predict.reproduction.reproduce",
    "analysis.predict.reproduction.results",
    "analysis.predict.simulate.run",
    "analysis.summary.analyze",
    "experiments.screens.console.app",
    "experiments.screens.console.start",
    "experiments.screens.participant.__main__",
    "experiments.screens.terminal",
    "experiments.study.files_begun_with",
    "experiments.study.new_study",
    "json_tricks",
    "matplotlib.pyplot",
    "openpyxl",
    "pingouin",
    "recoil.cli",
    "recoil.session",
    "recoil.study",
    "requests",
    "rich.progress",
    "rich.table",
    "scipy.interpolate",
    "typer.rich_utils",
]
"""What programs import and what their libraries do: not PsychoPy itself, which wants a display and a home."""


def warm(*words: object) -> list[str]:
    """What to start instead of `recoil WORDS` or, where they begin with `-m`, of `python WORDS`."""
    return [sys.executable, "-S", "-E", str(CLIENT), str(_address()), *map(str, words)]


def run_warm(*words: object, cwd: Path, env: Mapping[str, str]) -> subprocess.CompletedProcess[str]:
    """`subprocess.run(warm(WORDS))` with what it said, and without the process in between."""
    environment = {os.fsencode(key): os.fsencode(value) for key, value in env.items()}
    with (
        socket.socket(socket.AF_UNIX) as line,
        Path(os.devnull).open("rb") as nothing,
        tempfile.TemporaryFile("w+", encoding="utf-8") as out,
        tempfile.TemporaryFile("w+", encoding="utf-8") as err,
    ):
        line.settimeout(PATIENCE_S)  # it ends where the line does
        line.connect(str(_address()))
        streams = [stream.fileno() for stream in (nothing, out, err)]
        ask(line, list(map(str, words)), folder=os.fsencode(cwd), environment=environment, streams=streams)
        code = int(line.recv(16) or 1)
        said = [stream.seek(0) or stream.read() for stream in (out, err)]
    return subprocess.CompletedProcess(words, code, *said)


def _address() -> Path:
    """The server's, which is started where it does not yet serve."""
    address = Path(os.environ[FOLDER]) / "socket"
    if not address.exists():
        _start(address)
    return address


def _start(address: Path) -> None:
    """Start the server, once for all who come here at the same time."""
    with (address.parent / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if address.exists():
            return
        words = [sys.executable, "-m", "tests.warm_start", str(address)]
        environment = os.environ | {"PYTHONPATH": str(CLIENT.parent.parent)}
        nowhere = [(os.POSIX_SPAWN_OPEN, number, os.devnull, os.O_RDWR, 0) for number in (0, 1)]
        server = os.posix_spawn(sys.executable, words, environment, file_actions=nowhere, setsid=True)
        while not address.exists():
            if os.waitpid(server, os.WNOHANG) != (0, 0):
                raise RuntimeError("the server of warm starts ended before it served: its error is printed above")
            time.sleep(0.02)


class _Server:
    """Forks a child for each client, and tells it the exit code."""

    def __init__(self, door: socket.socket, owner: int) -> None:
        self._door = door
        self._waits = selectors.DefaultSelector()
        self._waits.register(door, selectors.EVENT_READ, self._let_in)
        self._waits.register(os.pidfd_open(owner), selectors.EVENT_READ, lambda: sys.exit(0))

    def serve(self) -> NoReturn:
        while True:
            for key, _ in self._waits.select():
                if key.fd in self._waits.get_map():  # an earlier one of these may have closed it
                    key.data()

    def _let_in(self) -> None:
        line, _ = self._door.accept()
        try:
            request, streams = _received(line)
        except OSError:
            line.close()
            return
        child = os.fork()
        if not child:
            _be(request, streams)
        for stream in streams:
            os.close(stream)
        ended = os.pidfd_open(child)
        self._waits.register(line, selectors.EVENT_READ, lambda: self._hand_on(line, child))
        self._waits.register(ended, selectors.EVENT_READ, lambda: self._tell(line, child, ended))

    def _hand_on(self, line: socket.socket, child: int) -> None:
        """A signal for the child, or the death of who started it."""
        signals = line.recv(64)
        for number in signals:
            os.kill(child, number)
        if not signals:
            os.killpg(child, signal.SIGKILL)
            os.waitid(os.P_PID, child, os.WEXITED | os.WNOWAIT)  # gone before who killed it starts the next
            self._waits.unregister(line)

    def _tell(self, line: socket.socket, child: int, ended: int) -> None:
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        if line in self._waits.get_map():
            self._waits.unregister(line)
            line.sendall(b"%d" % code)
        line.close()
        self._waits.unregister(ended)
        os.close(ended)


def _received(line: socket.socket) -> tuple[list[bytes], list[int]]:
    """What to be: folder, number of words, words, environment; and the three streams."""
    header, streams, _, _ = socket.recv_fds(line, 8, 3)
    size, request = int.from_bytes(header, "big"), b""
    while len(request) < size:
        request += line.recv(size - len(request)) or b"\0" * size
    return request.split(b"\0"), streams


def _be(request: list[bytes], streams: list[int]) -> NoReturn:
    """In the child: be the program, and end."""
    os.setsid()
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
    os.closerange(3, 1024)
    folder, count, *rest = request
    words = [os.fsdecode(word) for word in rest[: int(count)]]
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(os.fsdecode(pair).split("=", 1) for pair in rest[int(count) :])
    own = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    sys.path[:0] = [path for path in own if path and path not in sys.path]
    if figure_files.ASKED in os.environ:
        figure_files.draw()
    sys.stdin, sys.stdout, sys.stderr = (_text(number, mode) for number, mode in enumerate("rww"))
    code = _code(_module if words[0] == "-m" else _recoil, words)
    threading._shutdown()  # type: ignore[attr-defined]  # what the interpreter does at its end
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(code)


def _text(number: int, mode: str) -> io.TextIOWrapper:
    raw = open(number, f"{mode}b", closefd=False)  # noqa: SIM115 — as the interpreter does
    return io.TextIOWrapper(raw, encoding="utf-8", line_buffering=mode == "w" and (number == 2 or os.isatty(number)))  # type: ignore[type-var]


def _recoil(words: list[str]) -> None:
    from recoil.cli import main

    sys.modules["__main__"] = ModuleType("__main__")
    sys.argv = ["recoil", *words]
    main()


def _module(words: list[str]) -> None:
    sys.argv = words[1:]
    runpy.run_module(words[1], run_name="__main__", alter_sys=True)


def _code(program: Callable[[list[str]], None], words: list[str]) -> int:
    try:
        program(words)
    except SystemExit as end:
        if isinstance(end.code, str):
            sys.stderr.write(f"{end.code}\n")
            return 1
        return end.code or 0
    except KeyboardInterrupt:
        traceback.print_exc()
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
    except BaseException:  # noqa: BLE001 — the end of a program
        traceback.print_exc()
        return 1
    return 0


def main(address: Path, owner: int) -> NoReturn:
    """Import everything, then serve until the owner ends."""
    for name in PRELOADED:
        with suppress(ModuleNotFoundError):  # of an extra that is not installed: a program that needs it says so itself
            importlib.import_module(name)
    figure_files.leave_out()
    page.write_page(address.parent, "", ())  # which compiles the pages' templates
    from recoil.cli import app

    typer.main.get_command = cache(typer.main.get_command)
    typer.main.get_command(app)  # all options of all commands
    being = address.with_name("being-made")
    with socket.socket(socket.AF_UNIX) as door:
        door.bind(str(being))
        door.listen(64)
        being.rename(address)
        _Server(door, owner).serve()


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(os.environ[OWNER]))
