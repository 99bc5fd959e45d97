"""The lattices of an F: which sums of squares whole numbers can have, in rows of k or in groups.

With y_ij in grains, row sums R_i, column sums C_j and grand total T, all of these are whole:
effect A = k sum C^2 - T^2, W = sum_i (k sum_j y_ij^2 - R_i^2) = sum_i sum_{j<l} (y_ij - y_il)^2, and
F = (n - 1) A / (n W - A). W is even for odd k, and odd with T for even k.

With sums C_j of groups of n_j, B = sum C_j^2 / n_j, T and N in all, and S the sum of all squares:
F = ((B - T^2 / N) / (k - 1)) / ((S - B) / (N - k)); S is whole, and odd with T.

Whether whole numbers with a given sum and a given sum of squares exist is settled by a complete search: it ends with
such numbers, or with the proof that there are none, or says that its budget of steps is used up. Values fall from left
to right; a partial choice is left when the rest cannot have its sums, by parity (x and x^2 are odd together), by the
least sum of squares (all values equal) or by the greatest (all at an end).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from itertools import product
from math import isqrt, prod
from random import Random

from analysis.paper.audit.printed import Interval

Rows = tuple[tuple[int, ...], ...]
EXACT_WORK = 2_400_000
"""Transitions of a full enumeration that are affordable."""
_STEPS, _STARTS = 6_000, 6


def effect(columns: Sequence[int]) -> int:
    """A = k sum C^2 - T^2: n k times the sum of squares of the effect, in grains squared."""
    return len(columns) * sum(c * c for c in columns) - sum(columns) ** 2


def within_rows(rows: Rows) -> int:
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


def candidates(columns: Sequence[int], n: int, F: Interval, top: int | None) -> range:
    """The whole W of the right parity that give an F inside, up to the greatest that numbers up to `top` allow."""
    parity = 0 if len(columns) % 2 else sum(columns)
    return of_parity(needed(columns, n, F), 0, greatest_within(columns, n, top), parity)


def of_parity(interval: Interval, least: int, most: int | None, parity: int) -> range:
    """The whole numbers inside, from `least` to `most` (None: or a thousand on), as even or odd as `parity` is."""
    if most is None and interval.high is None:
        most = int(interval.low or 0) + 1_000
    whole = interval.integers(least, most)
    return range(whole.start + (whole.start - parity) % 2, whole.stop, 2)


def greatest_within(columns: Sequence[int], n: int, top: int | None) -> int | None:
    """A bound on W: no square of a column is above top times its sum, and sum R^2 is at least T^2 / n."""
    if top is None:
        return None
    k, total = len(columns), sum(columns)
    return k * top * total - -(-total * total // n)


def find_rows(columns: Sequence[int], n: int, targets: range, top: int | None) -> Rows | bool | None:
    """Rows of `0..top` (None: any) with these column sums and W in `targets`; False if proved that there are none."""
    if not targets:
        return False
    if affordable(n, len(columns), top):
        exact = every_sum(n, len(columns), top or 0).get(tuple(columns), 0)
        hits = [w for w in targets if exact >> w & 1]
        if not hits:
            return False
        targets = range(hits[0], hits[0] + 1)
    return search_rows(columns, n, targets, top)


def affordable(n: int, k: int, top: int | None) -> bool:
    """Can all sums be enumerated?"""
    return top is not None and bool(n * (top + 1) ** k * (n * top + 1) ** k <= EXACT_WORK)


@lru_cache(maxsize=64)
def every_sum(n: int, k: int, top: int) -> dict[tuple[int, ...], int]:
    """All column sums of n rows of k numbers in 0..top; the bits of each say which W it can have."""
    sums = {(0,) * k: 1}
    choices = [(row, within_rows((row,))) for row in product(range(top + 1), repeat=k)]
    for _ in range(n):
        grown: dict[tuple[int, ...], int] = {}
        for columns, bits in sums.items():
            for row, w in choices:
                place = tuple(a + b for a, b in zip(columns, row, strict=True))
                grown[place] = grown.get(place, 0) | bits << w
        sums = grown
    return sums


def search_rows(columns: Sequence[int], n: int, targets: range, top: int | None) -> Rows | None:
    """Rows with these column sums and W in `targets`, by small steps that keep the sums; None if none was met."""
    random = Random(0)  # noqa: S311 a search, no secret
    if top is not None and any(not 0 <= c <= n * top for c in columns):
        return None
    for _ in range(_STARTS):
        table = _Table(_start(columns, n, random), top)
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

    def __init__(self, rows: list[list[int]], top: int | None) -> None:
        self.rows, self.top = rows, top
        self.sums = [sum(row) for row in rows]
        self.w = within_rows(tuple(tuple(row) for row in rows))

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
        top = self.top
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


SEARCH_STEPS = 20_000
"""Of one search for numbers with their sums."""
_EXACT_WORK = 400_000
_TRIES = 60


def between_terms(sums: Sequence[int], sizes: Sequence[int]) -> tuple[Fraction, Fraction]:
    """B = sum C^2 / n and the sum of squares of the effect, B - T^2 / N."""
    b = sum((Fraction(c * c, n) for c, n in zip(sums, sizes, strict=True)), Fraction(0))
    return b, b - Fraction(sum(sums) ** 2, sum(sizes))


def between_ratio(sums: Sequence[int], squares: int, sizes: Sequence[int]) -> Fraction | None:
    """F of groups with these sums and this sum of all squares; None where there is no error."""
    b, explained = between_terms(sums, sizes)
    k, everyone = len(sizes), sum(sizes)
    return None if squares <= b else explained / (k - 1) / ((squares - b) / (everyone - k))


def between_candidates(sums: Sequence[int], sizes: Sequence[int], F: Interval, top: int | None) -> range:
    """The whole S of the right parity that give an F inside: S = B + effect (N - k) / ((k - 1) F)."""
    b, explained = between_terms(sums, sizes)
    scaled = explained * (sum(sizes) - len(sizes)) / (len(sizes) - 1)
    least, most = squares_bounds(sums, sizes, top)
    if explained == 0:
        interval = Interval(b, None if F.holds(Fraction(0)) else b, False, False)
    elif F.high is not None and F.high <= 0:
        return range(0)
    else:
        low = b if F.high is None else b + scaled / F.high
        high = b + scaled / F.low if F.low is not None and F.low > 0 else None
        interval = Interval(low, high, F.high_closed and F.high is not None, F.low_closed)
    return of_parity(interval, least, most, sum(sums))


def squares_bounds(sums: Sequence[int], sizes: Sequence[int], top: int | None) -> tuple[int, int | None]:
    """Least and greatest sum of all squares of groups with these sums."""
    pairs = list(zip(sizes, sums, strict=True))
    most = None if top is None else sum(greatest_squares(n, c, 0, top) for n, c in pairs)
    return sum(least_squares(n, c) for n, c in pairs), most


def find_groups(sums: Sequence[int], sizes: Sequence[int], targets: range, top: int | None) -> Rows | bool | None:
    """Groups with these sums and a sum of squares in `targets`; False if proved that there are none, else None."""
    if not targets or (top is not None and any(not 0 <= c <= n * top for c, n in zip(sums, sizes, strict=True))):
        return False
    if top is not None and max(sizes) ** 2 * top * (top + 1) <= _EXACT_WORK:
        return _exact(sums, sizes, targets, top)
    for squares in targets[:_TRIES]:
        found = _greedy(sums, sizes, squares, top)
        if found:
            return found
    return None


def _exact(sums: Sequence[int], sizes: Sequence[int], targets: range, top: int) -> Rows | bool:
    sets = [square_sums(n, top)[c] for n, c in zip(sizes, sums, strict=True)]
    after = [1]
    for bits in reversed(sets):
        after.append(_sumset(bits, after[-1]))
    after.reverse()
    hit = next((s for s in targets if after[0] >> s & 1), None)
    if hit is None:
        return False
    groups = []
    for n, c, bits, rest in zip(sizes, sums, sets, after[1:], strict=True):
        q = next(q for q in range(hit + 1) if bits >> q & 1 and rest >> (hit - q) & 1)
        groups.append(numbers_with_sums(n, c, q, 0, top, budget=10_000_000) or ())
        hit -= q
    return tuple(groups)


@lru_cache(maxsize=64)
def square_sums(n: int, top: int) -> list[int]:
    """For each sum of n numbers in 0..top, the bits of the sums of squares that go with it."""
    sets = [1]
    for count in range(1, n + 1):
        grown = [0] * (count * top + 1)
        for total, bits in enumerate(sets):
            for value in range(top + 1):
                grown[total + value] |= bits << value * value
        sets = grown
    return sets


def _sumset(one: int, other: int) -> int:
    """The bits of all sums of a bit of one and a bit of the other."""
    total, place = 0, 0
    while one >> place:
        if one >> place & 1:
            total |= other << place
        place += 1
    return total


def _greedy(sums: Sequence[int], sizes: Sequence[int], squares: int, top: int | None) -> Rows | None:
    """Every group as even as can be, what is left of the squares going to the first that can take it."""
    groups: list[tuple[int, ...]] = []
    later = [least_squares(n, c) for n, c in zip(sizes, sums, strict=True)]
    for place, (n, c) in enumerate(zip(sizes, sums, strict=True)):
        room = squares - sum(later[place + 1 :])
        if top is not None:
            room = min(room, greatest_squares(n, c, 0, top))
        found = _largest(n, c, room, top, 1 if place == len(sizes) - 1 else _TRIES)
        if found is None:
            return None
        groups.append(found)
        squares -= sum(value * value for value in found)
    return tuple(groups) if squares == 0 else None


def _largest(n: int, total: int, room: int, top: int | None, tries: int) -> tuple[int, ...] | None:
    """As many numbers with this sum and the greatest sum of squares up to `room` that a few tries meet."""
    room -= (room - total) % 2
    for squares in range(room, max(room - 2 * tries, least_squares(n, total) - 1), -2):
        try:
            found = numbers_with_sums(n, total, squares, None if top is None else 0, top)
        except BudgetError:
            continue
        if found is not None:
            return found
    return None


class BudgetError(RuntimeError):
    """The search ended without an answer."""


@dataclass(slots=True)
class SearchBudget:
    """Steps that are left to a search, or to several together."""

    left: int

    def spend(self) -> None:
        """Take a step. `BudgetError` where none is left."""
        self.left -= 1
        if self.left < 0:
            raise BudgetError


@dataclass(slots=True)
class _Search:
    low: int
    budget: SearchBudget
    failed: set[tuple[int, int, int, int]] = field(default_factory=set)

    def run(self, n: int, total: int, squares: int, high: int) -> tuple[int, ...] | None:
        """Falling values, the first at most `high`: the greatest value and how often, then the rest below it."""
        if not possible(n, total, squares, self.low, high):
            return None
        if n == 0:
            return ()
        place = (n, total, squares, high)
        if place in self.failed:
            return None
        self.budget.spend()
        for value in range(min(high, _greatest_value(n, total, squares)), -(-total // n) - 1, -1):
            self.budget.spend()
            for times in _times(n, total, squares, value, self.low):
                rest = self.run(n - times, total - times * value, squares - times * value**2, value - 1)
                if rest is not None:
                    return (value,) * times + rest
        self.failed.add(place)
        return None


def _times(n: int, total: int, squares: int, value: int, low: int) -> range:
    """How often `value` can be the greatest of n whole numbers from `low` on, the most first; necessary bounds.

    At most: sum (y - value)^2 is all that t values at it leave to the others, t <= (n S - T^2) / (n v^2 - 2 T v + S).
    At least: the others are at most v - 1, and with l their least (y - l)(v - 1 - y) >= 0 for each of them.
    """
    apart = n * value**2 - 2 * total * value + squares
    most = n if apart <= 0 else min(n, (n * squares - total**2) // apart)
    if value == low:
        return range(n, n - 1, -1) if most == n else range(0)
    below = value - 1
    least = max(1, total - n * below, -((-squares + (low + below) * total - n * low * below) // (value - low)))
    return range(most, least - 1, -1)


def _greatest_value(n: int, total: int, squares: int) -> int:
    """No value lies above the mean plus sqrt((n - 1)(n squares - total^2)) / n (Samuelson 1968, JASA 63, 1522)."""
    return (total + isqrt((n - 1) * (n * squares - total**2))) // n


def possible(n: int, total: int, squares: int, low: int, high: int) -> bool:
    """Necessary for n whole numbers in `low..high` to have these sums: range, parity, least and greatest squares."""
    if n == 0:
        return total == 0 and squares == 0
    if low > high or not n * low <= total <= n * high or (total - squares) % 2:
        return False
    return least_squares(n, total) <= squares <= greatest_squares(n, total, low, high)


def least_squares(n: int, total: int) -> int:
    """The least sum of squares of n whole numbers with this sum: all as equal as can be."""
    base, more = divmod(total, n)
    return n * base**2 + more * (2 * base + 1)


def greatest_squares(n: int, total: int, low: int, high: int) -> int:
    """The greatest sum of squares of n whole numbers in `low..high` with this sum: all but one at an end."""
    if low == high:
        return n * low**2
    at_high, rest = divmod(total - n * low, high - low)
    if at_high == n:
        return n * high**2
    return at_high * high**2 + (low + rest) ** 2 + (n - at_high - 1) * low**2


def numbers_with_sums(
    n: int,
    total: int,
    squares: int,
    low: int | None = None,
    high: int | None = None,
    *,
    budget: int | SearchBudget = SEARCH_STEPS,
) -> tuple[int, ...] | None:
    """Falling whole numbers with sum `total` and sum of squares `squares`; None if there are none: that is proved.

    `low, high`: the scale; without them the squares bound it. `BudgetError` if the search ends without an answer.

    >>> numbers_with_sums(3, 6, 14)
    (3, 2, 1)
    """
    reach = isqrt(squares) if squares > 0 else 0
    low = -reach if low is None else max(low, -reach)
    high = reach if high is None else min(high, reach)
    return _Search(low, budget if isinstance(budget, SearchBudget) else SearchBudget(budget)).run(
        n, total, squares, high
    )
