"""The audit for people and programs: sections of a report page, a table for the terminal, plain values for JSON."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import sqrt
from types import MappingProxyType
from typing import cast, get_args

from analysis.paper.audit.claims import AuditFinding
from analysis.paper.audit.printed import ROUNDINGS, AuditVerdict, CheckResult, PrintedNumber, decimal
from analysis.paper.paper import ComparisonRow, ComparisonVerdict, Prediction
from analysis.report.section import Section, Table
from analysis.report.serial import beside
from device.messages import how_many

_AUDIT_VERDICTS: tuple[AuditVerdict, ...] = get_args(AuditVerdict)


def counts(findings: Sequence[AuditFinding]) -> dict[str, int]:
    """How many numbers have which verdict, all verdicts named."""
    return {verdict: sum(finding.result.verdict == verdict for finding in findings) for verdict in _AUDIT_VERDICTS}


def sections(findings: Sequence[AuditFinding], origin: Sequence[tuple[str, str]]) -> tuple[Section, ...]:
    """The sections of the report; `origin` is label and value of where it comes from."""
    asked = [finding for finding in findings if finding.result.verdict in ATTENTION]
    origins = Table(caption="Where this comes from", header=("What", "Value"), rows=tuple(origin))
    return (
        _summary(findings),
        *((_questions(asked),) if asked else ()),
        _all(findings),
        _proofs(findings),
        Section(title="Provenance", tables=(origins,)),
    )


def _summary(findings: Sequence[AuditFinding]) -> Section:
    rows = tuple((verdict, str(count), _MEANING[verdict]) for verdict, count in counts(findings).items() if count)
    caption = f"{how_many(len(findings), 'number')}, each with its verdict"
    return Section(
        title="Verdicts",
        paragraphs=(FAIRNESS,),
        tables=(Table(caption=caption, header=("Verdict", "Numbers", "What it means"), rows=rows),),
    )


_MEANING = {
    "attainable": "data of the stated kind give it as printed, a tie rounded half up or half to even",
    "only under a reading": "no such data give it as printed; under a reading that the paper does not state, some do",
    "not attainable": "proved: no such data give it under any reading that was tried",
    "not published": "needed to repeat the work, and not printed",
    "undecided": "nothing printed bears on it, or neither data nor a proof were found",
    "refused": "the claim's own numbers make none, or are more than the audit bears",
}


def _questions(asked: Sequence[AuditFinding]) -> Section:
    rows = tuple(
        (
            f"{f.place}: “{f.quote}”",
            f.result.verdict,
            nearest_text(f.result),
            "; ".join(f.result.judged.readings) or "none",
        )
        for f in asked
    )
    header = ("Number", "Verdict", "Nearest attainable", "Rescued by")
    return Section(
        title="Numbers to ask about",
        items=tuple(f"{f.place}, “{f.quote}”. {' '.join(sentences(f))}" for f in asked),
        tables=(Table(caption="What these numbers would have to be", header=header, rows=rows),),
    )


def _all(findings: Sequence[AuditFinding]) -> Section:
    rows = tuple((f"{f.place}: “{f.quote}”", f.result.verdict, _told(f)) for f in findings)
    table = Table(caption="Every number in the file's order", header=("Number", "Verdict", "Why"), rows=rows)
    return Section(title="Every number", tables=(table,))


def _told(finding: AuditFinding) -> str:
    said = not finding.note or finding.result.verdict == "only under a reading"
    note = "" if said else f" Read as: {finding.note}."
    return " ".join(sentences(finding)) + note


def _proofs(findings: Sequence[AuditFinding]) -> Section:
    rows = tuple(
        (f"{f.place}: “{f.quote}”", f.result.check, "; ".join(_proof(f.result)), f.result.source)
        for f in findings
        if f.result.check not in {"stated", "unpublished", "total", "refused"}
    )
    header = ("Number", "Check", "The lattice and what the proof rests on", "Source")
    text = "The exact fractions, all readings that were tried and the data that give a number stand in audit.json."
    return Section(
        title="Proofs",
        paragraphs=(text,),
        tables=(Table(caption="What each verdict rests on", header=header, rows=rows),),
    )


def _proof(result: CheckResult) -> Iterator[str]:
    if result.step is not None:
        yield f"step {float(result.step):.6g}"
    if nearest := nearest_text(result):
        yield f"nearest {nearest}"
    yield from (f"{name} {value}" for name, value in result.numbers)


@dataclass(frozen=True)
class FindingEntry:
    """A finding with all of its proof, as it stands in `audit.json`."""

    place: str
    quote: str
    note: str
    sentences: tuple[str, str]
    result: CheckResult = field(metadata=beside(CheckResult))


def finding_entry(finding: AuditFinding) -> FindingEntry:
    """What `audit.json` says of a finding."""
    return FindingEntry(finding.place, finding.quote, finding.note, sentences(finding), finding.result)


def findings_text(findings: Sequence[AuditFinding]) -> str:
    """A line a number, then in full the ones to ask about."""
    verdicts = max(len(finding.result.verdict) for finding in findings) if findings else 0
    places = max((len(finding.place) for finding in findings), default=0)
    checks = max((len(finding.result.check) for finding in findings), default=0)
    lines = [
        f"{f.result.verdict:{verdicts}}  {f.result.check:{checks}}  {f.place:{places}}  {cut(f.quote, 56)}"
        for f in findings
    ]
    asked = [f"{f.place}, “{f.quote}”: {' '.join(sentences(f))}" for f in findings if f.result.verdict in _IN_FULL]
    told = ", ".join(f"{count} {verdict}" for verdict, count in counts(findings).items() if count)
    return "\n".join(
        [*lines, "", f"{how_many(len(findings), 'number')}: {told or 'none'}.", *(f"\n{text}" for text in asked)]
    )


def cut(text: str, most: int) -> str:
    """Of a long text the beginning."""
    return text if len(text) <= most else f"{text[: most - 1]}…"


ATTENTION = ("not attainable", "only under a reading")
"""The verdicts that ask something of a paper."""
_IN_FULL = (*ATTENTION, "refused")
_RATIOS = ("repeated-measures F", "between-subjects F")
_DATA = ("grim", "grimmer", "debit", *_RATIOS)
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
    if result.number is None:
        return ""
    shown = [_UNITS[result.check](result.number, value) for value in (result.below, result.above) if value is not None]
    return " and ".join(dict.fromkeys(shown))


def _attainable(finding: AuditFinding) -> tuple[str, str]:
    result = finding.result
    rounding = result.judged.rounding.replace("rounding", ", printed", 1)
    return f"{_subject(result)} is attainable: {result.reason}{rounding}.", _why_attainable(result)


def _subject(result: CheckResult) -> str:
    return f"the df {result.printed}" if result.check == "df" else result.printed


def _why_attainable(result: CheckResult) -> str:
    if result.check == "binomial p":
        return f"The {result.numbers[0][0]}: {result.numbers[0][1]}."
    if result.check == "Tukey pattern" and result.numbers:
        return "; ".join(f"{pair}: {found}" for pair, found in result.numbers) + "."
    if result.judged.witness and result.check in _DATA:
        return "It needs no special reading, and data that give it are in the JSON, as `data`."
    return "It needs no special reading."


def _under_a_reading(finding: AuditFinding) -> tuple[str, str]:
    result = finding.result
    one = len(result.judged.readings) == 1
    note = f" ({finding.note})" if finding.note else ""
    second = "It is attainable under " + ("one reading" if one else "either of these readings")
    second += f", which the paper would have to state: {', or '.join(result.judged.readings)}{note}."
    return f"{_refused(result)}.", second


def _not_attainable(finding: AuditFinding) -> tuple[str, str]:
    result = finding.result
    if result.check == "percent of count":
        return f"{_refused(result)}.", _percentage_rescue(result)
    against = " and ".join(result.contradicts)
    follows = f"it cannot stand beside {against}: one of them is misprinted" if against else "it is misprinted"
    return f"{_refused(result)}.", (
        f"No reading that was tried rescues it ({_tried(result)}), so {follows}, or rests on something that the paper "
        "does not state."
    )


def _percentage_rescue(result: CheckResult) -> str:
    counts = result.numbers[0][1]
    count = "" if counts == "none" else f", or with the percentage as printed the count {counts}"
    return (
        "Neither another rounding nor a smaller number of people who answered rescues it; with the count as printed "
        f"the percentage would have to be {_share(result)}{count}, so a misprint of one of them would explain it."
    )


def _share(result: CheckResult) -> str:
    """What the percentage would have to be."""
    return "" if result.number is None or result.share is None else _number(result.number, result.share)


def _undecided(finding: AuditFinding) -> tuple[str, str]:
    result = finding.result
    if result.check == "stated":
        return f"{result.printed} is stated, and {result.reason}.", "It can be neither confirmed nor doubted from here."
    return (
        f"{result.printed} is undecided: {result.reason}.",
        "Neither data that give it nor a proof that there are none were found, which is nothing to hold against it.",
    )


def _refused_claim(finding: AuditFinding) -> tuple[str, str]:
    return f"The claim is refused: {finding.result.reason}.", "It was not judged; the other numbers were."


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
        "refused": _refused_claim,
    }
)


def _refused(result: CheckResult) -> str:
    """That the number is not what it would have to be."""
    nearest = nearest_text(result)
    if result.check == "percent of count":
        counts = result.numbers[0][1]
        whose = "no count of them has that percentage" if counts == "none" else f"that is the percentage of {counts}"
        percent = "" if result.number is None else result.number.text
        return f"{result.of} people are {_share(result)}, not {percent}; {whose}"
    if result.check in _RATIOS:
        shown = f"the nearest F that such {_nearest_verb(nearest)}" if nearest else "no such data give it"
        return f"{result.printed} is not attainable from {result.of}: {shown}"
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
    others = [name for name in result.judged.tried if name not in ROUNDINGS]
    return ", ".join(["any rounding, truncation", *others])


def _number(printed: PrintedNumber, value: Fraction) -> str:
    """In the unit and to the digits of the printed number; a tie, which prints in two ways, to its own last digit."""
    percent = "%" in printed.text
    shown, digits = value * (100 if percent else 1), _digits(printed)
    tie = (shown * 10**digits % 1) == Fraction(1, 2)
    return f"{float(shown):.{digits + tie}f}{' %' if percent else ''}"


def _one_digit_more(printed: PrintedNumber, value: Fraction) -> str:
    percent = "%" in printed.text
    return decimal(value * (100 if percent else 1), _digits(printed) + 1) + (" %" if percent else "")


def _root(printed: PrintedNumber, value: Fraction) -> str:
    return f"SD {sqrt(value):.{_digits(printed) + 1}f}"


def _digits(printed: PrintedNumber) -> int:
    return len(printed.text.strip("% ").partition(".")[2])


_UNITS: Mapping[str, Callable[[PrintedNumber, Fraction], str]] = MappingProxyType(
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
    rescued = f"; attainable by {', or '.join(result.judged.readings)}" if result.judged.readings else ""
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
