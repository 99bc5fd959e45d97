"""A study that was frozen as its runs are found: by their journals, given to an analysis or not."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

from analysis.logs.files import ARCHIVE_FILE
from analysis.logs.journals import RunFile, journal_of, run_file
from analysis.logs.reading import Logs
from experiments.record import journal, storage
from experiments.record.journal import Head, JournalError
from experiments.record.lines import ending_of
from experiments.record.names import journals
from experiments.study.folders import freeze_status
from experiments.study.preregistration import Chain, FreezeStatus, read_chain
from experiments.study.register import Register, read_register
from experiments.study.study import RunProgress, RunState


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundRun:
    """A run by its journal: the first record, and when it came to its end, if the last one says that it did."""

    file: RunFile
    head: Head
    ended_utc: str

    @property
    def finished(self) -> bool:
        """Whether it came to its end."""
        return bool(self.ended_utc)

    @property
    def code(self) -> str:
        """Whose it is."""
        return self.file.participant

    @property
    def progress(self) -> RunProgress:
        """How far it came, and when, where that was the world's time."""
        state: RunState = "done" if self.finished else "in progress"
        began = "" if self.head.clock == "virtual" else self.head.utc
        return RunProgress(experiment=self.file.experiment, state=state, began_utc=began, last_utc=self.ended_utc)


@dataclass(frozen=True, kw_only=True)
class FoundStudy:
    """One study as it was found: its register, its runs in the order in which they began, and how it stands.

    `blank`: runs that were killed before anything was acknowledged; `unread`: those whose journal cannot be read.
    `strangers`: the journals of whoever else has runs, as synthetic participants beside people. `elsewhere`: runs that
    lie in the study's results and were not given to the analysis; `unread_elsewhere` as `unread`.
    """

    results: Path
    logs: Logs
    stand: FreezeStatus
    registered: Register
    runs: tuple[FoundRun, ...]
    blank: tuple[RunFile, ...]
    unread: tuple[RunFile, ...]
    strangers: frozenset[str]
    elsewhere: tuple[FoundRun, ...]
    unread_elsewhere: tuple[RunFile, ...]

    @classmethod
    def at(cls, results: Path, logs: Logs, runs: Sequence[RunFile]) -> FoundStudy | None:
        """`None` of a study that was never frozen, and of an archive, which has not what it is held against."""
        folder = logs.folder_of(str(results))
        if (folder / ARCHIVE_FILE).exists():
            return None
        chain = read_chain(folder)
        if not (chain.every or chain.problems or any(_names_one(run.path) for run in runs)):
            return None
        given = _given(results, logs, runs)
        read = [(run, _read(run)) for run in given.values()]
        began = [one for _, one in read if isinstance(one, FoundRun)]
        carried = [(one.head.plan.participant_id, one.head.preregistration_sha256) for one in began]
        mine = [one for one in began if logs.kind == "synthetic" or one.head.participant == "person"]
        whose = "synthetic" if logs.kind == "synthetic" else "person"
        others = [(run, _read(run)) for run in _not_given(results, logs, given)]
        return cls(
            results=results,
            logs=logs,
            stand=freeze_status(folder, carried),
            registered=read_register(results),
            runs=tuple(sorted(mine, key=lambda one: one.head.utc)),
            blank=tuple(run for run, one in read if one == "blank"),
            unread=tuple(run for run, one in read if one == "unread"),
            strangers=frozenset(real_place(one.file.path) for one in began if one not in mine),
            elsewhere=tuple(one for _, one in others if isinstance(one, FoundRun) and one.head.participant == whose),
            unread_elsewhere=tuple(run for run, one in others if one == "unread"),
        )

    @property
    def chain(self) -> Chain:
        """Its preregistrations."""
        return self.stand.chain

    @cached_property
    def excluded(self) -> dict[str, str]:
        """Who is excluded by hand, with the reason."""
        members = self.registered.members.items()
        return {code: member.excluded for code, member in members if member.excluded is not None}


def _names_one(path: str) -> bool:
    """Whether a journal names a preregistration: a look that is cheap enough for ten thousand of them."""
    try:
        return b'"preregistration_sha256":' in storage.first_line(path)
    except OSError:
        return False


def _given(results: Path, logs: Logs, runs: Iterable[RunFile]) -> dict[str, RunFile]:
    """By the place of its journal every run that the analysis knows, also where its table alone was given."""
    found = {real_place(run.path): run for run in runs}
    for place in map(real_place, map(journal_of, logs.paths)):
        run = run_file(place, str(results))
        if run is not None and Path(place).parent.parent == results:
            found.setdefault(place, run)
    return found


def _not_given(results: Path, logs: Logs, given: Collection[str]) -> Sequence[RunFile]:
    """The runs that it does not know."""
    known = {*given, *(real_place(journal_of(str(problem.file))) for problem in logs.problems)}
    there = map(str, journals(results))
    return [file for path in there if path not in known and (file := run_file(path, str(results)))]


def real_place(path: str) -> str:
    """A file by its real folder; its own name stays, also where it is a link."""
    folder, name = os.path.split(path)
    return f"{os.path.realpath(folder)}{os.sep}{name}"


def _read(file: RunFile) -> FoundRun | Literal["blank", "unread"]:
    path = Path(file.path)
    try:
        data = journal.journal_bytes(path)
        head = journal.head_of(path, data)
    except JournalError:  # why it cannot be read is said elsewhere
        return "unread"
    return "blank" if head is None else FoundRun(file=file, head=head, ended_utc=ending_of(data)[-1])
