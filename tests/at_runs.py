"""Runs at the console, by their words and what they leave on the disk."""

from __future__ import annotations

import csv
from pathlib import Path

from experiments.record.journal import read_journal
from experiments.record.replay import history
from experiments.session.steps import Answered

DIRECTION = "results/sub-P01/sub-P01_task-direction"
PREFERENCE = "results/sub-P01/sub-P01_task-preference"
RUN = "Recoil – P01"


def words(configs: Path, experiment: str, *more: object) -> list[object]:
    config = configs / f"{experiment}.toml"
    return ["run", config, "--screen", "console", "--results", "results", "--seed", 1, *more]


def rows(folder: Path, stem: str, kind: str) -> list[dict[str, str]]:
    with (folder / f"{stem}_{kind}.csv").open(newline="", encoding="utf-8") as table:
        return list(csv.DictReader(table))


def answers(journal: Path) -> list[str]:
    return [outcome.response for _, outcome in history(read_journal(journal)) if isinstance(outcome, Answered)]
