"""A printed p of a binomial test against the counts that give it, in whole numbers."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import accumulate
from math import comb

from scipy import special

from analysis.paper.audit.means import check_count
from analysis.paper.audit.printed import Interval, PrintedNumber, Rounding, decimal, read
from analysis.paper.audit.words import NONE_EXISTS, UNKNOWN, Attempt, Found, Result, decide, listed

Bounds = tuple[Fraction, Fraction]
Rule = Callable[[int, Fraction], list[Bounds]]
"""The p-values of all counts 0..n, each between two bounds (equal where exact)."""
_NEAR_TIE = 1 + Fraction(1, 10**7)
_MARGIN = Fraction(1, 10**9)


def binomial_p(p: str, n: int, *, chance: str = "1/2", counts: Sequence[int] | None = None) -> Result:
    """Which counts of n give this p-value against `chance`? The printed p stands if one of `counts` (all) does.

    Exact: the sum of all probabilities not above that of the count. Readings: near ties of 1e-7 counted (R), the
    doubled smaller tail, one tail, the normal approximation without and with continuity correction.
    `ValueError`: text that is no number, n below 1, a chance not between 0 and 1, counts outside 0..n.
    Sources: Sterne 1954, Biometrika 41, 275; Fisher 1925 (doubled tail); Yates 1934 (continuity).

    >>> binomial_p("0.205", 140).numbers
    (('counts of 140 that give p', '62, 78'),)
    """
    check_count(n)
    printed, share = read(p), Fraction(chance)
    if not 0 < share < 1:
        raise ValueError(f"chance must lie between 0 and 1, not {chance}")
    asked = list(range(n + 1)) if counts is None else list(counts)
    if any(not 0 <= count <= n for count in asked):
        raise ValueError(f"counts must lie in 0..{n}, not {listed(asked)}")
    plain, *others = ((name, _rule_attempt(printed, rule(n, share), asked)) for name, rule in RULES)
    decision = decide(plain[1], others)
    exact = [low for low, _ in small_probabilities(n, share)]
    fitting = [k for k in range(n + 1) if printed.interval(Rounding.ANY).holds(exact[k])]
    return Result(
        check="binomial p",
        printed=f"p = {printed.text}",
        verdict=decision.verdict,
        reason=f"exact two-sided p of {n} against {decimal(share)}, counts asked: {_asked(counts, n)}",
        source="Sterne 1954, Biometrika 41, 275",
        below=max((exact[k] for k in asked if exact[k] <= printed.value), default=None),
        above=min((exact[k] for k in asked if exact[k] >= printed.value), default=None),
        readings=decision.readings,
        tried=decision.tried,
        contradicts=() if decision.verdict == "attainable" else (f"n = {n}", f"counts {_asked(counts, n)}"),
        numbers=((f"counts of {n} that give p", listed(fitting) or "none"),),
        witness=decision.witness,
    )


def _asked(counts: Sequence[int] | None, n: int) -> str:
    return f"0 to {n}" if counts is None else listed(counts)


def _rule_attempt(printed: PrintedNumber, values: list[Bounds], counts: Sequence[int]) -> Attempt:
    def attempt(rounding: Rounding) -> Found:
        interval, unsure = printed.interval(rounding), False
        for count in counts:
            low, high = values[count]
            if interval.holds(low) and interval.holds(high):
                return Found(True, ((Fraction(count),),))
            unsure |= low < high and interval.meets(Interval(low, high))
        return UNKNOWN if unsure else NONE_EXISTS

    return attempt


def weights(n: int, chance: Fraction) -> list[int]:
    """The probabilities of 0..n times denominator^n, whole."""
    a, b = chance.numerator, chance.denominator - chance.numerator
    return [comb(n, k) * a**k * b ** (n - k) for k in range(n + 1)]


def small_probabilities(n: int, chance: Fraction, tolerance: Fraction = Fraction(1)) -> list[Bounds]:
    """Sum of all probabilities not above that of the count times `tolerance`."""
    weight = weights(n, chance)
    ordered = sorted(weight)
    sums = [0, *accumulate(ordered)]
    whole = sums[-1]
    limits = (value * tolerance.numerator // tolerance.denominator for value in weight)
    return [(p, p) for p in (Fraction(sums[bisect_right(ordered, limit)], whole) for limit in limits)]


def tails(n: int, chance: Fraction) -> Iterator[tuple[Fraction, Fraction]]:
    """P(X <= k) and P(X >= k) for k in 0..n."""
    weight = weights(n, chance)
    sums = list(accumulate(weight))
    for k in range(n + 1):
        yield Fraction(sums[k], sums[-1]), Fraction(sums[-1] - sums[k] + weight[k], sums[-1])


def _doubled(n: int, chance: Fraction) -> list[Bounds]:
    return [(p, p) for p in (min(Fraction(1), 2 * min(pair)) for pair in tails(n, chance))]


def _lower(n: int, chance: Fraction) -> list[Bounds]:
    return [(low, low) for low, _ in tails(n, chance)]


def _upper(n: int, chance: Fraction) -> list[Bounds]:
    return [(high, high) for _, high in tails(n, chance)]


def _normal(correction: Fraction) -> Rule:
    """2 P(Z > max(0, |k - n p| - correction) / sqrt(n p (1 - p))), between bounds."""

    def rule(n: int, chance: Fraction) -> list[Bounds]:
        spread = float(n * chance * (1 - chance)) ** 0.5
        away = [float(max(Fraction(0), abs(k - n * chance) - correction)) / spread for k in range(n + 1)]
        p = [Fraction(2 * float(special.ndtr(-z))) for z in away]
        return [(x * (1 - _MARGIN), min(Fraction(1), x * (1 + _MARGIN))) if x < 1 else (x, x) for x in p]

    return rule


RULES: tuple[tuple[str, Rule], ...] = (
    ("sum of the small probabilities", small_probabilities),
    ("sum of the small probabilities, near ties counted", lambda n, p: small_probabilities(n, p, _NEAR_TIE)),
    ("doubled tail", _doubled),
    ("one-sided, lower tail", _lower),
    ("one-sided, upper tail", _upper),
    ("normal approximation", _normal(Fraction(0))),
    ("normal approximation with continuity correction", _normal(Fraction(1, 2))),
)
