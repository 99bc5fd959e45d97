"""Pieces of work done side by side: here, on processes of this machine, or on an existing Dask cluster.

Why the pool is our own and not joblib's: `docs/decisions/worker-processes.md`.

A piece is a function of one argument, both of which travel by pickle; what comes back does not depend on where or when
it was worked out, so the caller puts it in order by its number. Each is handed over as soon as it is there.
"""

from __future__ import annotations

import logging
import re
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from multiprocessing import get_context
from typing import Any

from analysis.report.copies import end_with_parent, no_interrupt
from device.messages import said_by
from experiments.config.door import ConfigError
from experiments.record.provenance import recoil_version, versions

Function = Callable[[Any], Any]
Done = Callable[[int, Any], None]
"""Told the number of a piece and what came of it, in the order in which they end."""
RunPieces = Callable[[Function, Sequence[Any], Done], None]
"""Works out a function of each piece."""

CONNECT_S = 10
"""How long to wait for a cluster, and for its first worker; assumed."""
_ADDRESS = r"(?:(?:tcp|tls|ws|wss)://)?(?:[^\s:/\[\]]+|\[[0-9a-fA-F:.]+\]):[0-9]{1,5}"
_SAME = ("recoil", "numpy", "scipy")
"""What workers must have in the versions of this machine, lest their numbers differ."""


def one_by_one(function: Function, pieces: Sequence[Any], done: Done) -> None:
    """In this process, one after the other."""
    for number, piece in enumerate(pieces):
        done(number, function(piece))


@contextmanager
def on_processes(workers: int) -> Iterator[RunPieces]:
    """On so many processes of their own, started anew ("spawn") so that it is the same on every system.

    When interrupted, what has begun ends and nothing more begins. `ConfigError` if a process is killed.
    """
    yield partial(_on_processes, workers)


@contextmanager
def on_cluster(address: str) -> Iterator[RunPieces]:
    """On the workers of the Dask scheduler at `address`. `ConfigError` if there is none, or its workers lack Recoil."""
    with _cluster(address) as client:
        check_workers(client, address)
        yield partial(_on_cluster, client)


_MOST_ON_WINDOWS = 61
"""A pool of more processes is refused there."""


def _on_processes(workers: int, function: Function, pieces: Sequence[Any], done: Done) -> None:
    workers = min(workers, len(pieces), _MOST_ON_WINDOWS if sys.platform == "win32" else workers)
    if workers < 2:
        one_by_one(function, pieces, done)
        return
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin_worker)
    try:
        with no_interrupt():
            numbers = {pool.submit(function, piece): number for number, piece in enumerate(pieces)}
        for future in as_completed(numbers):
            done(numbers[future], future.result())
    except BrokenProcessPool as error:
        raise ConfigError("a worker process was killed (too little memory?); run again with fewer --workers") from error
    finally:  # once: leaving a `with` would shut down again, and take back that the rest is cancelled
        with no_interrupt():  # else a second Ctrl-C leaves workers that nobody tells to end, and waits for them
            pool.shutdown(wait=True, cancel_futures=True)


def _on_cluster(client: Any, function: Function, pieces: Sequence[Any], done: Done) -> None:
    import distributed  # noqa: PLC0415 - the extra `dask`

    gathered: Any = distributed.as_completed  # it has no types
    futures = client.map(function, pieces, pure=False)
    numbers = {future.key: number for number, future in enumerate(futures)}
    try:
        for future in gathered(futures, loop=client.loop):
            done(numbers[future.key], _result(future))
    finally:
        client.cancel(futures)


def _begin_worker() -> None:
    """A worker does not outlive a parent that was killed; on Windows it ignores Ctrl-C only from here on."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()


def _cluster(address: str) -> Any:
    try:
        import distributed  # noqa: PLC0415 - the extra `dask`
    except Exception as error:  # it is missing, or whatever a broken library raises
        raise ConfigError(
            f'--scheduler needs Dask ({said_by(error)}): install "recoil[dask]" here and on the workers'
        ) from error
    if not re.fullmatch(_ADDRESS, address):  # some others would be tried in vain, and long
        raise ConfigError(f"--scheduler {address}: must be host and port, such as tcp://127.0.0.1:8786")
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # the message is ours
    client: Any = distributed.Client  # it has no types
    try:
        return client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ConfigError(f"--scheduler {address}: no Dask scheduler answers there ({reason})") from error


def _result(future: Any) -> Any:
    try:
        return future.result()
    except Exception as error:  # a lost scheduler, a killed worker, whatever a worker raises: passed on in words
        raise ConfigError(f"--scheduler: {type(error).__name__}: {error}") from error


def check_workers(client: Any, address: str) -> None:
    """There must be workers, with this machine's versions of what the numbers depend on."""
    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
        theirs = client.run(versions)
    except TimeoutError as error:
        raise ConfigError(f"--scheduler {address}: has no workers; start some with `dask worker {address}`") from error
    except Exception as error:  # whatever a worker raises
        raise ConfigError(f"--scheduler {address}: a worker cannot run Recoil {recoil_version()}: {error}") from error
    ours = versions()
    for worker, there in theirs.items():
        other = [f"{name} {there.get(name)}, not {ours[name]}" for name in _SAME if there.get(name) != ours[name]]
        if other:
            raise ConfigError(f"--scheduler {address}: the worker {worker} has {'; '.join(other)}; make them the same")
