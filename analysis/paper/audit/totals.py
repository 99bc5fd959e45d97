"""Totals of a protocol: trials, breaks, durations, masses; a printed number against sums and products of others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import prod
from typing import Literal

from analysis.paper.audit.printed import Interval, Rounding, decimal, read_printed
from analysis.paper.audit.words import NONE_EXISTS, Attempt, CheckResult, DataExistence, judge_readings

Bound = Literal["equals", "at least", "at most"]
_BOUNDS = {"equals": "that", "at least": "at least that", "at most": "at most that"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Term:
    """A product of factors, over divisors: a whole number is exact, text is a printed number with its rounding."""

    times: Sequence[int | str]
    over: Sequence[int | str] = ()


def total(printed: str, terms: Sequence[Term], bound: Bound = "equals") -> CheckResult:
    """Is the printed number what the terms add up to, or at least, or at most that?

    Exact interval arithmetic: every factor may be any value that prints so; the printed total must meet the sums.
    `ValueError`: no terms, text that is no number, factors below 0, divisors that may be 0.
    Source: Moore, Kearfott & Cloud 2009, Introduction to Interval Analysis, chapter 2.

    >>> total("30", [Term(times=[4, 5]), Term(times=[10])]).verdict
    'attainable'
    """
    number = read_printed(printed)
    if not terms:
        raise ValueError("a total needs at least one term")
    decision = judge_readings(_attempt(number.text, terms, bound))
    sums = [_sum(terms, rounding) for rounding in (Rounding.HALF_UP, Rounding.ANY)]
    middle = sum((_value(term) for term in terms), Fraction(0))
    return CheckResult(
        check="total",
        printed=number.text,
        verdict=decision.verdict,
        reason=f"{' + '.join(map(_text, terms))} make {_shown(sums[0])}, and it is to be {_BOUNDS[bound]}",
        source="Moore, Kearfott & Cloud 2009, chapter 2",
        below=middle if middle <= number.value else None,
        above=middle if middle >= number.value else None,
        readings=decision.readings,
        tried=decision.tried,
        contradicts=() if decision.verdict == "attainable" else tuple(map(_text, terms)),
        numbers=(("terms", " + ".join(map(_text, terms))),),
        witness=decision.witness,
    )


def _attempt(text: str, terms: Sequence[Term], bound: Bound) -> Attempt:
    def attempt(rounding: Rounding) -> DataExistence:
        claimed, whole = read_printed(text).interval(rounding), _sum(terms, rounding)
        if bound == "at least":
            whole = Interval(whole.low, None, whole.low_closed, False)
        elif bound == "at most":
            whole = Interval(None, whole.high, False, whole.high_closed)
        return DataExistence(True) if claimed.meets(whole) else NONE_EXISTS

    return attempt


def _sum(terms: Sequence[Term], rounding: Rounding) -> Interval:
    parts = [_product(term, rounding) for term in terms]
    low, high = (
        sum((end or Fraction(0) for end in ends), Fraction(0)) for ends in zip(*map(_ends, parts), strict=True)
    )
    return Interval(low, high, all(p.low_closed for p in parts), all(p.high_closed for p in parts))


def _product(term: Term, rounding: Rounding) -> Interval:
    """The product of the factors' intervals, none of them below 0, over those of the divisors."""
    top = [_factor(value, rounding) for value in term.times]
    under = [_factor(value, rounding) for value in term.over]
    if any((factor.low or Fraction(0)) <= 0 for factor in under):
        raise ValueError(f"a divisor may be 0: {_text(term)}")
    zero = [factor for factor in top if factor.low == 0]
    low_closed = all(f.low_closed for f in top) and all(f.high_closed for f in under)
    return Interval(
        prod((_ends(f)[0] for f in top), start=Fraction(1)) / prod((_ends(f)[1] for f in under), start=Fraction(1)),
        prod((_ends(f)[1] for f in top), start=Fraction(1)) / prod((_ends(f)[0] for f in under), start=Fraction(1)),
        any(f.low_closed for f in zero) if zero else low_closed,
        all(f.high_closed for f in top) and all(f.low_closed for f in under),
    )


def _factor(value: int | str, rounding: Rounding) -> Interval:
    """The values of a factor, those below 0 left out."""
    number = read_printed(value)
    if number.value < 0 or number.relation != "=":
        raise ValueError(f"a factor must be a number not below 0, not {number.text}")
    if isinstance(value, int):
        return Interval(number.value, number.value)
    interval = number.interval(rounding)
    return (
        interval
        if (interval.low or Fraction(0)) >= 0 and number.value
        else Interval(Fraction(0), interval.high, True, interval.high_closed)
    )


def _ends(interval: Interval) -> tuple[Fraction, Fraction]:
    return interval.low or Fraction(0), interval.high or Fraction(0)


def _value(term: Term) -> Fraction:
    """The term at the printed digits."""
    return prod((read_printed(v).value for v in term.times), start=Fraction(1)) / prod(
        (read_printed(v).value for v in term.over), start=Fraction(1)
    )


def _shown(sums: Interval) -> str:
    """A number, or the range of a rounded one."""
    low, high = _ends(sums)
    return decimal(low) if low == high else f"{decimal(low)} to {decimal(high)}"


def _text(term: Term) -> str:
    return " x ".join(map(str, term.times)) + "".join(f" / {value}" for value in term.over)
