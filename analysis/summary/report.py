"""The report of a study as files: the page, its figures, and the statistics as JSON."""

from __future__ import annotations

import json
from pathlib import Path

from analysis.report.page import write_page
from analysis.summary.sections.data import ReportData
from analysis.summary.sections.pictures import write_figures
from analysis.summary.sections.sections import sections


def write_report(out: Path, report: ReportData) -> None:
    """Write `report.html`, `report.md`, `statistics.json` and `figures/` into `out`, which is made if need be.

    Files of an earlier report there are replaced. The same data give the same bytes.
    """
    out.mkdir(parents=True, exist_ok=True)
    write_figures(out / "figures", report)
    write_page(out, report.title, sections(report))
    text = json.dumps(report.statistics, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    (out / "statistics.json").write_text(text, encoding="utf-8", newline="\n")
