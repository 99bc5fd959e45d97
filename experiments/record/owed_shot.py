"""Test shots that an emergency stop in another test shot leaves owed: a file of the results folder has a line for each.

It is there until a test shot was fired beside all runs. One that was fired in a run stands in its journal.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from experiments.record import storage

OWED_FILE = "test-shots-owed.jsonl"


@dataclass(frozen=True, slots=True, kw_only=True)
class OwedShot:
    """When the stop was, on which gun, by its name and by the address that it was opened at; "" if nobody knows."""

    utc: str
    gun: str
    address: str


_ELSEWHERE = "another address"
_UNREAD = OwedShot(utc="9999", gun="", address="")
"""A line that says nothing: whose it is nobody knows, so every gun owes it."""


def owe_shot(results: Path, owed: OwedShot) -> None:
    """Have it on the disk. `OSError`, if that does not take it."""
    storage.make_folder(results)
    _write(results, [*owed_shots(results), owed])


def owed_shots(results: Path) -> list[OwedShot]:
    """All that are owed."""
    try:
        data = storage.read_whole(results / OWED_FILE)
    except (FileNotFoundError, NotADirectoryError):
        return []
    return [_of_line(line) for line in data.splitlines() or [data]]


def _of_line(line: bytes) -> OwedShot:
    try:
        values = json.loads(line)
        return OwedShot(**{name: str(value) for name, value in values.items()})
    except (ValueError, TypeError, AttributeError):
        return _UNREAD


def shot_was_fired(results: Path, gun: str, address: str) -> None:
    """A test shot was fired on a gun: it owes none any more. `OSError`, if the disk does not take that.

    What another gun owes that was at its address, it owes wherever it is now.
    """
    owed = owed_shots(results)
    others = [
        replace(one, address=_ELSEWHERE) if one.address == address else one
        for one in owed
        if one.gun not in ("", gun) or (not one.gun and one.address not in ("", address))
    ]
    if others:
        _write(results, others)
    elif owed:
        (results / OWED_FILE).unlink()


def _write(results: Path, owed: list[OwedShot]) -> None:
    lines = [json.dumps(asdict(one), ensure_ascii=False) for one in owed]
    storage.write_whole(results / OWED_FILE, "".join(f"{line}\n" for line in lines).encode())
