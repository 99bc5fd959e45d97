"""Log files into two tables. A file that breaks a rule is left out whole, and the reason stands in `problems`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.column_map import ColumnMap
from analysis.log_batch import Source, read_batch
from analysis.log_files import ENDINGS, Found, Problem, code_in_name, find_logs, read_content
from analysis.log_frames import Block, block_of_rows, joined
from analysis.log_records import records
from analysis.log_rules import BadLogError, check_table
from analysis.mapped_logs import MappedLog, is_recoils, read_mapped
from analysis.studies import study_names
from experiments import register

__all__ = ["Logs", "Problem", "Track", "read_logs"]

_BATCH_BYTES = 2 << 20
"""So much is read before it is checked: enough for speed, and little enough for the cache."""

_LOGS_A_FILE = 1 << 20
"""Numbers of logs are so far apart from file to file: a mapped file may hold several."""

Track = Callable[[Sequence[Path]], Iterable[Path]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Logs:
    """The rows of all good files, with the columns of `experiments.columns` and the study; empty cells are NA.

    With several studies a participant is `study/code`: the same code in another study is another person.
    """

    trials: pd.DataFrame
    ratings: pd.DataFrame
    problems: tuple[Problem, ...]
    files: tuple[Path, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Log:
    """One participant's log of an experiment, as far as it tells who was where."""

    file: Path
    study: str
    experiment: str
    code: str

    @property
    def key(self) -> tuple[str, str, str]:
        """There may be one such log."""
        return self.study, self.experiment, self.code.casefold()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Waiting:
    """A file's content, or why there is none."""

    log: Found
    file: Path
    content: bytes | BadLogError

    @property
    def whole(self) -> bytes:
        """The content, empty if there is none."""
        return self.content if isinstance(self.content, bytes) else b""


@dataclass(slots=True, kw_only=True)
class _Reading:
    """What was read so far. Logs are numbered in the order of their files."""

    problems: list[Problem]
    mapping: ColumnMap | None
    blocks: list[Block] = field(default_factory=list)
    good: dict[int, _Log] = field(default_factory=dict)
    keys: dict[tuple[str, str, str], _Log] = field(default_factory=dict)
    count: int = 0

    def refuse(self, file: Path, bad: BadLogError) -> None:
        """Note why a file is left out."""
        self.problems.append(Problem(file=file, line=bad.line, column=bad.column, message=bad.message))

    def admit(self, number: int, log: _Log) -> None:
        """Take a log, or note why it is left out."""
        try:
            _check_admitted(log)
            _check_new(log, self.keys.setdefault(log.key, log))
        except BadLogError as bad:
            self.refuse(log.file, bad)
        else:
            self.good[number] = log


def read_logs(paths: Iterable[str | Path], track: Track = iter, mapping: ColumnMap | None = None) -> Logs:
    """The logs in `paths`, files or folders (searched through for `*_trials.csv` and `*_ratings.csv`).

    Files with `practice` in their name are not read. A bad file, a missing path or a second log of the same participant
    for an experiment in a study is a `Problem`, never an exception. `track` is given the files and gives them back one
    by one: for a progress bar. With a `mapping`, files without the header of Recoil's own tables are read by it.
    """
    _exclusions.cache_clear()  # the register may have been written since
    endings = mapping.files_end_with if mapping else ()
    found, problems = find_logs([Path(path) for path in paths], (*ENDINGS, *endings))
    reading = _Reading(problems=problems, mapping=mapping)
    waiting: list[_Waiting] = []
    size = 0
    for log, file in zip(found, track([Path(log.path) for log in found]), strict=True):
        waiting.append(_Waiting(log=log, file=file, content=_content(log)))
        size += len(waiting[-1].whole)
        if size >= _BATCH_BYTES:
            _check(reading, waiting)
            waiting, size = [], 0
    _check(reading, waiting)
    return _logs(reading)


def _logs(reading: _Reading) -> Logs:
    folders = {log.study for log in reading.good.values()}
    names = study_names(folder for folder in folders if Path(folder).is_absolute())
    studies = {number: names.get(log.study, log.study) for number, log in reading.good.items()}
    return Logs(
        trials=joined("direction", reading.blocks, studies),
        ratings=joined("preference", reading.blocks, studies),
        problems=tuple(reading.problems),
        files=tuple({str(log.file): log.file for log in reading.good.values()}.values()),
    )


def _content(log: Found) -> bytes | BadLogError:
    try:
        return read_content(log.path)
    except BadLogError as bad:
        return bad


def _check(reading: _Reading, waiting: Sequence[_Waiting]) -> None:
    """Add files to what was read: all that surely are right at once, the others one by one."""
    sources = [Source(content=one.whole, code_in_name=code_in_name(one.log.path)) for one in waiting]
    blocks, codes = read_batch(sources)
    experiments = {number: block.experiment for block in blocks for number in np.unique(block.log).tolist()}
    for block in blocks:
        logs = (block.log + reading.count) * _LOGS_A_FILE
        reading.blocks.append(replace(block, log=logs))
    for number, one in enumerate(waiting):
        if number in codes:
            place = (reading.count + number) * _LOGS_A_FILE
            sure = _Log(file=one.file, study=one.log.study, experiment=experiments[number], code=codes[number])
            reading.admit(place, sure)
        else:
            _check_carefully(reading, one, reading.count + number)
    reading.count += len(waiting)


def _check_carefully(reading: _Reading, one: _Waiting, number: int) -> None:
    try:
        logs = _careful(one, reading.mapping)
    except BadLogError as bad:
        reading.refuse(one.file, bad)
        return
    for place, log in enumerate(logs, start=number * _LOGS_A_FILE):
        if isinstance(log.table, BadLogError):
            reading.refuse(one.file, log.table)
            continue
        reading.blocks.append(block_of_rows(log.table.experiment, log.table.rows, place))
        study = log.study or one.log.study
        reading.admit(place, _Log(file=one.file, study=study, experiment=log.table.experiment, code=log.code))


def _careful(one: _Waiting, mapping: ColumnMap | None) -> list[MappedLog]:
    """The logs of a file that is in doubt: one, if it is Recoil's."""
    if isinstance(one.content, BadLogError):
        raise one.content
    if mapping is not None and not is_recoils(one.content):
        return read_mapped(one.content, one.file.name, mapping)
    table = check_table(records(one.content), code_in_name(one.log.path))
    return [MappedLog(study=None, code=str(table.rows[0]["participant_id"]), table=table)]


def _check_admitted(log: _Log) -> None:
    """An exclusion in the register beside the participants' folders keeps their logs out, with its reason."""
    results = str(log.file).rpartition(os.sep)[0].rpartition(os.sep)[0] or str(log.file.parent.parent)
    reason = _exclusions(results).get(log.code)
    if reason is not None:
        raise BadLogError(f"participant {log.code} is excluded: {reason} (`recoil study` readmits them)")


@lru_cache(maxsize=64)
def _exclusions(results: str) -> dict[str, str]:
    """Who is excluded in a results folder, as far as its register can be read."""
    members = register.read(Path(results)).members
    return {code: member.excluded for code, member in members.items() if member.excluded is not None}


def _check_new(log: _Log, first: _Log) -> None:
    if first is not log:
        name = (
            f"participant {log.code!r}"
            if log.code == first.code
            else f"participant {log.code!r} (there {first.code!r})"
        )
        rule = "(rule: one log a participant and experiment, upper and lower case alike)"
        raise BadLogError(f"{name} has a {log.experiment} log already in {first.file} {rule}", None, "participant_id")
