"""Printed p-values against the printed statistic and its degrees of freedom, by tails between safe bounds."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from functools import partial
from itertools import accumulate
from math import comb
from typing import Literal

import numpy as np
from scipy import special

from analysis.paper.audit.means import check_count
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
    read_printed,
)
from analysis.stats.anova import studentized_range_sf

Statistic = Literal["t", "F", "chi2", "r", "z", "Q", "q"]
Sides = Literal["two-sided", "one-sided"]
RELATIVE, ABSOLUTE = 1e-9, 1e-300
"""Margin of t, F, chi2, r and z: scipy states 1e-13 or better."""
RANGE_RELATIVE, RANGE_FAR, RANGE_ABSOLUTE = 1e-5, 1e-2, 1e-11
"""Margins of the studentized range: 2e-7 relative was measured up to 1000 df, 1e-3 beyond; no digit below 1e-12."""
_DF = {"t": 1, "F": 2, "chi2": 1, "r": 1, "z": 0, "Q": 1, "q": 2}
SIDED = ("t", "r", "z")
"""Statistics with a sign: the others' p-values have one tail."""


def check_df(statistic: Statistic, df: Sequence[Fraction]) -> None:
    """`ValueError` if the statistic has not so many degrees of freedom, or one is not above 0 (q: k below 2)."""
    if len(df) != _DF[statistic] or any(value <= 0 for value in df) or (statistic == "q" and df[0] < 2):
        raise ValueError(f"{statistic} needs {_DF[statistic]} degrees of freedom above 0, not {list(map(str, df))}")


def p_bounds(statistic: Statistic, value: Fraction, df: Sequence[Fraction], sides: Sides) -> tuple[Fraction, Fraction]:
    """Bounds that certainly hold the p-value of |value|: t, F, chi2, r, z, meta-analytic Q, or Tukey's q (df: k, df).

    The sign is dropped: a one-sided p is that of the tail on the statistic's own side. |r| above 1 counts as 1.
    """
    x = abs(value)
    if x == 0 and statistic != "q":
        return (Fraction(1, 2),) * 2 if statistic in SIDED and sides == "one-sided" else (Fraction(1),) * 2
    p = _TAILS[statistic](x, [float(number) for number in df])
    p *= 2 if statistic in SIDED and sides == "two-sided" else 1
    relative, absolute = RELATIVE, ABSOLUTE
    if statistic == "q":
        relative, absolute = RANGE_RELATIVE if df[1] <= 1000 else RANGE_FAR, RANGE_ABSOLUTE
    low, high = p * (1 - relative) - absolute, p * (1 + relative) + absolute
    return Fraction(max(low, 0.0)), Fraction(min(high, 1.0))


def p_range(
    statistic: Statistic, values: Interval, df: Sequence[Fraction], sides: Sides
) -> tuple[Interval, Interval | None]:
    """All p-values that |values| can have: an interval certainly holding them, and one certainly within (or None).

    p falls as |value| rises and is continuous, so the ends of the statistic give the ends of p.
    """
    least, most = _magnitudes(values)
    low = (Fraction(0), Fraction(0)) if most is None else p_bounds(statistic, most, df, sides)
    high = p_bounds(statistic, least, df, sides)
    outer = Interval(low[0], high[1])
    return outer, Interval(low[1], high[0], False, False) if low[1] < high[0] else None


def _magnitudes(values: Interval) -> tuple[Fraction, Fraction | None]:
    """Least and greatest magnitude in an interval."""
    if values.low is None or values.high is None:
        nearest = values.low if values.high is None else values.high
        outwards = nearest is not None and (nearest > 0) == (values.high is None)
        return (abs(nearest) if outwards and nearest is not None else Fraction(0)), None
    ends = sorted((abs(values.low), abs(values.high)))
    return (Fraction(0) if values.low <= 0 <= values.high else ends[0]), ends[1]


def _beta_tail(a: float, b: float, small: Fraction) -> float:
    """I(1 - small; a, b): by its complement where `small` is the argument that keeps its digits."""
    if small >= 1:
        return 0.0
    return float(special.betaincc(b, a, float(small)) if 2 * small < 1 else special.betainc(a, b, float(1 - small)))


def _t_tail(x: Fraction, df: list[float]) -> float:
    """P(T > x) = I(df / (df + x^2); df / 2, 1 / 2) / 2."""
    return _beta_tail(df[0] / 2, 0.5, x**2 / (Fraction(df[0]) + x**2)) / 2


