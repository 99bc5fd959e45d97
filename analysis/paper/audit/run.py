"""The audit of a paper: every claim of its file, checked in the order of the paper.

```
[paper]
title = "..."
source = "doi or address"

[[claims]]
place = "Results, first paragraph"
quote = "M = 5.21, SD = 1.60"
kind = "grimmer"          # a key of analysis.paper.audit.claims.CHECKS, or "stated", "unpublished"
mean = "5.21"             # text: the printed digits; whole numbers are exact
sd = "1.60"
n = 28
```

The other keys of a claim are the arguments of its check: docs/howto/check-a-paper.md has a table of them,
`claims` their types.

Every claim may also have a `note` on how the file reads the paper, and `about`, the names of the numbers of Recoil's
own comparison that it is about. `[participants]`, `[direction]` and `[preference]`, if there, give claims of their own
(`derived`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import Field

from analysis.paper.audit.claims import (
    AnyClaim,
    AuditFinding,
    Claim,
    direction_claims,
    participants_claims,
    preference_claims,
    refusal,
)
from analysis.paper.audit.page import FindingEntry, counts, finding_entry, findings_text, sections
from analysis.paper.paper import PaperHead, Participants, PublishedDirection, PublishedPreference
from analysis.report import placing
from analysis.report.page import write_page
from analysis.report.serial import NotebookResult, as_json, plain
from analysis.report.terminal import Progress, Tell, unseen, untold
from experiments.config.door import ConfigError, Model, load
from experiments.config.setup import sha256
from experiments.load import find
from experiments.record import storage
from experiments.record.provenance import provenance


def audit(paper: PaperFile, tell: Tell = untold) -> tuple[AuditFinding, ...]:
    """The findings on all claims, those of the paper's sections first, the same at every call; `tell` hears of each.

    A claim whose numbers make none, such as a count above n, or are beyond what a check bears, is refused by its
    finding, with the rule; the others are judged.
    """
    return tuple(_finding(claim, tell) for claim in _claims(paper))


def _claims(paper: PaperFile) -> tuple[Claim, ...]:
    return (*derived(paper), *paper.claims)


def derived(paper: PaperFile) -> tuple[Claim, ...]:
    """The claims of the sections that the file has, in the order of the paper."""
    claims: list[Claim] = []
    if paper.participants is not None:
        claims += participants_claims(paper.participants)
    if paper.direction is not None:
        claims += direction_claims(paper.direction)
    if paper.preference is not None:
        claims += preference_claims(paper.preference)
    return tuple(claims)


def _finding(claim: Claim, tell: Tell) -> AuditFinding:
    try:
        result = claim.run()
    except ValueError as error:
        result = refusal(str(error))
    tell(claim.place)
    return AuditFinding(place=claim.place, quote=claim.quote, note=claim.note, result=result, about=tuple(claim.about))


class PaperFile(Model):
    """Everything that a paper reports, as claims; the three sections are those of Recoil's own paper."""

    paper: PaperHead = PaperHead()
    participants: Participants | None = None
    direction: PublishedDirection | None = None
    preference: PublishedPreference | None = None
    claims: tuple[AnyClaim, ...] = Field(default=(), strict=False)


def load_paper_file(path: str | Path) -> PaperFile:
    """A paper's file. `ConfigError` with file, key, value and rule."""
    return load(PaperFile, Path(path))


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditRecord:
    """The content of `audit.json`."""

    paper: PaperHead
    verdicts: Mapping[str, int]
    findings: tuple[FindingEntry, ...]
    versions: Mapping[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Audited(NotebookResult):
    """A paper with what was found of its numbers."""

    paper: PaperFile
    findings: tuple[AuditFinding, ...]
    source: Path

    def rows(self) -> list[dict[str, object]]:
        """A row a number: where it stands, its verdict, and why."""
        return [
            {"place": one.place, "quote": one.quote, "verdict": one.result.verdict, "reason": one.result.reason}
            for one in self.findings
        ]

    def to_dict(self) -> dict[str, Any]:
        """The content of `audit.json`."""
        written: dict[str, Any] = plain(self.record)
        return written

    @property
    def exceptions(self) -> bool:
        """Is any number not attainable, or was any refused?"""
        return any(finding.result.verdict in {"not attainable", "refused"} for finding in self.findings)

    @property
    def record(self) -> AuditRecord:
        """All of it, as it is written."""
        return AuditRecord(
            paper=self.paper.paper,
            verdicts=counts(self.findings),
            findings=tuple(finding_entry(finding) for finding in self.findings),
            versions={"file": self.source.name, "sha256": self._sha256, **provenance()},
        )

    def as_text(self) -> str:
        """The terminal's table."""
        return findings_text(self.findings)

    @property
    def origin(self) -> list[tuple[str, str]]:
        """Label and value of where it comes from."""
        head = self.paper.paper
        facts = {"paper": head.title, "source": head.source, "field": head.field, "file": self.source.name}
        shown = [(name, value) for name, value in facts.items() if value]
        return [*shown, ("sha256 of the file's content", self._sha256), *provenance().items()]

    @property
    def _sha256(self) -> str:
        return sha256(self.paper.model_dump(mode="json"))


def audit_file(name: str, progress: Progress = unseen) -> Audited:
    """The audit of a paper's file, or of a shipped one. `ConfigError` if it cannot be used, or no claim of it."""
    source = find(name)
    paper = load_paper_file(source)
    claims = len(_claims(paper))
    if not claims:
        raise ConfigError(f"{source}: makes no claims; give [[claims]], or the sections of a paper")
    with progress("audit", claims) as tell:
        findings = audit(paper, tell)
    if all(finding.result.verdict == "refused" for finding in findings):
        raise ConfigError("\n".join(f"{source}: {one.place}, “{one.quote}”: {one.result.reason}" for one in findings))
    return Audited(paper=paper, findings=findings, source=source)


def write(audited: Audited, out: Path) -> None:
    """Write `audit.json`, `report.html` and `report.md` into `out`."""
    title = f"Audit: {audited.paper.paper.title or audited.source.stem}"
    with placing.results_in(out, _RECORD) as part:
        storage.write_whole(part / _RECORD, as_json(audited.record))
        write_page(part, title, sections(audited.findings, audited.origin))


_RECORD = "audit.json"
