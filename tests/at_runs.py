"""Runs at the console, by their words and what they leave on the disk."""

from __future__ import annotations

import csv
import re
from pathlib import Path

from experiments.record.journal import read_journal
from experiments.record.replay import history
from experiments.session.steps import Answered

DIRECTION = "results/sub-P01/sub-P01_task-direction"
PREFERENCE = "results/sub-P01/sub-P01_task-preference"
RUN = "Recoil – P01"


SHORT_TRIALS = 8


def shorten(configs: Path) -> None:
    """Experiment 1 with two methods of two sets of two trials: `SHORT_TRIALS`."""
    config = configs / "direction.toml"
    text = config.read_text()
    for key, value in (
        ("levels", '["vibration", "asymmetric-2"]'),
        ("sets", "2"),
        ("repetitions", "2"),
    ):
        text = re.sub(rf"^{key} = [^#\n]*", f"{key} = {value} ", text, count=1, flags=re.MULTILINE)
    config.write_text(text)


def words(configs: Path, experiment: str, *more: object) -> list[object]:
    config = configs / f"{experiment}.toml"
    return ["run", config, "--screen", "console", "--results", "results", "--seed", 1, *more]


def rows(folder: Path, stem: str, kind: str) -> list[dict[str, str]]:
    with (folder / f"{stem}_{kind}.csv").open(newline="", encoding="utf-8") as table:
        return list(csv.DictReader(table))


def answers(journal: Path) -> list[str]:
    return [outcome.value for _, outcome in history(read_journal(journal)) if isinstance(outcome, Answered)]
