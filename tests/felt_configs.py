"""The shipped experiment 1 with somebody who feels the gun, and instructions for its sets."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

from experiments.load import shipped_folder


def felt_config(
    folder: Path,
    instructions: tuple[str, ...] = (),
    spreads: Mapping[str, float] | None = None,
    sensitivity: float | None = None,
) -> Path:
    """The shipped experiment 1 with people who feel the gun, differ so much, and are told so before their sets."""
    for name in ("gun.toml", "direction.toml", "synthetic/direction-felt.toml"):
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(shipped_folder() / name, folder / name)
    path, people = folder / "direction.toml", folder / "synthetic" / "direction-felt.toml"
    text = edited(path.read_text(encoding="utf-8"), "synthetic/direction.toml", "synthetic/direction-felt.toml")
    if instructions:
        texts = "".join(f'texts.{name} = "Answer with {name}."\n' for name in instructions)
        factor = f"[factors.instruction]\nlevels = {[*instructions]}\n{texts}\n[order]\nset = ['instruction']"
        text = edited(text, "[order]", factor)
    path.write_text(text, encoding="utf-8")
    law = people.read_text(encoding="utf-8")
    for name, sd in (spreads or {}).items():
        law = edited(law, f"{name} = 0.0", f"{name} = {sd}")
    if sensitivity is not None:
        law = edited(law, "sensitivity = 0.213", f"sensitivity = {sensitivity}")
    people.write_text(law, encoding="utf-8")
    return path


def edited(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new, 1)
