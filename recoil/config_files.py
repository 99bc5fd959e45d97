"""`recoil configs` and `recoil new`: the shipped configs to edit, those a run began with, and a study's folder.

The head holds the whole resolved setup: the experiment's config, its gun, the answers of its table. The copies load
back to the very same setup, by its hash, so that the run can go on with them; this is checked before it is said.
"""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from experiments.config.door import ConfigError, StudyConfig, checked_table, read_toml
from experiments.config.setup import GunConfig
from experiments.config.toml_text import toml_text
from experiments.design.config import DesignConfig
from experiments.load import load_setup, shipped_folder
from experiments.record import journal, storage
from experiments.record.journal import Head, JournalError
from experiments.record.tables import guard
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
    path, sha256 = head.path, head.setup_sha256
    try:
        setup = load_setup(str(config))
    except ConfigError as error:
        raise ConfigError(f"{path}: line 1: what the run began with does not load here:\n{error}") from error
    found = setup.sha256()
    people = setup.laws.model_dump(mode="json") if setup.laws is not None else None
    if found == sha256 and people != head.laws_json:
        raise ConfigError(
            f"{path}: line 1: this version of Recoil reads the run's synthetic people otherwise than that which wrote "
            "them; go on with the version that the head names (provenance)"
        )
    if found != sha256:
        raise ConfigError(
            f"{path}: line 1: the run began with setup {sha256[:12]}, but this version of Recoil makes {found[:12]} "
            "of the same values; go on with the version that the head names (provenance)"
        )


_README = """# {title}

Edit the configs here; every number of the protocol is in them.

| command | does |
| --- | --- |
| `recoil check study.toml` | the design, the orders, the duration, the limits |
| `recoil reproduce --study study.toml --out simulated` | the whole study with synthetic participants |
| `recoil freeze .` | a preregistration, whose hash every later run carries |
| `recoil doctor` | the rig's self-test |
| `recoil run direction.toml --screen console` | runs at the console, from its start window |
| `recoil run direction.toml --participant P01` | a run on a terminal |
| `recoil study .` | who is done, in progress, excluded, next |
| `recoil analyze results --out analysis` | statistics, figures and report of all logs |

Logs go to `results/`; it is readable by its owner only, on Windows by whoever may read this folder. Use codes for
participants, never names.
"""


_README_OF_DESIGN = """# {title}

`{name}.toml` is the design: what varies, in which order, what is asked. Edit it, and look at what it comes to:

| command | does |
| --- | --- |
| `recoil check {name}.toml` | the plan as a Methods section, cells, orders, duration |
| `recoil run {name}.toml --participant S01 --screen synthetic --results simulated` | one simulated run |
| `recoil freeze .` | a preregistration, whose hash every later run carries |
| `recoil doctor` | the rig's self-test |
| `recoil run {name}.toml --screen console` | runs at the console, from its start window |
| `recoil study .` | who is done, in progress, excluded, next |
| `recoil analyze results --out analysis` | statistics, figures and report of all logs |

Logs go to `results/`; it is readable by its owner only, on Windows by whoever may read this folder. Use codes for
participants, never names. `study.toml` says how many people there are; who may take part is asked once you write
[eligibility] into it.
"""
_KINDS = ("*.toml", "examples/*.toml", "synthetic/*.toml", "schemas/*.json")
_PEOPLE = ("direction", "direction-felt", "preference", "preference-felt", "hurry-felt")
_OF_THE_PAPER = (
    *("direction.toml", "preference.toml", "gun.toml", "study.toml", "paper.toml"),
    *(f"synthetic/{name}.toml" for name in _PEOPLE),
)


def shipped() -> list[Path]:
    """The shipped configs, who answers them in simulations, examples of what else can be given, and the schemas."""
    return [path for kind in _KINDS for path in sorted(shipped_folder().glob(kind))]


def copy_configs(folder: Path, sources: Iterable[Path] | None = None) -> list[Path]:
    """Copy shipped files, all unless some are named. `PlaceError` if one is there already; then nothing is copied."""
    named = shipped() if sources is None else sources
    copies = [(source, folder / source.relative_to(shipped_folder())) for source in named]
    there = [str(target) for _, target in copies if target.exists()]
    if there:
        raise PlaceError(f"{', '.join(there)}: already there; nothing is overwritten, so copy to another folder")
    for source, target in copies:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(source.read_bytes())
    return [target for _, target in copies]


