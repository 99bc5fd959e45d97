"""Whole numbers that follow from a design: degrees of freedom, and totals of a protocol (trials, breaks, durations)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from functools import partial
from math import prod
from typing import Annotated, Literal

from pydantic import Field

from analysis.paper.audit.means import check_count
from analysis.paper.audit.printed import (
    NONE_EXISTS,
    Attempt,
    CheckResult,
    DataExistence,
    Interval,
    PrintedNumber,
    PrintedText,
    Rounding,
    decimal,
    family,
    judge_readings,
    listed,
    read_printed,
)
from experiments.config.door import Model

ComparisonDesign = Literal["between", "repeated", "one sample", "paired", "two samples", "correlation", "contingency"]
Freedom = tuple[Fraction, ...]
_SOURCE = "Winer 1971, Statistical Principles in Experimental Design; Greenhouse & Geisser 1959; Welch 1947"


_COUNTS = {"repeated": 2, "two samples": 2, "contingency": 2, "one sample": 1, "paired": 1, "correlation": 1}
_DF: dict[ComparisonDesign, Callable[[Sequence[int]], list[int]]] = {
    "between": lambda sizes: [len(sizes) - 1, sum(sizes) - len(sizes)],
    "repeated": lambda counts: [counts[1] - 1, (counts[0] - 1) * (counts[1] - 1)],
    "two samples": lambda sizes: [sum(sizes) - 2],
    "correlation": lambda counts: [counts[0] - 2],
    "contingency": lambda counts: [(counts[0] - 1) * (counts[1] - 1)],
    "one sample": lambda counts: [counts[0] - 1],
    "paired": lambda counts: [counts[0] - 1],
}


def degrees_of_freedom(df: Sequence[str], design: ComparisonDesign, counts: Sequence[int]) -> CheckResult:
    """Are these the degrees of freedom of this design?

    `counts`: "between" the size of each group, df (k - 1, N - k); "repeated" participants n and conditions k, df
    (k - 1, (n - 1)(k - 1)); "one sample" and "paired" n, df n - 1; "two samples" the two sizes, df n1 + n2 - 2;
    "correlation" n, df n - 2; "contingency" rows and columns, df (r - 1)(c - 1).
    Readings: the other error term of a one-way design, Greenhouse-Geisser's correction, Welch's, fewer participants.
    `ValueError`: counts that make no such design, or another number of df than it has.
    Sources: Winer 1971, chapter 4; Greenhouse & Geisser 1959, Psychometrika 24, 95; Welch 1947, Biometrika 34, 28.

    >>> degrees_of_freedom(["2", "26"], "repeated", [14, 3]).verdict
    'attainable'
    """
    printed = [read_printed(text) for text in df]
    expected = expected_df(design, counts)
    if len(printed) != len(expected):
        raise ValueError(f"a {design} design has {len(expected)} degrees of freedom, not {len(printed)}")
    others = [*_readings(printed, design, counts), *_corrections(printed, design, counts)]
    judged = judge_readings(partial(_same, printed, expected), others)
    return CheckResult(
        check="df",
        printed=f"({', '.join(number.text for number in printed)})",
        judged=judged,
        reason=f"a {design} design of {listed(counts)} has df ({', '.join(map(decimal, expected))})",
        source=_SOURCE,
        step=Fraction(1),
        contradicts=() if judged.verdict == "attainable" else (f"{design} design", f"counts {listed(counts)}"),
        numbers=(("df of the design", ", ".join(map(decimal, expected))),),
    )


def expected_df(design: ComparisonDesign, counts: Sequence[int]) -> Freedom:
    """The degrees of freedom of a design without any correction; `ValueError` if the counts make none."""
    if (len(counts) < 2) if design == "between" else (len(counts) != _COUNTS[design]):
        raise ValueError(f"a {design} design cannot be made of the counts {listed(counts)}")
    for count in counts:
        check_count(count, "each count")
    values = _DF[design](counts)
    if min(values) < 1:
        raise ValueError(f"a {design} design of {listed(counts)} leaves no degrees of freedom")
    return tuple(map(Fraction, values))


def _same(printed: Sequence[PrintedNumber], values: Freedom, rounding: Rounding) -> DataExistence:
    fits = all(n.interval(rounding).holds(value) for n, value in zip(printed, values, strict=True))
    return DataExistence(True, (values,)) if fits else NONE_EXISTS


Reading = tuple[str, Attempt]


def _readings(printed: Sequence[PrintedNumber], design: ComparisonDesign, counts: Sequence[int]) -> list[Reading]:
    """Other whole degrees of freedom that the same data could have been given."""
    if design == "repeated":
        return _repeated_readings(printed, *counts)
    if design == "between":
        return _between_readings(printed, counts)
    if design == "contingency":
        return []
    full = int(expected_df(design, counts)[0])

    def fitting(rounding: Rounding) -> range:
        df = printed[0].interval(rounding).integers(1, full - 1)
        return range(full - df.stop + 1, full - df.start + 1)

    def name(missing: str) -> str:
        return f"{missing} participants" if missing == "fewer" else f"{missing} participants fewer"

    return family(fitting, name, lambda missing: partial(_same, printed, (Fraction(full - missing),)))


def _repeated_readings(printed: Sequence[PrintedNumber], n: int, k: int) -> list[Reading]:
    def fitting(rounding: Rounding) -> range:
        return printed[1].interval(rounding).mapped(lambda df: df / (k - 1) + 1).integers(2, n - 1)

    def same(error: int) -> Attempt:
        return partial(_same, printed, (Fraction(k - 1), Fraction(error)))

    fewer = family(fitting, lambda m: f"{m} participants instead of {n}", lambda m: same((m - 1) * (k - 1)))
    return [
        ("error term of a between-subjects design", same(k * (n - 1))),
        *([("multivariate test", same(n - k + 1))] if n > k else []),
        *fewer,
    ]


def _between_readings(printed: Sequence[PrintedNumber], sizes: Sequence[int]) -> list[Reading]:
    k, everyone = len(sizes), sum(sizes)

    def fitting(rounding: Rounding) -> range:
        return printed[1].interval(rounding).mapped(lambda df: df + k).integers(k + 1, everyone - 1)

    def same(error: int) -> Attempt:
        return partial(_same, printed, (Fraction(k - 1), Fraction(error)))

    equal = len(set(sizes)) == 1 and sizes[0] > 1
    repeated = ("error term of a repeated-measures design", same((sizes[0] - 1) * (k - 1)))
    return [
        *([repeated] if equal else []),
        *family(fitting, lambda total: f"{total} participants instead of {everyone}", lambda total: same(total - k)),
    ]


def _corrections(
    printed: Sequence[PrintedNumber], design: ComparisonDesign, counts: Sequence[int]
) -> Iterator[Reading]:
    if design == "repeated":
        yield "Greenhouse-Geisser or Huynh-Feldt correction", partial(_corrected, printed, counts[0], counts[1])
    if design == "two samples":
        yield "Welch's correction", partial(_welch, printed[0], min(counts) - 1, sum(counts) - 2)


def _corrected(printed: Sequence[PrintedNumber], n: int, k: int, rounding: Rounding) -> DataExistence:
    """Both df times an epsilon from 1 / (k - 1) to 1: is there one that prints so?"""
    first, second = (number.interval(rounding) for number in printed)
    df = _within([first, second.mapped(lambda df: df / (n - 1))], 1, k - 1)
    return NONE_EXISTS if df is None else DataExistence(True, ((df, df * (n - 1)),))


def _welch(printed: PrintedNumber, low: int, high: int, rounding: Rounding) -> DataExistence:
    df = _within([printed.interval(rounding)], low, high)
    return NONE_EXISTS if df is None else DataExistence(True, ((df,),))


def _within(intervals: Sequence[Interval], low: int, high: int) -> Fraction | None:
    """A number in `low..high` and in all the intervals, if there is one: then a middle of two of the ends is."""
    ends = [end for one in intervals for end in (one.low, one.high) if end is not None]
    ends += [Fraction(low), Fraction(high)]
    middles = ((a + b) / 2 for a in ends for b in ends)
    return next((x for x in middles if low <= x <= high and all(one.holds(x) for one in intervals)), None)


Bound = Literal["equals", "at least", "at most"]
_BOUNDS = {"equals": "that", "at least": "at least that", "at most": "at most that"}


class Term(Model):
    """A product of factors, over divisors: a whole number is exact, text is a printed number with its rounding."""

    times: Annotated[list[int | PrintedText], Field(min_length=1)]
    over: list[int | PrintedText] = Field(default_factory=list)


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
    judged = judge_readings(partial(_met, number, terms, bound))
    sums = [_sum(terms, rounding) for rounding in (Rounding.HALF_UP, Rounding.ANY)]
    middle = sum((_value(term) for term in terms), Fraction(0))
    return CheckResult(
        check="total",
        printed=number.text,
        judged=judged,
        reason=f"{' + '.join(map(_text, terms))} make {_shown(sums[0])}, and it is to be {_BOUNDS[bound]}",
        source="Moore, Kearfott & Cloud 2009, chapter 2",
        below=middle if middle <= number.value else None,
        above=middle if middle >= number.value else None,
        contradicts=() if judged.verdict == "attainable" else tuple(map(_text, terms)),
        numbers=(("terms", " + ".join(map(_text, terms))),),
    )


def _met(printed: PrintedNumber, terms: Sequence[Term], bound: Bound, rounding: Rounding) -> DataExistence:
    whole = _sum(terms, rounding)
    if bound == "at least":
        whole = Interval(whole.low, None, whole.low_closed, False)
    elif bound == "at most":
        whole = Interval(None, whole.high, False, whole.high_closed)
    return DataExistence(True) if printed.interval(rounding).meets(whole) else NONE_EXISTS


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
