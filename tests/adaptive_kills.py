"""An adaptive run that is killed at random moments, and goes on each time."""

from __future__ import annotations

import csv
import random
import subprocess
import time
from pathlib import Path

from experiments.record.journal import begun
from tests.warm_start import warm

_STEM = "sub-P01/sub-P01_task-staircase"
_COLUMNS = ("trial", "track", "pulse_s", "interval", "correct")


def _words(folder: Path, *more: str) -> list[object]:
    run = ["run", "staircase", "--participant", "P01", "--screen", "synthetic", "--seed", 5]
    return [*run, "--results", folder, *more]


def _rows(folder: Path) -> list[tuple[str, ...]]:
    with (folder / f"{_STEM}_trials.csv").open(newline="") as file:
        return [tuple(row[name] for name in _COLUMNS) for row in csv.DictReader(file)]


def unbroken(folder: Path) -> list[tuple[str, ...]]:
    """What a run felt and answered, trial by trial, that nobody disturbed."""
    subprocess.run(list(map(str, warm(*_words(folder)))), check=True, capture_output=True)
    return _rows(folder)


def killed_until_done(folder: Path, draw: random.Random, kills: int) -> tuple[int, list[tuple[str, ...]]]:
    """The same of a run that was killed and resumed so often, or until it was done; and how often it was."""
    journal, done = folder / f"{_STEM}_journal.jsonl", 0
    while done < kills:
        more = ["--resume"] if _lines(journal) else ["--fresh"]
        with subprocess.Popen(
            list(map(str, warm(*_words(folder, *more)))), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as run:
            _wait_until(run, journal, _lines(journal) + draw.randint(1, 60))
            run.kill()
        contents = begun(journal) if journal.exists() else None
        if contents is not None and contents.finished:
            return done, _rows(folder)
        done += 1
    subprocess.run(list(map(str, warm(*_words(folder, "--resume")))), check=True, capture_output=True)
    return done, _rows(folder)


def _lines(journal: Path) -> int:
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


def _wait_until(run: subprocess.Popen[bytes], journal: Path, lines: int) -> None:
    while run.poll() is None and _lines(journal) < lines:
        time.sleep(0.001)
