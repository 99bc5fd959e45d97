"""Configs from disk: found, and checked with what belongs to them."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from experiments.catalogue import CATALOGUE
from experiments.config.door import ConfigError, checked, load, read_toml
from experiments.config.models import ExperimentConfig, StudyConfig
from experiments.config.setup import GunConfig, Setup


def shipped_folder() -> Path:
    """Where the configs that come with Recoil lie: beside the code in a checkout, inside it in a wheel."""
    here = Path(__file__).resolve().parent
    installed = here / "shipped_configs"
    return installed if installed.is_dir() else here.parent / "configs"


def find(name: str) -> Path:
    """The file that a path or the name of a shipped config means."""
    shipped = shipped_folder() / (name if name.endswith(".toml") else f"{name}.toml")
    for path in (Path(name), shipped if shipped.parent == shipped_folder() else Path(name)):
        if path.is_file():
            return path
    known = ", ".join(sorted(path.stem for path in shipped_folder().glob("*.toml")))
    if name and Path(name).is_dir():
        raise ConfigError(f"{name}: a folder, not a config; name a file in it, or a shipped config: {known}")
    raise ConfigError(f"{name}: no such file and no shipped config; shipped are {known}")


def load_setup(name: str) -> Setup[Any]:
    """An experiment's config with its gun and its table of answers."""
    path = find(name)
    table = read_toml(path)
    kind = table.get("experiment")
    if not isinstance(kind, str) or kind not in CATALOGUE:
        known = ", ".join(CATALOGUE)
        raise ConfigError(f"{path}: experiment = {kind!r}; must be one of {known} (is it the config of a run?)")
    config = checked(CATALOGUE[kind].config, table, path)
    gun = load_gun(path.parent / config.gun)
    setup = Setup(config=config, gun=gun, source=path, answers=_answers(path, config))
    _check_methods(path, setup)
    return setup


def load_gun(path: Path) -> GunConfig:
    """A gun's config."""
    if not path.is_file():
        what = "a folder, not a file" if path.is_dir() else "no such file"
        raise ConfigError(f"{path}: {what}; the config's key `gun` names it")
    return load(GunConfig, path)


def load_study(name: str) -> tuple[StudyConfig, Path]:
    """A study's config and the folder it lies in."""
    path = find(name)
    return load(StudyConfig, path), path.parent


def _check_methods(path: Path, setup: Setup[Any]) -> None:
    try:
        setup.gun.renderings(setup.config.design.methods)
    except ValueError as error:
        raise ConfigError(f"{path}: {error}") from error


def _answers(path: Path, config: ExperimentConfig) -> tuple[dict[str, str], ...]:
    synthetic = getattr(config, "synthetic", None)
    if synthetic is None or synthetic.observer != "table":
        return ()
    table, columns = path.parent / synthetic.table, CATALOGUE[config.experiment].answer_columns
    try:
        with table.open(encoding="utf-8-sig", newline="") as file:
            return tuple(_answer_rows(table, csv.reader(file, strict=True), columns))
    except (OSError, ValueError, csv.Error) as error:
        raise ConfigError(f"{table}: cannot be read ({error}); the config's key synthetic.table names it") from error


def _answer_rows(table: Path, lines: Any, columns: tuple[str, ...]) -> Iterator[dict[str, str]]:
    header = tuple(next(lines, ()))
    if header != columns:
        raise ConfigError(f"{table}: line 1: columns are {', '.join(header)}; they must be {', '.join(columns)}")
    for row in filter(None, lines):
        if len(row) != len(columns):
            raise ConfigError(f"{table}: line {lines.line_num}: {len(row)} fields; there must be {len(columns)}")
        yield dict(zip(columns, row, strict=True))
