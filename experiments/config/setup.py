"""A setup: an experiment's config with the gun it runs on, resolved and hashed by one spelling of every value."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, TypeVar

from experiments.config.gun import GunConfig
from experiments.config.models import ExperimentConfig


def canonical_json(value: object) -> bytes:
    """UTF-8 JSON with sorted keys, no blanks and no NaN; floats in Python's shortest round-trip form.

    >>> canonical_json({"b": 1, "a": [0.1, "é"]}).decode()
    '{"a":[0.1,"é"],"b":1}'
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()


def sha256(value: object) -> str:
    """The SHA-256 of a value's canonical JSON, in hexadecimal."""
    return hashlib.sha256(canonical_json(value)).hexdigest()


def without_blank_instruction(pairs: Iterable[tuple[str, object]]) -> dict[str, object]:
    """A `dict_factory` for what has an instruction: where there is none, its record has no such key.

    >>> without_blank_instruction([("set", 1), ("instruction", "")])
    {'set': 1}
    """
    return {key: value for key, value in pairs if key != "instruction" or value}


Config_co = TypeVar("Config_co", bound=ExperimentConfig, covariant=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup(Generic[Config_co]):
    """An experiment's config, its gun and the answers of its table, if a table answers. `source` is its file."""

    config: Config_co
    gun: GunConfig
    source: Path
    answers: tuple[dict[str, str], ...] = field(default=())

    def record(self) -> dict[str, object]:
        """All of it as plain JSON values."""
        return {
            "experiment": self.config.model_dump(mode="json"),
            "gun": self.gun.model_dump(mode="json"),
            "answers": list(self.answers),
        }

    def sha256(self) -> str:
        """The hash that names this setup."""
        return sha256(self.record())
