"""The log files in folders, the study each belongs to under a short name, and their unedited content."""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath

from device.words import RecoilError
from experiments.record import tables

ENDINGS = tuple(f"_{suffix}.csv" for suffix in tables.FILE_SUFFIX.values())
_BEHIND_STEM = re.compile(rf"(_({'|'.join(tables.FILE_SUFFIX.values())}))?\.[^.]*$")
_CODE = re.compile(r"sub-([^_]+)_")
_READ_ONLY = os.O_RDONLY | getattr(os, "O_BINARY", 0)
_PIECE_BYTES = 1 << 16
_TAIL_BYTES = (1 << 12, 1 << 16)
"""As much of a journal as mostly, and as surely, holds its last record."""


class BadLogError(RecoilError):
    """A log that breaks a rule: what, and where. It never leaves the room."""

    def __init__(self, message: str, line: int | None = None, column: str | None = None) -> None:
        super().__init__(message)
        self.message, self.line, self.column = message, line, column


_NO_FILE = "a link that leads to no file; fetch what it stands for (`git annex get`, `datalad get`), or delete it"


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """A file that was left out, the place, and why."""

    file: Path
    line: int | None
    column: str | None
    message: str

    def __str__(self) -> str:
        line = "" if self.line is None else f", line {self.line}"
        column = "" if self.column is None else f", column {self.column}"
        return f"{self.file}{line}{column}: {self.message}"


def find_logs(paths: Sequence[Path], endings: tuple[str, ...] = ENDINGS) -> tuple[dict[str, str], list[Problem]]:
    """The files in `paths`, each once, with the folder that stands for its study; files in folders by their endings.

    Practice is left out.
    """
    found: dict[str, tuple[str, str]] = {}
    problems: list[Problem] = []
    for path in paths:
        logs = _in_folder(path, endings, problems) if path.is_dir() else {os.path.realpath(path): str(path)}
        if not logs or not path.exists():
            kinds = " or ".join(f"*{ending}" for ending in endings)
            reason = f"no {kinds} in this folder" if path.is_dir() else "no such file or folder"
            problems.append(Problem(file=path, line=None, column=None, message=reason))
            continue
        top = os.path.realpath(path if path.is_dir() else path.parent)
        for real, log in logs.items():
            found.setdefault(real, (log, _study(real, top)))
    return {log: study for log, study in found.values() if "practice" not in _name(log).lower()}, problems


def names_below(files: Iterable[Path]) -> dict[Path, Path]:
    """Files by their path below the folder that holds them all: results say nothing of the machine they come from."""
    every = [*files]
    folders = {file.absolute().parent for file in every}
    root = Path(os.path.commonpath(folders)) if folders else Path()
    return {file: file.absolute().relative_to(root) for file in every}


def _name(path: str) -> str:
    return path.rpartition(os.sep)[2]


def _study(real: str, top: str) -> str:
    """The results folder that holds the file's `sub-<ID>` folder; without one, the folder that was asked for."""
    results, _, name = real.rpartition(os.sep)[0].rpartition(os.sep)
    return results or os.sep if name.startswith("sub-") else top


def _in_folder(folder: Path, endings: tuple[str, ...], problems: list[Problem]) -> dict[str, str]:
    """The files below a folder by their real paths, in the order of their paths. Linked folders are not entered."""
    logs: list[tuple[str, str]] = []
    waiting = [(str(folder), os.path.realpath(folder))]
    while waiting:
        place, real = waiting.pop()
        try:
            with os.scandir(place) as entries:
                for entry in entries:
                    if entry.is_dir(follow_symlinks=False):
                        waiting.append((entry.path, f"{real}{os.sep}{entry.name}"))
                    elif entry.name.endswith(endings):
                        target = os.path.realpath(entry.path) if entry.is_symlink() else f"{real}{os.sep}{entry.name}"
                        if entry.is_file():
                            logs.append((entry.path, target))
                        else:
                            problems.append(Problem(file=Path(entry.path), line=None, column=None, message=_NO_FILE))
        except OSError as error:
            reason = f"cannot be read: {error.strerror or error}"
            problems.append(Problem(file=Path(place), line=None, column=None, message=reason))
    found: dict[str, str] = {}
    for path, real in sorted(logs, key=lambda log: log[0].split(os.sep)):  # noqa: PTH206 - of many thousands
        found.setdefault(real, path)
    return found


