"""One column of a table to be found: n whole numbers `0..top` with a given sum, and a sum of squares if one is given.

Sources: SPRITE, Heathers, Anaya, van der Zee & Brown 2018, PeerJ Preprints 6, e26968v1; `power_sums` where it fails.
"""

from __future__ import annotations

from random import Random

from analysis.paper.audit.power_sums import BudgetError, greatest_squares, least_squares, numbers_with_sums
from analysis.paper.audit.repeated_lattice import distance

_STEPS, _EXACT = 3_000, 6


def drawn(total: int, around: list[float], sd: float, top: int, random: Random) -> list[int]:
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
    least, most = least_squares(n, total), greatest_squares(n, total, 0, top)
    wanted = range(max(squares.start, least + (squares.start - least) % 2), min(squares.stop, most + 1), squares.step)
    if not wanted:
        return None
    values = drawn(total, [total / n] * n, max((wanted[-1] - total * total / n) / n, 0.01) ** 0.5, top, random)
    return values if _walked(values, wanted, top, random) else _exact(n, total, wanted, top, random)


def _walked(values: list[int], wanted: range, top: int, random: Random) -> bool:
    """Ones moved between two numbers, apart or together, until the sum of squares is wanted."""
    now, n = sum(value * value for value in values), len(values)
    for _ in range(_STEPS):
        if now in wanted:
            return True
        i, j = int(random.random() * n), int(random.random() * n)
        change = 2 * (values[i] - values[j] + 1)
        if i == j or values[i] == top or values[j] == 0:
            continue
        if distance(now + change, wanted) <= distance(now, wanted) or random.random() < 0.1:
            values[i] += 1
            values[j] -= 1
            now += change
    return now in wanted


def _exact(n: int, total: int, wanted: range, top: int, random: Random) -> list[int] | None:
    for squares in random.sample(wanted, min(_EXACT, len(wanted))):
        try:
            found = numbers_with_sums(n, total, squares, 0, top)
        except BudgetError:
            continue
        if found is not None:
            values = list(found)
            random.shuffle(values)
            return values
    return None
