"""The test shot that an emergency stop in another test shot leaves owed: a file of the results folder says so.

It is there until a test shot was fired beside all runs. One that was fired in a run stands in its journal.
"""

from __future__ import annotations

from pathlib import Path

from experiments.record import storage

OWED_FILE = "test-shot-owed.txt"


def owe_shot(results: Path, gun: str, utc: str) -> None:
    """Have it on the disk. `OSError`, if that does not take it."""
    storage.make_folder(results)
    said = f"{utc} A test shot on {gun} ended by an emergency stop. Whatever comes next begins with a test shot.\n"
    storage.write_whole(results / OWED_FILE, said.encode())


def shot_owed_since(results: Path) -> str:
    """The date and time of the stop; empty if nothing is owed."""
    try:
        said = storage.read_whole(results / OWED_FILE)
    except (FileNotFoundError, NotADirectoryError):
        return ""
    return said.decode(errors="replace").partition(" ")[0]


def no_shot_is_owed(results: Path) -> None:
    """A test shot was fired. `OSError`, if the disk keeps the file."""
    (results / OWED_FILE).unlink(missing_ok=True)