def code_in_name(path: str) -> str | None:
    """The participant's code in a file's name, if there is one.

    >>> code_in_name("results/sub-P01/sub-P01_task-direction_trials.csv"), code_in_name("log.csv")
    ('P01', None)
    """
    match = _CODE.match(_name(path))
    return match[1] if match else None


def read_content(path: str) -> bytes:
    """A file's bytes; `BadLogError` if it cannot be read or is not the one that its finished run left."""
    try:
        content = _bytes(path)
    except OSError as error:
        raise BadLogError(f"cannot be read: {error.strerror or error}") from error
    _check_unedited(path, content)
    return content


def _bytes(path: str) -> bytes:
    """A file's bytes with as few calls as can be: a log is mostly one piece."""
    descriptor = os.open(path, _READ_ONLY)
    try:
        content = os.read(descriptor, _PIECE_BYTES)
        while piece := os.read(descriptor, _PIECE_BYTES):
            content += piece
    finally:
        os.close(descriptor)
    return content


def _check_unedited(path: str, content: bytes) -> None:
    """If the journal beside the file says that the run was finished, the file is still the one it finished with."""
    journal = f"{_BEHIND_STEM.sub('', path)}_journal.jsonl"
    finished = _last_record(journal)
    expected = finished.get("table_sha256") if finished.get("kind") == "finished" else None
    if expected is not None and expected != hashlib.sha256(content).hexdigest():
        raise BadLogError(f"edited since the run; `recoil rebuild {journal}` gives the original")


def _last_record(journal: str) -> dict[str, object]:
    """The last record of a journal, or nothing if there is no journal or its last line is torn."""
    if not os.access(journal, os.F_OK):
        return {}
    try:
        with open(journal, "rb", buffering=0) as stream:  # noqa: PTH123 - of many thousands
            record = json.loads(next(filter(None, _last_lines(stream)), b"{}"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}


def _last_lines(stream: io.FileIO) -> Iterator[bytes]:
    """The last line, if it lies within as much of the end as mostly holds it; else the last of as much as surely."""
    size = stream.seek(0, io.SEEK_END)
    for tail in _TAIL_BYTES:
        stream.seek(max(0, size - tail))
        lines = stream.read(tail).splitlines()
        yield lines[-1] if len(lines) > 1 or (lines and size <= tail) else b""


def study_names(folders: Iterable[str]) -> dict[str, str]:
    """Short names for studies' folders: what tells them apart, from the first differing part on; else the last part.

    >>> study_names(["/data/kyoto/results", "/data/oslo/results"])
    {'/data/kyoto/results': 'kyoto', '/data/oslo/results': 'oslo'}
    >>> study_names(["/data/kyoto"])
    {'/data/kyoto': 'kyoto'}
    """
    ways = {folder: PurePath(folder).parts for folder in sorted(folders)}
    shared = _shared(list(ways.values()))
    tails = [way[shared:][::-1] for way in ways.values()]
    behind = _shared(tails)
    ends = {folder: way[shared : len(way) - behind] for folder, way in ways.items()}
    if len(ways) > 1 and all(ends.values()):
        return {folder: "/".join(end) for folder, end in ends.items()}
    return {folder: "/".join(way[shared - 1 :]) for folder, way in ways.items()} if ways else {}


def _shared(ways: list[tuple[str, ...]]) -> int:
    """How many parts all begin with."""
    return next(
        (n for n, parts in enumerate(zip(*ways, strict=False)) if len(set(parts)) > 1), min(map(len, ways), default=0)
    )
