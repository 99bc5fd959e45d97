"""The journals beside logs: whether a table is what its journal says, and the runs that have no table to read."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, NamedTuple

from analysis.logs.files import FULL_ONSET, BadLogError, Problem
from device.messages import first_few, how_many
from experiments.design.plan import Plan
from experiments.record import journal, storage
from experiments.record.journal import JournalError
from experiments.record.lines import ending_of
from experiments.record.names import JOURNAL_NAME, misnamed, shots_path
from experiments.record.tables import FILE_SUFFIX, DataKind
from experiments.study.folders import data_of

RunKind = Literal["run", "practice", "set aside"]
NOT_FINISHED = "its run is not finished"
"""How the remark on a log begins whose run was stopped before its end."""
_SUFFIXES = tuple(f"_{suffix}" for suffix in FILE_SUFFIX.values())


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFile:
    """A run by the name of its journal: whose, of which experiment, in which folder.

    `data`: of a practice and of a run that was set aside whose data it has, where its journal says so.
    """

    path: str
    participant: str
    experiment: str
    kind: RunKind
    study: str
    data: DataKind | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BegunRun:
    """A run that has no table and is not finished: how far it has come, and whose data it gives, as far as known."""

    file: RunFile
    answered: int
    planned: int
    data: DataKind | None = None

    @property
    def far(self) -> str:
        """How far it has come, in words."""
        return f"{self.answered} of {how_many(self.planned, 'trial')}" if self.planned else "nothing was acknowledged"

    @property
    def remedy(self) -> str:
        """How to go on, or to have a table of what is there."""
        go_on = f"`recoil run ... --participant {self.file.participant} --resume`"
        return f"go on with {go_on}, or make a table of what is there with `recoil rebuild {self.file.path}`"

    def __str__(self) -> str:
        run = self.file
        what = f"participant {run.participant} has begun {run.experiment} and not finished it ({self.far})"
        return f"{run.path}: {what}; {self.remedy}"


def run_file(path: str, study: str) -> RunFile | None:
    """The run whose journal has this name; `None` if it is that of no journal."""
    found = JOURNAL_NAME.search(path)
    if found is None:
        return None
    kind: RunKind = "practice" if found[3] else "set aside" if found[4] else "run"
    return RunFile(path=path, participant=found[1], experiment=found[2], kind=kind, study=study)


def with_data(run: RunFile) -> RunFile:
    """A practice or a run that was set aside with whose data it has; of other runs their logs say it."""
    with suppress(JournalError, OSError):
        head = None if run.kind == "run" else journal.head_of(Path(run.path), storage.first_line(run.path))
        return run if head is None else replace(run, data=data_of(head))
    return run


def journal_of(path: str) -> str:
    """The journal that belongs beside a table; a journal itself."""
    if path.endswith(journal.ENDING):
        return path
    stem = path.rpartition(".")[0] if "." in path else path
    suffix = next((one for one in _SUFFIXES if stem.endswith(one)), "")
    return f"{stem.removesuffix(suffix)}{journal.ENDING}"


def shots_beside(log: Path) -> Path:
    """Where the table of shots belongs beside a log, if a sensor measured them."""
    return shots_path(Path(journal_of(str(log))))


def without_table(runs: Iterable[RunFile], tables: Iterable[str]) -> list[RunFile]:
    """The runs, neither practices nor set aside, whose table is not among these."""
    of_runs = [run for run in runs if run.kind == "run"]
    there = {journal_of(path) for path in tables} if of_runs else set[str]()
    return [run for run in of_runs if run.path not in there]


def made_again(run: RunFile) -> bytes | BegunRun:
    """The table of a finished run, made from its journal; how far one has come that is not. `BadLogError`: neither."""
    from experiments.record import rebuild  # noqa: PLC0415 - slow, and of tables that are as they were none is made

    try:
        contents = journal.begun(Path(run.path))
        if contents is None:
            return BegunRun(file=run, answered=0, planned=0)
        check_journals_name(run.path, contents.plan)
        if not contents.finished:
            done = rebuild.trials_answered(contents)
            return BegunRun(file=run, answered=done, planned=len(contents.plan.trials), data=data_of(contents.head))
        return rebuild.table(contents)
    except JournalError as error:
        raise BadLogError(f"its table is missing, and the journal is no help: {_without(run.path, error)}") from error


def check_journals_name(path: str, plan: Plan, called: str = "") -> None:
    """`BadLogError` for a journal that lies under another run's name; `called`: as what its table knows it."""
    if said := misnamed(Path(path), plan):
        raise BadLogError(f"{called}{said}", experiment=plan.experiment)


