"""Test shots that an emergency stop in another test shot leaves owed: a file of the results folder has a line for each.

It is there until a test shot was fired beside all runs. One that was fired in a run stands in its journal.
"""

from __future__ import annotations

import errno
import json
import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from experiments.clock import utc_text
from experiments.record import storage
from experiments.record.journal import JournalError

OWED_FILE = "test-shots-owed.jsonl"


@dataclass(frozen=True, slots=True, kw_only=True)
class OwedShot:
    """When the stop was, on which gun, by its name and by the address that it was opened at; "" if nobody knows."""

    utc: str
    gun: str
    address: str


_ELSEWHERE = "another address"
_PATIENCE_S = 1.0
"""So long another window that changes the file is waited for."""


RETRY_S = 1.0
"""So long after it was not taken, something is written once more."""


class DebtKeeper:
    """Has on the disk what changes in what guns owe, in a thread of its own: a disk may take its time, or be away.

    What it does not take is tried again until the end. `tell` hears in that thread why, and "" once it is there.
    """

    def __init__(self, results: Path, tell: Callable[[str], None]) -> None:
        self._results, self._tell = results, tell
        self._had_results = results.is_dir()
        self._ending, self._writer = threading.Event(), ThreadPoolExecutor(1, "owed")
        self.why = ""
        """Why the last change is not there yet."""

    def keep(self, change: Callable[[], None]) -> None:
        """Carry a change out, after those before it; none behind the end."""
        if not self._ending.is_set():
            self._writer.submit(self._keep, change)

    def _keep(self, change: Callable[[], None]) -> None:
        is_last = False
        while not self._is_done(change) and not is_last:
            is_last = self._ending.wait(RETRY_S)

    def _is_done(self, change: Callable[[], None]) -> bool:
        self.why = ""
        try:
            if self._had_results and not self._results.is_dir():  # a new one would be in its way back
                raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))
            change()
        except OSError as error:
            self.why = error.strerror or str(error)
        self._tell(self.why)
        return not self.why

    def end(self, *, wait: bool) -> None:
        """Try what is not there yet once more, now."""
        self._ending.set()
        self._writer.shutdown(wait=wait)


def owe_shot(results: Path, owed: OwedShot) -> None:
    """Have it on the disk. `OSError`, if that does not take it."""
    storage.make_folder(results)
    _change(results, lambda before: [*before, owed])


def owed_shots(results: Path) -> list[OwedShot]:
    """All that are owed. `JournalError`, if nobody can read them."""
    try:
        return _owed_shots(results)
    except OSError as error:
        said = (
            f"cannot be read ({error.strerror or error}), and says which guns owe a test shot after an emergency stop; "
            "have it readable, or put away what stands there and fire a test shot before anything else"
        )
        raise JournalError(said, at=results / OWED_FILE) from error


def _owed_shots(results: Path) -> list[OwedShot]:
    path = results / OWED_FILE
    try:
        data, written_s = storage.read_whole(path), path.stat().st_mtime
    except (FileNotFoundError, NotADirectoryError):
        return []
    unread = OwedShot(utc=utc_text(datetime.fromtimestamp(written_s, UTC)), gun="", address="")
    return [_of_line(line, unread) for line in data.splitlines() or [data]]


def _of_line(line: bytes, unread: OwedShot) -> OwedShot:
    """What a line says; of one that says nothing nobody knows whose it is: every gun owes it since it was written."""
    try:
        values = json.loads(line)
        return OwedShot(**{name: str(value) for name, value in values.items()})
    except (ValueError, TypeError, AttributeError, RecursionError):
        return unread


def shot_was_fired(results: Path, gun: str, address: str) -> None:
    """A test shot was fired on a gun: it owes none any more. `OSError`, if the disk does not take that.

    What another gun owes that was at its address, it owes wherever it is now.
    """

    def others(before: list[OwedShot]) -> list[OwedShot]:
        return [
            replace(one, address=_ELSEWHERE) if one.address == address else one
            for one in before
            if one.gun not in ("", gun) or (not one.gun and one.address not in ("", address))
        ]

    _change(results, others)


def take_back(results: Path, owed: OwedShot) -> None:
    """It is owed no more: the gun is a simulated one. `OSError`, if the disk does not take that."""
    _change(results, lambda before: [one for one in before if one != owed])


def _change(results: Path, change: Callable[[list[OwedShot]], list[OwedShot]]) -> None:
    """Write what becomes of what is owed, with nobody else between; who holds the folder for long is not waited for."""
    with storage.folder_held(results, _PATIENCE_S):
        lines = [json.dumps(asdict(one), ensure_ascii=False) for one in change(_owed_shots(results))]
        if lines:
            storage.write_whole(results / OWED_FILE, "".join(f"{line}\n" for line in lines).encode())
        else:
            (results / OWED_FILE).unlink(missing_ok=True)
