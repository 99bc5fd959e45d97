"""Each finding in two sentences that a reviewer could quote: what the number would have to be, and what rescues it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from math import sqrt
from types import MappingProxyType
from typing import cast

from analysis.paper.audit.printed import PrintedNumber, decimal, read_printed
from analysis.paper.audit.run import AuditFinding
from analysis.paper.audit.words import ROUNDINGS, CheckResult
from analysis.paper.published import ComparisonRow, ComparisonVerdict, Prediction

ATTENTION = ("not attainable", "only under a reading")
"""The verdicts that ask something of a paper."""
_DATA = ("grim", "grimmer", "debit", "repeated-measures F", "between-subjects F")
FAIRNESS = (
    "A number that is not attainable is a number to ask about: the verdict says that no data of the stated kind give "
    "it, not how it came about, and often one misprinted digit explains it. “Attainable” says that some data give the "
    "number, not that it is right."
)


def sentences(finding: AuditFinding) -> tuple[str, str]:
    """What was found, and what follows."""
    said = _SAID[finding.result.verdict](finding)
    return (_capital(said[0]), _capital(said[1]))


def nearest_text(result: CheckResult) -> str:
    """The nearest attainable values, in the unit and to the digits of the printed number; empty if there are none.

    Where both sides are one value, the number is on the lattice. Spreads are kept as squares, and shown as roots.
    """
    if result.check not in _UNITS:
        return ""
    shown = [_UNITS[result.check](result, value) for value in (result.below, result.above) if value is not None]
    return " and ".join(dict.fromkeys(shown))


def _attainable(finding: AuditFinding) -> tuple[str, str]:
    result = finding.result
    return f"{_subject(result)} is attainable: {result.reason}.", _why_attainable(result)


def _subject(result: CheckResult) -> str:
    return f"the df {result.printed}" if result.check == "df" else result.printed


def _why_attainable(result: CheckResult) -> str:
    if result.check == "binomial p":
        return f"The {result.numbers[0][0]}: {result.numbers[0][1]}."
    if result.check == "Tukey pattern" and result.numbers:
        return "; ".join(f"{pair}: {found}" for pair, found in result.numbers) + "."
    if result.witness and result.check in _DATA:
        return "It needs no special reading, and data that give it are in audit.json."
    return "It needs no special reading."


def _under_a_reading(finding: AuditFinding) -> tuple[str, str]:
    result = finding.result
    one = len(result.readings) == 1
    note = f" ({finding.note})" if finding.note else ""
    second = "It is attainable under " + ("one reading" if one else "either of these readings")
    second += f", which the paper would have to state: {', or '.join(result.readings)}{note}."
    return f"{_refused(result)}.", second


def _not_attainable(finding: AuditFinding) -> tuple[str, str]:
    result = finding.result
    if result.check == "percent of count":
        return f"{_refused(result)}.", _percentage_rescue(result)
    against = " and ".join(result.contradicts)
    return f"{_refused(result)}.", (
        f"No reading that was tried rescues it ({_tried(result)}), so it cannot stand beside {against}: one of them is "
        "misprinted, or rests on something that the paper does not state."
    )


def _percentage_rescue(result: CheckResult) -> str:
    share, counts = _number(result, _share(result)), result.numbers[0][1]
    count = "" if counts == "none" else f", or with the percentage as printed the count {counts}"
    return (
        "Neither another rounding nor a smaller number of people who answered rescues it; with the count as printed "
        f"the percentage would have to be {share}{count}, so a misprint of one of them would explain it."
    )


def _share(result: CheckResult) -> Fraction:
    count, _, rest = result.printed.partition(" of ")
    return Fraction(int(count), int(rest.partition(",")[0]))


def _undecided(finding: AuditFinding) -> tuple[str, str]:
    result = finding.result
    if result.check == "stated":
        return f"{result.printed} is stated, and {result.reason}.", "It can be neither confirmed nor doubted from here."
    return (
        f"{result.printed} is undecided: {result.reason}.",
        "Neither data that give it nor a proof that there are none were found, which is nothing to hold against it.",
    )


def _not_published(finding: AuditFinding) -> tuple[str, str]:
    return (
        f"{finding.result.reason}.",
        "What rests on it cannot be checked, and is assumed by whoever repeats the work.",
    )


_SAID: Mapping[str, Callable[[AuditFinding], tuple[str, str]]] = MappingProxyType(
    {
        "attainable": _attainable,
        "only under a reading": _under_a_reading,
        "not attainable": _not_attainable,
        "undecided": _undecided,
        "not published": _not_published,
    }
)


def _refused(result: CheckResult) -> str:
    """That the number is not what it would have to be."""
    nearest = nearest_text(result)
    if result.check == "percent of count":
        counts = result.numbers[0][1]
        whose = "no count of them has that percentage" if counts == "none" else f"that is the percentage of {counts}"
        people, _, percent = result.printed.partition(", ")
        return f"{people} people are {_number(result, _share(result))}, not {percent}; {whose}"
    if result.check.endswith(" F"):
        grain = result.reason.partition(":")[0]
        shown = f"the nearest F that such {_nearest_verb(nearest)}" if nearest else "no such data give it"
        return f"{result.printed} is not attainable from {grain}: {shown}"
    needed = f"; it would have to be {nearest.replace(' and ', ' or ')}" if nearest else ""
    found = "; ".join(f"{name}: {value}" for name, value in result.numbers if value not in result.reason)
    return f"{_subject(result)} is not attainable: {result.reason}{needed}{f'; {found}' if found else ''}"


def _nearest_verb(nearest: str) -> str:
    """The end of a sentence on one or two neighbours.

    >>> _nearest_verb("28.10 and 28.51")
    'scores can have are 28.10 and 28.51'
    """
    return f"scores can have {'are' if ' and ' in nearest else 'is'} {nearest}"


def _tried(result: CheckResult) -> str:
    """The readings in a few words."""
    others = [name for name in result.tried if name not in ROUNDINGS]
    return ", ".join(["any rounding, truncation", *others])


def _number(result: CheckResult, value: Fraction) -> str:
    """In the unit and to the digits of the printed number."""
    printed = _printed(result)
    percent = "%" in printed.text
    digits = _digits(printed)
    return f"{float(value) * (100 if percent else 1):.{digits}f}{' %' if percent else ''}"


def _one_digit_more(result: CheckResult, value: Fraction) -> str:
    printed = _printed(result)
    percent = "%" in printed.text
    return decimal(value * (100 if percent else 1), _digits(printed) + 1) + (" %" if percent else "")


def _root(result: CheckResult, value: Fraction) -> str:
    return f"SD {sqrt(value):.{_digits(_printed(result)) + 1}f}"


def _printed(result: CheckResult) -> PrintedNumber:
    """The last number of what is printed, such as the SD of "M = 5.21, SD = 1.60"."""
    return read_printed(result.printed.rpartition("=")[2].rpartition(",")[2])


def _digits(printed: PrintedNumber) -> int:
    return len(printed.text.strip("% ").partition(".")[2])


_UNITS: Mapping[str, Callable[[CheckResult, Fraction], str]] = MappingProxyType(
    {
        "grim": _one_digit_more,
        "percent of count": _one_digit_more,
        "repeated-measures F": _number,
        "between-subjects F": _number,
        "binomial p": _number,
        "grimmer": _root,
        "debit": _root,
    }
)


def _capital(text: str) -> str:
    """A capital at the start, but not of a symbol such as p."""
    return text[:1].upper() + text[1:] if text[1:2].isalpha() else text


ELSEWHERE = "elsewhere in the paper"
"""Where the numbers stand that no log holds."""


def predictions(findings: Sequence[AuditFinding]) -> dict[str, Prediction]:
    """By the name of the number (`quantities.named_in`): verdict, nearest attainable values, and a note on them."""
    return {name: _prediction(finding) for finding in findings for name in finding.about}


def _prediction(finding: AuditFinding) -> Prediction:
    result = finding.result
    if result.verdict not in ATTENTION:
        return Prediction(verdict=result.verdict)
    return Prediction(verdict=result.verdict, nearest=_nearest(result), note=_note(result))


def _nearest(result: CheckResult) -> tuple[float, ...]:
    unit = 100 if "%" in result.printed else 1
    return tuple(float(value) * unit for value in (result.below, result.above) if value is not None)


def _note(result: CheckResult) -> str:
    near = nearest_text(result)
    rescued = f"; attainable by {', or '.join(result.readings)}" if result.readings else ""
    return f"not attainable beside the other numbers{f', nearest {near}' if near else ''}{rescued}"


def other_rows(findings: Sequence[AuditFinding]) -> Iterator[ComparisonRow]:
    """The published numbers that no log holds, each with the audit's verdict."""
    for finding in findings:
        if finding.about or finding.result.verdict == "not published":
            continue
        yield ComparisonRow(
            experiment=ELSEWHERE,
            quantity=f"{finding.place}: {finding.quote}",
            published=finding.result.printed,
            obtained=None,
            verdict=cast("ComparisonVerdict", finding.result.verdict),
            note=sentences(finding)[0] if finding.result.verdict in ATTENTION else finding.note,
        )
