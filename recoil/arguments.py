"""What a notebook's arguments have to be: each error names the argument, its value and the rule."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from numbers import Real
from pathlib import Path

from device.messages import RecoilError
from device.words import is_number, is_whole_number
from experiments.config.door import ConfigError
from experiments.config.setup import Setup
from experiments.load import find

_LONGEST, _LONGEST_NAME = 80, 255
_OF_OPTIONS = {"include-synthetic": "include_synthetic=True", "effect": "effects"}
"""What options are called in Python, where it is not the same."""
_OPTION = re.compile(r"--([a-z][a-z-]*)( \S+:)?")


def argument_error(name: str, value: object, must: str) -> ConfigError:
    """The error for an argument that cannot be.

    >>> str(argument_error("target", "high", "a number, such as 0.8"))
    "target = 'high': must be a number, such as 0.8"
    """
    try:
        shown = repr(value)
    except ValueError:  # whole numbers of more than some thousand digits have no text
        shown = "a number of thousands of digits"
    return ConfigError(f"{name} = {shown if len(shown) <= _LONGEST else shown[:_LONGEST] + '...'}: must be {must}")


def file_or_name(name: str, value: object) -> str:
    """A file, or the name of a shipped config."""
    if not isinstance(value, str | Path) or not str(value):
        raise argument_error(name, value, "a file or the name of a shipped config, such as 'direction'")
    try:
        find(str(value))
    except OSError as error:
        raise argument_error(name, value, f"a file ({error.strerror})") from error
    except ConfigError as error:
        raise ConfigError(f"{name} = {error}") from None
    return str(value)


def path_of(name: str, value: object) -> Path:
    """A file or folder, there or to be made."""
    if not isinstance(value, str | Path) or not str(value):
        raise argument_error(name, value, "a path, such as 'results'")
    if "\0" in str(value) or any(len(part) > _LONGEST_NAME for part in Path(value).parts):
        raise argument_error(name, value, "a path that a disk takes")
    return Path(value)


def file_of(name: str, value: object) -> Path:
    """A file that is there."""
    path = path_of(name, value)
    if not path.is_file():
        raise argument_error(name, str(value), "a file that is there")
    return path


def flag_of(name: str, value: object) -> bool:
    """True or False."""
    if not isinstance(value, bool):
        raise argument_error(name, value, "True or False")
    return value


def paths_of(name: str, values: Sequence[object]) -> tuple[Path, ...]:
    """One or more files or folders."""
    if not values or not all(isinstance(path, str | Path) and str(path) for path in values):
        raise argument_error(name, values, "files or folders with logs, one argument each")
    return tuple(path_of(name, path) for path in values)


def check_setup(name: str, value: object) -> None:
    """`ConfigError` for what is no loaded config."""
    if not isinstance(value, Setup):
        raise argument_error(name, value, "what load_config gives, such as load_config('direction')")


def texts_of(name: str, values: object, what: str, example: str) -> tuple[str, ...]:
    """A list of texts; one text alone is none."""
    if isinstance(values, str | Mapping) or not isinstance(values, Iterable):
        shown = values if isinstance(values, str) and values else example
        raise argument_error(name, values, f"a list of {what}, such as [{shown!r}]")
    found = tuple(values)
    if not all(isinstance(one, str) for one in found):
        raise argument_error(name, values, f"a list of {what}, such as [{example!r}]")
    return found


def numbers_of(name: str, values: object) -> str | None:
    """Numbers as the command line takes them; `None` for none."""
    if isinstance(values, bool | bytes | Mapping) or not isinstance(values, str | Real | Iterable):
        raise argument_error(name, values, "a number, a list of numbers, or text such as '8,10,14-20'")
    if isinstance(values, str | Real):
        return str(values)
    return ",".join(map(str, values)) or None


def count_of(name: str, value: object, most: int) -> int:
    """A whole number from 1."""
    if not is_whole_number(value) or not 1 <= value <= most:
        raise argument_error(name, value, f"a whole number from 1 to {most:,}")
    return int(value)


def share_argument(name: str, value: object) -> float:
    """A number between 0 and 1."""
    if not is_number(value) or not 0 < value < 1:
        raise argument_error(name, value, "a number between 0 and 1, such as 0.8")
    return float(value)


def in_python(message: str) -> str:
    """A message whose options are called as the arguments are.

    >>> in_python("--participants abc: is no number; give --include-synthetic")
    'participants = abc: is no number; give include_synthetic=True'
    """

    def named(option: re.Match[str]) -> str:
        name = _OF_OPTIONS.get(option[1], option[1].replace("-", "_"))
        return name if option[2] is None else f"{name} ={option[2]}"

    return _OPTION.sub(named, message)


@contextmanager
def arguments_named() -> Iterator[None]:
    """Have errors of commands speak of arguments instead of options."""
    try:
        yield
    except RecoilError as error:
        if "--" not in str(error):
            raise
        raise ConfigError(in_python(str(error))) from error
