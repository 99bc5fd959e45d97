"""Valid logs for tests: rows as text, in the layout of `experiments.record.tables`, and a writer."""

from __future__ import annotations

import csv
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from experiments.record import tables

METHODS = ("vibration", "asymmetric-1", "asymmetric-2")
FORWARD_RATES = {"vibration": 0.557, "asymmetric-1": 0.793, "asymmetric-2": 0.929}
RATINGS = {"vibration": 2.0, "asymmetric-1": 5.5, "asymmetric-2": 7.5}

TextRow = dict[str, str]


def trial_rows(code: str = "P01", seed: int = 1, methods: tuple[str, ...] = METHODS, sets: int = 4) -> list[TextRow]:
    """One participant's direction trials: a session a method, `sets` x 5 trials, half of them forward."""
    rng = np.random.default_rng(seed)
    rows = []
    for session, method in enumerate(methods, start=1):
        directions = rng.permutation(["forward", "backward"] * (sets * 5 // 2))
        for i, direction in enumerate(directions):
            correct = rng.random() < FORWARD_RATES.get(method, 0.5)
            other = "backward" if direction == "forward" else "forward"
            rows.append(
                {
                    "participant_id": code,
                    "experiment": "direction",
                    "session": str(session),
                    "method": method,
                    "set": str(i // 5 + 1),
                    "trial": str(i + 1),
                    "direction": str(direction),
                    "response": str(direction) if correct else other,
                    "correct": str(int(correct)),
                    "response_time_s": f"{0.6 + rng.random():.3f}",
                    "response_source": "synthetic",
                    "response_time_valid": "1",
                    "attempts": "1",
                    "note": "",
                }
            )
    return rows


def by_hand(rows: list[TextRow]) -> list[TextRow]:
    """The rows, all entered by the experimenter."""
    return [row | {"response_source": "experimenter", "response_time_valid": "0"} for row in rows]


def rating_rows(code: str = "P01", seed: int = 1, methods: tuple[str, ...] = METHODS) -> list[TextRow]:
    """One participant's ratings, a spread of 1.5 around the mean of each method."""
    rng = np.random.default_rng(seed)
    return [
        {
            "participant_id": code,
            "experiment": "preference",
            "trial": str(i + 1),
            "method": method,
            "rating": f"{np.clip(RATINGS.get(method, 5.0) + rng.normal(0.0, 1.5), 0.0, 10.0):.1f}",
            "rating_by": "synthetic",
            "comment": "",
        }
        for i, method in enumerate(methods)
    ]


def write_rows(path: Path, rows: list[TextRow], header: list[str] | None = None) -> Path:
    """`rows` under `header` (all columns of the table unless given) as RFC 4180."""
    names = header or tables.names(rows[0]["experiment"])
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, names, restval="", extrasaction="ignore", lineterminator="\r\n")
        writer.writeheader()
        writer.writerows(rows)
    return path


def trials_path(folder: Path, code: str) -> Path:
    return folder / f"sub-{code}" / f"sub-{code}_task-direction_trials.csv"


def ratings_path(folder: Path, code: str) -> Path:
    return folder / f"sub-{code}" / f"sub-{code}_task-preference_ratings.csv"


def write_study(folder: Path, participants: int = 14, seed: int = 1) -> Path:
    """Both experiments of so many participants, P01, P02, ..."""
    for i in range(1, participants + 1):
        code = f"P{i:02d}"
        write_rows(trials_path(folder, code), trial_rows(code, seed * 1000 + i))
        write_rows(ratings_path(folder, code), rating_rows(code, seed * 1000 + i))
    return folder


def write_many(folder: Path, participants: int) -> Path:
    """Direction trials of so many participants with every column that a run fills in, each its own answers."""
    start = datetime(2024, 11, 21, 9, tzinfo=UTC)
    for i in range(1, participants + 1):
        rng = np.random.default_rng(i)
        rows = trial_rows(f"P{i:05d}", i)
        for k, row in enumerate(rows):
            onset = start + timedelta(hours=i, seconds=17 * k + float(rng.random()))
            row["onset_utc"] = onset.isoformat(timespec="microseconds").replace("+00:00", "Z")
            row |= {"gun": "simulated", "response_time_s": f"{0.6 + rng.random():.6f}"}
        write_rows(trials_path(folder, f"P{i:05d}"), rows)
    return folder


def tree(folder: Path) -> dict[str, bytes]:
    """Every file below a folder, by its path there."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