def new_study(folder: Path, design: str = "", *, paper: bool = False) -> list[Path]:
    """A study's folder: configs, a page that says how to go on, and a private folder for results.

    Without a `design` it is the paper's study; with one a study of that alone, for everybody; with `paper` beside the
    paper's numbers. `ConfigError`: there is no such shipped design.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        there = "has something in it" if folder.is_dir() else "is no folder"
        raise PlaceError(f"{folder}: {there}; name a new folder, or an empty one")
    page, results = folder / "README.md", folder / "results"
    if design:
        made = _study_of(folder, design, paper=paper)
        page.write_text(_README_OF_DESIGN.format(title=folder.name, name=design), encoding="utf-8")
    else:
        its_own = [shipped_folder() / name for name in _OF_THE_PAPER]
        made = copy_configs(folder, [*its_own, *sorted(shipped_folder().glob("examples/*.toml")), *_schemas()])
        page.write_text(_README.format(title=folder.name), encoding="utf-8")
    storage.make_folder(results)
    return [*made, page, results]


def _schemas() -> list[Path]:
    return sorted(shipped_folder().glob("schemas/*.json"))


def _study_of(folder: Path, name: str, *, paper: bool) -> list[Path]:
    """A shipped design with its gun and its synthetic people, and a study that says nothing about who may come."""
    path = shipped_folder() / f"{name}.toml"
    setup = load_setup(name) if name in designs() else None
    if setup is None:
        raise ConfigError(f"--from {name}: no shipped design; there are {', '.join(designs())}")
    laws = setup.config.synthetic
    named = [setup.config.gun, *([laws] if laws else []), *(["paper.toml"] if paper else [])]
    made = copy_configs(folder, [path, *(shipped_folder() / one for one in named), *_schemas()])
    study: dict[str, object] = {"title": f"A study of {setup.config.title}", "participants": 12}
    study |= {"experiments": [path.name]} | ({"paper": "paper.toml"} if paper else {})
    (folder / "study.toml").write_text(f"#:schema schemas/study.json\n{toml_text(study)}", encoding="utf-8")
    return [*made, folder / "study.toml"]


def designs() -> list[str]:
    """The names of the shipped designs."""
    return [path.stem for path in sorted(shipped_folder().glob("*.toml")) if "factors" in read_toml(path)]


def schemas() -> dict[str, bytes]:
    """A JSON Schema of each kind of config, by file name: an editor that reads them completes and checks keys."""
    from analysis.logs.column_map import ColumnMap  # noqa: PLC0415 - the lab's own kinds come without the desk
    from analysis.logs.exclusion_rules import Rules  # noqa: PLC0415
    from analysis.logs.level_map import LevelMap  # noqa: PLC0415
    from analysis.paper.paper import Paper  # noqa: PLC0415
    from analysis.summary.remarks_coding import Codebook  # noqa: PLC0415
    from analysis.summary.requests import Requests  # noqa: PLC0415

    kinds: dict[str, type[BaseModel]] = {
        "design": DesignConfig,
        "synthetic": SyntheticAnswers,
        "gun": GunConfig,
        "study": StudyConfig,
        "paper": Paper,
        "columns": ColumnMap,
        "levels": LevelMap,
        "rules": Rules,
        "codebook": Codebook,
        "requests": Requests,
    }
    return {f"{name}.json": _schema(name, kind) for name, kind in kinds.items()}


def _schema(name: str, kind: type[BaseModel]) -> bytes:
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": f"Recoil: {name}"}
    return (json.dumps(kind.model_json_schema() | head, indent=1, ensure_ascii=False, sort_keys=True) + "\n").encode()


def write_schemas(folder: Path) -> list[Path]:
    """Write the schema of each kind of config into a folder; those that are there are written anew."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in schemas().items():
        (folder / name).write_bytes(content)
    return [folder / name for name in schemas()]
