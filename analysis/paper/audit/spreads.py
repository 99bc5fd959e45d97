"""GRIMMER and DEBIT: standard deviations on the lattice that n, the mean and the grain leave."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from itertools import islice

from analysis.paper.audit.means import AnswerScale, check_count, scale_of
from analysis.paper.audit.power_sums import BudgetError, greatest_squares, least_squares, numbers_with_sums
from analysis.paper.audit.printed import Interval, PrintedNumber, Rounding, decimal, read_printed
from analysis.paper.audit.words import NONE_EXISTS, UNKNOWN, Attempt, CheckResult, DataExistence, judge_readings, listed

Divisor = Callable[[int], int]
"""What n the sum of squared deviations is divided by to give the square of the printed number."""
DIVISORS: tuple[tuple[str, Divisor], ...] = (
    ("SD with n - 1", lambda n: n - 1),
    ("SD with n", lambda n: n),
    ("the printed SD is a standard error", lambda n: n * (n - 1)),
)
_MOST_SUMS = 20_000


def grimmer(
    mean: str, sd: str, n: int, *, grain: str = "1", items: int = 1, low: str | None = None, high: str | None = None
) -> CheckResult:
    """Can n scores in steps of `grain` have this mean and this standard deviation?

    Exact: with scores low + grain y, SD^2 = grain^2 (sum y^2 - (sum y)^2 / n) / (n - 1) for whole y; all pairs of sums
    that print so are searched for such y. Readings: SD with n, standard error. `ValueError` as in `grim`, or n below 2.
    Sources: Anaya 2016, PeerJ Preprints 4, e2400v1; Allard 2018, Analytic-GRIMMER.

    >>> grimmer("7.3", "2.51", 12).readings, grimmer("5.21", "1.6", 28).verdict
    (('the printed SD is a standard error',), 'attainable')
    """
    means, spread, scale = read_printed(mean), read_printed(sd), scale_of(grain, low, high, items)
    check_count(n - 1, "n - 1")
    plain, *others = ((name, _spread_attempt(means, spread, n, scale, by)) for name, by in DIVISORS)
    decision = judge_readings(plain[1], others)
    below, above = _nearest_spreads(means, spread, n, scale)
    return CheckResult(
        check="grimmer",
        printed=f"M = {means.text}, SD = {spread.text}",
        verdict=decision.verdict,
        reason=f"{n} scores in steps of {decimal(scale.grain)} with one mean have sums of squares 2 steps apart",
        source="Anaya 2016, PeerJ Preprints 4, e2400v1; Allard 2018",
        step=2 * scale.grain**2 / (n - 1),
        below=below,
        above=above,
        readings=decision.readings,
        tried=decision.tried,
        contradicts=() if decision.verdict == "attainable" else (f"M = {means.text}", f"n = {n}"),
        witness=decision.witness,
    )


def _spread_attempt(
    means: PrintedNumber, spread: PrintedNumber, n: int, scale: AnswerScale, divisor: Divisor
) -> Attempt:
    def attempt(rounding: Rounding) -> DataExistence:
        variances = spread.interval(rounding).squared()
        if variances is None:
            return NONE_EXISTS
        sums = scale.sums(means.interval(rounding), n)
        pairs = _pairs(sums, variances, n, scale, divisor(n))
        return _first_witness(islice(pairs, _MOST_SUMS), n, scale)

    return attempt


def _pairs(sums: range, variances: Interval, n: int, scale: AnswerScale, divisor: int) -> Iterator[tuple[int, int]]:
    """Sums and sums of squares, in grains, that print so; the middle sums first, where data are most likely."""
    for total in sorted(sums, key=lambda value: abs(2 * value - sums[0] - sums[-1])):
        squares = variances.mapped(partial(_sum_of_squares, total, n, divisor, scale.grain))
        bounded = scale.low is not None and scale.high is not None
        most = greatest_squares(n, total, scale.low or 0, scale.high or 0) if bounded else None
        for value in squares.integers(least_squares(n, total), most):
            if (value - total) % 2 == 0:
                yield total, value


def _sum_of_squares(total: int, n: int, divisor: int, grain: Fraction, variance: Fraction) -> Fraction:
    return variance * divisor / grain**2 + Fraction(total**2, n)


def _first_witness(pairs: Iterator[tuple[int, int]], n: int, scale: AnswerScale) -> DataExistence:
    unsure, tried = False, 0
    for tried, (total, squares) in enumerate(pairs, 1):  # noqa: B007 the count outlives the loop
        try:
            found = numbers_with_sums(n, total, squares, scale.low, scale.high)
        except BudgetError:
            unsure = True
            continue
        if found is not None:
            return DataExistence(True, (tuple(scale.value(value) for value in found),))
    return UNKNOWN if unsure or tried == _MOST_SUMS else NONE_EXISTS


def _nearest_spreads(
    means: PrintedNumber, spread: PrintedNumber, n: int, scale: AnswerScale
) -> tuple[Fraction | None, Fraction | None]:
    """The nearest attainable squares of the SD on both sides of the printed one, for sums that print the mean."""
    sums = scale.sums(means.interval(Rounding.ANY), n)
    if not sums or len(sums) > 100:
        return None, None
    target, unit = spread.value**2, scale.grain**2 / (n - 1)
    sides: tuple[list[Fraction], list[Fraction]] = ([], [])
    for total in sums:
        place = int(_sum_of_squares(total, n, n - 1, scale.grain, target))
        for side, step in enumerate((-1, 1)):
            squares = _next_squares(place + side, step, n, total, scale)
            sides[side].extend([] if squares is None else [(squares - Fraction(total**2, n)) * unit])
    return max(sides[0], default=None), min(sides[1], default=None)


def _next_squares(start: int, step: int, n: int, total: int, scale: AnswerScale) -> int | None:
    """From `start` on, the first sum of squares that n whole numbers with this sum have."""
    least = least_squares(n, total)
    start = max(start, least) if step > 0 else start
    for squares in range(start, start + 200 * step, step):
        if squares < least:
            return None
        try:
            if numbers_with_sums(n, total, squares, scale.low, scale.high) is not None:
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
    plain, *others = ((name, _binary_attempt(means, spread, n, by)) for name, by in DIVISORS)
    decision = judge_readings(plain[1], others)
    ones = AnswerScale(Fraction(1), low=0, high=1).sums(means.interval(Rounding.ANY), n)
    squares = sorted(_binary_variance(k, n, n - 1) for k in ones)
    return CheckResult(
        check="debit",
        printed=f"M = {means.text}, SD = {spread.text}",
        verdict=decision.verdict,
        reason=f"the mean fixes the SD of answers of 0 and 1, here with {listed(ones) or 'no whole number of'} ones",
        source="Heathers & Brown 2019, https://osf.io/5vb3u/",
        step=Fraction(1, n),
        below=max((value for value in squares if value <= spread.value**2), default=None),
        above=min((value for value in squares if value >= spread.value**2), default=None),
        readings=decision.readings,
        tried=decision.tried,
        contradicts=() if decision.verdict == "attainable" else (f"M = {means.text}", f"n = {n}"),
        witness=decision.witness,
    )


def _binary_variance(ones: int, n: int, divisor: int) -> Fraction:
    return Fraction(ones * (n - ones), n * divisor)


def _binary_attempt(means: PrintedNumber, spread: PrintedNumber, n: int, divisor: Divisor) -> Attempt:
    def attempt(rounding: Rounding) -> DataExistence:
        variances = spread.interval(rounding).squared()
        ones = AnswerScale(Fraction(1), low=0, high=1).sums(means.interval(rounding), n)
        fitting = (k for k in ones if variances and variances.holds(_binary_variance(k, n, divisor(n))))
        k = next(fitting, None)
        return NONE_EXISTS if k is None else DataExistence(True, ((Fraction(1),) * k + (Fraction(0),) * (n - k),))

    return attempt
