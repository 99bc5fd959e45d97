"""Sections as a page: HTML that needs nothing else, and Markdown."""

from __future__ import annotations

import base64
import re
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from analysis.report.section import Section

_VERDICTS = (
    *("agrees", "differs", "differs as predicted", "not published", "not obtained"),
    *("attainable", "only under a reading", "not attainable", "undecided"),
)

_MARKDOWN_MARKS = re.compile(r"[\\`*|~]|<(?=[a-zA-Z/!?])|(?<![a-zA-Z0-9])_|_(?![a-zA-Z0-9])|](?=[(\[:])|^[#>+-]")
"""What Markdown would take for its own: `<` before a tag, `_` at the edge of a word, `]` before an address."""

_TIGHT = re.compile(r" (?=[=<>] [\d.−])|(?<= [=<>]) (?=[\d.−])|(?<=\d) (?=%)|(?<=% CI) (?=\[)|(?<=,) (?=[\d.]+[)\]])")
"""Spaces that no line may break at: around `=` and `<` before a number, before a percent sign, in brackets."""


def write_page(out: Path, title: str, parts: tuple[Section, ...]) -> None:
    """Write `report.html` and `report.md` of finished sections; their pictures stand in `out / "figures"` already."""
    for name in ("report.html", "report.md"):
        text = _render(f"{name}.j2", title, parts, out / "figures")
        (out / name).write_text(text, encoding="utf-8", newline="\n")


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
    return environment.get_template(template).render(title=title, sections=parts, embedded=embedded, verdicts=_VERDICTS)


def _data_address(png: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(png.read_bytes()).decode("ascii")
