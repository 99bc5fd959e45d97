"""Data sets that meet all constraints at once: n participants in k conditions, whole numbers.

Sources: SPRITE, Heathers, Anaya, van der Zee & Brown 2018, PeerJ Preprints 6, e26968v1; the complete search of
`lattices` where it fails.

Constraints are column sums (or the printed means they give), spreads, a repeated-measures F, and how many participants
rank two conditions in which order. Small spaces are enumerated, which also proves that there are none; others are
searched from many starts. Whatever is returned has been checked exactly.

Moves keep the sums of the columns: a whole amount goes from one row of a column to another, or two of its numbers
change places, which also keeps its sum of squares. What is steered is W (see `lattices`) into its targets, and
how many rows have which order of two columns. Source: Kirkpatrick, Gelatt & Vecchi 1983, Science 220, 671.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations_with_replacement, islice, product
from math import comb, exp, prod, sqrt
from random import Random

from analysis.paper.audit import lattices
from analysis.paper.audit.printed import Interval

_DRAW_STEPS, _EXACT = 3_000, 6


def _drawn(total: int, around: list[float], sd: float, top: int, random: Random) -> list[int]:
    """Numbers near `around` by a normal spread, then moved by ones until they have the sum."""
    values = [min(max(round(random.gauss(centre, sd)), 0), top) for centre in around]
    step = 1 if sum(values) < total else -1
    while sum(values) != total:
        i = int(random.random() * len(values))
        if 0 <= values[i] + step <= top:
            values[i] += step
    return values


def with_squares(n: int, total: int, squares: range, top: int, random: Random) -> list[int] | None:
    """Numbers with this sum and a sum of squares in `squares`; None if none were met."""
    least, most = lattices.least_squares(n, total), lattices.greatest_squares(n, total, 0, top)
    wanted = range(max(squares.start, least + (squares.start - least) % 2), min(squares.stop, most + 1), squares.step)
    if not wanted:
        return None
    values = _drawn(total, [total / n] * n, max((wanted[-1] - total * total / n) / n, 0.01) ** 0.5, top, random)
    return values if _walked(values, wanted, top, random) else _exact(n, total, wanted, top, random)


def _walked(values: list[int], wanted: range, top: int, random: Random) -> bool:
    """Ones moved between two numbers, apart or together, until the sum of squares is wanted."""
    now, n = sum(value * value for value in values), len(values)
    for _ in range(_DRAW_STEPS):
        if now in wanted:
            return True
        i, j = int(random.random() * n), int(random.random() * n)
        change = 2 * (values[i] - values[j] + 1)
        if i == j or values[i] == top or values[j] == 0:
            continue
        if lattices.distance(now + change, wanted) <= lattices.distance(now, wanted) or random.random() < 0.1:
            values[i] += 1
            values[j] -= 1
            now += change
    return now in wanted


def _exact(n: int, total: int, wanted: range, top: int, random: Random) -> list[int] | None:
    for squares in random.sample(wanted, min(_EXACT, len(wanted))):
        try:
            found = lattices.numbers_with_sums(n, total, squares, 0, top)
        except lattices.BudgetError:
            continue
        if found is not None:
            values = list(found)
            random.shuffle(values)
            return values
    return None


ColumnSums = tuple[int, ...]
_STEPS, _STEPS_EACH = 8_000, 20
"""Of one start: at most, and for each pair of cells of a column."""
_DRAWS, _LISTED, _SMALL = 2_000, 5_000, 20_000
"""Column sums drawn before a start gives up, sets of them that are listed, data sets that are enumerated."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionColumn:
    """A condition: the sums its numbers may have, and their variance (with n - 1), None where any will do."""

    sums: Sequence[int]
    variance: Interval | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Constraints:
    """What `n` rows of whole numbers `0..top` must meet.

    `accepts` says of column sums whether they will do, as where a pattern of post-hoc tests follows from them and F.
    `person_sd`: how much rows differ when a search starts; it steers, and binds nothing.
    """

    n: int
    top: int
    columns: tuple[ConditionColumn, ...]
    F: Interval | None = None
    orders: tuple[ColumnOrder, ...] = ()
    accepts: Callable[[ColumnSums], bool] | None = None
    person_sd: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Reconstruction:
    """Data sets found, how many starts were made and succeeded, and whether such data exist (None: not settled).

    `space`: how many data sets meet the constraints, the order of participants aside, if all were enumerated.
    """

    data: tuple[lattices.Rows, ...]
    starts: int
    succeeded: int
    exists: bool | None
    space: int | None = None


