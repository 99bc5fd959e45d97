"""Printed numbers, the exact intervals of the true values that print so, and the verdicts on them.

Half-up and half-even printing are both ordinary: a number that prints so under either is plain attainable. Half-down (a
tie can fall either way in binary arithmetic) and truncation are readings of their own. `ANY` is the union of the four:
what lies outside it prints so under none.

"not attainable" is said only where no attempt under any reading could succeed, "attainable" only with a witness.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from fractions import Fraction
from itertools import groupby
from math import ceil, floor
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator

from analysis.report.serial import UNWRITTEN, beside, written
from device.messages import first_few

Relation = Literal["=", "<", "<=", ">", ">="]
_RELATIONS: dict[str, Relation] = {"": "=", "=": "=", "<": "<", ">": ">", "<=": "<=", ">=": ">=", "≤": "<=", "≥": ">="}
_TEXT = re.compile(r"^(<=|>=|[<>=≤≥]?)\s*([-+−]?)\s*([0-9]*)(?:\.([0-9]*))?\s*(%?)$")
_COMMA = re.compile(r"[0-9]*,[0-9]+")
_LONGEST = 40
"""Characters of a printed number; longer ones are no number of a paper."""


class Rounding(StrEnum):
    """How a value became its printed digits; the text is what a report says."""

    HALF_UP = "rounding half up"
    HALF_EVEN = "rounding half to even"
    HALF_DOWN = "rounding half down"
    TRUNCATION = "truncation"
    ANY = "roundings mixed"


@dataclass(frozen=True, slots=True)
class Interval:
    """Rational numbers between two ends, each in or out; an end that is None is infinite."""

    low: Fraction | None
    high: Fraction | None
    low_closed: bool = True
    high_closed: bool = True

    def holds(self, value: Fraction) -> bool:
        """Is `value` inside?"""
        return self.side(value) == 0

    def side(self, value: Fraction) -> int:
        """-1 where `value` lies below, 0 inside, 1 above."""
        if self.low is not None and (value < self.low or (value == self.low and not self.low_closed)):
            return -1
        return int(self.high is not None and (value > self.high or (value == self.high and not self.high_closed)))

    def mapped(self, change: Callable[[Fraction], Fraction]) -> Interval:
        """The image under a strictly increasing `change`."""
        low = None if self.low is None else change(self.low)
        high = None if self.high is None else change(self.high)
        return Interval(low, high, self.low_closed, self.high_closed)

    def integers(self, low: int | None = None, high: int | None = None) -> range:
        """The integers inside, also within `low..high`; `ValueError` if that leaves an end open."""
        ends = [] if self.low is None else [ceil(self.low) if self.low_closed else floor(self.low) + 1]
        tops = [] if self.high is None else [floor(self.high) if self.high_closed else ceil(self.high) - 1]
        ends += [] if low is None else [low]
        tops += [] if high is None else [high]
        if not ends or not tops:
            raise ValueError("the interval has an infinite end: name the bound of the integers")
        return range(max(ends), max(min(tops), max(ends) - 1) + 1)

    def squared(self) -> Interval | None:
        """The squares of the numbers inside that are not negative; None if there are none."""
        if self.high is not None and (self.high < 0 or (self.high == 0 and not self.high_closed)):
            return None
        negative = self.low is None or self.low < 0
        low = Fraction(0) if self.low is None or negative else self.low**2
        high = None if self.high is None else self.high**2
        return Interval(low, high, self.low_closed or negative, self.high_closed)

    def meets(self, other: Interval) -> bool:
        """Is any number in both?"""
        return _before(self, other) and _before(other, self)

    def __str__(self) -> str:
        low = "-inf" if self.low is None else decimal(self.low)
        high = "inf" if self.high is None else decimal(self.high)
        return f"{'[' if self.low_closed else '('}{low}, {high}{']' if self.high_closed else ')'}"


def _before(one: Interval, other: Interval) -> bool:
    """Does `one` begin before `other` ends?"""
    if one.low is None or other.high is None:
        return True
    return one.low < other.high or (one.low == other.high and one.low_closed and other.high_closed)


@dataclass(frozen=True, slots=True)
class PrintedNumber:
    """A number as printed: `value` and `unit` (one of its last digit) with a percent sign already divided out.

    `digits` is the number in units of its last digit: its evenness decides ties to even.
    """

    text: str
    relation: Relation
    value: Fraction
    unit: Fraction

    @property
    def digits(self) -> int:
        """The value in units of the last digit."""
        return int(self.value / self.unit)

    def interval(self, rounding: Rounding) -> Interval:
        """The true values that print so; for a bound such as "< .001" all that satisfy it, however rounded."""
        if self.relation != "=":
            return _bound(self.relation, self.value)
        positive = _positive_interval(abs(self.value), self.unit, abs(self.digits), rounding)
        if self.value == 0:
            end, closed = positive.high, positive.high_closed
            return Interval(None if end is None else -end, end, closed, closed)
        return positive if self.value > 0 else _mirrored(positive)


def read_printed(text: str | int) -> PrintedNumber:
    """A printed number such as "28.45", ".205", "< .001", "64.3%"; `ValueError` if it is none.

    >>> read_printed("64.3%").value
    Fraction(643, 1000)
    """
    found = _TEXT.match(str(text).strip()) if len(str(text)) <= _LONGEST else None
    if found is None or not (found[3] or found[4]):
        raise ValueError(f"{_cut(str(text))!r} is no printed number ({_rule(str(text))})")
    relation, sign, whole, decimals, percent = found.groups()
    decimals = decimals or ""
    unit = Fraction(1, 10 ** len(decimals)) / (100 if percent else 1)
    value = int(whole + decimals) * unit
    return PrintedNumber(str(text).strip(), _RELATIONS[relation], -value if sign in {"-", "−"} else value, unit)


def read_plain(text: str) -> PrintedNumber:
    """A printed number that stands for itself; `ValueError` for a bound and for a percentage too.

    >>> read_plain("26.4").value
    Fraction(132, 5)
    """
    number = read_printed(text)
    if number.relation != "=" or "%" in number.text:
        what = "a percentage" if number.relation == "=" else "a bound"
        raise ValueError(f"{number.text!r} is {what} (rule: a number alone, as in '28')")
    return number


def _rule(text: str) -> str:
    if len(text) > _LONGEST:
        return f"rule: at most {_LONGEST} characters, not {len(text)}"
    if _COMMA.search(text):
        point = text.replace(",", ".") if text.count(",") == 1 and "." not in text else None
        return f"a comma? write {point!r}" if point else "rule: a decimal point, and no mark between thousands"
    return "rule: digits, as in '28.45', '< .001' or '64.3%'"


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def _quoted(value: object) -> object:
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise ValueError(f'stands without quotes, so its printed digits are lost; write it as printed: "{value}"')
    return value


def _is_printed(text: str) -> str:
    read_printed(text)
    return text


def _is_plain(text: str) -> str:
    read_plain(text)
    return text


PrintedText = Annotated[str, BeforeValidator(_quoted), AfterValidator(_is_printed)]
"""A number or a bound as printed: "28.45", ".205", "< .001", "64.3%"."""
PlainText = Annotated[str, BeforeValidator(_quoted), AfterValidator(_is_plain)]
"""A number as printed that is neither a bound nor a percentage, such as degrees of freedom: "28", "26.4"."""


def _positive_interval(value: Fraction, unit: Fraction, digits: int, rounding: Rounding) -> Interval:
    half = unit / 2
    even = digits % 2 == 0
    match rounding:
        case Rounding.HALF_UP:
            return Interval(value - half, value + half, True, False)
        case Rounding.HALF_EVEN:
            return Interval(value - half, value + half, even, even)
        case Rounding.HALF_DOWN:
            return Interval(value - half, value + half, False, True)
        case Rounding.TRUNCATION:
            return Interval(value, value + unit, True, False)
        case Rounding.ANY:
            return Interval(value - half, value + unit, True, False)


def _mirrored(interval: Interval) -> Interval:
    low = None if interval.high is None else -interval.high
    high = None if interval.low is None else -interval.low
    return Interval(low, high, interval.high_closed, interval.low_closed)


def _bound(relation: Relation, value: Fraction) -> Interval:
    if relation in {"<", "<="}:
        return Interval(None, value, False, relation == "<=")
    return Interval(value, None, relation == ">=", False)


def decimal(value: Fraction, digits: int = 6) -> str:
    """`value` to at most so many decimals for a report: the display rounds, no check does.

    >>> decimal(Fraction(5, 14))
    '0.357143'
    """
    whole, part = divmod(abs(round(value * 10**digits)), 10**digits)
    return f"{'-' if value < 0 else ''}{whole}.{part:0{digits}d}".rstrip("0").rstrip(".")


AuditVerdict = Literal["attainable", "only under a reading", "not attainable", "not published", "undecided", "refused"]
Witness = tuple[tuple[Fraction, ...], ...]
"""Data that give the printed numbers: rows of values in the unit of the data."""


_LONG_ROW = 100


def _as_texts(rows: Witness) -> list[list[str]]:
    return [_row_texts(row) for row in rows]


def _row_texts(row: Sequence[Fraction]) -> list[str]:
    """The values of a row; of a long one each with how often it stands there, such as "3 x 500000"."""
    if len(row) <= _LONG_ROW:
        return [str(value) for value in row]
    return [f"{value} x {sum(1 for _ in run)}" for value, run in groupby(row)]


ORDINARY = (Rounding.HALF_UP, Rounding.HALF_EVEN)
OTHER = (Rounding.HALF_DOWN, Rounding.TRUNCATION)
ROUNDINGS = tuple(rounding.value for rounding in Rounding)


@dataclass(frozen=True, slots=True)
class JudgedReadings:
    """A verdict with the readings that rescue, data for the first of them, and all readings tried beside the plain.

    `rounding`: of a number that is attainable under one of the two ordinary conventions alone, which one.
    """

    verdict: AuditVerdict
    readings: tuple[str, ...] = ()
    witness: Witness = field(default=(), metadata=written(_as_texts, name="data"))
    tried: tuple[str, ...] = ()
    rounding: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckResult:
    """What a check found of one printed number.

    `step` is the distance of neighbouring attainable values, `below` and `above` the nearest ones on both sides of the
    printed value (None where there is none or none was proved), `contradicts` the other numbers it cannot stand
    beside, `numbers` what else the proof rests on. For sentences: the `number` that is judged where it has nearest
    values to tell, what it is `of` (so many of the people, scores of a kind), and the `share` that was counted.
    """

    check: str
    printed: str
    judged: JudgedReadings = field(metadata=beside(JudgedReadings))
    reason: str
    source: str
    step: Fraction | None = None
    below: Fraction | None = None
    above: Fraction | None = None
    contradicts: tuple[str, ...] = ()
    numbers: tuple[tuple[str, str], ...] = field(default=(), metadata=written(dict))
    number: PrintedNumber | None = field(default=None, metadata=UNWRITTEN)
    of: str = field(default="", metadata=UNWRITTEN)
    share: Fraction | None = field(default=None, metadata=UNWRITTEN)

    @property
    def verdict(self) -> AuditVerdict:
        """The verdict."""
        return self.judged.verdict


@dataclass(frozen=True, slots=True)
class DataExistence:
    """Do such data exist? `None` if neither a witness nor a proof was found."""

    exists: bool | None
    witness: Witness = ()


NONE_EXISTS, UNKNOWN = DataExistence(False), DataExistence(None)
Attempt = Callable[[Rounding], DataExistence]
"""Tries one reading: are there data that print so under this rounding?"""


def judge_readings(plain: Attempt, others: Sequence[tuple[str, Attempt]] = ()) -> JudgedReadings:
    """Attainable if `plain` succeeds under one of the ordinary roundings; else the readings that rescue are named.

    A rounding alone is named if only some of them rescue; of `others`, (name, attempt), all that rescue are named.
    Where `plain` could not be settled the verdict is "undecided", whatever the readings give.
    """
    first = _under_roundings(plain) or JudgedReadings("undecided")
    if first.verdict != "not attainable":
        return replace(first, tried=ROUNDINGS)
    names = (*ROUNDINGS, *(name for name, _ in others))
    found = [(name, _under_roundings(attempt)) for name, attempt in others]
    rescued = [(_named(name, one), one) for name, one in found if one is not None and _names(one)]
    if rescued:
        readings = tuple(reading for names, _ in rescued for reading in names)
        return JudgedReadings("only under a reading", readings, rescued[0][1].witness, names)
    unsure = any(one is None or one.verdict == "undecided" for _, one in found)
    return JudgedReadings("undecided" if unsure else "not attainable", (), (), names)


def _under_roundings(attempt: Attempt) -> JudgedReadings | None:
    """The decision on one reading; None if nothing was found or proved."""
    widest = attempt(Rounding.ANY)
    if widest.exists is not True:
        return JudgedReadings("not attainable") if widest.exists is False else None
    ordinary = {rounding: attempt(rounding) for rounding in ORDINARY}
    printing = [rounding for rounding, found in ordinary.items() if found.exists]
    if printing:
        alone = printing[0] if len(printing) == 1 else ""
        return JudgedReadings("attainable", (), ordinary[printing[0]].witness, rounding=str(alone))
    tried = ordinary | {rounding: attempt(rounding) for rounding in OTHER}
    names = [rounding for rounding, found in tried.items() if found.exists]
    if not names and not any(found.exists is None for found in tried.values()):
        names = [Rounding.ANY]
    unsure = any(found.exists is None for found in ordinary.values())
    witness = tried[names[0]].witness if names and names[0] in tried else widest.witness
    return JudgedReadings("undecided" if unsure else "only under a reading", tuple(map(str, names)), witness)


def _names(one: JudgedReadings) -> bool:
    """Whether a reading gives the number, under some rounding."""
    return one.verdict == "attainable" or bool(one.readings)


def _named(name: str, one: JudgedReadings) -> tuple[str, ...]:
    """A reading by its name, with the roundings that it needs."""
    needed = one.readings or ((one.rounding,) if one.rounding else ())
    return tuple(f"{name}, {rounding}" for rounding in needed) or (name,)


def family(
    fitting: Callable[[Rounding], range], name: Callable[[str], str], attempt: Callable[[int], Attempt]
) -> list[tuple[str, Attempt]]:
    """Readings that differ in a whole number: those that could fit, all in one where they are many.

    `fitting` gives the numbers that fit under a rounding; `name` names a reading by its number, or by "fewer" where
    none fits.
    """
    values = fitting(Rounding.ANY)
    if not values:
        return [(name("fewer"), lambda _: NONE_EXISTS)]
    if values.stop - values.start <= LISTED_AT_MOST:
        return [(name(str(value)), attempt(value)) for value in values]
    values = fitting(Rounding.HALF_UP) or values
    return [(name(f"{values[0]} to {values[-1]}"), attempt(middle(values)))]


def middle(values: range) -> int:
    """The number in the middle of a range of any length."""
    return (values.start + values.stop - 1) // 2


LISTED_AT_MOST = 12
"""Values of which a report names all."""


def listed(values: Sequence[object]) -> str:
    """Values for a report: the first of them, and how many more there are."""
    return first_few(values, LISTED_AT_MOST)


def listed_by_rounding(values: Callable[[Rounding], Sequence[int]]) -> str:
    """The numbers that print so under both ordinary roundings, then those that need one rounding, with its name.

    >>> listed_by_rounding({**dict.fromkeys(Rounding, [9]), Rounding.TRUNCATION: [9, 10]}.__getitem__)
    '9, or 10 by truncation'
    """
    found = {rounding: values(rounding) for rounding in (*ORDINARY, *OTHER)}
    both = set[int].intersection(*(set(found[rounding]) for rounding in ORDINARY))
    names = dict[str, list[str]]()
    for rounding, fitting in found.items():
        more = [value for value in fitting if value not in both]
        if more:
            names.setdefault(listed(more), []).append(rounding)
    others = (f"{more} by {' or '.join(roundings)}" for more, roundings in names.items())
    return ", or ".join([*([listed(sorted(both))] if both else []), *others])
