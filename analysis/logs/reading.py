"""Log files into tables. Whoever's log breaks a rule is left out whole, and the reason stands in `problems`.

A finished run without a table is read from its journal. What was used, though there is something to say of it, stands
in `remarks`, and who has only begun in `begun`.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from analysis.logs.admission import LOGS_A_FILE, Batch, LogsSoFar, WaitingFile
from analysis.logs.design_logs import (
    DesignLog,
    DesignLogs,
    frozen_designs,
    is_of_design,
    logs_by_design,
    read_design_log,
)
from analysis.logs.doubles import told_by_design
from analysis.logs.doubtful_times import doubt_of_design
from analysis.logs.files import (
    ENDINGS,
    LONGEST_MAPPED,
    BadLogError,
    Problem,
    check_length,
    code_in_name,
    experiment_in_name,
    find_logs,
    read_content,
    results_above,
    study_names,
)
from analysis.logs.journals import (
    BegunRun,
    RunFile,
    all_gone,
    compared,
    gone,
    journal_of,
    made_again,
    run_file,
    without_table,
)
from analysis.logs.kinds import begun_by_kind, kind_of_design, kinds_there
from analysis.logs.names import MethodNames, names_beside
from analysis.logs.rules import Log, check_logs
from analysis.logs.suspicions import turned_round
from analysis.logs.texts import TextTable, is_recoils, joined, table_of_records, text_tables
from experiments.record import tables
from experiments.record.tables import DataKind
from experiments.study.folders import PlaceError
from experiments.study.preregistration import study_folder
from experiments.study.study import Member

if TYPE_CHECKING:
    from analysis.logs.column_map import ColumnMap, MappedLog

__all__ = ["Logs", "Problem", "Track", "read_logs"]

_BATCH_BYTES = 16 << 20
"""So much is checked at once: of smaller pieces, handing them from thread to thread costs a fifth of the reading."""

_BATCHES_AHEAD = 4
"""So many are read from disk while others are checked."""

Track = Callable[[Sequence[str]], Iterable[str]]
"""Is given the paths of the files and gives them back one by one, each as its reading begins."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Logs:
    """The rows of all good files, with the columns of `experiments.record.tables` and the study; empty cells are NA.

    With several studies a participant is `study/code`: the same code in another study is another person. All rows are
    of one `kind` of data; those of other kinds, if they were asked for, are logs of their own, `apart`.
    """

    trials: pd.DataFrame
    ratings: pd.DataFrame
    problems: tuple[Problem, ...]
    paths: tuple[str, ...]
    """The files that were read."""
    designs: tuple[DesignLogs, ...] = ()
    remarks: tuple[Problem, ...] = ()
    notes: tuple[Problem, ...] = ()
    """What is good to know of logs that are as they should be."""
    begun: tuple[BegunRun, ...] = ()
    runs: tuple[RunFile, ...] = ()
    """Every run whose journal was found, practices and those set aside too."""
    joined: tuple[tuple[str, Member], ...] = ()
    """Folder and entry of everyone in the registers of the folders that were read."""
    names: Mapping[str, str] = field(default_factory=dict)
    """Short names of the studies' folders."""
    methods: MethodNames = field(default_factory=MethodNames)
    """The order of methods and what they are called in print."""

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that were read."""
        return tuple(map(Path, self.paths))

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """The rows by experiment, of the two that have tables of their own."""
        return {"direction": self.trials, "preference": self.ratings}

    def person(self, study: str, code: str) -> str:
        """What a participant is called in the tables; where these hold one study alone, another's has its name."""
        names = set(self.names.values())
        apart = len(names) > 1 or (names and study not in self.names)
        return f"{self.names.get(study, Path(study).name)}/{code}" if apart else code

    def folder_of(self, results: str) -> Path:
        """The folder of a study: that beside its results as they were given, which may be a link to another disk."""
        given = {results_above(str(Path(path).absolute())) for path in (*self.paths, *(run.path for run in self.runs))}
        links = (folder for folder in sorted(given - {results}) if os.path.realpath(folder) == results)
        return study_folder(Path(next(links, results)), Path(results))

    mapped: bool = False
    """Whether some come from other programs, read by a map: they say of no plan."""
    kind: DataKind = "real"
    apart: tuple[Logs, ...] = ()


