"""The shipped experiment 1 as text, with somebody who feels the gun and instructions for its sets."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

from experiments.load import shipped_folder

TEXTS = {"speed": "Answer as fast as you can.", "neutral": "Answer fast and well.", "accuracy": "Be sure."}
BALANCE = 'balance = "session"'


def shipped_text(name: str = "direction") -> str:
    return (shipped_folder() / f"{name}.toml").read_text(encoding="utf-8")


def felt_text(names: tuple[str, ...] = (), **values: object) -> str:
    """The config for "felt" with these instructions; `values` replace those of keys, wherever they stand first."""
    tables = "".join(f'\n[instructions.{name}]\ntext = "{TEXTS[name]}"\n' for name in names)
    told = ", ".join(f'"{name}"' for name in names)
    text = changed(shipped_text(), (BALANCE, f"{BALANCE}\ninstructions = [{told}]"))
    for key, value in ({"observer": '"felt"'} | values).items():
        old = next(line for line in text.splitlines() if line.startswith(f"{key} ="))
        text = text.replace(old, f"{key} = {value}", 1)
    return text + tables


def changed(text: str, *edits: tuple[str, str]) -> str:
    for old, new in edits:
        assert old in text, f"no {old!r} any more"
        text = text.replace(old, new, 1)
    return text


def written(folder: Path, text: str, name: str = "direction") -> Path:
    """The config in a folder with the shipped gun."""
    shutil.copy(shipped_folder() / "gun.toml", folder)
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def felt_config(folder: Path, instructions: tuple[str, ...] = (), spreads: Mapping[str, float] | None = None) -> Path:
    """The shipped config with people who feel the gun and differ so much, told so."""
    return written(folder, felt_text(instructions, **(spreads or {})))
