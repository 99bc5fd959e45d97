"""Tables of scores of every kind that a repeated-measures ANOVA meets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from analysis.logs.reading import read_logs
from analysis.stats.cells import ByParticipant
from analysis.summary.results import StudyStatistics
from analysis.summary.summary import summarize
from tests.log_files import METHODS, rating_rows, ratings_path, trial_rows, trials_path, write_rows

KINDS = ("ordinary", "weak", "huge", "far apart")


def made_scores(seed: int, n: int, k: int, kind: str, offset: float) -> np.ndarray:
    """A table (n, k) of spread 1 about `offset`.

    `weak` has F below 0.01, `huge` near 1e8 and above, and no offset, which would leave its residuals no digit; in
    `far apart` each participant has an offset of his own, up to `offset`.
    """
    rng = np.random.default_rng(seed)
    noise, people, effect = rng.normal(size=(n, k)), 2 * rng.normal(size=(n, 1)), rng.normal(size=k)
    match kind:
        case "weak":
            return offset + people + noise - noise.mean(axis=0) + 1e-3 * effect
        case "huge":
            return 1e-4 * (people + noise) + effect
        case "far apart":
            return people + noise + 0.6 * effect + offset ** rng.uniform(0, 1, size=(n, 1))
        case _:
            return offset + people + noise + 0.6 * effect


_ROWS = "6 9 10, 2 9 10, 5 7 8, 6 6 10, 5 9 9, 8 8 10, 5 8 10, 8 10 10, 2 8 10, 7 8 9, 6 9 10, 5 8 10, 7 7 9, 7 9 10"
RIGHT = np.array([row.split() for row in _ROWS.split(",")], dtype=np.int64)
"""Right forward answers of ten, 14 participants by 3 methods: the data of every "R 4.2.2" number in these tests."""


def study_of(folder: Path, right: Any, methods: tuple[str, ...] = METHODS, *, timed: bool = True) -> StudyStatistics:
    """Statistics of participants with so many right forward answers of ten; every second backward answer is right.

    Answers that are not timed have no diffusion to fit, which takes longer than all else.
    """
    for i, counts in enumerate(right):
        code = f"P{i + 1:02d}"
        rows = trial_rows(code, seed=i + 1, methods=methods)
        for method, count in zip(methods, counts, strict=True):
            for direction, share in (("forward", int(count)), ("backward", 5)):
                chosen = [r for r in rows if r["method"] == method and r["direction"] == direction]
                for place, row in enumerate(chosen):
                    other = "backward" if direction == "forward" else "forward"
                    correct = place < share
                    row.update(response=direction if correct else other, correct=str(int(correct)))
                    row.update({} if timed else {"response_time_s": "", "response_time_valid": ""})
        write_rows(trials_path(folder, code), rows)
    return summarize(read_logs([folder]))


def ratings_of(folder: Path, table: Any, methods: tuple[str, ...] = METHODS) -> StudyStatistics:
    for i, ratings in enumerate(table):
        rows = rating_rows(f"P{i + 1:02d}", methods=methods)
        for row, rating in zip(rows, ratings, strict=True):
            row["rating"] = str(rating)
        write_rows(ratings_path(folder, f"P{i + 1:02d}"), rows)
    return summarize(read_logs([folder]))


def crowd_of(people: ByParticipant, n: int) -> ByParticipant:
    """So many participants: these again and again."""
    return ByParticipant([f"P{i:05d}" for i in range(n)], people.names, np.resize(people.array, (n, len(people.names))))


CEILING = np.full((6, 3), 10)
ONE_AT_CEILING = np.column_stack([RIGHT[:, :2], np.full(14, 10)])


PEOPLE, COLUMNS = np.arange(14)[:, None] * 0.1, np.array([0.0, 0.1, 0.3])
ADDITIVE = PEOPLE + COLUMNS
"""0, 0.1, ... 1.3 plus 0, 0.1, 0.3: F is infinite in decimals, 3e32 in doubles; pingouin 0.7: -9.6e15, p = 1."""
