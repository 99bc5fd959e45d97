"""The audit for people and programs: sections of a report page, a table for the terminal, plain values for JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, get_args

from analysis.paper.audit.run import AuditFinding
from analysis.paper.audit.sentences import ATTENTION, FAIRNESS, nearest_text, sentences
from analysis.paper.audit.words import AuditVerdict, CheckResult
from analysis.report.section import Section, Table

Json = dict[str, Any]
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
    caption = f"{len(findings)} numbers, each with its verdict"
    return Section(
        title="Verdicts",
        paragraphs=(FAIRNESS,),
        tables=(Table(caption=caption, header=("Verdict", "Numbers", "What it means"), rows=rows),),
    )


_MEANING = {
    "attainable": "data of the stated kind give it, as printed",
    "only under a reading": "no such data give it as printed; under a reading that the paper does not state, some do",
    "not attainable": "proved: no such data give it under any reading that was tried",
    "not published": "needed to repeat the work, and not printed",
    "undecided": "nothing printed bears on it, or neither data nor a proof were found",
}


def _questions(asked: Sequence[AuditFinding]) -> Section:
    rows = tuple(
        (f"{f.place}: “{f.quote}”", f.result.verdict, nearest_text(f.result), "; ".join(f.result.readings) or "none")
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
        if f.result.check not in {"stated", "unpublished", "total"}
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


def findings_json(findings: Sequence[AuditFinding]) -> list[Json]:
    """Every finding with all of its proof, fractions exact as text beside their decimal value."""
    return [_finding(finding) for finding in findings]


def _finding(finding: AuditFinding) -> Json:
    result = finding.result
    return {
        "place": finding.place,
        "quote": finding.quote,
        "note": finding.note,
        "check": result.check,
        "printed": result.printed,
        "verdict": result.verdict,
        "sentences": list(sentences(finding)),
        "reason": result.reason,
        "step": _exact(result.step),
        "below": _exact(result.below),
        "above": _exact(result.above),
        "readings": list(result.readings),
        "tried": list(result.tried),
        "contradicts": list(result.contradicts),
        "numbers": dict(result.numbers),
        "data": [[str(value) for value in row] for row in result.witness],
        "source": result.source,
    }


def _exact(value: Fraction | None) -> Json | None:
    return None if value is None else {"exact": str(value), "value": float(value)}


def findings_text(findings: Sequence[AuditFinding]) -> str:
    """A line a number, then in full the ones to ask about."""
    verdicts = max(len(finding.result.verdict) for finding in findings) if findings else 0
    places = max((len(finding.place) for finding in findings), default=0)
    checks = max((len(finding.result.check) for finding in findings), default=0)
    lines = [
        f"{f.result.verdict:{verdicts}}  {f.result.check:{checks}}  {f.place:{places}}  {_short(f.quote)}"
        for f in findings
    ]
    asked = [f"{f.place}, “{f.quote}”: {' '.join(sentences(f))}" for f in findings if f.result.verdict in ATTENTION]
    told = ", ".join(f"{count} {verdict}" for verdict, count in counts(findings).items() if count)
    return "\n".join([*lines, "", f"{len(findings)} numbers: {told or 'none'}.", *(f"\n{text}" for text in asked)])


def _short(text: str, most: int = 56) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"
