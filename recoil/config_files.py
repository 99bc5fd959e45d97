"""`recoil configs` and `recoil new`: the shipped configs to edit, those a run began with, and a study's folder.

The head holds the whole resolved setup: the experiment's config, its gun, the answers of its table. The copies load
back to the very same setup, by its hash, so that the run can go on with them; this is checked before it is said.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from experiments.catalogue import CATALOGUE
from experiments.config.door import ConfigError, toml_text
from experiments.load import load_setup, shipped_folder
from experiments.record import journal, storage
from experiments.record.journal import JournalError
from experiments.study.folders import PlaceError


def copy_began_with(path: Path, folder: Path) -> list[Path]:
    """Write the files that a journal's run began with, the experiment's config first. Nothing is overwritten.

    `JournalError` if the journal has no whole head; `PlaceError` if a file is there already, or would lie outside of
    `folder`; `ConfigError` if what was written does not load back to the same setup: then it is taken away again.
    """
    head = journal.head(path)
    if head is None:
        raise JournalError(f"{path}: line 1: no whole record, so nothing says what the run began with")
    try:
        files = _files(path, head.setup_json, folder)
    except (KeyError, TypeError, AttributeError) as error:
        raise JournalError(f"{path}: line 1: no setup of this version of Recoil ({error!r})") from error
    there = [str(file) for file in files if file.exists()]
    if there:
        raise PlaceError(f"{', '.join(there)}: already there; nothing is overwritten, so copy to another folder")
    _write(files, lambda: _check(path, next(iter(files)), head.setup_sha256))
    return list(files)


def _files(path: Path, setup: Any, folder: Path) -> dict[Path, bytes]:
    """The files by their places. Names in the config stay as they are, since the hash is over them too."""
    config = setup["experiment"]
    kind = config.get("experiment")
    if kind not in CATALOGUE:
        raise ConfigError(f"{path}: line 1: experiment = {kind!r} is not known to this version of Recoil")
    named = {config["gun"]: _toml(path, setup["gun"])}
    table = (config.get("synthetic") or {}).get("table")
    if table is not None:
        named[table] = _csv(path, setup["answers"], CATALOGUE[kind].answer_columns)
    own = folder.joinpath(*["configs"] * max(_steps_up(path, name) for name in named))
    return {_place(own, f"{kind}.toml"): _toml(path, config)} | {
        _place(own, name): data for name, data in named.items()
    }


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


def _csv(path: Path, rows: list[dict[str, str]], columns: tuple[str, ...]) -> bytes:
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, columns)
    writer.writeheader()
    try:
        writer.writerows(rows)
    except ValueError as error:
        raise ConfigError(f"{path}: line 1: answers: {error}; its columns are {', '.join(columns)}") from error
    return text.getvalue().encode()


def _write(files: Mapping[Path, bytes], check: Callable[[], None]) -> None:
    """Write all files and check them; if anything goes wrong, take away what was written."""
    written: list[Path] = []
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
        raise


def _check(path: Path, config: Path, sha256: str) -> None:
    """`ConfigError` unless the copies load to the setup that the journal names."""
    try:
        found = load_setup(str(config)).sha256()
    except ConfigError as error:
        raise ConfigError(f"{path}: line 1: what the run began with does not load here:\n{error}") from error
    if found != sha256:
        raise ConfigError(
            f"{path}: line 1: the run began with setup {sha256[:12]}, but this version of Recoil makes {found[:12]} "
            "of the same values; go on with the version that the head names (provenance)"
        )


_README = """# {title}

Edit the configs here; every number of the protocol is in them.

    recoil check study.toml                                   the design, the orders, the duration, the limits
    recoil reproduce --study study.toml --out simulated       the whole study with synthetic participants
    recoil doctor                                             the rig's self-test
    recoil run direction.toml --screen console                sessions at the console, from its start window
    recoil run direction.toml --participant P01               a session on a terminal
    recoil study .                                            who is done, in progress, excluded, next
    recoil analyze results --out analysis                     statistics, figures and report of all logs

Logs go to `results/`; it is readable by its owner only. Use codes for participants, never names.
"""


def shipped() -> list[Path]:
    """The shipped configs, and the examples of what else can be given as a file."""
    return sorted(shipped_folder().glob("*.toml")) + sorted(shipped_folder().glob("examples/*.toml"))


def copy_configs(folder: Path) -> list[Path]:
    """Copy the shipped configs and examples. `PlaceError` if one is there already; then nothing is copied."""
    copies = [(source, folder / source.relative_to(shipped_folder())) for source in shipped()]
    there = [str(target) for _, target in copies if target.exists()]
    if there:
        raise PlaceError(f"{', '.join(there)}: already there; nothing is overwritten, so copy to another folder")
    for source, target in copies:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(source.read_bytes())
    return [target for _, target in copies]


def new_study(folder: Path) -> list[Path]:
    """A study's folder: configs, a page that says how to go on, and a private folder for results."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise PlaceError(f"{folder}: exists and is not empty; name a new folder")
    made = copy_configs(folder)
    page = folder / "README.md"
    page.write_text(_README.format(title=folder.name), encoding="utf-8")
    storage.make_folder(folder / "results")
    return [*made, page, folder / "results"]
