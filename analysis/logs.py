"""Log files into two tables. A file that breaks a rule is left out whole, and the reason stands in `problems`."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import pandas as pd

from analysis.log_rules import BadLogError, Row, Table, check_table
from experiments import columns, register

_PATTERNS = tuple(f"*_{suffix}.csv" for suffix in columns.FILE_SUFFIX.values())
_DTYPES = {"text": "string", "level": "string", "integer": "Int64", "flag": "Int64", "number": "float64"}
_TAIL_BYTES = 1 << 16
"""As much of a journal as surely holds its last record."""


Track = Callable[[Sequence[Path]], Iterable[Path]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """A file that was left out, the place, and why."""

    file: Path
    line: int | None
    column: str | None
    message: str

    def __str__(self) -> str:
        place = "".join(
            [
                str(self.file),
                f", line {self.line}" if self.line is not None else "",
                f", column {self.column}" if self.column is not None else "",
            ]
        )
        return f"{place}: {self.message}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Logs:
    """The rows of all good files, with the columns of `experiments.columns`; empty cells are NA."""

    trials: pd.DataFrame
    ratings: pd.DataFrame
    problems: tuple[Problem, ...]
    files: tuple[Path, ...]


def read_logs(paths: Iterable[str | Path], track: Track = iter) -> Logs:
    """The logs in `paths`, files or folders (searched through for `*_trials.csv` and `*_ratings.csv`).

    Files with `practice` in their name are not read. A bad file, a missing path or a second log of the same participant
    for an experiment is a `Problem`, never an exception. `track` is given the files and gives them back one by one: for
    a progress bar.
    """
    _exclusions.cache_clear()  # the register may have been written since
    files, problems = _find([Path(path) for path in paths])
    tables: dict[Path, Table] = {}
    for file in track(files):
        try:
            _check_admitted(file, table := read_table(file))
            _check_new(table, tables)
        except BadLogError as bad:
            problems.append(Problem(file=file, line=bad.line, column=bad.column, message=bad.message))
        else:
            tables[file] = table
    return Logs(
        trials=_frame("direction", tables.values()),
        ratings=_frame("preference", tables.values()),
        problems=tuple(problems),
        files=tuple(tables),
    )


def read_table(file: Path) -> Table:
    """One log file, checked by every rule; `BadLogError` names the first that it breaks."""
    try:
        content = file.read_bytes()
    except OSError as error:
        raise BadLogError(f"cannot be read: {error.strerror or error}") from error
    _check_unedited(file, content)
    return check_table(_records(content), _code_in_name(file))


def _find(paths: Sequence[Path]) -> tuple[list[Path], list[Problem]]:
    found: dict[Path, Path] = {}
    problems = []
    for path in paths:
        logs = _in_folder(path) if path.is_dir() else [path]
        if not logs or not path.exists():
            reason = "no *_trials.csv or *_ratings.csv in this folder" if path.is_dir() else "no such file or folder"
            problems.append(Problem(file=path, line=None, column=None, message=reason))
            continue
        for log in logs:
            found.setdefault(log.resolve(), log)
    return [log for log in found.values() if "practice" not in log.name.lower()], problems


def _in_folder(folder: Path) -> list[Path]:
    return sorted(file for pattern in _PATTERNS for file in folder.rglob(pattern) if file.is_file())


def _records(content: bytes) -> list[tuple[int, list[str]]]:
    """The records of an RFC 4180 file, each with the line it starts on."""
    text = _text(content)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    records: list[tuple[int, list[str]]] = []
    start = 1
    try:
        for cells in reader:
            records.append((start, cells))
            start = reader.line_num + 1
    except csv.Error as error:
        raise BadLogError(f"is not comma-separated text by RFC 4180: {error}", start) from error
    if not text.endswith(("\n", "\r")):
        raise BadLogError(
            "the last line has no end (rule: every row ends with a line end; was the file cut off?)", start - 1
        )
    return records


def _text(content: bytes) -> str:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise BadLogError(f"byte 0x{content[error.start]:02x} is not UTF-8 (rule: UTF-8 text)", line) from error
    if not text.strip():
        raise BadLogError("is empty (rule: a header and one row a planned trial)")
    return text


def _code_in_name(file: Path) -> str | None:
    match = re.match(r"sub-([^_]+)_", file.name)
    return match[1] if match else None


def _check_unedited(file: Path, content: bytes) -> None:
    """If the journal beside the file says that the run was finished, the file is still the one it finished with."""
    stem = re.sub(rf"_({'|'.join(columns.FILE_SUFFIX.values())})$", "", file.stem)
    journal = file.with_name(f"{stem}_journal.jsonl")
    finished = _last_record(journal)
    expected = finished.get("table_sha256") if finished.get("kind") == "finished" else None
    if expected is not None and expected != hashlib.sha256(content).hexdigest():
        raise BadLogError(f"edited since the run; `recoil rebuild {journal}` gives the original")


def _last_record(journal: Path) -> dict[str, object]:
    """The last record of a journal, or nothing if there is no journal or its last line is torn."""
    try:
        with journal.open("rb") as stream:
            size = stream.seek(0, io.SEEK_END)
            stream.seek(max(0, size - _TAIL_BYTES))
            lines = stream.read().splitlines()
        record = json.loads(lines[-1]) if lines else {}
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}


def _check_admitted(file: Path, table: Table) -> None:
    """An exclusion in the register beside the participants' folders keeps their logs out, with its reason."""
    code = str(table.rows[0]["participant_id"])
    reason = _exclusions(file.parent.parent).get(code)
    if reason is not None:
        raise BadLogError(f"participant {code} is excluded: {reason} (`recoil study` readmits them)")


@lru_cache(maxsize=64)
def _exclusions(results: Path) -> dict[str, str]:
    """Who is excluded in a results folder, as far as its register can be read."""
    members = register.read(results).members
    return {code: member.excluded for code, member in members.items() if member.excluded is not None}


def _check_new(table: Table, tables: dict[Path, Table]) -> None:
    for file, other in tables.items():
        if _key(other) == _key(table):
            code, twin = table.rows[0]["participant_id"], other.rows[0]["participant_id"]
            name = f"participant {code!r}" if code == twin else f"participant {code!r} (there {twin!r})"
            rule = "(rule: one log a participant and experiment, upper and lower case alike)"
            raise BadLogError(f"{name} has a {table.experiment} log already in {file} {rule}", None, "participant_id")


def _key(table: Table) -> tuple[str, str]:
    return table.experiment, str(table.rows[0]["participant_id"]).casefold()


def _frame(experiment: str, tables: Iterable[Table]) -> pd.DataFrame:
    rows: list[Row] = [row for table in tables if table.experiment == experiment for row in table.rows]
    return pd.DataFrame(
        {
            column.name: pd.Series([row[column.name] for row in rows], dtype=_DTYPES[column.type])
            for column in columns.TABLES[experiment]
        }
    )
