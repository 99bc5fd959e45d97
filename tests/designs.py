"""Small designs for tests: what a test is not about has a value that does not matter."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from experiments.config.door import checked_table
from experiments.design.config import DesignConfig
from experiments.load import shipped_folder

QUESTION = {"kind": "choice", "text": "Which way?", "answers": ["forward", "backward"]}


def path_of(name: str) -> Path:
    """Where a design lies: shipped, or the paper's two as designs."""
    folder = Path(__file__).parent / "ten_designs" if name in ("direction", "preference") else shipped_folder()
    return folder / f"{name}.toml"


def design(**tables: Any) -> DesignConfig:
    """A design of these tables; `ConfigError` as from a file."""
    shared = {
        "design": "test",
        "title": "A test",
        "gun": "gun.toml",
        "factors": {"method": {"levels": ["a"]}},
        "questions": {"response": QUESTION},
        "fatigue": {"max_trials_without_break": 10_000, "max_planned_s": 86_400.0},
        "timing": {"hand_over_s": 1.0, "planned_s": 60.0},
    }
    return checked_table(DesignConfig, shared | tables, "design.toml")