class Beside(NamedTuple):
    """The journal beside a table: what there is to say of it, empty if all is well, and the hash of its setup.

    `original`: of a redacted one the SHA-256 of the first line of the journal that it was made from. `laws`: the hash
    of how synthetic people answer.
    """

    said: str
    setup: str = ""
    original: str = ""
    laws: str = ""


def compared(path: str, content: bytes) -> Beside | None:
    """The journal of a table; `None` if there is none. `BadLogError`: the table is not what the journal says."""
    where = journal_of(path)
    if not os.access(where, os.F_OK):  # of many thousands, much quicker than an exception
        return None
    try:
        data = storage.read_whole(where)
    except OSError as error:
        return Beside(f"its journal cannot be read ({error.strerror}), so nothing proves the table")
    return journal_beside(data, path, content)


def journal_beside(data: bytes, path: str, content: bytes) -> Beside:
    """The journal of a table, by its bytes. Raises as `compared`."""
    said = compared_with(data, path, content)
    laws = hashlib.sha256(_in_head(_LAWS, data)).hexdigest()
    return Beside(said, _in_head(_SETUP, data).decode(), _in_head(_ORIGINAL, data).decode(), laws)


_SETUP = re.compile(rb'"setup_sha256":"([0-9a-f]{64})"')
_ORIGINAL = re.compile(rb'"redacted_from":\{"format":1,"first_line_sha256":"([0-9a-f]{64})"')


_LAWS = re.compile(rb'"laws":(\{.*?),"setup":\{')


def _in_head(there: re.Pattern[bytes], data: bytes) -> bytes:
    """What the group of a pattern finds in the first line of a journal; empty if that is nothing."""
    found = there.search(data, 0, data.find(b"\n"))
    return found[1] if found else b""


def begins_with(path: str, line_sha256: str) -> bool:
    """Whether the first line of a journal has this hash."""
    with suppress(OSError):
        return hashlib.sha256(storage.read_whole(path).partition(b"\n")[0]).hexdigest() == line_sha256
    return False


def compared_with(data: bytes, path: str, content: bytes) -> str:
    """What there is to say of a journal, by its bytes; empty if all is well. Raises as `compared`."""
    where = journal_of(path)
    if where == path:
        return f"its table is missing, so it was made again from this journal; `recoil rebuild {path}` writes it"
    of_table, of_itself, _ = ending_of(data)
    if of_table and of_table != hashlib.sha256(content).hexdigest():
        raise _edited(where, data, content, f"edited since the run; `recoil rebuild {where}` gives the original")
    return "" if of_itself else _compared_whole(where, content, data, finished=bool(of_table))


def _edited(where: str, data: bytes, content: bytes, otherwise: str) -> BadLogError:
    """What is said of a table that its journal does not make: whose the journal is, if it is another run's."""
    from experiments.record import rebuild  # noqa: PLC0415 - slow, and of tables that are as they were none is made

    name = Path(where).name
    with suppress(JournalError):  # what is wrong with the head is no news beside a table that differs
        head = journal.head_of(Path(where), data)
        if head is not None and (said := misnamed(Path(where), head.plan)):
            return BadLogError(f"the journal beside it, {name}, {said}; nothing proves this table")
        contents = journal.contents_of(Path(where), data)
        if contents is not None and _of_another_run(rebuild.table(contents), content):
            other = f"is of another run of {contents.plan.participant_id}, as of another study: no onset is the same"
            return BadLogError(
                f"the journal beside it, {name}, {other} (rule: a run's table and journal stay together); put the "
                "journal of this table here and that one back to its own"
            )
    return BadLogError(otherwise)


