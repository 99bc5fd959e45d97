"""The files that a run began with, made again from the head of its journal.

The head holds the whole resolved setup: the experiment's config, its gun, the answers of its table. The copies load
back to the very same setup, by its hash, so that the run can go on with them; this is checked before it is said.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from experiments.config.door import ConfigError, checked_table
from experiments.config.toml_text import toml_text
from experiments.load import load_setup
from experiments.record import journal, storage
from experiments.record.journal import Head, JournalError
from experiments.record.tables import guard
from experiments.study.changes import changes_told, people_changes, setup_changes
from experiments.study.folders import PlaceError
from experiments.synthetic.laws import SyntheticAnswers, TableLaw


def copy_began_with(path: Path, folder: Path) -> list[Path]:
    """Write the files that a journal's run began with, the experiment's config first. Nothing is overwritten.

    `JournalError` if the journal has no whole head; `PlaceError` if a file is there already, or would lie outside of
    `folder`; `ConfigError` if what was written does not load back to the same setup: then it is taken away again.
    """
    head = journal.head(path)
    if head is None:
        raise JournalError(f"{path}: line 1: no whole record, so nothing says what the run began with")
    try:
        files = _files(path, head.setup_json, head.laws_json, folder)
    except (KeyError, TypeError, AttributeError) as error:
        raise JournalError(f"{path}: line 1: no setup of this version of Recoil ({error!r})") from error
    there = [str(file) for file in files if file.exists()]
    if there:
        raise PlaceError(f"{', '.join(there)}: already there; nothing is overwritten, so copy to another folder")
    _write(files, lambda: _check(head, next(iter(files))))
    return list(files)


def _files(path: Path, setup: Any, laws: Any, folder: Path) -> dict[Path, bytes]:
    """The files by their places. Names in the config stay as they are, since the hash is over them too."""
    config = setup["experiment"]
    named = {config["gun"]: _toml(path, setup["gun"])}
    if config.get("synthetic") is not None:
        named |= _people(path, config, laws)
    own = folder.joinpath(*["configs"] * max(_steps_up(path, name) for name in named))
    return {_place(own, f"{config['design']}.toml"): _toml(path, config)} | {
        _place(own, name): data for name, data in named.items()
    }


def _people(path: Path, config: Any, laws: Any) -> dict[str, bytes]:
    """The file of the synthetic people, and the tables that it names."""
    try:
        found = checked_table(SyntheticAnswers, laws, f"{path}: line 1")
    except ConfigError as error:
        raise JournalError(f"{error}; the journal was changed, or another version of Recoil wrote it") from error
    tables = {name: law for name, law in found.questions.items() if isinstance(law, TableLaw)}
    files = {
        law.file: _csv(path, law.rows, law.columns(name, scored=config["questions"][name].get("correct") is not None))
        for name, law in tables.items()
    }
    told = {**laws, "questions": {name: _without_rows(law) for name, law in laws["questions"].items()}}
    return {config["synthetic"]: _toml(path, told)} | files


def _without_rows(law: Mapping[str, object]) -> dict[str, object]:
    """A law as its file has it: the lines of its table stand in a file of their own."""
    return {key: value for key, value in law.items() if key != "rows"}


def _place(own: Path, name: str) -> Path:
    return Path(os.path.normpath(own / name))


def _steps_up(path: Path, name: str) -> int:
    """How many folders above the config a file lies that it names: `../gun.toml` is one up."""
    if Path(name).is_absolute() or "\0" in name:
        raise PlaceError(
            f"{path}: line 1: the config names {name!r}, which is no place inside a folder of copies; "
            "the run can go on only where that file stands as it was"
        )
    lowest, depth = 0, 0
    for part in Path(name).parts:
        depth += -1 if part == ".." else 1
        lowest = min(lowest, depth)
    return -lowest


def _toml(path: Path, table: Mapping[str, object]) -> bytes:
    try:
        return toml_text(table).encode()
    except ValueError as error:
        raise ConfigError(f"{path}: line 1: {error}") from error


def _csv(path: Path, rows: Sequence[Mapping[str, str]], columns: tuple[str, ...]) -> bytes:
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, columns)
    writer.writeheader()
    try:
        writer.writerows({name: guard(cell) for name, cell in row.items()} for row in rows)
    except ValueError as error:
        raise ConfigError(f"{path}: line 1: answers: {error}; its columns are {', '.join(columns)}") from error
    return text.getvalue().encode()


def _write(files: Mapping[Path, bytes], check: Callable[[], None]) -> None:
    """Write all files and check them; if anything goes wrong, take away what was written."""
    written: list[Path] = []
    made = {one for file in files for one in file.parents if not one.exists()}
    try:
        for file, data in files.items():
            storage.make_folder(file.parent)
            with file.open("xb") as out:
                written.append(file)
                out.write(data)
        check()
    except BaseException:
        for file in written:
            with suppress(OSError):
                file.unlink()
        for one in sorted(made, reverse=True):  # the inner ones first
            with suppress(OSError):
                one.rmdir()
        raise


def _check(head: Head, config: Path) -> None:
    """`ConfigError` unless the copies load to the setup that the journal names, and to its synthetic people."""
    try:
        setup = load_setup(str(config))
    except ConfigError as error:
        raise ConfigError(f"{head.path}: line 1: what the run began with does not load here:\n{error}") from error
    changes = [*setup_changes(head.setup_json, setup.record()), *people_changes(head.laws_json, setup)]
    if changes:
        raise ConfigError(
            f"{head.path}: line 1: this version of Recoil reads what the run began with otherwise than that which "
            f"wrote it: {changes_told(changes)}; go on with the version that the head names (provenance)"
        )
