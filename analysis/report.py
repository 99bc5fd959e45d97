"""The report as files: HTML that needs nothing else, Markdown, the statistics as JSON, and the figures."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from analysis.figures import figure_5, figure_8
from analysis.report_parts import Picture, ReportData, Section, Table
from analysis.report_sections import FIGURE_5, FIGURE_8, has_people, sections

__all__ = ["Picture", "ReportData", "Section", "Table", "write_report"]

VERDICTS = ("agrees", "differs", "not published", "not obtained")

_MARKDOWN_MARKS = re.compile(r"[\\`*|~]|<(?=[a-zA-Z/!?])|(?<![a-zA-Z0-9])_|_(?![a-zA-Z0-9])|](?=[(\[:])|^[#>+-]")
"""What Markdown would take for its own: `<` before a tag, `_` at the edge of a word, `]` before an address."""


def write_report(out: Path, report: ReportData) -> None:
    """Write `report.html`, `report.md`, `statistics.json` and `figures/` into `out`, which is made if need be.

    Files of an earlier report there are replaced. The same data give the same bytes.
    """
    out.mkdir(parents=True, exist_ok=True)
    _write_figures(out / "figures", report)
    parts = sections(report)
    for name in ("report.html", "report.md"):
        _write(out / name, _render(f"{name}.j2", report.title, parts, out / "figures"))
    _write(out / "statistics.json", json.dumps(report.statistics, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def markdown(text: str) -> str:
    r"""`text` on one line, its marks escaped.

    >>> print(markdown("a|b *c* p < .001, snake_case"))
    a\|b \*c\* p < .001, snake_case
    """
    return _MARKDOWN_MARKS.sub(r"\\\g<0>", " ".join(text.splitlines()))


def _write_figures(folder: Path, report: ReportData) -> None:
    if has_people(report.statistics):
        figure_8(report.statistics, folder / FIGURE_8)
    if report.panels:
        figure_5(report.panels, folder / FIGURE_5)


def _render(template: str, title: str, parts: tuple[Section, ...], figures: Path) -> str:
    environment = Environment(
        loader=PackageLoader("analysis"),
        autoescape=select_autoescape(enabled_extensions=("html.j2",)),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["markdown"] = markdown
    embedded = {
        part.stem: _data_address(figures / f"{part.stem}.png") for section in parts for part in section.pictures
    }
    return environment.get_template(template).render(title=title, sections=parts, embedded=embedded, verdicts=VERDICTS)


def _data_address(png: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(png.read_bytes()).decode("ascii")


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")