def _of_another_run(made: bytes, content: bytes) -> bool:
    """Whether two tables have onsets and share none; an edited one keeps those of its run."""
    ours, theirs = ({*FULL_ONSET.findall(some)} for some in (made, content))
    return bool(ours and theirs) and ours.isdisjoint(theirs)


def _compared_whole(where: str, content: bytes, data: bytes, *, finished: bool) -> str:
    """The same of a journal that is not finished, or that was changed: every record is read."""
    from experiments.record import rebuild  # noqa: PLC0415 - slow, and of tables that are as they were none is made

    try:
        contents = journal.contents_of(Path(where), data)
        if contents is None:
            return "its journal holds no whole record, so nothing proves the table"
        made = rebuild.table(contents)
    except JournalError as error:
        known = "the table is still the one of the finished run" if finished else "so nothing proves the table"
        return f"its journal cannot be trusted, {known}: {_without(where, error)}"
    if made != content:
        raise _edited(where, data, content, _differs(where, rebuild.rows_beyond(content, made), finished=finished))
    if finished:
        return "its journal was changed and says the same as before"
    return f"{NOT_FINISHED}; the table holds what was answered so far, and `recoil run ... --resume` goes on"


def _differs(where: str, beyond: int, *, finished: bool) -> str:
    """What is said of a table that is not what its journal says; `beyond`: so many rows hold more, the rest agrees."""
    if beyond and not finished:
        return (
            f"holds more than its journal, which is cut short: nothing proves {how_many(beyond, 'row')} of it, and "
            f"the others agree; put the whole journal, as from a backup, in the place of {Path(where).name}; "
            "do not rebuild the table, which would lose these"
        )
    how = f"edited, or the run went on since; `recoil rebuild {where}` makes it anew"
    return f"is not what its journal says: {how}"


def _without(path: str, error: JournalError) -> str:
    return str(error).removeprefix(f"{path}: ").splitlines()[0]


def gone(logs: Iterable[tuple[str, str, bool]]) -> list[Problem]:
    """Of each study's folder where some logs have a journal, those that have none. `logs`: folder, code, has one."""
    return [_lacking(study, there) for study, there in _by_study(logs).items() if there[True] and there[False]]


def all_gone(logs: Iterable[tuple[str, str, bool]]) -> list[Problem]:
    """The studies' folders in which no log has a journal; whoever was sent tables alone has done nothing wrong."""
    return [_lacking(study, there) for study, there in _by_study(logs).items() if not there[True]]


def _by_study(logs: Iterable[tuple[str, str, bool]]) -> dict[str, dict[bool, list[str]]]:
    """By folder the codes of the logs with a journal, and without."""
    by_study: dict[str, dict[bool, list[str]]] = {}
    for study, code, proven in logs:
        by_study.setdefault(study, {True: [], False: []})[proven].append(code)
    return by_study


def _lacking(study: str, there: dict[bool, list[str]]) -> Problem:
    message = _gone(there[False], sum(map(len, there.values())))
    return Problem(file=Path(study), line=None, column=None, message=message)


def _gone(codes: list[str], count: int) -> str:
    if len(codes) == count:
        has = "the log has no journal" if count == 1 else f"none of the {count} logs has a journal"
        return f"{has} beside it, which every run writes, so nothing proves what is there; put the journals back"
    return (
        f"{len(codes)} of {count} logs have no journal beside them, as the others have, so nothing proves them: "
        f"{first_few([*dict.fromkeys(codes)], 20)}; put the journals back"
    )
