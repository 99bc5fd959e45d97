"""A repeated-measures F of transformed scores: looked for, never excluded.

The transformed values are no lattice, so only data that give the F count; F is computed in doubles and must lie inside
its interval by a margin far above their rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import asin, sqrt
from random import Random

from analysis.paper.audit.printed import Interval
from analysis.paper.audit.repeated_lattice import Rows

_STEPS, _STARTS, _MARGIN = 1_500, 8, 1e-9

TRANSFORMS: dict[str, Callable[[float], float]] = {
    "arcsine": lambda share: asin(sqrt(share)),
    "square root": sqrt,
    "square": lambda share: share * share,
}
"""Of a score as a share of its scale. Arcsine of the root: Freeman & Tukey 1950, Annals of Math. Statistics 21, 607."""


def find_transformed(name: str, columns: Sequence[int], n: int, top: int, F: Interval) -> Rows | None:
    """Rows of whole numbers 0..top with these column sums whose transformed values have an F inside, if met.

    `ValueError` for a transform that is not known.
    """
    if name not in TRANSFORMS:
        raise ValueError(f"transform {name!r} is unknown (rule: one of {', '.join(TRANSFORMS)})")
    if F.low is None or F.high is None or F.high <= 0:
        return None
    values = [TRANSFORMS[name](y / top) for y in range(top + 1)]
    low, high = float(F.low) * (1 + _MARGIN), float(F.high) * (1 - _MARGIN)
    random = Random(1)  # noqa: S311 a search, no secret
    for _ in range(_STARTS):
        rows = _climbed(_spread(columns, n), values, (low, high), random)
        if rows is not None:
            return tuple(map(tuple, rows))
    return None


def _spread(columns: Sequence[int], n: int) -> list[list[int]]:
    return [[c // n + (i < c % n) for c in columns] for i in range(n)]


def _climbed(
    rows: list[list[int]], values: Sequence[float], goal: tuple[float, float], random: Random
) -> list[list[int]] | None:
    """Steps of one amount between two rows of a column, kept if they bring F nearer to the goal, or by chance."""
    low, high = goal
    now = _f_of(rows, values)
    for _ in range(_STEPS):
        if low < now < high:
            return rows
        a, b, j = random.randrange(len(rows)), random.randrange(len(rows)), random.randrange(len(rows[0]))
        amount = random.choice((1, 1, 2, rows[b][j] - rows[a][j]))
        if a == b or not (0 <= rows[a][j] + amount < len(values) and 0 <= rows[b][j] - amount < len(values)):
            continue
        rows[a][j] += amount
        rows[b][j] -= amount
        then = _f_of(rows, values)
        if abs(then - (low + high) / 2) <= abs(now - (low + high) / 2) or random.random() < 0.02:
            now = then
        else:
            rows[a][j] -= amount
            rows[b][j] += amount
    return None


def _f_of(rows: list[list[int]], values: Sequence[float]) -> float:
    n, k = len(rows), len(rows[0])
    x = [[values[y] for y in row] for row in rows]
    columns = [sum(column) for column in zip(*x, strict=True)]
    grand = sum(columns) ** 2 / (n * k)
    effect = sum(c * c for c in columns) / n - grand
    people = sum(sum(row) ** 2 for row in x) / k - grand
    error = sum(v * v for row in x for v in row) - grand - effect - people
    return (n - 1) * effect / error if error > 1e-9 else float("inf")