def reconstruct(wanted: Constraints, seed: int = 0, *, count: int = 1, starts: int = 60) -> Reconstruction:
    """`count` different data sets that meet the constraints, or as many as are found within so many starts.

    The same for the same seed. `exists` is False only by proof: every data set, or every sum, was looked at.

    >>> from analysis.paper.audit.printed import Rounding, read_printed
    >>> spread = read_printed("1.52").interval(Rounding.HALF_UP).squared()
    >>> five = Constraints(n=5, top=6, columns=(ConditionColumn(sums=[12], variance=spread),))  # a mean of 2.40
    >>> found = reconstruct(five, count=9)
    >>> found.space, sorted(sorted(value for (value,) in rows) for rows in found.data)
    (3, [[0, 2, 3, 3, 4], [1, 1, 2, 4, 4], [1, 2, 2, 2, 5]])
    """
    random = Random(seed)  # noqa: S311 a search, no secret
    if _size(wanted) <= _SMALL:
        return _from_all(wanted, count, random)
    found: dict[lattices.Rows, lattices.Rows] = {}
    tried = succeeded = 0
    sums = _sums(wanted, random)
    for chosen in islice(sums, starts):
        tried += 1
        rows = _searched(wanted, chosen, random)
        if rows is not None and meets(rows, wanted):
            succeeded += 1
            found.setdefault(tuple(sorted(rows)), rows)
        if len(found) == count:
            break
    data = tuple(found.values())
    exists = True if data else False if _impossible(wanted) else None
    return Reconstruction(data=data, starts=tried, succeeded=succeeded, exists=exists)


def meets(rows: lattices.Rows, wanted: Constraints) -> bool:
    """Do these rows meet every constraint? Exact."""
    sums = tuple(map(sum, zip(*rows, strict=True)))
    return (
        len(rows) == wanted.n
        and all(0 <= value <= wanted.top for row in rows for value in row)
        and all(total in column.sums for total, column in zip(sums, wanted.columns, strict=True))
        and all(map(_spread_fits, zip(*rows, strict=True), wanted.columns))
        and (wanted.accepts is None or wanted.accepts(sums))
        and (wanted.F is None or _f_fits(rows, sums, wanted.F))
        and all(_order_fits(rows, order) for order in wanted.orders)
    )


def _spread_fits(values: ColumnSums, column: ConditionColumn) -> bool:
    n, total = len(values), sum(values)
    squares = sum(value * value for value in values)
    return column.variance is None or column.variance.holds(Fraction(n * squares - total**2, n * (n - 1)))


def _f_fits(rows: lattices.Rows, sums: ColumnSums, F: Interval) -> bool:
    found = lattices.ratio(sums, lattices.within_rows(rows), len(rows))
    return found is not None and F.holds(found)


def _order_fits(rows: lattices.Rows, order: ColumnOrder) -> bool:
    above = sum(row[order.one] > row[order.other] for row in rows)
    tied = sum(row[order.one] == row[order.other] for row in rows)
    return order.above in {None, above} and order.tied in {None, tied}


def _size(wanted: Constraints) -> int:
    """How many data sets there are, the order of participants aside."""
    return comb(wanted.n + (wanted.top + 1) ** len(wanted.columns) - 1, wanted.n)


def _from_all(wanted: Constraints, count: int, random: Random) -> Reconstruction:
    kinds = product(range(wanted.top + 1), repeat=len(wanted.columns))
    every = [rows for rows in combinations_with_replacement(kinds, wanted.n) if meets(rows, wanted)]
    picked = random.sample(every, min(count, len(every)))
    data = tuple(tuple(random.sample(rows, len(rows))) for rows in picked)
    return Reconstruction(data=data, starts=1, succeeded=int(bool(data)), exists=bool(every), space=len(every))