def _r_tail(x: Fraction, df: list[float]) -> float:
    """P(R > x) by t = r sqrt(df / (1 - r^2)): I(1 - r^2; df / 2, 1 / 2) / 2."""
    return _beta_tail(df[0] / 2, 0.5, x**2) / 2


def _f_tail(x: Fraction, df: list[float]) -> float:
    """P(F > x) = I(df2 / (df2 + df1 x); df2 / 2, df1 / 2)."""
    explained = Fraction(df[0]) * x
    return _beta_tail(df[1] / 2, df[0] / 2, explained / (Fraction(df[1]) + explained))


def _range_tail(x: Fraction, df: list[float]) -> float:
    return float(np.asarray(studentized_range_sf(float(x), df[0], df[1])))


_TAILS: dict[Statistic, Callable[[Fraction, list[float]], float]] = {
    "t": _t_tail,
    "r": _r_tail,
    "z": lambda x, _: float(special.ndtr(-float(x))),
    "F": _f_tail,
    "chi2": lambda x, df: float(special.chdtrc(df[0], float(x))),
    "Q": lambda x, df: float(special.chdtrc(df[0], float(x))),
    "q": _range_tail,
}

_SOURCE = "Nuijten et al. 2016, Behavior Research Methods 48, 1205"


def p_against_statistic(
    statistic: Statistic, value: str, df: Sequence[str], p: str, *, sides: Sides = "two-sided"
) -> CheckResult:
    """Can the statistic, unrounded, have this p-value or one within this bound ("< .001")?

    `statistic`: t(df), F(df1, df2), chi2(df), r(df), z(), Q(df) of a meta-analysis, Tukey's q(k, df); all values that
    print as `value` are taken, and p falls as they rise. Reading: the other number of sides (t, r, z).
    "undecided" within the numerical margin of the tail's bounds. `ValueError`: text that is no number, a bound as the
    statistic's own value, wrong degrees of freedom. Source: Nuijten et al. 2016, Behavior Research Methods 48, 1205.

    >>> p_against_statistic("t", "2.20", ["28"], ".036").verdict
    'attainable'
    """
    number, printed, freedom = read_printed(value), read_printed(p), [read_printed(text).value for text in df]
    check_df(statistic, freedom)
    if number.relation != "=":
        raise ValueError(f"the statistic must be a number, not the bound {number.text}")

    def attempt(sides: Sides, rounding: Rounding) -> DataExistence:
        return _fitting(printed.interval(rounding), *p_range(statistic, number.interval(rounding), freedom, sides))

    other: Sides = "one-sided" if sides == "two-sided" else "two-sided"
    others = [(f"{other} p", partial(attempt, other))] if statistic in SIDED else []
    judged = judge_readings(partial(attempt, sides), others)
    outer, _ = p_range(statistic, number.interval(Rounding.HALF_UP), freedom, sides)
    return CheckResult(
        check="p against statistic",
        printed=f"{statistic}({', '.join(df)}) = {number.text}, p {_shown(printed)}",
        judged=judged,
        reason=f"{statistic} = {number.text} means p in {_small(outer)}, {sides}",
        source=_SOURCE,
        below=outer.low,
        above=outer.high,
        contradicts=() if judged.verdict == "attainable" else (f"{statistic} = {number.text}", f"p {_shown(printed)}"),
        numbers=(("p of the statistic", _small(outer)),),
    )


def _fitting(claimed: Interval, outer: Interval, inner: Interval | None) -> DataExistence:
    """Does the range of p meet what prints as claimed? A proof on both sides of the margin."""
    if not outer.meets(claimed) or not claimed.meets(Interval(Fraction(0), Fraction(1))):  # such as "< .000"
        return NONE_EXISTS
    within = all(end is not None and claimed.holds(end) for end in (outer.low, outer.high))
    return DataExistence(True) if within or (inner is not None and inner.meets(claimed)) else UNKNOWN


def _shown(printed: PrintedNumber) -> str:
    return printed.text if printed.relation != "=" else f"= {printed.text.removeprefix('=').strip()}"


def _small(interval: Interval) -> str:
    low, high = (float(end) for end in (interval.low or Fraction(0), interval.high or Fraction(1)))
    return f"{low:.4g} to {high:.4g}"


Bounds = tuple[Fraction, Fraction]
_PValueRule = Callable[[int, Fraction], list[Bounds]]
"""The p-values of all counts 0..n, each between two bounds (equal where exact)."""
_NEAR_TIE = 1 + Fraction(1, 10**7)
_MARGIN = Fraction(1, 10**9)


