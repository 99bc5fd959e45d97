"""GRIM: means and percentages on the lattice that the number of values and their grain leave."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor

from analysis.paper.audit.printed import Interval, PrintedNumber, Rounding, decimal, read_printed
from analysis.paper.audit.words import NONE_EXISTS, Attempt, CheckResult, DataExistence, Witness, judge_readings, listed

_GRIM = "Brown & Heathers 2017, Social Psychological and Personality Science 8, 363"


@dataclass(frozen=True, slots=True)
class AnswerScale:
    """Values are `origin` plus whole multiples of `grain`, from `low` to `high` multiples (None: no end)."""

    grain: Fraction
    origin: Fraction = Fraction(0)
    low: int | None = None
    high: int | None = None

    def value(self, multiple: Fraction | int) -> Fraction:
        """The value of a multiple of the grain."""
        return self.origin + self.grain * multiple

    def multiples(self, interval: Interval) -> Interval:
        """An interval of values in multiples of the grain."""
        return interval.mapped(lambda value: (value - self.origin) / self.grain)

    def sums(self, interval: Interval, n: int) -> range:
        """The sums of n values, in grains, whose mean lies in `interval`."""
        return self.multiples(interval).mapped(lambda value: value * n).integers(*self.ends(n))

    def ends(self, n: int) -> tuple[int | None, int | None]:
        """Least and greatest sum of n values, in grains."""
        return (None if self.low is None else n * self.low, None if self.high is None else n * self.high)


def scale_of(grain: str, low: str | None = None, high: str | None = None, items: int = 1) -> AnswerScale:
    """A scale in steps of `grain` from `low` to `high`, a score being the mean of `items` answers.

    `ValueError` if the grain is not above 0, or the ends are not whole steps apart or in the wrong order.
    """
    step = read_printed(grain).value / items
    if step <= 0 or items < 1:
        raise ValueError(f"grain must be above 0 and items at least 1, not {grain} and {items}")
    origin = read_printed(low).value if low is not None else Fraction(0)
    top = None if high is None else (read_printed(high).value - origin) / step
    if top is not None and (top.denominator != 1 or (low is not None and top < 0)):
        raise ValueError(f"the scale {low} to {high} is no whole number of steps of {grain}")
    return AnswerScale(step, origin, None if low is None else 0, None if top is None else int(top))


def grim(
    mean: str, n: int, *, grain: str = "1", items: int = 1, low: str | None = None, high: str | None = None
) -> CheckResult:
    """Can n scores in steps of `grain` have this mean? Exact: mean = low + grain K / (n items), K whole.

    `mean` is text as printed, with a percent sign for a percentage (the scores are then shares: grain "1" for yes and
    no). `low, high`: ends of the scale. `ValueError` for text that is no number, n below 1, or no scale.
    Source: Brown & Heathers 2017, Social Psychological and Personality Science 8, 363.

    >>> grim("5.19", 28).verdict, grim("5.21", 28).verdict
    ('not attainable', 'attainable')
    """
    printed, scale = read_printed(mean), scale_of(grain, low, high, items)
    check_count(n)
    decision = judge_readings(_means_attempt(printed, n, scale))
    below, above = nearest(printed.value, scale.grain / n, scale.origin, scale.ends(n))
    return CheckResult(
        check="grim",
        printed=printed.text,
        verdict=decision.verdict,
        reason=f"means of {n} scores in steps of {decimal(scale.grain)} lie {decimal(scale.grain / n)} apart",
        source=_GRIM,
        step=scale.grain / n,
        below=below,
        above=above,
        readings=decision.readings,
        tried=decision.tried,
        contradicts=() if decision.witness else (f"n = {n}", f"grain {grain}"),
        witness=decision.witness,
    )


def check_count(n: int, name: str = "n") -> None:
    """`ValueError` if `n` is below 1."""
    if n < 1:
        raise ValueError(f"{name} must be at least 1, not {n}")


def _means_attempt(printed: PrintedNumber, n: int, scale: AnswerScale) -> Attempt:
    def attempt(rounding: Rounding) -> DataExistence:
        sums = scale.sums(printed.interval(rounding), n)
        return DataExistence(True, even_spread(sums[len(sums) // 2], n, scale)) if sums else NONE_EXISTS

    return attempt


def even_spread(total: int, n: int, scale: AnswerScale) -> Witness:
    """So many scores with the sum `total`, as equal as can be."""
    base, more = divmod(total, n)
    return (tuple(scale.value(base + (i < more)) for i in range(n)),)


def nearest(
    value: Fraction, step: Fraction, origin: Fraction, ends: tuple[int | None, int | None] = (None, None)
) -> tuple[Fraction | None, Fraction | None]:
    """The lattice points origin + step K on both sides of `value` (itself where it is one), K within `ends`."""
    place = (value - origin) / step
    low, high = ends
    below, above = floor(place), ceil(place)
    below = below if high is None else min(below, high)
    above = above if low is None else max(above, low)
    return (
        None if low is not None and below < low else origin + step * below,
        None if high is not None and above > high else origin + step * above,
    )


def percent_of_count(percent: str, count: int, n: int) -> CheckResult:
    """Is `percent` what `count` of `n` is? Exact: 100 count / n.

    Reading that can rescue: out of fewer than n, as when some did not answer. The proof names the counts of n, if any,
    that would print so. `ValueError` if count is not in 0..n, n below 1, or text is no number.
    Source: the definition of a percentage; Brown & Heathers 2017.

    >>> percent_of_count("35.7%", 4, 14).numbers
    (('counts of 14 that print 35.7%', '5'),)
    """
    check_count(n)
    if not 0 <= count <= n:
        raise ValueError(f"count must lie in 0..{n}, not {count}")
    printed = read_printed(percent if "%" in percent else f"{percent}%")
    others = [(f"out of {m} instead of {n}", _share_attempt(printed, count, m)) for m in _bases(printed, count, n)]
    decision = judge_readings(_share_attempt(printed, count, n), others)
    fitting = list(AnswerScale(Fraction(1), low=0, high=1).sums(printed.interval(Rounding.ANY), n))
    below, above = nearest(printed.value, Fraction(1, n), Fraction(0), (0, n))
    return CheckResult(
        check="percent of count",
        printed=f"{count} of {n}, {printed.text}",
        verdict=decision.verdict,
        reason=f"{count} of {n} is {decimal(Fraction(100 * count, n), 3)} %",
        source="definition of a percentage",
        step=Fraction(1, n),
        below=below,
        above=above,
        readings=decision.readings,
        tried=decision.tried,
        contradicts=() if decision.verdict == "attainable" else (f"count {count}", f"n = {n}"),
        numbers=((f"counts of {n} that print {printed.text}", listed(fitting) or "none"),),
        witness=decision.witness,
    )


def _share_attempt(printed: PrintedNumber, count: int, n: int) -> Attempt:
    share = Fraction(count, n)
    return lambda rounding: DataExistence(True, ((share,),)) if printed.interval(rounding).holds(share) else NONE_EXISTS


def _bases(printed: PrintedNumber, count: int, n: int) -> list[int]:
    """Smaller numbers of people of which `count` would print so."""
    widest = printed.interval(Rounding.ANY)
    return [m for m in range(max(count, 1), n) if widest.holds(Fraction(count, m))]
