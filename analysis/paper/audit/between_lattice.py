"""The lattice of a between-subjects F: which sums of squares groups of whole numbers with given sums can have.

With sums C_j of groups of n_j, B = sum C_j^2 / n_j, T and N in all, and S the sum of all squares:
F = ((B - T^2 / N) / (k - 1)) / ((S - B) / (N - k)); S is whole, and odd with T.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache

from analysis.paper.audit.power_sums import BudgetError, greatest_squares, least_squares, numbers_with_sums
from analysis.paper.audit.printed import Interval

Groups = tuple[tuple[int, ...], ...]
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
    if most is None and interval.high is None:
        most = int(interval.low or 0) + 1_000
    whole = interval.integers(least, most)
    start = whole.start + (whole.start - sum(sums)) % 2
    return range(start, whole.stop, 2)


def squares_bounds(sums: Sequence[int], sizes: Sequence[int], top: int | None) -> tuple[int, int | None]:
    """Least and greatest sum of all squares of groups with these sums."""
    pairs = list(zip(sizes, sums, strict=True))
    most = None if top is None else sum(greatest_squares(n, c, 0, top) for n, c in pairs)
    return sum(least_squares(n, c) for n, c in pairs), most


def find_groups(sums: Sequence[int], sizes: Sequence[int], targets: range, top: int | None) -> Groups | bool | None:
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


def _exact(sums: Sequence[int], sizes: Sequence[int], targets: range, top: int) -> Groups | bool:
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


def _greedy(sums: Sequence[int], sizes: Sequence[int], squares: int, top: int | None) -> Groups | None:
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
