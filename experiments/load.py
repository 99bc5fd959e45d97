"""Configs from disk: found, and checked with what belongs to them."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from device.messages import escaped
from experiments.config.door import ConfigError, StudyConfig, at_key, load, read_toml, said_of, why_unread
from experiments.config.setup import GunConfig, Setup
from experiments.design.config import DesignConfig
from experiments.design.limits import check_limits, check_methods, unchanged_methods
from experiments.design.planned import planned_run, plans_of_groups
from experiments.record import storage
from experiments.record.design_columns import columns
from experiments.record.tables import MAY_LACK, TABLES, unguard
from experiments.synthetic.laws import SyntheticAnswers, TableLaw, check_laws


def shipped_folder() -> Path:
    """Where the configs that come with Recoil lie: beside the code in a checkout, inside it in a wheel."""
    here = Path(__file__).resolve().parent
    installed = here / "shipped_configs"
    return installed if installed.is_dir() else here.parent / "configs"


def find(name: str | Path) -> Path:
    """The file that a path or the name of a shipped config means; for a `Path` no shipped one is taken."""
    if isinstance(name, Path):
        if name.is_file():
            return name
        raise ConfigError(f"{name}: {_why_none(name, 'config')}")
    shipped = shipped_folder() / (name if name.endswith(".toml") else f"{name}.toml")
    for path in (Path(name), shipped if shipped.parent == shipped_folder() else Path(name)):
        if path.is_file():
            return path
    known = ", ".join(sorted(path.stem for path in shipped_folder().glob("*.toml")))
    if name and Path(name).is_dir():
        raise ConfigError(f"{name}: a folder, not a config; name a file in it, or a shipped config: {known}")
    if name and Path(name).exists():
        raise ConfigError(f"{escaped(name)}: {_why_none(Path(name))}; a shipped config is one of {known}")
    raise ConfigError(f"{escaped(name)}: no such file and no shipped config; shipped are {known}")


def _why_none(path: Path, what: str = "file") -> str:
    """Why a path that is no file is none."""
    if path.is_dir():
        return f"a folder, not a {what}"
    return storage.NO_FILE if path.exists() else "no such file"


def load_setup(name: str | Path) -> Setup[DesignConfig]:
    """A design with its gun and its synthetic people, held against each other. `ConfigError` names what is wrong."""
    path = find(name)
    if not {"design", "factors"} & set(read_toml(path)):
        raise ConfigError(
            f"{path}: no design: it has neither the key design nor a table [factors.*] (is it the config of a run?)"
        )
    design = load(DesignConfig, path)
    setup = Setup(config=design, gun=load_gun(path.parent / design.gun), source=path)
    with said_of(path):
        _check_known_columns(design)
        plans = plans_of_groups(design)
        for plan in plans:
            planned_run(design, plan)
    by_gun = () if design.below_break_away else unchanged_methods(design)
    if set(by_gun) <= set(setup.gun.methods):
        check_methods(setup.gun, by_gun, path.parent / design.gun)
    check_limits(setup)
    if not design.synthetic:
        return setup
    people = path.parent / design.synthetic
    if not people.is_file():
        raise ConfigError(f"{people}: {_why_none(people)}; the config's key `synthetic` names it")
    laws = load(SyntheticAnswers, path.parent / design.synthetic)
    with said_of(path.parent / design.synthetic):
        check_laws(design, laws, plans)
    return replace(setup, laws=_with_tables(path, design, laws))


def _check_known_columns(design: DesignConfig) -> None:
    """`ConfigError`: a name whose logs other programs read, with other columns than they know."""
    if design.design not in TABLES:
        return
    wanted = [column.name for column in TABLES[design.design]]
    have = [column.name for column in columns(design)]
    missing = [name for name in wanted if name not in have and name not in MAY_LACK]
    surplus = [name for name in have if name not in wanted]
    if missing or surplus:
        told = [f"without {', '.join(missing)}"] if missing else []
        told += [f"with {', '.join(surplus)}"] if surplus else []
        raise ConfigError(
            f"design = {design.design!r}: logs of this name have columns of their own, and this design makes them "
            f"{' and '.join(told)}; choose another name"
        )


def _with_tables(path: Path, design: DesignConfig, laws: SyntheticAnswers) -> SyntheticAnswers:
    """The laws with the lines of the tables that they name."""
    read = {
        name: law.model_copy(update={"rows": _table_rows(path, law, law.columns(name, scored=scored))})
        for name, law in laws.questions.items()
        if isinstance(law, TableLaw)
        for scored in [design.questions[name].correct is not None]
    }
    return laws.model_copy(update={"questions": laws.questions | read})


def _table_rows(path: Path, law: TableLaw, columns: tuple[str, ...]) -> tuple[dict[str, str], ...]:
    table = path.parent / law.file
    try:
        with table.open(encoding="utf-8-sig", newline="") as file:
            return tuple(_answer_rows(table, csv.reader(file, strict=True), columns))
    except (OSError, ValueError, csv.Error) as error:
        raise ConfigError(f"{table}: cannot be read ({why_unread(error)}); the law's key `file` names it") from error


def load_gun(path: Path) -> GunConfig:
    """A gun's config."""
    if not path.is_file():
        raise ConfigError(f"{path}: {_why_none(path)}; the config's key `gun` names it")
    return load(GunConfig, path)


def load_study(name: str | Path) -> tuple[StudyConfig, Path]:
    """A study's config and the folder it lies in."""
    path = find(name)
    return load(StudyConfig, path), path.parent


def _answer_rows(table: Path, lines: Any, columns: tuple[str, ...]) -> Iterator[dict[str, str]]:
    header = tuple(next(lines, ()))
    if header != columns:
        raise ConfigError(f"{table}: line 1: columns are {', '.join(header)}; they must be {', '.join(columns)}")
    for row in filter(None, lines):
        if len(row) != len(columns):
            raise ConfigError(f"{table}: line {lines.line_num}: {len(row)} fields; there must be {len(columns)}")
        yield dict(zip(columns, map(unguard, row), strict=True))


def language_key(setup: Setup[DesignConfig]) -> str:
    """What the design says of its texts' language, behind file and line."""
    return at_key(setup.source, f"language = {setup.config.language!r}")
