"""`recoil audit`: are a paper's numbers attainable and consistent? Table, `audit.json` and a report page."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.paper.audit import audit
from analysis.paper.audit.page import counts, findings_json, findings_text, sections
from analysis.paper.audit.paper_file import PaperFile, load_paper_file
from analysis.paper.audit.run import AuditFinding
from analysis.report.page import write_page
from experiments.config.door import ConfigError
from experiments.config.setup import sha256
from experiments.load import find
from experiments.record import storage
from experiments.record.provenance import provenance


@dataclass(frozen=True, slots=True, kw_only=True)
class Audited:
    """A paper with what was found of its numbers."""

    paper: PaperFile
    findings: tuple[AuditFinding, ...]
    source: Path

    @property
    def exceptions(self) -> bool:
        """Is any number not attainable?"""
        return any(finding.result.verdict == "not attainable" for finding in self.findings)

    def as_json(self) -> dict[str, Any]:
        """All of it as plain JSON values."""
        return {
            "paper": self.paper.paper.model_dump(),
            "verdicts": counts(self.findings),
            "findings": findings_json(self.findings),
            "versions": {"file": self.source.name, "sha256": self._sha256, **provenance()},
        }

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


def audit_file(name: str) -> Audited:
    """The audit of a paper's file, or of a shipped one. `ConfigError` if it cannot be used."""
    source = find(name)
    paper = load_paper_file(source)
    try:
        findings = audit(paper)
    except ValueError as error:
        raise ConfigError(f"{source}: {error}") from error
    if not findings:
        raise ConfigError(f"{source}: makes no claims; give [[claims]], or the sections of a paper")
    return Audited(paper=paper, findings=findings, source=source)


def write(audited: Audited, out: Path) -> None:
    """Write `audit.json`, `report.html` and `report.md` into `out`."""
    storage.make_folder(out)
    text = json.dumps(audited.as_json(), indent=1, ensure_ascii=False) + "\n"
    storage.write_whole(out / "audit.json", text.encode())
    title = f"Audit: {audited.paper.paper.title or audited.source.stem}"
    write_page(out, title, sections(audited.findings, audited.origin))
