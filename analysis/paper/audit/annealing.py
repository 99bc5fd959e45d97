"""A search for whole numbers in n rows and k columns with given column sums, by simulated annealing.

Moves keep the sums of the columns: a whole amount goes from one row of a column to another, or two of its numbers
change places, which also keeps its sum of squares. What is steered is W (see `repeated_lattice`) into its targets, and
how many rows have which order of two columns. Source: Kirkpatrick, Gelatt & Vecchi 1983, Science 220, 671.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp
from random import Random

from analysis.paper.audit.lattices import Rows, distance, within_rows

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
        self._w = within_rows(self.rows)
        self._of = [[order for order in orders if j in (order.one, order.other)] for j in range(self._k)]
        self._above = {order: sum(self._sign(order, row) > 0 for row in range(self._n)) for order in orders}
        self._tied = {order: sum(self._sign(order, row) == 0 for row in range(self._n)) for order in orders}

    @property
    def rows(self) -> Rows:
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
        energy = 0.0 if targets is None else distance(self._w, targets) / unit
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
