"""The command line without its start: a child of a server that has everything imported, for tests that call it often.

The child is a process of its own, with its own folder, environment and streams, as one that a shell starts; only the
imports, a second or two of each call, are done once. How a command really starts is for `tests/test_cli.py`.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from subprocess import CompletedProcess, TimeoutExpired
from tempfile import TemporaryDirectory

PRELOADED = [
    "analysis.archive.bids_export",
    "analysis.predict.check",
    "analysis.predict.design_search.run",
    "analysis.predict.fit.percept",
    "analysis.predict.fit.times",
    "analysis.predict.power.run",
    "analysis.predict.reproduction.reproduce",
    "analysis.predict.simulate.run",
    "analysis.summary.analyze",
    "experiments.screens.terminal",
    "recoil.cli",
    "recoil.config_files",
    "recoil.session",
    "recoil.study",
    "tests.forked_commands",
]


def forked(
    words: Sequence[str], folder: Path, environment: Mapping[str, str], timeout_s: float
) -> CompletedProcess[str]:
    """A command's exit code and what it printed. `TimeoutExpired` after `timeout_s`; the child is killed then."""
    server = multiprocessing.get_context("forkserver")
    server.set_forkserver_preload(PRELOADED)
    with TemporaryDirectory() as place:
        streams = Path(place) / "stdout", Path(place) / "stderr"
        child = server.Process(target=_call, args=(list(words), str(folder), dict(environment), streams))
        child.start()
        child.join(timeout_s)
        if child.exitcode is None:
            child.kill()
            child.join()
            raise TimeoutExpired(words, timeout_s)
        said = [stream.read_text(encoding="utf-8") for stream in streams]
    return CompletedProcess(list(words), child.exitcode, *said)


def _call(words: list[str], folder: str, environment: dict[str, str], streams: tuple[Path, Path]) -> None:
    """In the child: be the command."""
    from recoil.cli import main

    for number, stream in enumerate(streams, start=1):
        target = os.open(stream, os.O_WRONLY | os.O_CREAT, 0o600)
        os.dup2(target, number)
        os.close(target)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = ["recoil", *words]
    main()
