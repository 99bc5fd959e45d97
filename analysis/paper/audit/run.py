"""The audit of a paper: every claim of its file, checked in the order of the paper."""

from __future__ import annotations

from dataclasses import dataclass

from analysis.paper.audit.claims import Claim
from analysis.paper.audit.derived import derived
from analysis.paper.audit.paper_file import PaperFile
from analysis.paper.audit.words import CheckResult


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditFinding:
    """What the audit found of one number: where the paper prints it, in which words, and the check's result.

    `about`: the numbers of Recoil's own comparison that it is about.
    """

    place: str
    quote: str
    note: str
    result: CheckResult
    about: tuple[str, ...] = ()


def audit(paper: PaperFile) -> tuple[AuditFinding, ...]:
    """The findings on all claims, those of the paper's sections first; pure, and the same at every call.

    `ValueError` with the place and the quote for numbers that make no such claim, such as a count above n.
    """
    return tuple(_finding(claim) for claim in (*derived(paper), *paper.claims))


def _finding(claim: Claim) -> AuditFinding:
    try:
        result = claim.run()
    except ValueError as error:
        raise ValueError(f"{claim.place}, “{claim.quote}”: {error}") from error
    return AuditFinding(place=claim.place, quote=claim.quote, note=claim.note, result=result, about=tuple(claim.about))
