"""The order in which methods are met: at random, or balanced over participants by a square."""

from __future__ import annotations

from collections.abc import Sequence

from experiments.config.models import Order
from experiments.design.streams import Stream


def rows(order: Order, count: int) -> list[list[int]]:
    """All rows of a balancing square over `count` methods; none for a random order.

    A Latin square has each method once at each place. Williams' design has, beyond that, each method equally often
    right after each other one: `count` rows if it is even, twice as many if it is odd (Williams 1949).

    >>> rows("latin-square", 3)
    [[0, 1, 2], [1, 2, 0], [2, 0, 1]]
    >>> rows("williams", 4)
    [[0, 3, 1, 2], [1, 0, 2, 3], [2, 1, 3, 0], [3, 2, 0, 1]]
    """
    if order == "random":
        return []
    first = list(range(count)) if order == "latin-square" else _zigzag(count)
    square = [[(place + shift) % count for place in first] for shift in range(count)]
    if order == "williams" and count % 2:
        square += [row[::-1] for row in square]
    return square


def _zigzag(count: int) -> list[int]:
    """0, count - 1, 1, count - 2, ...: neighbours differ by every amount once."""
    return [place // 2 if place % 2 == 0 else count - 1 - place // 2 for place in range(count)]


def next_row(order: Order, count: int, used: Sequence[int]) -> int | None:
    """The row that was used least so far, the first of them; `None` for a random order.

    >>> next_row("latin-square", 3, [0, 1, 1])
    2
    """
    square = rows(order, count)
    if not square:
        return None
    return min(range(len(square)), key=lambda row: (list(used).count(row), row))


def method_order(order: Order, methods: Sequence[str], row: int | None, stream: Stream) -> list[str]:
    """The methods in the order of a row of the square, or shuffled where there is none."""
    if row is None:
        return stream.shuffled(methods)
    return [methods[place] for place in rows(order, len(methods))[row]]
