"""GRIM, GRIMMER and DEBIT: means, percentages and standard deviations on the lattice that n and the grain leave."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from itertools import chain, islice, zip_longest
from math import ceil, floor, log10

from analysis.paper.audit.lattices import (
    SEARCH_STEPS,
    BudgetError,
    SearchBudget,
    greatest_squares,
    least_squares,
    numbers_with_sums,
)
from analysis.paper.audit.printed import (
    NONE_EXISTS,
    ORDINARY,
    UNKNOWN,
    Attempt,
    CheckResult,
    DataExistence,
    Interval,
    PrintedNumber,
    Rounding,
    Witness,
    decimal,
    family,
    judge_readings,
    listed_by_rounding,
    middle,
    read_printed,
)
from analysis.paper.paper import MOST_COUNTED

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

    `ValueError` if the grain is not above 0, items are below 1 or above what can be checked, or the ends are not whole
    steps apart or in the wrong order.
    """
    step = read_printed(grain).value
    if step <= 0 or items < 1:
        raise ValueError(f"grain must be above 0 and items at least 1, not {grain} and {items}")
    check_count(items, "items")
    step /= items
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
    judged = judge_readings(partial(_mean_data, printed, n, scale))
    below, above = nearest(printed.value, scale.grain / n, scale.origin, scale.ends(n))
    return CheckResult(
        check="grim",
        printed=printed.text,
        judged=judged,
        reason=_apart(n, scale),
        source=_GRIM,
        step=scale.grain / n,
        below=below,
        above=above,
        contradicts=() if judged.witness else (f"n = {n}", f"grain {grain}"),
        number=printed,
    )


def _apart(n: int, scale: AnswerScale) -> str:
    if n == 1:
        return f"a single score comes in steps of {_step(scale.grain)}"
    return f"means of {n} scores in steps of {_step(scale.grain)} lie {_step(scale.grain / n)} apart"


