"""The data sets given to R: `python make_datasets.py` writes `datasets.json` beside this file.

Every number comes from the raw bits of PCG64, which numpy promises never to change, through additions alone; it is
rounded to a few decimals, so the file is short and R reads the very doubles that Python reads.
`relative_tolerance` is how far apart two sums of squares, or an F, may lie: 1e-12, or what is left of R's digits where
it is known to lose some (an offset of 10^d costs aov and afex about d digits).
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

FULL = 1e-12
Table = list[list[float]]
Dataset = dict[str, Any]


def normals(seed: int, count: int) -> np.ndarray:
    """Nearly normal numbers of mean 0 and variance 1: twelve uniform ones added up, less six."""
    uniform = (np.random.PCG64(seed).random_raw(12 * count) >> np.uint64(11)) * 2.0**-53
    total = np.zeros(count)
    for part in uniform.reshape(12, count):
        total = total + part
    return total - 6.0


def table(seed: int, n: int, k: int) -> np.ndarray:
    return normals(seed, n * k).reshape(n, k)


def person(seed: int, n: int) -> np.ndarray:
    return normals(1000 + seed, n)[:, None]


def tenths(values: np.ndarray) -> Table:
    """On the lattice 0, 0.1 ... 1: a rate of 10 trials."""
    return decimals(np.clip(np.rint(values * 10), 0, 10) / 10, 1)


def decimals(values: np.ndarray, digits: int = 3) -> Table:
    return [[round(float(value), digits) + 0.0 for value in row] for row in values]


def dataset(name: str, about: str, scores: Table, relative_tolerance: float = FULL) -> Dataset:
    return {"name": name, "about": about, "relative_tolerance": relative_tolerance, "scores": scores}


def within() -> list[Dataset]:
    """Participants by conditions."""
    return [*like_the_papers(), *sizes(), *scales(), *effects(), *shapes()]


def like_the_papers() -> list[Dataset]:
    rate = np.array([0.55, 0.8, 0.88])
    rating = np.array([2.4, 6.0, 7.8])
    return [
        dataset("rates", "14 x 3 rates of 10 trials", tenths(rate + 0.1 * table(1, 14, 3))),
        dataset("rates at chance", "14 x 3 rates of 10 trials, no effect", tenths(0.5 + 0.15 * table(2, 14, 3))),
        dataset(
            "rates near the ceiling",
            "14 x 3, one condition without a spread",
            tenths(rate + [0, 0, 1] + table(3, 14, 3) / 5),
        ),
        dataset(
            "ratings",
            "14 x 3 ratings 0 to 10 with one decimal",
            decimals(np.clip(rating + 2 * table(4, 14, 3), 0, 10), 1),
        ),
        dataset(
            "whole ratings", "16 x 4 ratings 1 to 7, many ties", decimals(4 + np.arange(4) / 4 + table(5, 16, 4), 0)
        ),
        dataset("right or wrong", "20 x 3 zeros and ones", decimals(table(6, 20, 3) > [0.6, 0.0, -0.8], 0)),
    ]


def sizes() -> list[Dataset]:
    return [
        dataset("two conditions", "12 x 2", decimals(person(7, 12) + np.arange(2) / 2 + table(7, 12, 2))),
        dataset("two participants", "2 x 4", decimals(np.arange(4) + table(8, 2, 4))),
        dataset("two by two", "2 x 2", decimals(np.arange(2) + table(9, 2, 2))),
        dataset("three participants", "3 x 3", decimals(np.arange(3) + table(10, 3, 3))),
        dataset("fewer participants than conditions", "4 x 7", decimals(np.arange(7) / 3 + table(11, 4, 7))),
        dataset("as many participants as conditions", "6 x 6", decimals(np.arange(6) / 3 + table(12, 6, 6))),
        dataset("many conditions", "25 x 12", decimals(person(13, 25) + np.arange(12) / 10 + table(13, 25, 12))),
        dataset("many participants", "120 x 3", decimals(person(14, 120) + np.arange(3) / 8 + table(14, 120, 3))),
    ]


def scales() -> list[Dataset]:
    base = np.arange(3) * 0.6 + table(15, 14, 3)
    return [
        dataset("offset of a thousand", "14 x 3 around 1e3", decimals(1e3 + base), 1e-11),
        dataset("offset of a million", "14 x 3 around 1e6: R keeps about 9 digits", decimals(1e6 + base), 1e-8),
        dataset("tiny numbers", "14 x 3, x 1e-6", decimals(1e-6 * base, 9)),
        dataset("huge numbers", "14 x 3, x 1e9", decimals(1e9 * base, 0)),
        dataset("below zero", "14 x 3 around -50", decimals(base - 50.0)),
        dataset(
            "people far apart",
            "14 x 3, participants 100 times as far apart as the error",
            decimals(100 * person(16, 14) + base),
            1e-11,
        ),
    ]


def effects() -> list[Dataset]:
    return [
        dataset("weak effect", "20 x 4", decimals(person(17, 20) + np.arange(4) / 10 + table(17, 20, 4))),
        dataset("strong effect", "20 x 4", decimals(person(18, 20) + np.arange(4) * 1.2 + table(18, 20, 4))),
        dataset(
            "no effect at all",
            "a Latin square: F = 0, and no spread of the participants",
            [[1, 2, 3], [2, 3, 1], [3, 1, 2]],
        ),
    ]


def shapes() -> list[Dataset]:
    noisy = table(20, 20, 4) * [0.3, 0.3, 0.3, 3.0]
    return [
        dataset("one noisy condition", "20 x 4, epsilon near its bound", decimals(np.arange(4) / 2 + noisy)),
        dataset(
            "random walks",
            "16 x 6, errors that add up",
            decimals(np.arange(6) / 3 + np.cumsum(table(21, 16, 6), axis=1)),
        ),
        dataset("spherical", "30 x 4, independent errors", decimals(np.arange(4) / 4 + table(22, 30, 4))),
        dataset(
            "response times", "24 x 3 in seconds, skewed", decimals(0.3 + [0.3, 0.4, 0.5] * np.square(table(23, 24, 3)))
        ),
        dataset(
            "ties within participants",
            "18 x 3 whole numbers 0 to 2",
            decimals(np.clip(np.rint(1 + table(24, 18, 3)), 0, 2), 0),
        ),
        dataset(
            "opposed",
            "15 x 2, conditions that correlate negatively",
            decimals(person(25, 15) * [1, -1] + table(25, 15, 2) / 3),
        ),
    ]


def between() -> list[Dataset]:
    """Groups of different people."""
    return [
        groups("equal groups", [10, 10, 10], seed=40),
        groups("unequal groups", [5, 6, 9], seed=41),
        groups("one alone in a group", [1, 7, 8], seed=42),
        groups("two groups", [8, 12], seed=43),
        groups("many groups", [3, 4, 5, 6, 7, 8, 9, 10], seed=44, step=0.3),
        groups("very unequal groups", [2, 40, 5], seed=45),
        groups("weak difference", [15, 14, 16, 15], seed=46, step=0.05),
        groups("strong difference", [9, 10, 11], seed=47, step=2.0),
        groups("ties", [12, 12, 12], seed=48, digits=0),
        groups("offset of a thousand", [7, 8, 9], seed=49, offset=1e3, relative_tolerance=1e-11),
        groups("offset of a million", [7, 8, 9], seed=50, offset=1e6, relative_tolerance=1e-8),
    ]


def groups(
    name: str,
    sizes: list[int],
    *,
    seed: int,
    step: float = 0.8,
    offset: float = 0.0,
    digits: int = 3,
    relative_tolerance: float = FULL,
) -> Dataset:
    drawn = np.split(normals(seed, sum(sizes)), np.cumsum(sizes)[:-1])
    about = f"{len(sizes)} groups of {', '.join(map(str, sizes))}"
    values = decimals([offset + step * i + group for i, group in enumerate(drawn)], digits)
    return {"name": name, "about": about, "relative_tolerance": relative_tolerance, "groups": values}


def studentized_range() -> Dataset:
    """Where R's ptukey and qtukey keep digits: not at 2 or 3 degrees of freedom, not far out in the tail."""
    return {
        "ptukey": {
            "q": [0.25, 0.5, 1, 2, 3, 3.5, 4, 5, 6, 7],
            "k": [2, 3, 4, 6, 10, 20],
            "df": [5, 8, 13, 26, 60, 200, 1000],
        },
        "qtukey": {"alpha": [0.1, 0.05, 0.01], "k": [2, 3, 4, 10], "df": [5, 13, 26, 200]},
    }


