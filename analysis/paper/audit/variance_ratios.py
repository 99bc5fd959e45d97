"""A printed F against the printed means, at the grain of the data: within, between, or of transformed scores.

Column sums and sums of squares of whole numbers are whole, so the possible F are a lattice. A printed F off it is
proved impossible; one on it is believed only with data that give it.
Transformed values are no lattice, so only data that give the F count; F is computed in doubles and must lie inside its
interval by a margin far above their rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import asin, sqrt
from random import Random

from analysis.paper.audit.lattices import (
    Rows,
    between_candidates,
    between_ratio,
    between_terms,
    candidates,
    column_choices,
    effect,
    find_groups,
    find_rows,
    needed,
    ratio,
)
from analysis.paper.audit.means import AnswerScale, check_count, scale_of
from analysis.paper.audit.printed import (
    NONE_EXISTS,
    UNKNOWN,
    Attempt,
    CheckResult,
    DataExistence,
    Interval,
    JudgedReadings,
    PrintedNumber,
    Rounding,
    decimal,
    judge_readings,
    read_printed,
)

_STEPS, _STARTS, _MARGIN, _FEW_VALUES = 1_500, 8, 1e-9, 100

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
    for _ in range(_STARTS if n * len(columns) <= _FEW_VALUES else 1):
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


Search = Callable[[Sequence[int], Interval], Rows | bool | None]
"""From column sums and the F allowed: data in grains, False if proved that there are none, None if not settled."""
_SOURCE = "Winer 1971, chapter 4; lattice of whole sums as in Brown & Heathers 2017 and Anaya 2016"
_GUESSES, _SEARCHES = 3_000, 20
"""Column sums that are tried, and searches that may end without an answer."""
_MOST_VALUES, _MOST_TRANSFORMED = 20_000, 1_000
"""Values that a search moves within a second, and of those that are transformed."""


@dataclass(frozen=True, slots=True)
class _Claim:
    """A printed F with the printed means of groups of `sizes` on a scale."""

    F: PrintedNumber
    means: tuple[PrintedNumber, ...] | None
    sizes: tuple[int, ...]
    scale: AnswerScale

    @property
    def top(self) -> int | None:
        return self.scale.high if self.scale.low is not None else None

    @property
    def n(self) -> int:
        return self.sizes[0]

    def sums(self, rounding: Rounding) -> list[range]:
        """The column sums, in grains, that print as the means."""
        pairs = zip(self.means or (), self.sizes, strict=True)
        return [self.scale.sums(mean.interval(rounding), n) for mean, n in pairs]


def repeated_f(
    F: str,
    n: int,
    k: int,
    means: Sequence[str] | None = None,
    *,
    grain: str = "1",
    low: str | None = None,
    high: str | None = None,
    transforms: Sequence[str] = (),
    other_grains: Sequence[str] = (),
) -> CheckResult:
    """Can n participants in k conditions, scores in steps of `grain`, have these means and this repeated-measures F?

    Exact: F = (n - 1) A / (n W - A) with A = k sum C^2 - T^2 of the column sums C, and W the sum of squared differences
    between conditions within participants, both whole in grains squared, W of known parity. Without means every set of
    column sums is allowed. Readings: another error term (between), `transforms` of the scores as shares of the scale,
    scores in `other_grains` with any means. `ValueError`: text that is no number, n or k below 2, a wrong scale.
    Source: Winer 1971, chapter 4; the lattice by the identity in `lattices`.

    >>> repeated_f("28.45", 14, 3, ["55.7%", "79.3%", "92.9%"], grain="0.1", low="0", high="1").verdict
    'not attainable'
    """
    check_count(n - 1, "n - 1")
    claim = _claimed(F, means, (n,) * k, scale_of(grain, low, high))
    others: list[tuple[str, Attempt]] = [
        ("error term of a between-subjects design", partial(_data, claim, _between(claim)))
    ]
    others += [(f"{name} transform", partial(_data, claim, _transformed(claim, name))) for name in transforms]
    for step in other_grains:
        free = _claimed(F, None, (n,) * k, scale_of(step, low, high))
        others.append((f"scores in steps of {step} with other means", partial(_data, free, _repeated(free))))
    judged = judge_readings(partial(_data, claim, _repeated(claim)), others)
    return _result("repeated-measures F", claim, judged, _neighbours(claim, _w_steps))


def between_f(
    F: str,
    sizes: Sequence[int],
    means: Sequence[str] | None = None,
    *,
    grain: str = "1",
    low: str | None = None,
    high: str | None = None,
) -> CheckResult:
    """Can groups of these sizes, scores in steps of `grain`, have these means and this between-subjects F?

    Exact: F = ((B - T^2 / N) / (k - 1)) / ((S - B) / (N - k)), B = sum C^2 / n of the groups' sums C, and S, the sum of
    all squares, whole in grains squared and odd with T. Reading: a repeated-measures error term, in equal groups.
    `ValueError`: text that is no number, fewer than two groups, no group of two, a wrong scale.
    Source: Fisher 1925, Statistical Methods for Research Workers.

    >>> between_f("21.00", [3, 3, 3], ["2.00", "3.00", "7.00"]).verdict
    'attainable'
    """
    claim = _claimed(F, means, tuple(sizes), scale_of(grain, low, high))
    equal = len(set(sizes)) == 1 and claim.n > 1
    others = [("error term of a repeated-measures design", partial(_data, claim, _repeated(claim)))] if equal else []
    judged = judge_readings(partial(_data, claim, _between(claim)), others)
    return _result("between-subjects F", claim, judged, _neighbours(claim, _s_steps))


def _claimed(F: str, means: Sequence[str] | None, sizes: tuple[int, ...], scale: AnswerScale) -> _Claim:
    check_count(len(sizes) - 1, "number of groups less 1")
    for size in sizes:
        check_count(size, "each group")
    check_count(max(sizes) - 1, "size of the largest group less 1")
    if sum(sizes) > _MOST_VALUES:
        raise ValueError(f"values must be at most {_MOST_VALUES:,} in all for an F, not {sum(sizes):,}")
    if (scale.low is None) != (scale.high is None):
        raise ValueError("a scale needs both ends or none")
    if means is not None and len(means) != len(sizes):
        raise ValueError(f"{len(sizes)} means are needed, not {len(means)}")
    printed = read_printed(F)
    if printed.relation != "=":
        raise ValueError(f"F must be a number, not the bound {printed.text}")
    return _Claim(printed, None if means is None else tuple(map(read_printed, means)), sizes, scale)


def _repeated(claim: _Claim) -> Search:
    n, top = claim.n, claim.top
    return lambda columns, F: find_rows(columns, n, candidates(columns, n, F, top), top)


def _between(claim: _Claim) -> Search:
    sizes, top = claim.sizes, claim.top
    return lambda columns, F: find_groups(columns, sizes, between_candidates(columns, sizes, F, top), top)


def _transformed(claim: _Claim, name: str) -> Search:
    top = claim.top
    if top is None or claim.means is None:
        raise ValueError(f"the {name} transform needs a scale with both ends, and means")
    if sum(claim.sizes) > _MOST_TRANSFORMED or top > _MOST_VALUES:
        return lambda _columns, _F: None  # more than a search moves within seconds: left open
    return lambda columns, F: find_transformed(name, columns, claim.n, top, F)


def _data(claim: _Claim, search: Search, rounding: Rounding) -> DataExistence:
    F = claim.F.interval(rounding)
    if F.high is not None and F.high < 0:
        return NONE_EXISTS
    columns, complete = _columns(claim, rounding)
    left = _SEARCHES
    for sums in columns:
        found = search(sums, F)
        if found is None:
            complete, left = False, left - 1
            if left == 0:
                break
        elif found is not False and found is not True:
            return DataExistence(True, tuple(tuple(map(claim.scale.value, row)) for row in found))
    return NONE_EXISTS if complete else UNKNOWN


def _columns(claim: _Claim, rounding: Rounding) -> tuple[Iterator[tuple[int, ...]], bool]:
    """Column sums to try, and whether they are all there are."""
    if claim.means is not None:
        ranges = claim.sums(rounding)
        every = column_choices(ranges)
        return (every, True) if every is not None else (_guessed(ranges), False)
    ranges = [range(n * (100 if claim.top is None else claim.top) + 1) for n in claim.sizes]
    every = None if claim.top is None else column_choices(ranges, 20_000)
    return (every, True) if every is not None else (map(tuple, map(sorted, _guessed(ranges))), False)


def _guessed(ranges: Sequence[range]) -> Iterator[tuple[int, ...]]:
    random = Random(1)  # noqa: S311 a search, no secret
    if not all(ranges):
        return iter(())
    return (tuple(random.choice(sums) for sums in ranges) for _ in range(_GUESSES))


Steps = Callable[[_Claim, tuple[int, ...]], Iterator[tuple[Fraction, int]]]
"""From column sums: the F of the lattice next to the printed one with the side (-1 below, 1 above), if proved."""


def _neighbours(claim: _Claim, steps: Steps) -> tuple[Fraction | None, Fraction | None]:
    """The nearest F below and above the printed one that data give, for the column sums that print the means."""
    if claim.means is None or claim.F.value <= 0:
        return None, None
    choices = column_choices(claim.sums(Rounding.ANY), 12)
    found = [pair for sums in choices or () for pair in steps(claim, sums)]
    below = max((F for F, side in found if side < 0), default=None)
    return below, min((F for F, side in found if side > 0), default=None)


def _w_steps(claim: _Claim, sums: tuple[int, ...]) -> Iterator[tuple[Fraction, int]]:
    edge = int(needed(sums, claim.n, Interval(claim.F.value, claim.F.value)).low or 0)
    start = edge + (edge - (0 if len(sums) % 2 else sum(sums))) % 2
    rows = partial(find_rows, sums, claim.n, top=claim.top)
    return _beside(claim.F.value, start, lambda w: ratio(sums, w, claim.n), rows)


def _s_steps(claim: _Claim, sums: tuple[int, ...]) -> Iterator[tuple[Fraction, int]]:
    b, explained = between_terms(sums, claim.sizes)
    edge = int(b + explained * (sum(claim.sizes) - len(sums)) / ((len(sums) - 1) * claim.F.value))
    start = edge + (edge - sum(sums)) % 2
    groups = partial(find_groups, sums, claim.sizes, top=claim.top)
    return _beside(claim.F.value, start, lambda s: between_ratio(sums, s, claim.sizes), groups)


def _beside(
    value: Fraction,
    start: int,
    ratio_of: Callable[[int], Fraction | None],
    data: Callable[[range], Rows | bool | None],
) -> Iterator[tuple[Fraction, int]]:
    """On both sides, the first F, from `start` squares on, that data are found to have. F falls as it grows."""
    for side in (1, -1):
        for squares in range(start, start - 12 * side, -2 * side):
            F = ratio_of(squares)
            if F is not None and (F - value) * side >= 0 and data(range(squares, squares + 1)):
                yield F, side
                break


def _result(
    check: str, claim: _Claim, judged: JudgedReadings, sides: tuple[Fraction | None, Fraction | None]
) -> CheckResult:
    means = "unprinted means" if claim.means is None else f"means {', '.join(m.text for m in claim.means)}"
    grain = f"scores in steps of {decimal(claim.scale.grain)} with {means}{_no_means(claim)}"
    return CheckResult(
        check=check,
        printed=f"F = {claim.F.text}",
        judged=judged,
        reason=f"{grain}: the error's sum of squares comes in steps{_next_to(sides)}",
        source=_SOURCE,
        step=2 * claim.scale.grain**2 / (len(claim.sizes) if check.startswith("repeated") else 1),
        below=sides[0],
        above=sides[1],
        contradicts=() if judged.verdict in {"attainable", "undecided"} else (means, f"sizes {claim.sizes}"),
        numbers=_numbers(claim, check),
        number=claim.F,
        of=grain,
    )


def _no_means(claim: _Claim) -> str:
    """The means that no so many scores have, however they are rounded."""
    each = zip(claim.means, claim.sizes, claim.sums(Rounding.ANY), strict=True) if claim.means else ()
    none = dict.fromkeys(f"no {n} of them have the mean {mean.text}" for mean, n, sums in each if not sums)
    return f" ({', '.join(none)})" if none else ""


def _next_to(sides: tuple[Fraction | None, Fraction | None]) -> str:
    shown = [decimal(F, 4) for F in sides if F is not None]
    return f"; the nearest F with data that give it: {' and '.join(shown)}" if shown else ""


def _numbers(claim: _Claim, check: str) -> tuple[tuple[str, str], ...]:
    """The sums of the columns and the sum of squares that F would need, for one set of column sums."""
    if claim.means is None or claim.F.value <= 0:
        return ()
    ranges = claim.sums(Rounding.ANY)
    if any(len(sums) != 1 for sums in ranges):
        return (("column sums in grains", "; ".join(f"{s.start} to {s.stop - 1}" for s in ranges)),)
    columns = [sums[0] for sums in ranges]
    interval = claim.F.interval(Rounding.ANY)
    shown = [("column sums in grains", ", ".join(map(str, columns)))]
    if check.startswith("repeated"):
        shown += [("A", str(effect(columns))), ("W needed", str(needed(columns, claim.n, interval)))]
    return tuple(shown)
