"""Shots in fifty digits: the paper's guns in all options, and 200 random ones, of tests/golden/make_physics.py."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, fields
from pathlib import Path

from device.parameters import GunParameters
from device.physics.scenes import OUTPUTS

FOLDER = Path(__file__).parent / "golden"
SHOTS = json.loads((FOLDER / "physics.json").read_text(encoding="utf-8"))["shots"]


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomShot:
    """A gun, back-EMF as printed, and the digits of each output by the coil's off-state."""

    numbers: dict[str, float]
    open: dict[str, str]
    shorted: dict[str, str]


def _random_shots() -> list[RandomShot]:
    with (FOLDER / "physics_random.csv").open(encoding="utf-8", newline="") as file:
        return [_random_shot(row) for row in csv.DictReader(file)]


def _random_shot(row: dict[str, str]) -> RandomShot:
    digits = {off: {name: row.get(name) or row[f"{off}_{name}"] for name in OUTPUTS} for off in ("open", "shorted")}
    numbers = {one.name: float(row[one.name]) for one in fields(GunParameters) if one.name in row}
    return RandomShot(numbers=numbers, **digits)


RANDOM = _random_shots()
