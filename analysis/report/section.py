"""What a page is made of. The templates know this and nothing of the statistics."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeVar

from analysis.report.labels import cut_names

_Item = TypeVar("_Item")

LISTED = 100
"""A list longer than this is cut: a page of ten thousand rows is read by nobody, and opens slowly."""
SHOWN = 50
"""So many of it are left."""
PNG_DPI = 200
"""Points of an inch of a picture."""
MAKER = "Recoil"
"""Who made it, as our pictures say."""
REPORT_FILES = ("report.html", "report.md")
"""What a page is written as."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table of finished text."""

    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A figure: `stem` is its file under `figures/` without the ending."""

    stem: str
    caption: str
    alt: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A heading with paragraphs, words to copy, pictures, tables and a list, each of which may be empty.

    What is of the `appendix` stands behind all else, its figures and tables with numbers of their own; what is
    `folded` opens with a click where a page can do so.
    """

    title: str
    paragraphs: tuple[str, ...] = ()
    quotes: tuple[str, ...] = ()
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()
    items: tuple[str, ...] = ()
    appendix: bool = False
    folded: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PageNotice:
    """A line on top of a page: a `warning` in colour, that nobody may overlook, or a quiet `note`."""

    text: str
    kind: Literal["warning", "note"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PageHead:
    """What stands under a page's title: notices, and the names of the files beside it."""

    notices: tuple[PageNotice, ...] = ()
    files: tuple[str, ...] = ()


def names_in_full() -> tuple[Section, ...]:
    """The names that were cut on a page; no section where none was."""
    rows = tuple(cut_names().items())
    if not rows:
        return ()
    table = Table(caption="Names that are cut above and in figures", header=("Cut as", "In full"), rows=rows)
    return (Section(title="Names in full", tables=(table,)),)


def origin_table(facts: Mapping[str, object]) -> Table:
    """Where the numbers of a page come from."""
    rows = tuple((name, str(value)) for name, value in facts.items())
    return Table(caption="Where the numbers come from", header=("What", "Value"), rows=rows)


def shortened(items: Sequence[_Item], noun: str, shown: Callable[[_Item], str] = str) -> tuple[str, ...]:
    """All `items` as they are `shown`, or the first 50 of more than 100 and how many more there are.

    >>> shortened(["a", "b"], "files"), shortened(["a"] * 10_000, "files")[-1]
    (('a', 'b'), 'and 9,950 more files')
    """
    if len(items) <= LISTED:
        return tuple(map(shown, items))
    return (*map(shown, items[:SHOWN]), f"and {len(items) - SHOWN:,} more {noun}")
