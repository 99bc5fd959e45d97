"""Files with one edit that makes a config unusable, and what its refusal must say."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import pytest

from experiments.config.door import ConfigError
from experiments.load import load_setup


class Broken(NamedTuple):
    """An edit of a file that makes `config` unusable, and what the refusal must say.

    `named` is the file that must be named, if it is another one; `at` words on the line that must be named, if there
    is one.
    """

    config: str
    file: str
    old: str
    new: str
    said: tuple[str, ...]
    at: str | None = None
    named: str | None = None


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text, f"{path.name} no longer holds {old!r}"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def line(path: Path, words: str) -> int:
    return next(n for n, row in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1) if words in row)


def refusal(path: Path) -> str:
    """Why a config is refused."""
    with pytest.raises(ConfigError) as refused:
        load_setup(str(path))
    return str(refused.value)


def check_refused(folder: Path, broken: Broken) -> None:
    """One refusal names file, place, key, value and rule."""
    edit(folder / broken.file, broken.old, broken.new)
    message = refusal(folder / broken.config)
    for words in broken.said:
        assert words in message
    place = f":{line(folder / broken.file, broken.at)}" if broken.at else r"(:\d+)?"
    named = re.escape(f"/{broken.named or broken.file}")
    assert re.search(f"{named}{place}: ", message)
