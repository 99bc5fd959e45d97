"""Whole numbers with a given sum and a given sum of squares: do they exist?

The search is complete: it ends with such numbers, or with the proof that there are none, or says that its budget of
steps is used up. Values fall from left to right; a partial choice is left when the rest cannot have its sums, by
parity (x and x^2 are odd together), by the least sum of squares (all values equal) or by the greatest (all at an end).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isqrt


class BudgetError(RuntimeError):
    """The search ended without an answer."""


@dataclass(slots=True)
class _Search:
    low: int
    budget: int
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
        self.budget -= 1
        if self.budget < 0:
            raise BudgetError
        for value in range(min(high, _greatest_value(n, total, squares)), -(-total // n) - 1, -1):
            for times in range(n, 0, -1):
                rest = self.run(n - times, total - times * value, squares - times * value**2, value - 1)
                if rest is not None:
                    return (value,) * times + rest
        self.failed.add(place)
        return None


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
    n: int, total: int, squares: int, low: int | None = None, high: int | None = None, *, budget: int = 20_000
) -> tuple[int, ...] | None:
    """Falling whole numbers with sum `total` and sum of squares `squares`; None if there are none: that is proved.

    `low, high`: the scale; without them the squares bound it. `BudgetError` if the search ends without an answer.

    >>> numbers_with_sums(3, 6, 14)
    (3, 2, 1)
    """
    reach = isqrt(squares) if squares > 0 else 0
    low = -reach if low is None else max(low, -reach)
    high = reach if high is None else min(high, reach)
    return _Search(low, budget).run(n, total, squares, high)
