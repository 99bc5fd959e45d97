"""An adaptive run that is killed at random moments, and goes on each time."""

from __future__ import annotations

import csv
import random
import subprocess
import time
from pathlib import Path

from experiments.config.door import read_toml
from experiments.config.toml_text import toml_text
from experiments.load import shipped_folder
from experiments.record.journal import begun
from tests.warm_start import warm

_COLUMNS = {
    "staircase": ("trial", "track", "pulse_s", "interval", "correct"),
    "pairs": ("trial", "track", "method_1", "method_2", "rather"),
}
"""What is compared of the designs' tables."""


def _words(name: str, folder: Path, *more: str) -> list[object]:
    run = ["run", _config(name, folder.parent), "--participant", "P01", "--screen", "synthetic", "--seed", 5]
    return [*run, "--results", folder, *more]


def _config(name: str, folder: Path) -> str | Path:
    """The shipped design; of the pairs one whose pairs are chosen by the answers."""
    if name != "pairs":
        return name
    file = folder / "pairs.toml"
    if not file.exists():
        shipped = read_toml(shipped_folder() / "pairs.toml")
        procedure = {"kind": "pairing", "of": ["method"], "trials": 40}
        beside = {key: str(shipped_folder() / shipped[key]) for key in ("gun", "synthetic")}
        kept = {key: one for key, one in shipped.items() if key != "order"}
        file.write_text(toml_text(kept | beside | {"procedure": procedure}))
    return file


def _stem(name: str, folder: Path) -> Path:
    return folder / "sub-P01" / f"sub-P01_task-{name}"


def _rows(name: str, folder: Path) -> list[tuple[str, ...]]:
    with Path(f"{_stem(name, folder)}_trials.csv").open(newline="") as file:
        return [tuple(row[column] for column in _COLUMNS[name]) for row in csv.DictReader(file)]


def unbroken(name: str, folder: Path) -> list[tuple[str, ...]]:
    """What a run of a design felt and answered, trial by trial, that nobody disturbed."""
    subprocess.run(list(map(str, warm(*_words(name, folder)))), check=True, capture_output=True)
    return _rows(name, folder)


def killed_until_done(name: str, folder: Path, draw: random.Random, kills: int) -> tuple[int, list[tuple[str, ...]]]:
    """The same of a run that was killed and resumed so often, or until it was done; and how often it was."""
    journal, done = Path(f"{_stem(name, folder)}_journal.jsonl"), 0
    while done < kills:
        more = ["--resume"] if _lines(journal) else ["--fresh"]
        with subprocess.Popen(
            list(map(str, warm(*_words(name, folder, *more)))), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        ) as run:
            _wait_until(run, journal, _lines(journal) + draw.randint(1, 60))
            run.kill()
            run.communicate()  # ends when the program is gone, which the server kills a little later than its client
        contents = begun(journal) if journal.exists() else None
        if contents is not None and contents.finished:
            return done, _rows_of_finished(name, folder, journal)
        done += 1
    subprocess.run(list(map(str, warm(*_words(name, folder, "--resume")))), check=True, capture_output=True)
    return done, _rows(name, folder)


def _rows_of_finished(name: str, folder: Path, journal: Path) -> list[tuple[str, ...]]:
    """As `_rows`; the kill may have come between the journal's end and the table, which is then made again from it."""
    if not Path(f"{_stem(name, folder)}_trials.csv").exists():
        subprocess.run(list(map(str, warm("rebuild", journal))), check=True, capture_output=True)
    return _rows(name, folder)


def _lines(journal: Path) -> int:
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


def _wait_until(run: subprocess.Popen[bytes], journal: Path, lines: int) -> None:
    while run.poll() is None and _lines(journal) < lines:
        time.sleep(0.001)
