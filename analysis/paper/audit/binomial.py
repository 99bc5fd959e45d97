"""A printed p of a binomial test: which counts give it, by any of the tests that are called so.

Along the counts every p rises to the expected count and falls after it (a tail's own p only rises or only falls), so
the counts that give a p are found by halving, whatever n is. Tails are exact where their fractions are short, else
between bounds that certainly hold them; which outcomes are no likelier than the count is decided in whole numbers.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, partial
from itertools import accumulate
from math import comb, floor, lgamma, log, perm

import scipy

from analysis.paper.audit.means import check_count
from analysis.paper.audit.p_values import ABSOLUTE, RELATIVE
from analysis.paper.audit.printed import (
    NONE_EXISTS,
    UNKNOWN,
    CheckResult,
    DataExistence,
    Interval,
    PrintedNumber,
    Rounding,
    decimal,
    judge_readings,
    listed,
    listed_by_rounding,
    read_printed,
)

Bounds = tuple[Fraction, Fraction]
"""Of a p, equal where it is exact."""
_CHANCE = re.compile(r"[0-9]{1,6}/[0-9]{1,6}|[0-9]?\.?[0-9]{0,15}")
_EXACT_BITS = 2_000
"""Fractions of up to so many bits (600 digits) are worked out in full."""
_NEAR_TIE = 1 + Fraction(1, 10**7)
_LOG_MARGIN = 1e-6
"""Far above the rounding of a difference of log gammas of up to a million: what is closer is compared in full."""
_ONE, _NONE = (Fraction(1), Fraction(1)), (Fraction(0), Fraction(0))


@dataclass(frozen=True, slots=True)
class _Trials:
    """X of n trials with one chance."""

    n: int
    chance: Fraction

    @property
    def mirrored(self) -> _Trials:
        """The failures."""
        return _Trials(self.n, 1 - self.chance)

    def lower(self, k: int) -> Bounds:
        """P(X <= k)."""
        if not 0 <= k < self.n:
            return _NONE if k < 0 else _ONE
        if self.n * self.chance.denominator.bit_length() > _EXACT_BITS:
            return _around(float(scipy.special.betaincc(k + 1, self.n - k, float(self.chance))))
        sums = _sums(self.n, self.chance)
        return (Fraction(sums[k], sums[-1]),) * 2

    def upper(self, k: int) -> Bounds:
        """P(X >= k)."""
        return self.mirrored.lower(self.n - k)

    def no_likelier(self, j: int, k: int, tolerance: Fraction) -> bool:
        """Is P(X = j) <= P(X = k) tolerance, for j above k?"""
        n, odds = self.n, self.chance / (1 - self.chance)
        if odds == 1 and abs(2 * j - n) >= abs(2 * k - n):
            return True
        ratio = lgamma(k + 1) + lgamma(n - k + 1) - lgamma(j + 1) - lgamma(n - j + 1) + (j - k) * log(odds)
        apart = ratio - log(tolerance)
        if abs(apart) > _LOG_MARGIN:
            return apart < 0
        more = j - k
        return perm(n - k, more) * odds**more <= perm(j, more) * tolerance


@lru_cache(maxsize=4)
def _sums(n: int, chance: Fraction) -> list[int]:
    """Sums of the probabilities of 0 to k, times denominator^n."""
    a, b = chance.numerator, chance.denominator - chance.numerator
    return list(accumulate(comb(n, k) * a**k * b ** (n - k) for k in range(n + 1)))


def _around(p: float) -> Bounds:
    low, high = p * (1 - RELATIVE) - ABSOLUTE, p * (1 + RELATIVE) + ABSOLUTE
    return Fraction(max(low, 0.0)), Fraction(min(high, 1.0))


def _small_probabilities(tolerance: Fraction, trials: _Trials, k: int) -> Bounds:
    """The tail of the count, and beyond the mode the one of outcomes no likelier than the count times `tolerance`."""
    mode = floor((trials.n + 1) * trials.chance)
    if k > mode:
        return _small_probabilities(tolerance, trials.mirrored, trials.n - k)
    others = range(max(k + 1, mode), trials.n + 1)
    place = bisect_left(others, True, key=lambda j: trials.no_likelier(j, k, tolerance))
    border = others.start + place
    return _ONE if border == k + 1 else _plus(trials.lower(k), trials.upper(border))


def _plus(one: Bounds, other: Bounds) -> Bounds:
    return one[0] + other[0], min(Fraction(1), one[1] + other[1])


def _doubled(trials: _Trials, k: int) -> Bounds:
    lower, upper = trials.lower(k), trials.upper(k)
    return min(Fraction(1), 2 * min(lower[0], upper[0])), min(Fraction(1), 2 * min(lower[1], upper[1]))


def _normal(correction: Fraction, trials: _Trials, k: int) -> Bounds:
    """2 P(Z > max(0, |k - n p| - correction) / sqrt(n p (1 - p)))."""
    n, chance = trials.n, trials.chance
    away = max(Fraction(0), abs(k - n * chance) - correction)
    spread = float(n * chance * (1 - chance)) ** 0.5
    return _around(2 * float(scipy.special.ndtr(-float(away) / spread))) if away else _ONE


@dataclass(frozen=True, slots=True)
class _PRule:
    """How p is worked out; whether it rises up to the expected count, and falls after it."""

    name: str
    p: Callable[[_Trials, int], Bounds]
    rises: bool = True
    falls: bool = True

    def slopes(self, counts: Sequence[int], trials: _Trials) -> tuple[Sequence[int], Sequence[int]]:
        """The counts in two rows along each of which p never falls."""
        expected = bisect_right(counts, trials.n * trials.chance) if self.rises else 0
        turn = expected if self.falls else len(counts)
        return counts[:turn], counts[turn:][::-1]


RULES = (
    _PRule("sum of the small probabilities", partial(_small_probabilities, Fraction(1))),
    _PRule("sum of the small probabilities, near ties counted", partial(_small_probabilities, _NEAR_TIE)),
    _PRule("doubled tail", _doubled),
    _PRule("one-sided, lower tail", _Trials.lower, falls=False),
    _PRule("one-sided, upper tail", _Trials.upper, rises=False),
    _PRule("normal approximation", partial(_normal, Fraction(0))),
    _PRule("normal approximation with continuity correction", partial(_normal, Fraction(1, 2))),
)


def binomial_p(p: str, n: int, *, chance: str = "1/2", counts: Sequence[int] | None = None) -> CheckResult:
    """Which counts of n give this p-value against `chance`? The printed p stands if one of `counts` (all) does.

    Exact: the sum of all probabilities not above that of the count. Readings: near ties of 1e-7 counted (R), the
    doubled smaller tail, one tail, the normal approximation without and with continuity correction. Where the fractions
    are long, a p within 1e-9 of itself of where the printing changes is "undecided".
    `ValueError`: text that is no number, n below 1 or above 1,000,000, a chance not between 0 and 1, counts outside
    0..n.
    Sources: Sterne 1954, Biometrika 41, 275; Fisher 1925 (doubled tail); Yates 1934 (continuity).

    >>> binomial_p("0.205", 140).numbers
    (('counts of 140 that give p', '62, 78'),)
    """
    check_count(n)
    printed, trials = read_printed(p), _Trials(n, _share(chance))
    asked = range(n + 1) if counts is None else sorted(set(counts))
    if asked and not 0 <= asked[0] <= asked[-1] <= n:
        raise ValueError(f"counts must lie in 0..{n}, not {listed(asked)}")
    plain, *others = [_Asked(rule, trials, asked) for rule in RULES]
    judged = judge_readings(
        partial(plain.data, printed), [(one.rule.name, partial(one.data, printed)) for one in others]
    )
    every = _Asked(RULES[0], trials, range(n + 1))
    fitting = listed_by_rounding(lambda rounding: every.giving(printed.interval(rounding))) or "none"
    below, above = plain.nearest(printed.value)
    shown = f"0 to {n}" if counts is None else listed(asked)
    return CheckResult(
        check="binomial p",
        printed=f"p = {printed.text}",
        judged=judged,
        reason=f"exact two-sided p of {n} against {decimal(trials.chance)}, counts asked: {shown}",
        source="Sterne 1954, Biometrika 41, 275",
        below=below,
        above=above,
        contradicts=() if judged.verdict == "attainable" else (f"n = {n}", f"counts {shown}"),
        numbers=((f"counts of {n} that give p", fitting),),
        number=printed,
    )


def _share(chance: str) -> Fraction:
    """A chance as printed: "1/2", "0.25"; `ValueError` if it is none between 0 and 1."""
    try:
        share = Fraction(chance) if _CHANCE.fullmatch(chance) else Fraction(0)
    except (ValueError, ZeroDivisionError):  # "." and "1/0"
        share = Fraction(0)
    if not 0 < share < 1:
        raise ValueError(f"chance must lie between 0 and 1, as 1/2 or 0.25, not {chance[:40]}")
    return share


class _Asked:
    """The p-values of some counts by a rule, each worked out once."""

    def __init__(self, rule: _PRule, trials: _Trials, counts: Sequence[int]) -> None:
        self.rule = rule
        self._p = lru_cache(maxsize=None)(partial(rule.p, trials))
        self._slopes = rule.slopes(counts, trials)

    def data(self, printed: PrintedNumber, rounding: Rounding) -> DataExistence:
        """A count whose p prints so."""
        interval, unsure = printed.interval(rounding), False
        for slope in self._slopes:
            first = bisect_left(slope, 0, key=lambda k: interval.side(self._p(k)[0]))
            for count in slope[first : first + 1]:
                if all(interval.holds(end) for end in self._p(count)):
                    return DataExistence(True, ((Fraction(count),),))
            unsure |= bool(self._held(slope, interval))
        return UNKNOWN if unsure else NONE_EXISTS

    def _held(self, slope: Sequence[int], interval: Interval) -> Sequence[int]:
        """The counts whose p may lie inside."""
        first = bisect_left(slope, 0, key=lambda k: interval.side(self._p(k)[1]))
        return slope[first : bisect_right(slope, 0, key=lambda k: interval.side(self._p(k)[0]))]

    def giving(self, interval: Interval) -> list[int]:
        """The counts whose p certainly lies inside, the lowest first."""
        found = list[int]()
        for slope in self._slopes:
            first = bisect_left(slope, 0, key=lambda k: interval.side(self._p(k)[0]))
            held = slope[first : bisect_right(slope, 0, key=lambda k: interval.side(self._p(k)[1]))]
            found += held
        return sorted(found)

    def nearest(self, value: Fraction) -> tuple[Fraction | None, Fraction | None]:
        """The nearest p-values below and above, or `value` itself."""
        below, above = list[Fraction](), list[Fraction]()
        for slope in self._slopes:
            below += map(self._middle, slope[: bisect_right(slope, value, key=self._middle)][-1:])
            above += map(self._middle, slope[bisect_left(slope, value, key=self._middle) :][:1])
        return max(below, default=None), min(above, default=None)

    def _middle(self, count: int) -> Fraction:
        low, high = self._p(count)
        return (low + high) / 2