def read_logs(
    paths: Iterable[str | Path],
    track: Track = iter,
    mapping: ColumnMap | None = None,
    *,
    include_synthetic: bool = False,
) -> Logs:
    """The logs in `paths`, files or folders (searched through for `*_trials.csv` and `*_ratings.csv`).

    Files with `practice` in their name are not read. A bad file, a missing path or a second log of the same participant
    for an experiment in a study is a `Problem`, never an exception. `track` is given the files and gives them back one
    by one: for a progress bar. With a `mapping`, files without the header of Recoil's own tables are read by it.

    Data of people at a gun, at a simulated gun, and of synthetic participants are never put together: beside the first
    of these kinds that is there, logs of the others are problems; with `include_synthetic` they stand `apart`.
    """
    endings = mapping.files_end_with if mapping else ()
    files = find_logs([Path(path) for path in paths], (*ENDINGS, *endings))
    reading = LogsSoFar(problems=list(files.problems), given=files.given)
    runs = [run for path, study in files.journals.items() if (run := run_file(path, study))]
    made, begun = _without_tables(reading, without_table(runs, files.logs))
    every = {**files.logs, **{run.path: run.study for run in runs if run.path in made}}
    found = {path: study for path, study in every.items() if not is_of_design(path)}
    for waiting, batch in _checked_batches(_batches(found, track, made), mapping):
        reading.add(waiting, batch)
    designs = _designed(reading, {path: every[path] for path in every if path not in found}, track, len(found), made)
    runs = [*_by_own_experiment(runs, reading.problems)]
    reading.leave_copies(runs)
    reading.remarks += gone(reading.proven.values())
    kinds = kinds_there(reading.kinds[number] for number in reading.studies)
    if not include_synthetic:
        reading.keep_out(kinds[0])
    begun_of, of_others = begun_by_kind(begun, kinds if include_synthetic else kinds[:1], alone=not reading.studies)
    reading.problems += of_others
    told = mapping.method.names if mapping else MethodNames()
    parts = kinds if include_synthetic else kinds[:1]
    first, *apart = [_of_kind(reading, designs, kind, kinds[0], told) for kind in parts]
    runs_of = reading.runs_by_kind(runs, kinds[0])
    return replace(
        first,
        problems=tuple(sorted(reading.problems, key=_by_place)),
        remarks=(*reading.remarks, *reading.changed_setups(), *turned_round(first.trials, first.paths)),
        notes=tuple(all_gone(reading.proven.values())),
        begun=tuple(begun_of[kinds[0]]),
        runs=tuple(runs_of[kinds[0]]),
        joined=tuple(
            (os.path.realpath(where), one) for where, codes in reading.members.items() for one in codes.values()
        ),
        apart=tuple(replace(part, runs=tuple(runs_of[part.kind]), begun=tuple(begun_of[part.kind])) for part in apart),
    )