def _impossible(wanted: Constraints) -> bool:
    """Is it proved that no data have such sums and F? Where all sums can be listed, by all of their W."""
    choices = prod(len(column.sums) for column in wanted.columns)
    if choices > _LISTED:
        return False
    every = product(*(column.sums for column in wanted.columns))
    return not any(_possible(wanted, sums) and _has_w(wanted, sums) for sums in every)


def _has_w(wanted: Constraints, sums: ColumnSums) -> bool:
    """False only by proof: these sums have none of the W that F needs."""
    if wanted.F is None or not lattices.affordable(wanted.n, len(sums), wanted.top):
        return True
    exact = lattices.every_sum(wanted.n, len(sums), wanted.top).get(sums, 0)
    return any(exact >> w & 1 for w in lattices.candidates(sums, wanted.n, wanted.F, wanted.top))


def _possible(wanted: Constraints, sums: ColumnSums) -> bool:
    """Will the sums do, and is there any W for them that gives F?"""
    if wanted.accepts is not None and not wanted.accepts(sums):
        return False
    return wanted.F is None or bool(lattices.candidates(sums, wanted.n, wanted.F, wanted.top))


def _sums(wanted: Constraints, random: Random) -> Iterator[ColumnSums]:
    """Column sums that will do, each start its own; ends where none are met."""
    choices = [list(column.sums) for column in wanted.columns]
    if prod(map(len, choices)) <= _LISTED:
        fitting = [sums for sums in product(*choices) if _possible(wanted, sums)]
        while fitting:
            yield random.choice(fitting)
    while all(choices):
        draws = (tuple(map(random.choice, choices)) for _ in range(_DRAWS))
        fitting_one = next((sums for sums in draws if _possible(wanted, sums)), None)
        if fitting_one is None:
            return
        yield fitting_one


def _searched(wanted: Constraints, sums: ColumnSums, random: Random) -> lattices.Rows | None:
    """One start: columns that meet their own constraints, then moves that keep them until the joint ones are met."""
    targets = None if wanted.F is None else lattices.candidates(sums, wanted.n, wanted.F, wanted.top)
    people = [random.gauss(0, wanted.person_sd) for _ in range(wanted.n)]
    sd = _start_sd(wanted, sums, targets)
    columns = []
    for total, column in zip(sums, wanted.columns, strict=True):
        if column.variance is None:
            around = [total / wanted.n + person for person in people]
            share = total / wanted.n / max(wanted.top, 1)
            binomial = (wanted.top * share * (1 - share)) ** 0.5
            columns.append(_drawn(total, around, sd or binomial, wanted.top, random))
            continue
        values = with_squares(wanted.n, total, _squares(wanted, total, column.variance), wanted.top, random)
        if values is None:
            return None
        columns.append(values)
    table = AnnealedRows(columns, wanted.top, [column.variance is not None for column in wanted.columns], wanted.orders)
    steps = min(_STEPS, _STEPS_EACH * wanted.n**2 * len(sums))
    return table.rows if table.anneal(targets, steps, random) else None


def _start_sd(wanted: Constraints, sums: ColumnSums, targets: range | None) -> float | None:
    """The SD of the error that F implies: MS = (n W - A) / (n k (n - 1)(k - 1))."""
    if not targets:
        return None
    n, k = wanted.n, len(sums)
    return sqrt(max((n * targets[0] - lattices.effect(sums)) / (n * k * (n - 1) * (k - 1)), 0.0))


def _squares(wanted: Constraints, total: int, variance: Interval) -> range:
    """The sums of squares that go with a sum and a variance, of the sum's parity."""
    n = wanted.n
    interval = variance.mapped(lambda value: value * (n - 1) + Fraction(total**2, n))
    return lattices.of_parity(
        interval, lattices.least_squares(n, total), lattices.greatest_squares(n, total, 0, wanted.top), total
    )


