"""Small data sets and the summaries of them that a paper prints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from math import isqrt
from random import Random

from analysis.paper.audit.means import AnswerScale, scale_of
from analysis.paper.audit.printed import Rounding, read_printed
from analysis.paper.audit.reconstruct import ColumnOrder, ConditionColumn, Constraints, meets

MEANS = {"vibration": 2.4, "asymmetric-1": 6.0, "asymmetric-2": 7.8}
Rows = tuple[tuple[int, ...], ...]
DESIGNS = [(1, True), (2, False), (3, False), (4, False), (2, True), (3, True), (4, True)]


def half_up(value: Fraction, digits: int = 2) -> str:
    """A number not below 0 as printed, by whole numbers alone."""
    units = (2 * value * 10**digits + 1) // 2
    return f"{units // 10**digits}.{units % 10**digits:0{digits}d}"


def root_half_up(square: Fraction, digits: int = 2) -> str:
    """The root of a square as printed: half the root of four squares, by whole numbers alone."""
    scaled = square * 4 * 100**digits
    units = (isqrt(scaled.numerator // scaled.denominator) + 1) // 2
    return f"{units // 10**digits}.{units % 10**digits:0{digits}d}"


def sample(random: Random, k: int) -> tuple[Rows, int]:
    """Whole numbers that somebody might have answered: at random, or of people who differ."""
    n, top = random.randint(5, 30), random.choice((4, 6, 10, 20, 100))
    if random.random() < 0.5:
        return tuple(tuple(random.randint(0, top) for _ in range(k)) for _ in range(n)), top
    centres, people = [random.uniform(0.2, 0.8) * top for _ in range(k)], [random.gauss(0, top / 6) for _ in range(n)]
    cells = ((min(max(round(random.gauss(c + p, top / 6)), 0), top) for c in centres) for p in people)
    return tuple(map(tuple, cells)), top


def summarised(rows: Rows, top: int, *, with_sds: bool) -> Constraints | None:
    """What a paper would print of a sample, to two decimals; None where its F is undefined."""
    n, k, columns = len(rows), len(rows[0]), list(zip(*rows, strict=True))
    means = [half_up(Fraction(sum(column), n)) for column in columns]
    squares = [Fraction(n * sum(x * x for x in column) - sum(column) ** 2, n * (n - 1)) for column in columns]
    F = None
    if k > 1:
        a = k * sum(sum(c) ** 2 for c in columns) - sum(map(sum, columns)) ** 2
        w = sum(k * sum(x * x for x in row) - sum(row) ** 2 for row in rows)
        if n * w <= a:
            return None
        F = half_up(Fraction((n - 1) * a, n * w - a))
    sds = [root_half_up(square) for square in squares] if with_sds else None
    return printed_constraints(n, means, scale_of("1", "0", str(top)), sds=sds, F=F)


def printed_constraints(
    n: int,
    means: Sequence[str],
    scale: AnswerScale,
    *,
    sds: Sequence[str] | None = None,
    F: str | None = None,
    orders: Sequence[ColumnOrder] = (),
) -> Constraints:
    """The constraints that printed means, SDs and F make of n participants on a scale with both ends.

    Data count in grains above the scale's lower end: `scale.value` gives their values.
    `ValueError` for text that is no number, or a scale without ends.
    """
    if scale.low is None or scale.high is None:
        raise ValueError("a reconstruction needs a scale with both ends")
    spreads = (
        [None] * len(means) if sds is None else [read_printed(sd).interval(Rounding.HALF_UP).squared() for sd in sds]
    )
    columns = tuple(
        ConditionColumn(
            sums=scale.sums(read_printed(mean).interval(Rounding.HALF_UP), n),
            variance=None if spread is None else spread.mapped(lambda value: value / scale.grain**2),
        )
        for mean, spread in zip(means, spreads, strict=True)
    )
    interval = None if F is None else read_printed(F).interval(Rounding.HALF_UP)
    return Constraints(n=n, top=scale.high, columns=columns, F=interval, orders=tuple(orders))


def cases(k: int, with_sds: bool, count: int, seed: int = 5) -> Iterator[Constraints]:
    random = Random(seed)
    while count:
        rows, top = sample(random, k)
        wanted = summarised(rows, top, with_sds=with_sds)
        if wanted is not None:
            assert meets(rows, wanted), rows
            count -= 1
            yield wanted
