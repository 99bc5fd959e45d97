"""Somebody who feels the gun, in data mode and at the real console: the same answers in the same times."""

from __future__ import annotations

import csv
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from experiments.record.journal import read_journal
from experiments.record.replay import history
from experiments.session.steps import Answered
from tests.at_display import AtDisplay, needs_display, virtual_display
from tests.felt_configs import felt_text, written
from tests.warm_start import warm

pytest.importorskip("PyQt6")
pytestmark = [needs_display, pytest.mark.slow]

STEM = "sub-P01/sub-P01_task-direction"
ANSWER = (
    "session", "method", "set", "trial", "direction", "instruction", "response", "correct", "response_time_s",
    "response_source", "response_time_valid",
)  # fmt: skip


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display() as name:
        yield name


def answers(results: Path) -> list[list[str]]:
    with (results / f"{STEM}_trials.csv").open(newline="", encoding="utf-8") as table:
        return [[row[name] for name in ANSWER] for row in csv.DictReader(table)]


def test_data_mode_and_the_console_give_the_same_answers_in_the_same_times(tmp_path: Path, display: str) -> None:
    short = {"sets_per_session": 2, "trials_per_set": 2, "forward_per_session": 2, "backward_per_session": 2}
    breaks = {"between_sets_s": 0.0, "between_sessions_s": 0.0, "max_trials_without_break": 60}
    methods = {"methods": '["asymmetric-1", "asymmetric-2"]', "non_decision_s": 0.2, "guard_s": 0.0}
    config = written(tmp_path, felt_text(("speed", "accuracy"), **short, **breaks, **methods))
    words = ["run", config, "--participant", "P01", "--seed", "3"]
    data = [*words, "--screen", "synthetic", "--results", tmp_path / "data"]
    subprocess.run(warm(*data), cwd=tmp_path, check=True, capture_output=True)
    seen = [*words, "--screen", "console", "--visual", "--results", tmp_path / "seen"]
    with AtDisplay(seen, tmp_path, display) as screen:
        code, said = screen.end()
    assert code == 0, said
    assert len(answers(tmp_path / "data")) == 8
    assert answers(tmp_path / "seen") == answers(tmp_path / "data")
    given = [
        word
        for _, word in history(read_journal(tmp_path / "seen" / f"{STEM}_journal.jsonl"))
        if isinstance(word, Answered)
    ]
    assert all(word.key_time_s is not None and word.key_time_s >= word.response_time_s for word in given)


def test_numbers_that_make_nobody_end_the_console_with_one_message(tmp_path: Path, display: str) -> None:
    config = written(tmp_path, felt_text(sensitivity=1e6))
    words = ["run", config, "--participant", "P01", "--seed", "3", "--screen", "console", "--visual"]
    with AtDisplay([*words, "--results", tmp_path / "seen"], tmp_path, display) as screen:
        code, said = screen.end()
    assert code == 2
    assert f"{config}: the numbers of [synthetic.*] make nobody: drift is" in said
    assert "Traceback" not in said
