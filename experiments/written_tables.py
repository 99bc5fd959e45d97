"""The tables of a run on the disk, made from its journal as it was read back."""

from __future__ import annotations

from experiments.live_run import RunStopped
from experiments.record import replay, storage
from experiments.record.dictionary import design_dictionary
from experiments.record.journal import Contents
from experiments.record.rebuild import began_with, shots_table, table
from experiments.session.steps import Answered
from experiments.study.folders import Place, PlaceError


def write_tables(place: Place, contents: Contents) -> int:
    """Write the tables that a journal makes, and their dictionary; the answers in it. `OSError`: they cannot be."""
    storage.write_whole(place.table, table(contents))
    design = began_with(contents.head)
    measured = shots_table(contents)
    if measured is not None:
        storage.write_whole(place.shots, measured)
    storage.write_whole(place.results / f"task-{design.design}_columns.md", design_dictionary(design).encode())
    return answers_in(contents)


def tables_of_finished(place: Place, contents: Contents) -> int:
    """As `write_tables`, of a run that is finished. `PlaceError`: they cannot be written, by which nothing is lost."""
    try:
        return write_tables(place, contents)
    except OSError as error:
        raise PlaceError(f"the run is finished, and {_unwritten(place, error)}") from error


def tables_of_stopped(place: Place, contents: Contents, why: str, *, halted: bool) -> int:
    """As `write_tables`, of a run that was stopped. `RunStopped`: they cannot be written, by which nothing is lost."""
    try:
        return write_tables(place, contents)
    except OSError as error:
        stop = RunStopped(f"{why}; {_unwritten(place, error)}")
        stop.saved, stop.halted = answers_in(contents), halted
        raise stop from error


def _unwritten(place: Place, error: OSError) -> str:
    mend = "free some space" if error.errno in storage.DISK_FULL else "see to that"
    return (
        f"every answer is in the journal, but its table could not be written ({error.filename or place.table}: "
        f"{error.strerror}): {mend}, and `recoil rebuild {place.journal}` writes it"
    )


def answers_in(contents: Contents) -> int:
    """How many answers a journal holds."""
    return sum(isinstance(word, Answered) for _, word in replay.history(contents))
