"""A setup: an experiment's config with the gun it runs on, resolved and hashed. What a run needs to know beforehand."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from experiments.config.canonical import sha256
from experiments.config.gun import GunConfig
from experiments.config.models import ExperimentConfig

Config_co = TypeVar("Config_co", bound=ExperimentConfig, covariant=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup(Generic[Config_co]):
    """An experiment's config, its gun and the answers of its table, if a table answers. `source` is its file."""

    config: Config_co
    gun: GunConfig
    source: Path
    answers: tuple[dict[str, str], ...] = field(default=())

    def record(self) -> dict[str, Any]:
        """All of it as plain JSON values."""
        return {
            "experiment": self.config.model_dump(mode="json"),
            "gun": self.gun.model_dump(mode="json"),
            "answers": list(self.answers),
        }

    def sha256(self) -> str:
        """The hash that names this setup."""
        return sha256(self.record())