def _of_kind(
    reading: LogsSoFar, designs: dict[int, DesignLog], kind: DataKind, first: DataKind, told: MethodNames
) -> Logs:
    """The good logs of one kind of data; where nobody answered, they count as of the first."""
    mine = {number: study for number, study in reading.studies.items() if (reading.kinds[number] or first) == kind}
    names = study_names(folder for folder in set(mine.values()) if Path(folder).is_absolute())
    studies = {number: names.get(study, study) for number, study in mine.items()}
    by_design = _by_design(reading, {number: log for number, log in designs.items() if number in mine}, studies)
    used = {number // LOGS_A_FILE for number in mine}
    paths = {number: path for number, path in reading.paths.items() if number in used}
    trials, ratings = (joined(experiment, reading.blocks, studies) for experiment in tables.TABLES)
    methods = {str(method) for table in (trials, ratings) for method in table["method"].unique()}
    return Logs(
        trials=trials,
        ratings=ratings,
        methods=names_beside(paths.values(), methods, told),
        designs=by_design,
        problems=(),
        paths=tuple(paths.values()),
        names={study: names.get(study, study) for study in mine.values()},
        kind=kind,
        mapped=not reading.mapped.isdisjoint(mine),
    )


def _by_place(problem: Problem) -> tuple[str, int, str, str]:
    return str(problem.file), problem.line or 0, problem.column or "", problem.message


def _without_tables(reading: LogsSoFar, runs: Sequence[RunFile]) -> tuple[dict[str, bytes], list[BegunRun]]:
    """The tables of finished runs that lack one, by the paths of their journals; and the runs that are not finished."""
    made, begun = dict[str, bytes](), list[BegunRun]()
    for run in runs:
        try:
            found = made_again(run)
        except BadLogError as bad:
            reading.problems.append(bad.of(Path(run.path), run.participant, run.experiment, run.study))
        else:
            if isinstance(found, BegunRun):
                begun.append(found)
                reading.known(str(Path(run.path).parent.parent))
            else:
                made[run.path] = found
    return made, begun


def _by_own_experiment(runs: Iterable[RunFile], problems: Iterable[Problem]) -> Iterator[RunFile]:
    """The runs, each of the experiment that it is of, also where its files are named for another."""
    told = {journal_of(str(one.file)): one.experiment for one in problems if one.experiment}
    return (replace(run, experiment=told.get(run.path, run.experiment)) for run in runs)


def _designed(
    reading: LogsSoFar, found: Mapping[str, str], track: Track, first: int, made: Mapping[str, bytes]
) -> dict[int, DesignLog]:
    """The good logs of designs, numbered behind the others."""
    logs: dict[int, DesignLog] = {}
    for number, path in enumerate(track([*found]) if found else (), start=first):
        study = found[path]
        waiting = WaitingFile(number=number, path=path, study=study, content=made.get(path) or _content(path))
        try:
            log = read_design_log(path, waiting.content)
            of_design = Log(code=log.code, experiment=log.design.design)
            reading.kinds[number * LOGS_A_FILE] = kind_of_design(log)
            reading.admit(number * LOGS_A_FILE, waiting, of_design, study)
            reading.note(number * LOGS_A_FILE, waiting, of_design, log.journal)
            reading.doubt(waiting, of_design, doubt_of_design(log.design, log.rows), proven=True)
            logs[number * LOGS_A_FILE] = log
            if told := told_by_design(number * LOGS_A_FILE, log.design, log.rows):
                reading.told.setdefault(log.design.design, []).append(told)
        except BadLogError as bad:
            reading.problems.append(bad.of(Path(path), code_in_name(path) or "", experiment_in_name(path), study))
    return logs


def _by_design(reading: LogsSoFar, logs: Mapping[int, DesignLog], studies: Mapping[int, str]) -> tuple[DesignLogs, ...]:
    """The logs by design; one that was made with another design than the one that is analysed is left out."""
    several = len(set(studies.values())) > 1
    folders = {studies[number]: _study_of(reading.paths[number // LOGS_A_FILE]) for number in logs}
    frozen = {study: frozen_designs(folder) for study, folder in folders.items()}
    found, others = logs_by_design([(log, studies[number]) for number, log in logs.items()], frozen, several=several)
    for number, log in logs.items():
        why = others.get((studies[number], log.key))
        if why is not None:
            path = reading.paths.pop(number // LOGS_A_FILE)
            study = reading.studies[number]
            reading.problems.append(BadLogError(why).of(Path(path), log.code, log.design.design, study))
    return tuple(found)


def _study_of(path: str) -> Path:
    """The folder of the study that a log belongs to."""
    results = Path(results_above(os.path.abspath(path)))  # noqa: PTH100 - no link is read
    return study_folder(results, results)


def _batches(found: Mapping[str, str], track: Track, made: Mapping[str, bytes]) -> Iterator[list[WaitingFile]]:
    """The files' contents, read in turn, but for tables that were `made` of journals."""
    waiting: list[WaitingFile] = []
    size = 0
    for number, path in enumerate(track([*found])):
        content = made[path] if path in made else _content(path)
        waiting.append(WaitingFile(number=number, path=path, study=found[path], content=content))
        size += len(content) if isinstance(content, bytes) else 0
        if size >= _BATCH_BYTES:
            yield waiting
            waiting, size = [], 0
    yield waiting


def _content(path: str) -> bytes | BadLogError:
    try:
        return read_content(path)
    except BadLogError as bad:
        return bad


def _checked_batches(
    batches: Iterable[list[WaitingFile]], mapping: ColumnMap | None
) -> Iterator[tuple[list[WaitingFile], Batch]]:
    """Each batch with what is in it; on all processors, for Arrow keeps none of them to itself."""
    ahead: deque[tuple[list[WaitingFile], Future[Batch]]] = deque()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for waiting in batches:
            ahead.append((waiting, pool.submit(_checked, waiting, mapping)))
            if len(ahead) > _BATCHES_AHEAD:
                first, batch = ahead.popleft()
                yield first, batch.result()
        yield from ((waiting, batch.result()) for waiting, batch in ahead)


def _checked(waiting: Sequence[WaitingFile], mapping: ColumnMap | None) -> Batch:
    """The logs of some files: one a file, but for files that are mapped."""
    batch, tables = Batch(), list[TextTable]()
    contents: dict[int, bytes] = {}
    names: dict[int, str | None] = {}
    for one in waiting:
        number = one.number * LOGS_A_FILE
        try:
            if isinstance(one.content, BadLogError):
                raise one.content
            if mapping is not None and not is_recoils(one.content):
                check_length(one.content, LONGEST_MAPPED)
                tables.append(_mapped(batch, number, mapping.logs_in(one.content, one.file.name), mapping))
            else:
                check_length(one.content)
                batch.journals[number] = compared(one.path, one.content)
                contents[number], names[number] = one.content, code_in_name(one.path)
        except BadLogError as bad:
            batch.logs[number] = bad
    own, faults = text_tables(contents)
    batch.logs |= faults
    for texts in (*own, *tables):
        try:
            block, logs = check_logs(texts, names, own=texts not in tables)
        except BadLogError as bad:
            batch.logs |= dict.fromkeys(texts.logs, bad)
        else:
            batch.take(block, logs if mapping is None or texts in own else _by_own_columns(logs, mapping))
    return batch


def _by_own_columns(logs: Mapping[int, Log | BadLogError], mapping: ColumnMap) -> dict[int, Log | BadLogError]:
    """What is wrong with logs of another program names the columns of their own file."""
    own = mapping.own_columns
    return {
        number: BadLogError(log.message, log.line, own.get(log.column or "", log.column))
        if isinstance(log, BadLogError)
        else log
        for number, log in logs.items()
    }


def _mapped(batch: Batch, first: int, logs: Sequence[MappedLog], mapping: ColumnMap) -> TextTable:
    """The logs of a file that Recoil did not write, numbered from `first`, as far as they could be mapped."""
    records = {}
    for number, log in enumerate(logs, start=first):
        batch.mapped[number] = log
        if isinstance(log.records, BadLogError):
            batch.logs[number] = log.records
        else:
            records[number] = log.records
    return table_of_records(tables.names(mapping.experiment), records)


def refuse_nothing(paths: Sequence[Path], logs: Logs) -> None:
    """`PlaceError` where there is no usable log at all, with every reason and what to do."""
    if not logs.paths:
        reasons = [*map(str, logs.problems), *map(str, logs.begun)]
        raise PlaceError("\n".join(["no usable log in " + ", ".join(map(str, paths)), *reasons]))
