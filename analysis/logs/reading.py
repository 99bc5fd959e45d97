"""Log files into two tables. A file that breaks a rule is left out whole, and the reason stands in `problems`."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import pandas as pd

from analysis.logs.batch import read_batch
from analysis.logs.column_map import ColumnMap
from analysis.logs.files import ENDINGS, Problem, code_in_name, find_logs, read_content, study_names
from analysis.logs.frames import Block, block_of_rows, joined
from analysis.logs.mapped import MappedLog, is_recoils, read_mapped
from analysis.logs.rules import BadLogError, check_table, records
from experiments.study import register

__all__ = ["Logs", "Problem", "Track", "read_logs"]

_BATCH_BYTES = 4 << 20
"""So much is checked at once: enough for speed, and little enough for the cache."""

_BATCHES_AHEAD = 4
"""So many are read from disk while others are checked."""

_LOGS_A_FILE = 1 << 20
"""Numbers of logs are so far apart from file to file: a mapped file may hold several."""

Track = Callable[[Sequence[Path]], Iterable[Path]]
Quick = tuple[list[Block], dict[int, str]]
"""What `read_batch` gives back."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Logs:
    """The rows of all good files, with the columns of `experiments.record.columns` and the study; empty cells are NA.

    With several studies a participant is `study/code`: the same code in another study is another person.
    """

    trials: pd.DataFrame
    ratings: pd.DataFrame
    problems: tuple[Problem, ...]
    files: tuple[Path, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Waiting:
    """A file, the folder that stands for its study, and its content, or why there is none."""

    file: Path
    path: str
    study: str
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
    studies: dict[int, str] = field(default_factory=dict)
    """The study's folder of each good log."""
    codes: dict[int, str] = field(default_factory=dict)
    firsts: dict[tuple[str, str, str], int] = field(default_factory=dict)
    """The first log of each study, experiment and code, upper and lower case alike."""
    files: dict[int, Path] = field(default_factory=dict)
    """The files of good logs, numbered."""
    count: int = 0

    def refuse(self, file: Path, bad: BadLogError) -> None:
        """Note why a file is left out."""
        self.problems.append(Problem(file=file, line=bad.line, column=bad.column, message=bad.message))

    def admit(self, number: int, one: _Waiting, study: str, experiment: str, code: str) -> None:
        """Take a participant's log of an experiment, or note why it is left out."""
        try:
            _check_admitted(one, code)
            self._check_new(study, experiment, code, number)
        except BadLogError as bad:
            self.refuse(one.file, bad)
        else:
            self.studies[number], self.codes[number] = study, code
            self.files[number // _LOGS_A_FILE] = one.file

    def _check_new(self, study: str, experiment: str, code: str, number: int) -> None:
        first = self.firsts.setdefault((study, experiment, code.casefold()), number)
        if first != number:
            there = self.codes[first]
            name = f"participant {code!r}" if code == there else f"participant {code!r} (there {there!r})"
            rule = "(rule: one log a participant and experiment, upper and lower case alike)"
            message = f"{name} has a {experiment} log already in {self.files[first // _LOGS_A_FILE]} {rule}"
            raise BadLogError(message, None, "participant_id")


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
    for waiting, (blocks, codes) in _quickly_checked(_batches(found, track)):
        _admit(reading, waiting, blocks, codes)
    return _logs(reading)


def _batches(found: Mapping[str, str], track: Track) -> Iterator[list[_Waiting]]:
    """The files' contents, read in turn."""
    waiting: list[_Waiting] = []
    size = 0
    for (path, study), file in zip(found.items(), track([Path(path) for path in found]), strict=True):
        waiting.append(_Waiting(file=file, path=path, study=study, content=_content(path)))
        size += len(waiting[-1].whole)
        if size >= _BATCH_BYTES:
            yield waiting
            waiting, size = [], 0
    yield waiting


def _quickly_checked(batches: Iterable[list[_Waiting]]) -> Iterator[tuple[list[_Waiting], Quick]]:
    """Each batch with what is surely right of it; on all processors, for Arrow keeps none of them to itself."""
    ahead: deque[tuple[list[_Waiting], Future[Quick]]] = deque()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for waiting in batches:
            names = [code_in_name(one.path) for one in waiting]
            ahead.append((waiting, pool.submit(read_batch, [one.whole for one in waiting], names)))
            if len(ahead) > _BATCHES_AHEAD:
                batch, quick = ahead.popleft()
                yield batch, quick.result()
        yield from ((batch, quick.result()) for batch, quick in ahead)


def _logs(reading: _Reading) -> Logs:
    names = study_names(folder for folder in set(reading.studies.values()) if Path(folder).is_absolute())
    studies = {number: names.get(study, study) for number, study in reading.studies.items()}
    return Logs(
        trials=joined("direction", reading.blocks, studies),
        ratings=joined("preference", reading.blocks, studies),
        problems=tuple(reading.problems),
        files=tuple(reading.files.values()),
    )


def _content(path: str) -> bytes | BadLogError:
    try:
        return read_content(path)
    except BadLogError as bad:
        return bad


def _admit(reading: _Reading, waiting: Sequence[_Waiting], blocks: Sequence[Block], codes: Mapping[int, str]) -> None:
    """Add files to what was read: those that surely are right with their participants' codes, the others with care."""
    experiments = {number: block.experiment for block in blocks for number in block.log.tolist()}
    reading.blocks += (replace(block, log=(block.log + reading.count) * _LOGS_A_FILE) for block in blocks)
    for number, one in enumerate(waiting):
        if number in codes:
            place = (reading.count + number) * _LOGS_A_FILE
            reading.admit(place, one, one.study, experiments[number], codes[number])
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
        reading.admit(place, one, log.study or one.study, log.table.experiment, log.code)


def _careful(one: _Waiting, mapping: ColumnMap | None) -> list[MappedLog]:
    """The logs of a file that is in doubt: one, if it is Recoil's."""
    if isinstance(one.content, BadLogError):
        raise one.content
    if mapping is not None and not is_recoils(one.content):
        return read_mapped(one.content, one.file.name, mapping)
    table = check_table(records(one.content), code_in_name(one.path))
    return [MappedLog(study=None, code=str(table.rows[0]["participant_id"]), table=table)]


def _check_admitted(one: _Waiting, code: str) -> None:
    """An exclusion in the register beside the participants' folders keeps their logs out, with its reason."""
    results = one.path.rpartition(os.sep)[0].rpartition(os.sep)[0] or str(one.file.parent.parent)
    reason = _exclusions(results).get(code)
    if reason is not None:
        raise BadLogError(f"participant {code} is excluded: {reason} (`recoil study` readmits them)")


@lru_cache(maxsize=64)
def _exclusions(results: str) -> dict[str, str]:
    """Who is excluded in a results folder, as far as its register can be read."""
    members = register.read(Path(results)).members
    return {code: member.excluded for code, member in members.items() if member.excluded is not None}
