"""Small designs for tests: what a test is not about has a value that does not matter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from experiments.config.door import checked_table
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.load import load_setup, shipped_folder
from experiments.study.new_study import designs
from experiments.synthetic.laws import SyntheticAnswers

Tables = Mapping[str, Any]

SHIPPED = tuple(designs())
"""The names of the shipped designs."""
OF_THE_PAPER, ADAPTIVE = ("direction", "preference"), ("staircase", "threshold")
QUESTION = {"kind": "choice", "text": "Which way?", "answers": ["forward", "backward"]}


def path_of(name: str) -> Path:
    """Where a shipped design lies."""
    return shipped_folder() / f"{name}.toml"


def changed(name: str, laws: Tables | None = None, **tables: Any) -> Setup[DesignConfig]:
    """A shipped setup with some values of its design changed, table by table, and of its synthetic people."""
    setup = load_setup(name)
    config = DesignConfig.model_validate(merged(setup.config.model_dump(), tables))
    if setup.laws is None:
        return replace(setup, config=config)
    people = SyntheticAnswers.model_validate(merged(setup.laws.model_dump(), laws or {}))
    return replace(setup, config=config, laws=people)


def laws_of(setup: Setup[DesignConfig]) -> SyntheticAnswers:
    assert isinstance(setup.laws, SyntheticAnswers)
    return setup.laws


def merged(values: Tables, changes: Tables) -> dict[str, Any]:
    """Tables with some values changed, those of inner tables beside what they hold."""
    found = dict(values)
    for key, value in changes.items():
        old = found.get(key)
        found[key] = merged(old, value) if isinstance(old, dict) and isinstance(value, dict) else value
    return found


def direction_with(
    methods: tuple[str, ...] = ("vibration", "asymmetric-1", "asymmetric-2"),
    sets: int = 4,
    repetitions: int = 10,
    **more: Any,
) -> Setup[DesignConfig]:
    """The shipped direction with these methods, and so many sets and repetitions of both directions a session."""
    order = {"sets": sets, "repetitions": repetitions} | more.pop("order", {})
    factors = merged({"method": {"levels": methods}}, more.pop("factors", {}))
    fatigue = {"max_trials_without_break": 1000, "max_planned_s": 86_400.0} | more.pop("fatigue", {})
    return changed("direction", factors=factors, order=order, fatigue=fatigue, **more)


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