def _step(value: Fraction) -> str:
    """A distance for a report: a small one to as many decimals as show it.

    >>> _step(Fraction(1, 150)), _step(Fraction(1, 10**8))
    ('0.006667', '0.00000001')
    """
    return decimal(value, max(6, len(str(value.denominator // value.numerator)) + 1))


def check_count(n: int, name: str = "n") -> None:
    """`ValueError` if `n` is below 1, or above what can be checked."""
    if not 1 <= n <= MOST_COUNTED:
        raise ValueError(f"{name} must be at {'least 1' if n < 1 else f'most {MOST_COUNTED:,}'}, not {n}")


def _mean_data(printed: PrintedNumber, n: int, scale: AnswerScale, rounding: Rounding) -> DataExistence:
    sums = scale.sums(printed.interval(rounding), n)
    return DataExistence(True, even_spread(middle(sums), n, scale)) if sums else NONE_EXISTS


def _ordinary_sums(printed: PrintedNumber, n: int, scale: AnswerScale) -> range:
    """The sums of n values whose mean prints so, a tie rounded half up or half to even."""
    found = [sums for sums in (scale.sums(printed.interval(rounding), n) for rounding in ORDINARY) if sums]
    return range(min(one.start for one in found), max(one.stop for one in found)) if found else range(0)


def _sums_by_rounding(printed: PrintedNumber, n: int, scale: AnswerScale) -> str:
    """The sums of n values whose mean prints so, with the rounding they need; empty if there are none.

    >>> _sums_by_rounding(read_printed("0.86"), 150, AnswerScale(Fraction(1), low=0, high=1))
    '129, or 130 by truncation'
    """
    return listed_by_rounding(lambda rounding: scale.sums(printed.interval(rounding), n))


def even_spread(total: int, n: int, scale: AnswerScale) -> Witness:
    """So many scores with the sum `total`, as equal as can be."""
    base, more = divmod(total, n)
    return ((scale.value(base + 1),) * more + (scale.value(base),) * (n - more),)


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
    others = family(
        partial(_bases, printed, count, n),
        lambda base: f"out of {base} instead of {n}",
        lambda base: _share_attempt(printed, count, base),
    )
    judged = judge_readings(_share_attempt(printed, count, n), others)
    fitting = _sums_by_rounding(printed, n, AnswerScale(Fraction(1), low=0, high=1))
    below, above = nearest(printed.value, Fraction(1, n), Fraction(0), (0, n))
    people, share = f"{count} of {n}", Fraction(count, n)
    return CheckResult(
        check="percent of count",
        printed=f"{people}, {printed.text}",
        judged=judged,
        reason=f"{people} is {decimal(100 * share, 3)} %",
        source="definition of a percentage",
        step=Fraction(1, n),
        below=below,
        above=above,
        contradicts=() if judged.verdict == "attainable" else (f"count {count}", f"n = {n}"),
        numbers=((f"counts of {n} that print {printed.text}", fitting or "none"),),
        number=printed,
        of=people,
        share=share,
    )


def _share_attempt(printed: PrintedNumber, count: int, n: int) -> Attempt:
    share = Fraction(count, n)
    return lambda rounding: DataExistence(True, ((share,),)) if printed.interval(rounding).holds(share) else NONE_EXISTS


def _bases(printed: PrintedNumber, count: int, n: int, rounding: Rounding) -> range:
    """Smaller numbers of people of which `count` would print so: a share falls as they grow."""
    fewer, share = range(max(count, 1), n)[::-1], printed.interval(rounding)
    fitting = _held(fewer, lambda m: share.side(Fraction(count, m)))
    return range(fitting[-1], fitting[0] + 1) if fitting else range(0)


def _held(numbers: range, side: Callable[[int], int]) -> range:
    """Of numbers along which a value never falls, those at which it lies inside (`Interval.side`)."""
    return numbers[bisect_left(numbers, 0, key=side) : bisect_right(numbers, 0, key=side)]


DIVISORS: tuple[tuple[str, Callable[[int], int]], ...] = (
    ("SD with n - 1", lambda n: n - 1),
    ("SD with n", lambda n: n),
    ("the printed SD is a standard error", lambda n: n * (n - 1)),
)
"""What the sum of squared deviations of n is divided by to give the square of the printed number."""
_MOST_SUMS, _MOST_STEPS, _MOST_FAILED = 20_000, 300_000, 10
"""Of one search for data: pairs of sums, steps in all, and searches without an answer."""


def grimmer(
    mean: str, sd: str, n: int, *, grain: str = "1", items: int = 1, low: str | None = None, high: str | None = None
) -> CheckResult:
    """Can n scores in steps of `grain` have this mean and this standard deviation?

    Exact: with scores low + grain y, SD^2 = grain^2 (sum y^2 - (sum y)^2 / n) / (n - 1) for whole y; all pairs of sums
    that print so are searched for such y. Readings: SD with n, standard error. `ValueError` as in `grim`, or n below 2.
    Sources: Anaya 2016, PeerJ Preprints 4, e2400v1; Allard 2018, Analytic-GRIMMER.

    >>> grimmer("7.3", "2.51", 12).judged.readings, grimmer("5.21", "1.6", 28).verdict
    (('the printed SD is a standard error',), 'attainable')
    """
    means, spread, scale = read_printed(mean), read_printed(sd), scale_of(grain, low, high, items)
    check_count(n - 1, "n - 1")
    plain, *others = ((name, _spread_attempt(means, spread, n, scale, by(n))) for name, by in DIVISORS)
    judged = judge_readings(plain[1], others)
    no_mean = _no_mean(means, n, scale)
    below, above = (None, None) if no_mean else _nearest_spreads(means, spread, n, scale)
    steps = f"{n} scores in steps of {_step(scale.grain)} with one mean have sums of squares 2 steps apart"
    return CheckResult(
        check="grimmer",
        printed=f"M = {means.text}, SD = {spread.text}",
        judged=judged,
        reason=no_mean or steps,
        source="Anaya 2016, PeerJ Preprints 4, e2400v1; Allard 2018",
        step=2 * scale.grain**2 / (n - 1),
        below=below,
        above=above,
        contradicts=() if judged.verdict == "attainable" else (f"M = {means.text}", f"n = {n}"),
        number=spread,
    )


def _no_mean(means: PrintedNumber, n: int, scale: AnswerScale) -> str:
    """Why the mean alone cannot be, before any SD is judged; empty if it can."""
    if judge_readings(partial(_mean_data, means, n, scale)).verdict == "attainable":
        return ""
    sides = nearest(means.value, scale.grain / n, scale.origin, scale.ends(n))
    digits = max(0, -floor(log10(means.unit))) + 1
    shown = " and ".join(decimal(value, digits) for value in sides if value is not None)
    return f"no {n} scores in steps of {_step(scale.grain)} have this mean, whatever their SD; the nearest are {shown}"


def _spread_attempt(means: PrintedNumber, spread: PrintedNumber, n: int, scale: AnswerScale, divisor: int) -> Attempt:
    def attempt(rounding: Rounding) -> DataExistence:
        variances = spread.interval(rounding).squared()
        if variances is None:
            return NONE_EXISTS
        sums = scale.sums(means.interval(rounding), n)
        pairs = _pairs(sums, variances, n, scale, divisor)
        return _first_witness(islice(pairs, _MOST_SUMS), n, scale, complete=sums.stop - sums.start <= _MOST_SUMS)

    return attempt


def _pairs(sums: range, variances: Interval, n: int, scale: AnswerScale, divisor: int) -> Iterator[tuple[int, int]]:
    """Sums and sums of squares, in grains, that print so; the middle sums first, where data are most likely."""
    for total in islice(_middle_out(sums), _MOST_SUMS):
        squares = variances.mapped(partial(_sum_of_squares, total, n, divisor, scale.grain))
        bounded = scale.low is not None and scale.high is not None
        most = greatest_squares(n, total, scale.low or 0, scale.high or 0) if bounded else None
        whole = squares.integers(least_squares(n, total), most)
        yield from ((total, value) for value in range(whole.start + (whole.start - total) % 2, whole.stop, 2))


def _middle_out(values: range) -> Iterator[int]:
    """The values of a range, those in its middle first."""
    if not values:
        return iter(())
    centre = middle(values)
    both = zip_longest(range(centre, values.start - 1, -1), range(centre + 1, values.stop))
    return (value for value in chain.from_iterable(both) if value is not None)


def _sum_of_squares(total: int, n: int, divisor: int, grain: Fraction, variance: Fraction) -> Fraction:
    return variance * divisor / grain**2 + Fraction(total**2, n)


def _first_witness(pairs: Iterator[tuple[int, int]], n: int, scale: AnswerScale, *, complete: bool) -> DataExistence:
    tried = unsure = steps = 0
    for tried, (total, squares) in enumerate(pairs, 1):  # noqa: B007 the count outlives the loop
        budget = SearchBudget(SEARCH_STEPS)
        try:
            found = numbers_with_sums(n, total, squares, scale.low, scale.high, budget=budget)
        except BudgetError:
            found, unsure = None, unsure + 1
        if found is not None:
            return DataExistence(True, (_values(found, scale),))
        steps += SEARCH_STEPS - budget.left
        if unsure == _MOST_FAILED or steps > _MOST_STEPS:
            return UNKNOWN
    return NONE_EXISTS if complete and not unsure and tried < _MOST_SUMS else UNKNOWN


def _values(multiples: Sequence[int], scale: AnswerScale) -> tuple[Fraction, ...]:
    known = {multiple: scale.value(multiple) for multiple in set(multiples)}
    return tuple(known[multiple] for multiple in multiples)


def _nearest_spreads(
    means: PrintedNumber, spread: PrintedNumber, n: int, scale: AnswerScale
) -> tuple[Fraction | None, Fraction | None]:
    """The nearest attainable squares of the SD on both sides of the printed one, for sums that print the mean."""
    sums = next(filter(None, (scale.sums(means.interval(rounding), n) for rounding in ORDINARY)), range(0))
    if sums.stop - sums.start > 100:
        return None, None
    target, unit, budget = spread.value**2, scale.grain**2 / (n - 1), SearchBudget(_MOST_STEPS)
    sides: tuple[list[Fraction], list[Fraction]] = ([], [])
    for total in sums:
        place = int(_sum_of_squares(total, n, n - 1, scale.grain, target))
        for side, step in enumerate((-1, 1)):
            squares = _next_squares(place + side, step, n, total, scale=scale, budget=budget)
            sides[side].extend([] if squares is None else [(squares - Fraction(total**2, n)) * unit])
    return max(sides[0], default=None), min(sides[1], default=None)


def _next_squares(start: int, step: int, n: int, total: int, *, scale: AnswerScale, budget: SearchBudget) -> int | None:
    """From `start` on, the first sum of squares that n whole numbers with this sum have."""
    least = least_squares(n, total)
    start = max(start, least) if step > 0 else start
    for squares in range(start, start + 200 * step, step):
        if squares < least:
            return None
        try:
            if numbers_with_sums(n, total, squares, scale.low, scale.high, budget=budget) is not None:
                return squares
        except BudgetError:
            return None
    return None


def debit(mean: str, sd: str, n: int) -> CheckResult:
    """Can n answers of 0 or 1 have this mean and this standard deviation?

    Exact: K ones give mean K / n and SD^2 = K (n - K) / (n (n - 1)); all K from 0 to n are tried. Readings: SD with n,
    standard error. `ValueError` for text that is no number or n below 2.
    Source: Heathers & Brown 2019, DEBIT, https://osf.io/5vb3u/.

    >>> debit("0.44", "0.50", 1683).verdict, debit("0.35", "0.18", 20).verdict
    ('attainable', 'not attainable')
    """
    means, spread = read_printed(mean), read_printed(sd)
    check_count(n - 1, "n - 1")
    plain, *others = ((name, partial(_binary_data, means, spread, n, by(n))) for name, by in DIVISORS)
    judged = judge_readings(plain[1], others)
    scale = AnswerScale(Fraction(1), low=0, high=1)
    no_mean = _no_mean(means, n, scale)
    below, above = (None, None) if no_mean else _nearest_variances(_ordinary_sums(means, n, scale), spread.value**2, n)
    fixed = f"the mean fixes the SD of answers of 0 and 1; ones among the {n}: {_sums_by_rounding(means, n, scale)}"
    return CheckResult(
        check="debit",
        printed=f"M = {means.text}, SD = {spread.text}",
        judged=judged,
        reason=no_mean or fixed,
        source="Heathers & Brown 2019, https://osf.io/5vb3u/",
        step=Fraction(1, n),
        below=below,
        above=above,
        contradicts=() if judged.verdict == "attainable" else (f"M = {means.text}", f"n = {n}"),
        number=spread,
    )


def _binary_variance(ones: int, n: int, divisor: int) -> Fraction:
    return Fraction(ones * (n - ones), n * divisor)


def _slopes(ones: range, n: int) -> tuple[range, range]:
    """Counts of ones along which the variance never falls: those up to a half, and from the others the most first."""
    half = max(ones.start, min(ones.stop, n // 2 + 1))
    return range(ones.start, half), range(half, ones.stop)[::-1]


def _nearest_variances(ones: range, target: Fraction, n: int) -> tuple[Fraction | None, Fraction | None]:
    """The nearest variances on both sides of the target."""

    def variance(k: int) -> Fraction:
        return _binary_variance(k, n, n - 1)

    below, above = list[Fraction](), list[Fraction]()
    for slope in _slopes(ones, n):
        below += map(variance, slope[: bisect_right(slope, target, key=variance)][-1:])
        above += map(variance, slope[bisect_left(slope, target, key=variance) :][:1])
    return max(below, default=None), min(above, default=None)


def _binary_data(
    means: PrintedNumber, spread: PrintedNumber, n: int, divisor: int, rounding: Rounding
) -> DataExistence:
    variances = spread.interval(rounding).squared()
    if variances is None:
        return NONE_EXISTS
    ones = AnswerScale(Fraction(1), low=0, high=1).sums(means.interval(rounding), n)
    for slope in _slopes(ones, n):
        for k in _held(slope, lambda k: variances.side(_binary_variance(k, n, divisor)))[:1]:
            return DataExistence(True, ((Fraction(1),) * k + (Fraction(0),) * (n - k),))
    return NONE_EXISTS