_HOT, _COLD = 1.0, 0.002
"""Temperatures at the start and at the end, in rows out of order; found by trial on data that existed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ColumnOrder:
    """In so many rows column `one` is above `other`, or tied with it; None: in any number of them."""

    one: int
    other: int
    above: int | None = None
    tied: int | None = None


class AnnealedRows:
    """Rows under way. `fixed` columns change by exchanges alone; numbers stay in `0..top`."""

    def __init__(
        self, columns: Sequence[list[int]], top: int, fixed: Sequence[bool], orders: Sequence[ColumnOrder]
    ) -> None:
        self._columns, self._top, self._fixed, self._orders = columns, top, fixed, orders
        self._n, self._k = len(columns[0]), len(columns)
        self._sums = [sum(row) for row in zip(*columns, strict=True)]
        self._w = lattices.within_rows(self.rows)
        self._of = [[order for order in orders if j in (order.one, order.other)] for j in range(self._k)]
        self._above = {order: sum(self._sign(order, row) > 0 for row in range(self._n)) for order in orders}
        self._tied = {order: sum(self._sign(order, row) == 0 for row in range(self._n)) for order in orders}

    @property
    def rows(self) -> lattices.Rows:
        """The rows as they are."""
        return tuple(zip(*self._columns, strict=True))

    def anneal(self, targets: range | None, steps: int, random: Random) -> bool:
        """Step on until W is in `targets` (None: anywhere) and all orders hold; False if they do not in so many."""
        unit = self._unit(targets)
        energy, cooling, temperature = self._energy(targets, unit), (_COLD / _HOT) ** (1 / steps), _HOT
        for _ in range(steps):
            if energy == 0:
                return True
            temperature *= cooling
            move = self._move(random)
            if move is None:
                continue
            self._apply(*move)
            then = self._energy(targets, unit)
            if then <= energy or random.random() < exp((energy - then) / temperature):
                energy = then
            else:
                row, other, column, amount = move
                self._apply(other, row, column, amount)
        return energy == 0

    def _unit(self, targets: range | None) -> float:
        """How far off W weighs as much as one row out of order: a move's usual change."""
        return max(2.0, 4 * max(self._w, targets[-1] if targets else 0) / self._n)

    def _energy(self, targets: range | None, unit: float) -> float:
        energy = 0.0 if targets is None else lattices.distance(self._w, targets) / unit
        for order in self._orders:
            if order.above is not None:
                energy += abs(self._above[order] - order.above)
            if order.tied is not None:
                energy += abs(self._tied[order] - order.tied)
        return energy

    def _move(self, random: Random) -> tuple[int, int, int, int] | None:
        """Two rows, a column and an amount from the second to the first; None if that is no move."""
        a, b = int(random.random() * self._n), int(random.random() * self._n)
        column = int(random.random() * self._k)
        x, y = self._columns[column][a], self._columns[column][b]
        if self._fixed[column] or random.random() < 0.4:
            amount = y - x
        else:
            amount = 1 if random.random() < 0.7 else int(random.random() * (2 + self._top // 8)) + 1
        if a == b or not amount or not (0 <= x + amount <= self._top and 0 <= y - amount <= self._top):
            return None
        return a, b, column, amount

    def _apply(self, a: int, b: int, column: int, amount: int) -> None:
        values, sums = self._columns[column], self._sums
        self._count(a, column, -1)
        self._count(b, column, -1)
        squares = 2 * amount * (values[a] - values[b] + amount)
        self._w += self._k * squares - 2 * amount * (sums[a] - sums[b] + amount)
        values[a] += amount
        values[b] -= amount
        sums[a] += amount
        sums[b] -= amount
        self._count(a, column, 1)
        self._count(b, column, 1)

    def _count(self, row: int, column: int, step: int) -> None:
        """Take a row into the counts of the orders, or out of them."""
        for order in self._of[column]:
            sign = self._sign(order, row)
            if sign > 0:
                self._above[order] += step
            elif sign == 0:
                self._tied[order] += step

    def _sign(self, order: ColumnOrder, row: int) -> int:
        return self._columns[order.one][row] - self._columns[order.other][row]
