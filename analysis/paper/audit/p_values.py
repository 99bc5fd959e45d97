"""Printed p-values against the printed statistic and its degrees of freedom, by tails between safe bounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache, partial
from types import MappingProxyType
from typing import Literal

import numpy as np
import scipy

from analysis.paper.audit.printed import (
    NONE_EXISTS,
    UNKNOWN,
    CheckResult,
    DataExistence,
    Interval,
    PrintedNumber,
    Rounding,
    judge_readings,
    read_plain,
    read_printed,
)
from analysis.stats.studentized_range import studentized_range_sf

Statistic = Literal["t", "F", "chi2", "r", "z", "Q", "q"]
Sides = Literal["two-sided", "one-sided"]
RELATIVE, ABSOLUTE = 1e-9, 1e-300
"""Margin of t, F, chi2, r and z: scipy states 1e-13 or better."""
RANGE_RELATIVE, RANGE_FAR, RANGE_ABSOLUTE = 1e-5, 1e-2, 1e-11
"""Margins of the studentized range: 2e-7 relative was measured up to 1000 df, 1e-3 beyond; no digit below 1e-12."""
_DF = {"t": 1, "F": 2, "chi2": 1, "r": 1, "z": 0, "Q": 1, "q": 2}
SIDED = ("t", "r", "z")
"""Statistics with a sign: the others' p-values have one tail."""
_ANY, _NOT_NEGATIVE = Interval(None, None, False, False), Interval(Fraction(0), None, True, False)
_RANGES: Mapping[Statistic, tuple[Interval, str]] = MappingProxyType(
    {
        "F": (_NOT_NEGATIVE, "F is never below 0"),
        "chi2": (_NOT_NEGATIVE, "chi-squared is never below 0"),
        "Q": (_NOT_NEGATIVE, "Q is never below 0"),
        "q": (_NOT_NEGATIVE, "q is never below 0"),
        "r": (Interval(Fraction(-1), Fraction(1)), "a correlation lies between -1 and 1"),
    }
)
"""The values that a statistic can have, with the rule in words; t and z can have any."""


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
    return float(
        scipy.special.betaincc(b, a, float(small)) if 2 * small < 1 else scipy.special.betainc(a, b, float(1 - small))
    )


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
    return _rounded_range_tail(float(x), *df)


@lru_cache(maxsize=1024)
def _rounded_range_tail(x: float, k: float, df: float) -> float:
    """Kept, as the two bounds of a root are mostly one number, and points are tried again under other readings."""
    return float(np.asarray(studentized_range_sf(x, k, df)))


_TAILS: dict[Statistic, Callable[[Fraction, list[float]], float]] = {
    "t": _t_tail,
    "r": _r_tail,
    "z": lambda x, _: float(scipy.special.ndtr(-float(x))),
    "F": _f_tail,
    "chi2": lambda x, df: float(scipy.special.chdtrc(df[0], float(x))),
    "Q": lambda x, df: float(scipy.special.chdtrc(df[0], float(x))),
    "q": _range_tail,
}

_SOURCE = "Nuijten et al. 2016, Behavior Research Methods 48, 1205"


def p_against_statistic(
    statistic: Statistic, value: str, df: Sequence[str], p: str, *, sides: Sides = "two-sided"
) -> CheckResult:
    """Can the statistic, unrounded, have this p-value or one within this bound ("< .001")?

    `statistic`: t(df), F(df1, df2), chi2(df), r(df), z(), Q(df) of a meta-analysis, Tukey's q(k, df); all values that
    print as `value` are taken, and p falls as they rise. Reading: the other number of sides (t, r, z).
    "not attainable" too where nothing that the statistic can be prints as `value`: a correlation of 1.2, an F below 0.
    "undecided" within the numerical margin of the tail's bounds. `ValueError`: text that is no number, a bound as the
    statistic's own value, degrees of freedom that are wrong, a bound or a percentage; one side of what has none.
    Source: Nuijten et al. 2016, Behavior Research Methods 48, 1205.

    >>> p_against_statistic("t", "2.20", ["28"], ".036").verdict
    'attainable'
    """
    number, printed, freedom = read_printed(value), read_printed(p), [read_plain(text).value for text in df]
    check_df(statistic, freedom)
    if sides == "one-sided" and statistic not in SIDED:
        raise ValueError(f"sides is one-sided; only {', '.join(SIDED)} have sides, not {statistic}: leave it out")
    if number.relation != "=":
        raise ValueError(f"the statistic must be a number, not the bound {number.text}")
    shown = f"{statistic}({', '.join(df)}) = {number.text}, p {_shown(printed)}"
    allowed, rule = _RANGES.get(statistic, (_ANY, ""))
    if not allowed.meets(number.interval(Rounding.ANY)):
        return _never(shown, rule)

    def attempt(sides: Sides, rounding: Rounding) -> DataExistence:
        return _fitting(printed.interval(rounding), *p_range(statistic, number.interval(rounding), freedom, sides))

    other: Sides = "one-sided" if sides == "two-sided" else "two-sided"
    others = [(f"{other} p", partial(attempt, other))] if statistic in SIDED else []
    judged = judge_readings(partial(attempt, sides), others)
    outer, _ = p_range(statistic, number.interval(Rounding.HALF_UP), freedom, sides)
    return CheckResult(
        check="p against statistic",
        printed=shown,
        judged=judged,
        reason=f"{statistic} = {number.text} means p in {_small(outer)}{f', {sides}' if statistic in SIDED else ''}",
        source=_SOURCE,
        below=outer.low,
        above=outer.high,
        contradicts=() if judged.verdict == "attainable" else (f"{statistic} = {number.text}", f"p {_shown(printed)}"),
        numbers=(("p of the statistic", _small(outer)),),
    )


def _never(printed: str, rule: str) -> CheckResult:
    """The result for a statistic that has no such value, whatever its p."""
    judged = judge_readings(lambda _: NONE_EXISTS)
    return CheckResult(check="p against statistic", printed=printed, judged=judged, reason=rule, source=_SOURCE)


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
