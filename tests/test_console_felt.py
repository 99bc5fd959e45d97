"""Somebody who feels the gun, in data mode and at the real console: the same answers in the same times."""

from __future__ import annotations

import csv
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from experiments.record.journal import read_journal
from experiments.record.replay import history
from experiments.session.steps import Answered
from tests.at_display import AtDisplay, needs_display, virtual_display
from tests.at_runs import SHORT_TRIALS, shorten
from tests.warm_start import warm

pytest.importorskip("PyQt6")
pytestmark = [needs_display, pytest.mark.slow]

STEM = "sub-P01/sub-P01_task-direction"
PEOPLE = "synthetic/direction-felt.toml"
TOLD = """
[factors.instruction]
levels = ["speed", "accuracy"]
texts = { speed = "Answer as fast as you can.", accuracy = "Be sure." }
"""
ANSWER = (
    "session", "method", "set", "trial", "direction", "instruction", "response", "correct", "response_time_s",
    "response_source", "response_time_valid",
)  # fmt: skip
STAMP_S = 0.001
"""Window systems stamp keys in whole milliseconds."""


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display() as name:
        yield name


def answers(results: Path) -> list[list[str]]:
    with (results / f"{STEM}_trials.csv").open(newline="", encoding="utf-8") as table:
        return [[row[name] for name in ANSWER] for row in csv.DictReader(table)]


def felt(configs: Path, key: str, value: float) -> Path:
    """Experiment 1 answered by people who feel the gun, with one of their numbers changed."""
    config, people = configs / "direction.toml", configs / PEOPLE
    config.write_text(config.read_text().replace("synthetic/direction.toml", PEOPLE, 1))
    numbers, found = re.subn(rf"^{key} = [\d.]+", f"{key} = {value}", people.read_text(), flags=re.MULTILINE)
    assert found == 1
    people.write_text(numbers)
    return config


def with_instructions(config: Path) -> None:
    """One instruction a set."""
    text = config.read_text()
    assert "[order]\n" in text
    config.write_text(text.replace("[order]\n", f'{TOLD}\n[order]\nset = ["instruction"]\n'))


def test_data_mode_and_the_console_give_the_same_answers_in_the_same_times(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    shorten(quick_configs)
    config = felt(quick_configs, "non_decision_s", 0.2)
    with_instructions(config)
    words = ["run", config, "--participant", "P01", "--seed", "3"]
    data = [*words, "--screen", "synthetic", "--results", tmp_path / "data"]
    subprocess.run(warm(*data), cwd=tmp_path, check=True, capture_output=True)
    seen = [*words, "--screen", "console", "--visual", "--results", tmp_path / "seen"]
    with AtDisplay(seen, tmp_path, display) as screen:
        code, said = screen.end()
    assert code == 0, said
    assert len(answers(tmp_path / "data")) == SHORT_TRIALS
    assert answers(tmp_path / "seen") == answers(tmp_path / "data")
    given = [
        word
        for _, word in history(read_journal(tmp_path / "seen" / f"{STEM}_journal.jsonl"))
        if isinstance(word, Answered)
    ]
    assert all(word.key_time_s is not None and word.key_time_s >= word.response_time_s - STAMP_S for word in given)


def test_numbers_that_make_nobody_end_the_console_with_one_message(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    config = felt(quick_configs, "sensitivity", 1e6)
    words = ["run", config, "--participant", "P01", "--seed", "3", "--screen", "console", "--visual"]
    with AtDisplay([*words, "--results", tmp_path / "seen"], tmp_path, display) as screen:
        code, said = screen.end()
    assert code == 2
    assert re.search(rf"{quick_configs / PEOPLE}: .*make nobody: drift is .* within 1e\+06", said), said
    assert "Traceback" not in said
