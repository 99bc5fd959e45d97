"""Configs from disk: found, read and checked at the door. Every refusal names file, line, key, value and rule."""

from __future__ import annotations

import csv
import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from experiments.catalogue import CATALOGUE
from experiments.config.gun import GunConfig
from experiments.config.models import ExperimentConfig, StudyConfig
from experiments.config.setup import Setup

SomeModel = TypeVar("SomeModel", bound=BaseModel)


class ConfigError(Exception):
    """A config that cannot be used; the message names file, place, value and rule, a line for each finding."""


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
    config = _checked(CATALOGUE[kind].config, path, table)
    gun = load_gun(path.parent / config.gun)
    setup = Setup(config=config, gun=gun, source=path, answers=_answers(path, config))
    _check_methods(path, setup)
    return setup


def load_gun(path: Path) -> GunConfig:
    """A gun's config."""
    if not path.is_file():
        what = "a folder, not a file" if path.is_dir() else "no such file"
        raise ConfigError(f"{path}: {what}; the config's key `gun` names it")
    return _checked(GunConfig, path, read_toml(path))


def load_study(name: str) -> tuple[StudyConfig, Path]:
    """A study's config and the folder it lies in."""
    path = find(name)
    return _checked(StudyConfig, path, read_toml(path)), path.parent


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file, unchecked."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: byte {error.start}: not UTF-8; save the file as UTF-8") from error
    except (ValueError, RecursionError) as error:  # also numbers and nestings beyond all reason
        raise ConfigError(f"{path}: not TOML: {error}") from error
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror})") from error


def _checked(model: type[SomeModel], path: Path, table: dict[str, Any]) -> SomeModel:
    try:
        # JSON on the way: strict types, while TOML's arrays may become tuples
        return model.model_validate_json(json.dumps(table, default=_no_json))
    except ValidationError as error:
        text = path.read_text(encoding="utf-8")
        raise ConfigError("\n".join(_finding(path, text, finding) for finding in error.errors())) from error


def _no_json(value: object) -> dict[str, str]:
    """Dates and times, which no config has: as something that is neither text nor number."""
    return {"date": str(value)}


def _finding(path: Path, text: str, finding: Any) -> str:
    keys = [str(part) for part in finding["loc"]]
    line = line_of(text, keys)
    value = finding["input"]
    shown = f" = {value!r}" if keys and isinstance(value, str | int | float | bool) else ""
    rule = finding["msg"].removeprefix("Value error, ")
    rule = "unknown key; remove it or correct its spelling" if finding["type"] == "extra_forbidden" else rule
    return f"{path}{f':{line}' if line else ''}: {'.'.join(keys)}{shown}{': ' if keys else ''}{rule}"


def line_of(text: str, keys: list[str]) -> int | None:
    r"""The line of a dotted key in a TOML text, or of the nearest table around it; `None` for the whole file.

    >>> line_of("a = 1\n[b]\nc = 2", ["b", "c"]), line_of("[b]", ["b", "missing"]), line_of("a = 1", [])
    (3, 1, None)
    """
    places: dict[tuple[str, ...], int] = {}
    table: tuple[str, ...] = ()
    for number, line in enumerate(text.split("\n"), start=1):
        if header := re.match(r"\s*\[([^\[\]]+)\]", line):
            table = tuple(part.strip(' "') for part in header[1].split("."))
            places.setdefault(table, number)
        elif entry := re.match(r"\s*([\w.\-\"]+)\s*=", line):
            places.setdefault((*table, *entry[1].replace('"', "").split(".")), number)
    return next((places[tuple(keys[:n])] for n in range(len(keys), 0, -1) if tuple(keys[:n]) in places), None)


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
