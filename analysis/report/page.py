"""The report as files: HTML that needs nothing else, Markdown, the statistics as JSON, and the figures."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from analysis.report.parts import Picture, ReportData, Section, Table
from analysis.summary.sections.pictures import write_figures
from analysis.summary.sections.sections import sections

__all__ = ["Picture", "ReportData", "Section", "Table", "write_page", "write_report"]

VERDICTS = (
    *("agrees", "differs", "differs as predicted", "not published", "not obtained"),
    *("attainable", "only under a reading", "not attainable", "undecided"),
)

_MARKDOWN_MARKS = re.compile(r"[\\`*|~]|<(?=[a-zA-Z/!?])|(?<![a-zA-Z0-9])_|_(?![a-zA-Z0-9])|](?=[(\[:])|^[#>+-]")
"""What Markdown would take for its own: `<` before a tag, `_` at the edge of a word, `]` before an address."""

_TIGHT = re.compile(r" (?=[=<>] [\d.−])|(?<= [=<>]) (?=[\d.−])|(?<=\d) (?=%)|(?<=% CI) (?=\[)|(?<=,) (?=[\d.]+[)\]])")
"""Spaces that no line may break at: around `=` and `<` before a number, before a percent sign, in brackets."""


def write_report(out: Path, report: ReportData) -> None:
    """Write `report.html`, `report.md`, `statistics.json` and `figures/` into `out`, which is made if need be.

    Files of an earlier report there are replaced. The same data give the same bytes.
    """
    out.mkdir(parents=True, exist_ok=True)
    write_figures(out / "figures", report)
    write_page(out, report.title, sections(report))
    _write(out / "statistics.json", json.dumps(report.statistics, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def write_page(out: Path, title: str, parts: tuple[Section, ...]) -> None:
    """Write `report.html` and `report.md` of finished sections; their pictures stand in `out / "figures"` already."""
    for name in ("report.html", "report.md"):
        _write(out / name, _render(f"{name}.j2", title, parts, out / "figures"))


def markdown(text: str) -> str:
    r"""`text` on one line, its marks escaped.

    >>> print(markdown("a|b *c* p < .001, snake_case"))
    a\|b \*c\* p < .001, snake_case
    """
    return _MARKDOWN_MARKS.sub(r"\\\g<0>", " ".join(text.splitlines()))


def unbroken(text: str) -> str:
    r"""`text` whose numbers stay on the line of their signs and units.

    >>> unbroken("a test, p = .002, 60.0 %").replace("\N{NO-BREAK SPACE}", "~")
    'a test, p~=~.002, 60.0~%'
    """
    return _TIGHT.sub("\N{NO-BREAK SPACE}", text)


def _render(template: str, title: str, parts: tuple[Section, ...], figures: Path) -> str:
    environment = Environment(
        loader=PackageLoader("analysis.report"),
        autoescape=select_autoescape(enabled_extensions=("html.j2",)),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"markdown": markdown, "unbroken": unbroken}
    embedded = {
        part.stem: _data_address(figures / f"{part.stem}.png") for section in parts for part in section.pictures
    }
    return environment.get_template(template).render(title=title, sections=parts, embedded=embedded, verdicts=VERDICTS)


def _data_address(png: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(png.read_bytes()).decode("ascii")


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")
