"""What the audit says of the numbers that a reproduction obtains, and of those that no log holds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import cast

from analysis.paper.audit.run import Finding
from analysis.paper.audit.sentences import ATTENTION, nearest_text, sentences
from analysis.paper.audit.words import Result
from analysis.paper.published import Prediction, Row, Verdict

ELSEWHERE = "elsewhere in the paper"
"""Where the numbers stand that no log holds."""


def predictions(findings: Sequence[Finding]) -> dict[str, Prediction]:
    """By the name of the number (`quantities.named_in`): verdict, nearest attainable values, and a note on them."""
    return {name: _prediction(finding) for finding in findings for name in finding.about}


def _prediction(finding: Finding) -> Prediction:
    result = finding.result
    if result.verdict not in ATTENTION:
        return Prediction(verdict=result.verdict)
    return Prediction(verdict=result.verdict, nearest=_nearest(result), note=_note(result))


def _nearest(result: Result) -> tuple[float, ...]:
    unit = 100 if "%" in result.printed else 1
    return tuple(float(value) * unit for value in (result.below, result.above) if value is not None)


def _note(result: Result) -> str:
    near = nearest_text(result)
    rescued = f"; attainable by {', or '.join(result.readings)}" if result.readings else ""
    return f"not attainable beside the other numbers{f', nearest {near}' if near else ''}{rescued}"


def other_rows(findings: Sequence[Finding]) -> Iterator[Row]:
    """The published numbers that no log holds, each with the audit's verdict."""
    for finding in findings:
        if finding.about or finding.result.verdict == "not published":
            continue
        yield Row(
            experiment=ELSEWHERE,
            quantity=f"{finding.place}: {finding.quote}",
            published=finding.result.printed,
            obtained=None,
            verdict=cast("Verdict", finding.result.verdict),
            note=sentences(finding)[0] if finding.result.verdict in ATTENTION else finding.note,
        )
