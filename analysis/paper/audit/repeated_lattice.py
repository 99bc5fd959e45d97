"""The lattice of a repeated-measures F: which sums of squares n rows of k whole numbers can have.

With y_ij in grains, row sums R_i, column sums C_j and grand total T, all of these are whole:
effect A = k sum C^2 - T^2, W = sum_i (k sum_j y_ij^2 - R_i^2) = sum_i sum_{j<l} (y_ij - y_il)^2, and
F = (n - 1) A / (n W - A). W is even for odd k, and odd with T for even k.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import product
from math import prod
from random import Random

from analysis.paper.audit.printed import Interval

Rows = tuple[tuple[int, ...], ...]
EXACT_WORK = 2_400_000
"""Transitions of a full enumeration that are affordable."""
_STEPS, _STARTS = 6_000, 6


@dataclass(frozen=True, slots=True)
class Levels:
    """Whole numbers `0..top`, or all of them (None)."""

    top: int | None


def effect(columns: Sequence[int]) -> int:
    """A = k sum C^2 - T^2: n k times the sum of squares of the effect, in grains squared."""
    return len(columns) * sum(c * c for c in columns) - sum(columns) ** 2


def within(rows: Rows) -> int:
    """W = sum over rows and pairs of columns of the squared difference."""
    return sum(len(row) * sum(y * y for y in row) - sum(row) ** 2 for row in rows)


def ratio(columns: Sequence[int], w: int, n: int) -> Fraction | None:
    """F = (n - 1) A / (n W - A); None where there is no error."""
    a = effect(columns)
    return Fraction((n - 1) * a, n * w - a) if n * w > a else None


def needed(columns: Sequence[int], n: int, F: Interval) -> Interval:
    """The values of W, not only whole ones, that give an F inside: W = A (1 + (n - 1) / F) / n."""
    a = effect(columns)
    if a == 0:
        return Interval(Fraction(0), None if F.holds(Fraction(0)) else Fraction(0), False, False)
    low, high = F.low or Fraction(0), F.high
    least = Fraction(a, n) if high is None else a * (1 + (n - 1) / high) / n if high > 0 else None
    most = a * (1 + (n - 1) / low) / n if low > 0 else None
    if least is None:
        return Interval(Fraction(0), Fraction(0), False, False)
    return Interval(least, most, F.high_closed and high is not None, F.low_closed and low > 0)


def candidates(columns: Sequence[int], n: int, F: Interval, levels: Levels) -> range:
    """The whole W of the right parity that give an F inside, up to the greatest that the levels allow."""
    interval = needed(columns, n, F)
    most = greatest_within(columns, n, levels)
    if most is None and interval.high is None:
        most = int(interval.low or 0) + 1_000
    whole = interval.integers(0, most)
    odd = sum(columns) % 2 if len(columns) % 2 == 0 else 0
    start = whole.start + (whole.start - odd) % 2
    return range(start, whole.stop, 2)


def greatest_within(columns: Sequence[int], n: int, levels: Levels) -> int | None:
    """A bound on W: no square of a column is above top times its sum, and sum R^2 is at least T^2 / n."""
    if levels.top is None:
        return None
    k, total = len(columns), sum(columns)
    return k * levels.top * total - -(-total * total // n)


def find(columns: Sequence[int], n: int, targets: range, levels: Levels) -> Rows | bool | None:
    """Rows with these column sums and W in `targets`; False if it is proved that there are none, else None."""
    if not targets:
        return False
    if affordable(n, len(columns), levels):
        exact = every_sum(n, len(columns), levels.top or 0).get(tuple(columns), 0)
        hits = [w for w in targets if exact >> w & 1]
        if not hits:
            return False
        targets = range(hits[0], hits[0] + 1)
    return search(columns, n, targets, levels)


def affordable(n: int, k: int, levels: Levels) -> bool:
    """Can all sums be enumerated?"""
    if levels.top is None:
        return False
    work: int = n * (levels.top + 1) ** k * (n * levels.top + 1) ** k
    return work <= EXACT_WORK


@lru_cache(maxsize=64)
def every_sum(n: int, k: int, top: int) -> dict[tuple[int, ...], int]:
    """All column sums of n rows of k numbers in 0..top; the bits of each say which W it can have."""
    sums = {(0,) * k: 1}
    choices = [(row, within((row,))) for row in product(range(top + 1), repeat=k)]
    for _ in range(n):
        grown: dict[tuple[int, ...], int] = {}
        for columns, bits in sums.items():
            for row, w in choices:
                place = tuple(a + b for a, b in zip(columns, row, strict=True))
                grown[place] = grown.get(place, 0) | bits << w
        sums = grown
    return sums


def search(columns: Sequence[int], n: int, targets: range, levels: Levels, seed: int = 0) -> Rows | None:
    """Rows with these column sums and W in `targets`, by small steps that keep the sums; None if none was met."""
    random = Random(seed)  # noqa: S311 a search, no secret
    if levels.top is not None and any(not 0 <= c <= n * levels.top for c in columns):
        return None
    for _ in range(_STARTS):
        table = _Table(_start(columns, n, random), levels)
        for _ in range(_STEPS):
            if table.w in targets:
                return tuple(tuple(row) for row in table.rows)
            table.step(targets, random)
    return None


def _start(columns: Sequence[int], n: int, random: Random) -> list[list[int]]:
    """Columns as even as can be, each in random order or sorted."""
    spread = [[c // n + (i < c % n) for i in range(n)] for c in columns]
    if random.random() < 0.5:
        for column in spread:
            random.shuffle(column)
    return [list(row) for row in zip(*spread, strict=True)]


class _Table:
    """Rows under way, with their sums and W kept up to date."""

    def __init__(self, rows: list[list[int]], levels: Levels) -> None:
        self.rows, self.levels = rows, levels
        self.sums = [sum(row) for row in rows]
        self.w = within(tuple(tuple(row) for row in rows))

    def step(self, targets: range, random: Random) -> None:
        """Move a whole amount from one row to another in a column, if that brings W nearer, or by chance."""
        k, n = len(self.rows[0]), len(self.rows)
        a, b, j = int(random.random() * n), int(random.random() * n), int(random.random() * k)
        gap = self.rows[b][j] - self.rows[a][j]
        amount = gap if random.random() < 0.4 else 1 if random.random() < 0.9 else int(random.random() * 4) + 1
        change = self._change(a, b, j, amount)
        if change is None:
            return
        far, near = distance(self.w, targets), distance(self.w + change, targets)
        if near <= far or random.random() < 0.02:
            self.rows[a][j] += amount
            self.rows[b][j] -= amount
            self.sums[a] += amount
            self.sums[b] -= amount
            self.w += change

    def _change(self, a: int, b: int, j: int, amount: int) -> int | None:
        """What the move does to W; None if it leaves the levels or moves nothing."""
        x, y, k = self.rows[a][j], self.rows[b][j], len(self.rows[0])
        top = self.levels.top
        if a == b or amount == 0 or (top is not None and not (0 <= x + amount <= top and 0 <= y - amount <= top)):
            return None
        squares = 2 * amount * (x - y + amount)
        return k * squares - 2 * amount * (self.sums[a] - self.sums[b] + amount)


def distance(w: int, targets: range) -> int:
    """How far W is from the nearest target."""
    if w < targets[0]:
        return targets[0] - w
    return w - targets[-1] if w > targets[-1] else int(w not in targets)


def column_choices(ranges: Sequence[range], most: int = 2_000) -> Iterator[tuple[int, ...]] | None:
    """All column sums within the ranges; None if they are too many."""
    return None if prod(map(len, ranges)) > most else product(*ranges)
