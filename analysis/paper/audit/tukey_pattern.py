"""A pattern of post-hoc Tukey tests against the printed means and the error term that the printed F implies.

With means m_j of n_j values, F = MS_effect / MS_error gives the error term, so q follows from means and F alone:
q_ij^2 = 2 (m_i - m_j)^2 (k - 1) F / (SS_effect (1 / n_i + 1 / n_j)), SS_effect = sum n_j (m_j - m)^2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from itertools import chain, product
from math import isqrt

import numpy as np

from analysis.paper.audit.lattices import column_choices
from analysis.paper.audit.means import AnswerScale, check_count, scale_of
from analysis.paper.audit.p_values import p_range
from analysis.paper.audit.printed import (
    NONE_EXISTS,
    UNKNOWN,
    Attempt,
    CheckResult,
    DataExistence,
    Interval,
    PrintedNumber,
    PrintedText,
    Rounding,
    judge_readings,
    read_printed,
)
from analysis.stats.arrays import FloatArray
from analysis.stats.studentized_range import studentized_range_isf
from experiments.config.door import Model

OWN_ERROR = "each pair's own error term"
_SOURCE = "Tukey 1953; Kramer 1956, Biometrics 12, 307; Winer 1971, chapter 4"
_POINTS, _GOLDEN = 12, Fraction(618, 1000)
"""Means tried within what prints alike, and the step that spreads them evenly."""
_SPANS, _BOXES = {2: 13, 3: 13, 4: 7}, 200
"""Small whole means that are tried by their number, and sets of means on the lattice."""
_TINY = 1e-100
Box = tuple[Interval, ...]
"""The values that each mean may have."""
Point = tuple[Fraction, ...]
Adjust = Callable[[Interval, int, int], tuple[Interval, Interval | None]]
"""From q, the number of means and the error df: p-values certainly holding, and certainly within."""


class ClaimedComparison(Model):
    """Mean `higher` is said to be above mean `lower` (places from 0) with `p`, such as "< .05".

    Stars also say that p is not below the next level: `p_at_least`.
    """

    higher: int
    lower: int
    p: PrintedText
    p_at_least: PrintedText | None = None


@dataclass(frozen=True, slots=True)
class _Pattern:
    F: PrintedNumber
    means: tuple[PrintedNumber, ...] | None
    sizes: tuple[int, ...]
    scale: AnswerScale | None
    comparisons: tuple[ClaimedComparison, ...]
    df: int

    @property
    def k(self) -> int:
        return len(self.sizes)


def tukey_pattern(
    F: str,
    sizes: Sequence[int],
    comparisons: Sequence[ClaimedComparison],
    means: Sequence[str] | None = None,
    *,
    repeated: bool = True,
    grain: str | None = None,
    low: str | None = None,
    high: str | None = None,
) -> CheckResult:
    """Do these means, with the error term that F implies, give this pattern of Tukey tests?

    `sizes`: values a mean, equal if `repeated` (error df (n - 1)(k - 1), else N - k). With `grain` the means are those
    of whole steps, else all that print so; without means some must exist that give the pattern. Readings: one-sided,
    unadjusted (LSD), Bonferroni; within participants each pair's own error, which is not printed, leaves "undecided".
    Whether any data have F and means is `repeated_f`'s question.
    `ValueError`: text that is no number, places that are not two of the means, unequal sizes within participants.
    Sources: Kramer 1956, Biometrics 12, 307; Winer 1971, chapter 4.
    """
    scale = None if grain is None else scale_of(grain, low, high)
    pattern = replace(_checked(F, sizes, comparisons, means, repeated), scale=scale)
    plain = partial(_means, pattern, _tukey)
    others: list[tuple[str, Attempt]] = [(name, partial(_means, pattern, adjust)) for name, adjust in _OTHERS]
    if repeated:
        others.append((OWN_ERROR, partial(_own_error, pattern)))
    judged = judge_readings(plain, others)
    pooled = judge_readings(plain).verdict
    return CheckResult(
        check="Tukey pattern",
        printed="; ".join(f"{c.higher + 1} above {c.lower + 1}: p {c.p}" for c in pattern.comparisons),
        judged=judged,
        reason=f"with the error term implied by F = {pattern.F.text}, df {pattern.df}: {pooled}",
        source=_SOURCE,
        contradicts=() if judged.verdict in {"attainable", "undecided"} else (f"F = {F}", "the means"),
        numbers=_shown(pattern),
    )


def _checked(
    F: str,
    sizes: Sequence[int],
    comparisons: Sequence[ClaimedComparison],
    means: Sequence[str] | None,
    repeated: bool,
) -> _Pattern:
    k = len(sizes)
    check_count(k - 1, "number of means less 1")
    for size in sizes:
        check_count(size, "each size")
    if repeated and len(set(sizes)) > 1:
        raise ValueError(f"within participants the sizes must be equal, not {list(sizes)}")
    if means is not None and len(means) != k:
        raise ValueError(f"{k} means are needed, not {len(means)}")
    for c in comparisons:
        if c.higher == c.lower or not (0 <= c.higher < k and 0 <= c.lower < k):
            raise ValueError(f"a comparison must be of two of the means 0..{k - 1}, not {c.higher} and {c.lower}")
    df = (sizes[0] - 1) * (k - 1) if repeated else sum(sizes) - k
    check_count(df, "error df")
    printed = None if means is None else tuple(map(read_printed, means))
    return _Pattern(read_printed(F), printed, tuple(sizes), None, tuple(comparisons), df)


def _means(pattern: _Pattern, adjust: Adjust, rounding: Rounding) -> DataExistence:
    F = pattern.F.interval(rounding)
    boxes = _boxes(pattern, rounding)
    if boxes is not None and not any(_box_possible(pattern, box, F, adjust, rounding) for box in boxes):
        return NONE_EXISTS
    around = _inside(F, pattern.F.value)
    tried = [] if boxes is None or adjust is not _tukey else _fitted(pattern, boxes[0], F, rounding)
    for point in chain(tried, _points(pattern, boxes)):
        if not all(point[c.higher] > point[c.lower] for c in pattern.comparisons):
            continue
        solved = boxes is not None and adjust is _tukey
        values = [pattern.F.value, *_solved(pattern, point, F, rounding)] if solved else around
        if any(_point_fits(pattern, point, value, adjust, rounding) for value in values if value > 0):
            return DataExistence(True, (point,))
    return UNKNOWN


def _solved(pattern: _Pattern, point: Point, F: Interval, rounding: Rounding) -> list[Fraction]:
    """An F inside in the middle of those that give every Tukey p for these means: a guess, to be checked."""
    low, high = float(F.low or 0), float(F.high or 0)
    box = tuple(Interval(mean, mean) for mean in point)
    for c in pattern.comparisons:
        share = float(_shares(pattern, box, c, _apart(box[c.higher], box[c.lower]))[0])
        if share == 0:
            return []
        squares = np.square(_claimed_q(pattern, c, rounding)) / share
        low, high = max(low, float(squares[0])), min(high, float(squares[1]))
    middle = Fraction((low + high) / 2)
    return [middle] if low < high and F.holds(middle) else []


def _claimed_q(pattern: _Pattern, c: ClaimedComparison, rounding: Rounding) -> FloatArray:
    """The least and the greatest q of what is claimed, about."""
    claims = _claims(c, rounding)
    least = max(claim.low or Fraction(0) for claim in claims)
    ends = [min(max(float(end), 1e-12), 1.0) for end in (claims[0].high or Fraction(1), least)]
    return np.asarray(studentized_range_isf(ends, pattern.k, pattern.df))


def _fitted(pattern: _Pattern, box: Box, F: Interval, rounding: Rounding) -> list[Point]:
    """Means of a box as far as can be from the ends of all that is printed, F and p too: a guess, to be checked."""
    ends = [[float(one.low or 0), float(one.high or 0)] for one in (*box, F)]
    ends += [[*_claimed_q(pattern, c, rounding)] for c in pattern.comparisons]
    middle, half = np.mean(ends, axis=1), np.diff(ends, axis=1)[:, 0] / 2
    if not (pattern.comparisons and all(half > 0)):
        return []
    from scipy.optimize import NonlinearConstraint, minimize  # noqa: PLC0415 - slow, and few patterns come here

    high, low = np.array([(c.higher, c.lower) for c in pattern.comparisons]).T
    sizes = np.array(pattern.sizes, dtype=np.float64)

    def room(x: FloatArray) -> FloatArray:
        """How far each number is from the ends, in halves of what is between them, less that of all."""
        own = middle[: pattern.k + 1] + half[: pattern.k + 1] * x[:-1]
        means, apart = own[:-1], own[high] - own[low]
        effect = np.sum(sizes * (means - np.average(means, weights=sizes)) ** 2) / (pattern.k - 1)
        error = max(effect, _TINY) * (1 / sizes[high] + 1 / sizes[low])  # times F
        found = apart * np.sqrt(2 * max(own[-1], 0.0) / error)
        z = np.append(x[:-1], (found - middle[pattern.k + 1 :]) / half[pattern.k + 1 :])
        return np.append(1 - x[-1] - z, 1 - x[-1] + z)

    def less_room(x: FloatArray) -> float:
        return -float(x[-1])

    within = NonlinearConstraint(room, 0.0, np.inf)
    fitted = minimize(less_room, np.zeros(pattern.k + 2), method="SLSQP", constraints=within).x
    point = tuple(map(Fraction, middle[: pattern.k] + half[: pattern.k] * fitted[: pattern.k]))
    return [point] if all(one.holds(mean) for one, mean in zip(box, point, strict=True)) else []


def _inside(F: Interval, value: Fraction) -> list[Fraction]:
    """The printed F and some values around it that print alike."""
    if F.low is None or F.high is None:
        return [value]
    around = [F.low + (F.high - F.low) * i / 8 for i in range(9)]
    return [x for x in (value, *around) if F.holds(x)]


def _own_error(pattern: _Pattern, rounding: Rounding) -> DataExistence:
    """Each pair on its own error, which is not printed: settled only where a mean is not above the other."""
    boxes = _boxes(pattern, rounding)
    return UNKNOWN if boxes is None or any(_in_order(pattern, box) for box in boxes) else NONE_EXISTS


def _in_order(pattern: _Pattern, box: Box) -> bool:
    return all(_apart(box[c.higher], box[c.lower])[1] > 0 for c in pattern.comparisons)


def _boxes(pattern: _Pattern, rounding: Rounding) -> list[Box] | None:
    """What the means may be: one box of intervals, or each set on the lattice; None if they are not printed."""
    if pattern.means is None:
        return None
    intervals = tuple(mean.interval(rounding) for mean in pattern.means)
    if pattern.scale is None:
        return [intervals]
    scale = pattern.scale
    choices = column_choices([scale.sums(i, n) for i, n in zip(intervals, pattern.sizes, strict=True)], _BOXES)
    if choices is None:
        return [intervals]
    values = (tuple(scale.value(Fraction(c, n)) for c, n in zip(sums, pattern.sizes, strict=True)) for sums in choices)
    return [tuple(Interval(mean, mean) for mean in means) for means in values]


def _points(pattern: _Pattern, boxes: list[Box] | None) -> Iterator[Point]:
    """Means to try: those of the boxes, or small whole numbers in every order."""
    if boxes is None:
        span = _SPANS.get(pattern.k, 0)
        yield from (tuple(map(Fraction, means)) for means in product(range(span), repeat=pattern.k))
        return
    for box in boxes:
        for place in range(1 if all(interval.low == interval.high for interval in box) else _POINTS):
            point = tuple(_within(interval, place * (i + 1)) for i, interval in enumerate(box))
            if all(interval.holds(value) for interval, value in zip(box, point, strict=True)):
                yield point


def _within(interval: Interval, place: int) -> Fraction:
    """A value of an interval: its middle for place 0, then others spread over it."""
    low, high = interval.low or Fraction(0), interval.high or Fraction(0)
    return low + (high - low) * ((Fraction(1, 2) + place * _GOLDEN) % 1)


def _box_possible(pattern: _Pattern, box: Box, F: Interval, adjust: Adjust, rounding: Rounding) -> bool:
    """False only if one of the comparisons certainly cannot be."""
    if F.high is None or F.high <= 0:
        return False
    for c in pattern.comparisons:
        apart = _apart(box[c.higher], box[c.lower])
        if apart[1] <= 0:
            return False
        shares = _shares(pattern, box, c, apart)
        low = Fraction(0) if F.low is None else max(Fraction(0), F.low)
        q = Interval(_root(shares[0] * low)[0], None if shares[1] is None else _root(shares[1] * F.high)[1])
        outer, _ = adjust(q, pattern.k, pattern.df)
        if not all(outer.meets(claim) for claim in _claims(c, rounding)):
            return False
    return True


def _point_fits(pattern: _Pattern, point: Point, F: Fraction, adjust: Adjust, rounding: Rounding) -> bool:
    """Do exactly these means and this F certainly give every comparison?"""
    box = tuple(Interval(mean, mean) for mean in point)
    for c in pattern.comparisons:
        share = _shares(pattern, box, c, _apart(box[c.higher], box[c.lower]))[0]
        outer, _ = adjust(Interval(*_root(share * F)), pattern.k, pattern.df)
        for claim in _claims(c, rounding):
            if not all(end is not None and claim.holds(end) for end in (outer.low, outer.high)):
                return False
    return True


def _claims(c: ClaimedComparison, rounding: Rounding) -> list[Interval]:
    bound = [] if c.p_at_least is None else [Interval(read_printed(c.p_at_least).value, None)]
    return [read_printed(c.p).interval(rounding), *bound]


def _apart(one: Interval, other: Interval) -> tuple[Fraction, Fraction]:
    """Least and greatest difference of two printed means."""
    ends = [end or Fraction(0) for end in (one.low, one.high, other.low, other.high)]
    return ends[0] - ends[3], ends[1] - ends[2]


def _shares(
    pattern: _Pattern, box: Box, c: ClaimedComparison, apart: tuple[Fraction, Fraction]
) -> tuple[Fraction, Fraction | None]:
    """Least and greatest q^2 / F; None where the effect can be nothing. SS_effect = sum n_i n_j (m_i - m_j)^2 / N."""
    sizes = pattern.sizes
    least = most = Fraction(0)
    for i in range(len(sizes)):
        for j in range(i):
            low, high = _squares(*_apart(box[i], box[j]))
            least += low * sizes[i] * sizes[j] / sum(sizes)
            most += high * sizes[i] * sizes[j] / sum(sizes)
    low, high = _squares(max(apart[0], Fraction(0)), apart[1])
    scale = 2 * (len(sizes) - 1) / (Fraction(1, sizes[c.higher]) + Fraction(1, sizes[c.lower]))
    return (scale * low / most if most else Fraction(0)), (scale * high / least if least else None)


def _squares(low: Fraction, high: Fraction) -> tuple[Fraction, Fraction]:
    ends = sorted((low**2, high**2))
    return (Fraction(0) if low <= 0 <= high else ends[0]), ends[1]


def _root(value: Fraction) -> tuple[Fraction, Fraction]:
    """Two numbers 1e-30 apart with the root between them."""
    scale = 10**30
    floor = isqrt(int(value * scale**2))
    return Fraction(floor, scale), Fraction(floor + 1, scale)


def _tukey(q: Interval, k: int, df: int) -> tuple[Interval, Interval | None]:
    return p_range("q", q, [Fraction(k), Fraction(df)], "two-sided")


def _one_sided(q: Interval, k: int, df: int) -> tuple[Interval, Interval | None]:
    outer, inner = _tukey(q, k, df)
    return outer.mapped(lambda p: p / 2), None if inner is None else inner.mapped(lambda p: p / 2)


def _unadjusted(q: Interval, _: int, df: int) -> tuple[Interval, Interval | None]:
    """The t-test with t = q / sqrt(2), two-sided."""
    low = _root((q.low or Fraction(0)) ** 2 / 2)[0]
    t = Interval(low, None if q.high is None else _root(q.high**2 / 2)[1])
    return p_range("t", t, [Fraction(df)], "two-sided")


def _bonferroni(q: Interval, k: int, df: int) -> tuple[Interval, Interval | None]:
    outer = _unadjusted(q, k, df)[0]
    return outer.mapped(lambda p: min(Fraction(1), p * k * (k - 1) / 2)), None


_OTHERS: tuple[tuple[str, Adjust], ...] = (
    ("one-sided Tukey", _one_sided),
    ("unadjusted (LSD)", _unadjusted),
    ("Bonferroni", _bonferroni),
)


def _shown(pattern: _Pattern) -> tuple[tuple[str, str], ...]:
    """The q and p of each comparison for the printed digits."""
    if pattern.means is None or pattern.F.value <= 0:
        return ()
    box = tuple(Interval(mean.value, mean.value) for mean in pattern.means)
    rows = []
    for c in pattern.comparisons:
        share = _shares(pattern, box, c, _apart(box[c.higher], box[c.lower]))[0]
        q = _root(share * pattern.F.value)
        p = _tukey(Interval(*q), pattern.k, pattern.df)[0]
        text = f"q = {float(q[0]):.3f}, p = {float(p.high or 0):.3g}"
        rows.append((f"{c.higher + 1} above {c.lower + 1}, at the printed digits", text))
    return tuple(rows)
