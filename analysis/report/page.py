"""Sections as a page: HTML that needs nothing else, and Markdown."""

from __future__ import annotations

import base64
import html
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.report.section import PNG_DPI, REPORT_FILES, PageHead, Section
from experiments.record.storage import write_whole

if TYPE_CHECKING:
    from jinja2 import Environment, Template

_VERDICTS = (
    *("agrees", "differs", "differs as predicted", "not published", "not obtained"),
    *("attainable", "only under a reading", "not attainable", "undecided"),
)

_MARKDOWN_MARKS = re.compile(r"[\\`*|~]|<(?=[a-zA-Z/!?])|(?<![a-zA-Z0-9])_|_(?![a-zA-Z0-9])|](?=[(\[:])|^[#>+-]")
"""What Markdown would take for its own: `<` before a tag, `_` at the edge of a word, `]` before an address."""

_TIGHT = re.compile(r" (?=[=<>] [\d.−])|(?<= [=<>]) (?=[\d.−])|(?<=\d) (?=%)|(?<=% CI) (?=\[)|(?<=,) (?=[\d.]+[)\]])")
"""Spaces that no line may break at: around `=` and `<` before a number, before a percent sign, in brackets."""

_BARE = PageHead()


def write_page(out: Path, title: str, parts: tuple[Section, ...], head: PageHead = _BARE) -> None:
    """Write `report.html` and `report.md` of finished sections; their pictures stand in `out / "figures"` already."""
    for name in REPORT_FILES:
        text = _render(name, title, parts, head, out / "figures")
        write_whole(out / name, text.encode("utf-8", "backslashreplace"))  # names of files may be no text


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


_CODE = re.compile(r"`([^`]+)`")


def with_code(text: str) -> str:
    """Text as HTML, escaped; what stands between two backticks is code.

    >>> print(with_code("say `recoil study <DIR>`"))
    say <code>recoil study &lt;DIR&gt;</code>
    """
    return _CODE.sub(r"<code>\1</code>", html.escape(text))


def load_templates() -> None:
    """Have the templates ready, which takes as long as writing a page: for who has others to wait for."""
    for name in REPORT_FILES:
        _template(name)


@cache
def _template(name: str) -> Template:
    return _environment().get_template(f"{name}.j2")


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape  # noqa: PLC0415 - slow

    made = Environment(
        loader=PackageLoader("analysis.report"),
        autoescape=select_autoescape(enabled_extensions=("html.j2",)),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= {"markdown": markdown, "unbroken": unbroken, "with_code": with_code}
    return made


def _render(name: str, title: str, parts: tuple[Section, ...], head: PageHead, figures: Path) -> str:
    stems = [picture.stem for section in parts for picture in section.pictures]
    embedded = {stem: _embedded(figures / f"{stem}.png") for stem in stems}
    body = [section for section in parts if not section.appendix]
    appendix = [section for section in parts if section.appendix]
    return _template(name).render(
        title=title, head=head, body=body, appendix=appendix, embedded=embedded, verdicts=_VERDICTS
    )


_SCREEN_DPI = 117.0
"""Pixels of the page for an inch of a figure: the widest figures fill the page, and all have letters of one size."""


@dataclass(frozen=True, slots=True)
class _Embedded:
    """A picture inside the page: its data, and how wide it is shown."""

    address: str
    width_px: int


def _embedded(png: Path) -> _Embedded:
    content = png.read_bytes()
    width = int.from_bytes(content[16:20])  # of the header, which comes first in every PNG
    address = "data:image/png;base64," + base64.b64encode(content).decode("ascii")
    return _Embedded(address, round(width * _SCREEN_DPI / PNG_DPI))