def binomial_p(p: str, n: int, *, chance: str = "1/2", counts: Sequence[int] | None = None) -> CheckResult:
    """Which counts of n give this p-value against `chance`? The printed p stands if one of `counts` (all) does.

    Exact: the sum of all probabilities not above that of the count. Readings: near ties of 1e-7 counted (R), the
    doubled smaller tail, one tail, the normal approximation without and with continuity correction.
    `ValueError`: text that is no number, n below 1, a chance not between 0 and 1, counts outside 0..n.
    Sources: Sterne 1954, Biometrika 41, 275; Fisher 1925 (doubled tail); Yates 1934 (continuity).

    >>> binomial_p("0.205", 140).numbers
    (('counts of 140 that give p', '62, 78'),)
    """
    check_count(n)
    printed, share = read_printed(p), Fraction(chance)
    if not 0 < share < 1:
        raise ValueError(f"chance must lie between 0 and 1, not {chance}")
    asked = list(range(n + 1)) if counts is None else list(counts)
    if any(not 0 <= count <= n for count in asked):
        raise ValueError(f"counts must lie in 0..{n}, not {listed(asked)}")
    plain, *others = ((name, partial(_count_data, printed, rule(n, share), asked)) for name, rule in RULES)
    judged = judge_readings(plain[1], others)
    exact = [low for low, _ in small_probabilities(n, share)]
    fitting = [k for k in range(n + 1) if printed.interval(Rounding.ANY).holds(exact[k])]
    return CheckResult(
        check="binomial p",
        printed=f"p = {printed.text}",
        judged=judged,
        reason=f"exact two-sided p of {n} against {decimal(share)}, counts asked: {_asked(counts, n)}",
        source="Sterne 1954, Biometrika 41, 275",
        below=max((exact[k] for k in asked if exact[k] <= printed.value), default=None),
        above=min((exact[k] for k in asked if exact[k] >= printed.value), default=None),
        contradicts=() if judged.verdict == "attainable" else (f"n = {n}", f"counts {_asked(counts, n)}"),
        numbers=((f"counts of {n} that give p", listed(fitting) or "none"),),
    )


def _asked(counts: Sequence[int] | None, n: int) -> str:
    return f"0 to {n}" if counts is None else listed(counts)


def _count_data(
    printed: PrintedNumber, values: list[Bounds], counts: Sequence[int], rounding: Rounding
) -> DataExistence:
    interval, unsure = printed.interval(rounding), False
    for count in counts:
        low, high = values[count]
        if interval.holds(low) and interval.holds(high):
            return DataExistence(True, ((Fraction(count),),))
        unsure |= low < high and interval.meets(Interval(low, high))
    return UNKNOWN if unsure else NONE_EXISTS


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


def _of_tails(p_of: Callable[[Fraction, Fraction], Fraction]) -> _PValueRule:
    """A rule that takes the p-value of a count from its two tails."""
    return lambda n, chance: [(p, p) for p in (p_of(*pair) for pair in tails(n, chance))]


def _normal(correction: Fraction) -> _PValueRule:
    """2 P(Z > max(0, |k - n p| - correction) / sqrt(n p (1 - p))), between bounds."""

    def rule(n: int, chance: Fraction) -> list[Bounds]:
        spread = float(n * chance * (1 - chance)) ** 0.5
        away = [float(max(Fraction(0), abs(k - n * chance) - correction)) / spread for k in range(n + 1)]
        p = [Fraction(2 * float(special.ndtr(-z))) for z in away]
        return [(x * (1 - _MARGIN), min(Fraction(1), x * (1 + _MARGIN))) if x < 1 else (x, x) for x in p]

    return rule


RULES: tuple[tuple[str, _PValueRule], ...] = (
    ("sum of the small probabilities", small_probabilities),
    ("sum of the small probabilities, near ties counted", lambda n, p: small_probabilities(n, p, _NEAR_TIE)),
    ("doubled tail", _of_tails(lambda lower, upper: min(Fraction(1), 2 * min(lower, upper)))),
    ("one-sided, lower tail", _of_tails(lambda lower, _: lower)),
    ("one-sided, upper tail", _of_tails(lambda _, upper: upper)),
    ("normal approximation", _normal(Fraction(0))),
    ("normal approximation with continuity correction", _normal(Fraction(1, 2))),
)