def binomial() -> list[list[float]]:
    """Rows of successes, trials, chance, confidence."""
    rows = []
    for trials in (1, 2, 5, 10, 20, 40, 140, 280, 1000):
        counts = sorted({0, 1, trials // 10, trials // 3, trials // 2, (trials + 1) // 2, trials - 1, trials})
        rows += [[k, trials, p0, 0.95] for k in counts for p0 in (0.1, 1 / 3, 0.5, 0.75)]
    published = [[k, 140, 0.5, level] for k in (67, 78) for level in (0.9, 0.95, 0.99)]
    return rows + published + [[0, 10, 0.0, 0.95], [1, 10, 0.0, 0.95], [10, 10, 1.0, 0.95], [9, 10, 1.0, 0.95]]


def everything() -> dict[str, Any]:
    return {
        "within": within(),
        "between": between(),
        "studentized_range": studentized_range(),
        "binomial": binomial(),
    }


def as_text(value: Any, depth: int = 0) -> str:
    """JSON with one row of numbers to a line."""
    if isinstance(value, list) and all(not isinstance(item, (list, dict)) for item in value):
        return json.dumps(value)
    if isinstance(value, (list, dict)):
        pairs = value.items() if isinstance(value, dict) else [(None, item) for item in value]
        inner = [(f"{json.dumps(key)}: " if key is not None else "") + as_text(item, depth + 1) for key, item in pairs]
        left, right = "{}" if isinstance(value, dict) else "[]"
        return f"{left}\n" + ",\n".join(" " * (depth + 1) + line for line in inner) + f"\n{' ' * depth}{right}"
    return json.dumps(value)


if __name__ == "__main__":
    text = as_text(everything()) + "\n"
    Path(__file__).with_name("datasets.json").write_text(text, encoding="utf-8")
