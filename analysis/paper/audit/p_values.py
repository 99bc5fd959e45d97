"""Printed p-values against the printed statistic and its degrees of freedom."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction

from analysis.paper.audit.printed import Interval, PrintedNumber, Rounding, read
from analysis.paper.audit.tails import SIDED, Sides, Statistic, check_df, p_range
from analysis.paper.audit.words import NONE_EXISTS, UNKNOWN, Attempt, Found, Result, decide

PFromRange = Callable[[Rounding], tuple[Interval, Interval | None]]
_SOURCE = "Nuijten et al. 2016, Behavior Research Methods 48, 1205"


def p_against_statistic(
    statistic: Statistic, value: str, df: Sequence[str], p: str, *, sides: Sides = "two-sided"
) -> Result:
    """Can the statistic, unrounded, have this p-value or one within this bound ("< .001")?

    `statistic`: t(df), F(df1, df2), chi2(df), r(df), z(), Q(df) of a meta-analysis, Tukey's q(k, df); all values that
    print as `value` are taken, and p falls as they rise. Reading: the other number of sides (t, r, z).
    "undecided" within the numerical margin of the tail's bounds. `ValueError`: text that is no number, a bound as the
    statistic's own value, wrong degrees of freedom. Source: Nuijten et al. 2016, Behavior Research Methods 48, 1205.

    >>> p_against_statistic("t", "2.20", ["28"], ".036").verdict
    'attainable'
    """
    number, printed, freedom = read(value), read(p), [read(text).value for text in df]
    check_df(statistic, freedom)
    if number.relation != "=":
        raise ValueError(f"the statistic must be a number, not the bound {number.text}")

    def at(sides: Sides) -> PFromRange:
        return lambda rounding: p_range(statistic, number.interval(rounding), freedom, sides)

    other: Sides = "one-sided" if sides == "two-sided" else "two-sided"
    others = [(f"{other} p", p_attempt(printed, at(other)))] if statistic in SIDED else []
    decision = decide(p_attempt(printed, at(sides)), others)
    outer, _ = at(sides)(Rounding.HALF_UP)
    return Result(
        check="p against statistic",
        printed=f"{statistic}({', '.join(df)}) = {number.text}, p {_shown(printed)}",
        verdict=decision.verdict,
        reason=f"{statistic} = {number.text} means p in {_small(outer)}, {sides}",
        source=_SOURCE,
        below=outer.low,
        above=outer.high,
        readings=decision.readings,
        tried=decision.tried,
        contradicts=()
        if decision.verdict == "attainable"
        else (f"{statistic} = {number.text}", f"p {_shown(printed)}"),
        numbers=(("p of the statistic", _small(outer)),),
        witness=decision.witness,
    )


def p_attempt(printed: PrintedNumber, values: PFromRange) -> Attempt:
    """Does the p range of a rounding meet what prints as `printed`? A proof on both sides of the margin."""

    def attempt(rounding: Rounding) -> Found:
        outer, inner = values(rounding)
        claimed = printed.interval(rounding)
        if not outer.meets(claimed) or _empty(claimed):
            return NONE_EXISTS
        if inner is not None and inner.meets(claimed):
            return Found(True)
        return Found(True) if _within(outer, claimed) else UNKNOWN

    return attempt


def _empty(claimed: Interval) -> bool:
    """No p-value from 0 to 1 is inside: a bound such as "< .000"."""
    return not claimed.meets(Interval(Fraction(0), Fraction(1)))


def _within(inner: Interval, outer: Interval) -> bool:
    return all(end is not None and outer.holds(end) for end in (inner.low, inner.high))


def _shown(printed: PrintedNumber) -> str:
    return printed.text if printed.relation != "=" else f"= {printed.text.removeprefix('=').strip()}"


def _small(interval: Interval) -> str:
    low, high = (float(end) for end in (interval.low or Fraction(0), interval.high or Fraction(1)))
    return f"{low:.4g} to {high:.4g}"
