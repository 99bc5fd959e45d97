"""What methods and levels are called in print: labels for their codes, cut where they are long, in short lines.

Labels are in force while a page or a figure is made (`labelled`). A long name is cut and numbered; its whole stands in
a key, below each figure and once in a page (`cut_names`).
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

PAPER_LABELS = {
    "vibration": "Vibration",
    "asymmetric-1": "Asymmetric Force I",
    "asymmetric-2": "Asymmetric Force II",
}
LONGEST = 32
"""Columns of text that a name has at most; a longer one is cut. A Chinese character takes two."""
_ELLIPSIS = "…"
_OPEN, _CLOSE = "\N{FIRST STRONG ISOLATE}", "\N{POP DIRECTIONAL ISOLATE}"
_PART = re.compile(r"\s+|…\[\d+\]|[^\s…-]*-+|[^\s…-]+|…")
_NO_WORD = re.compile(r"[\d_\s-]|[^\x00-\x7f]|.{13}")
"""What makes a code no word of a sentence, so that it may be replaced in one."""


@dataclass(frozen=True, slots=True)
class _Names:
    """The labels in force, and the names that were cut so far, numbered in the order in which they came."""

    labels: Mapping[str, str]
    cut: dict[str, int] = field(default_factory=dict)


_IN_FORCE: ContextVar[_Names | None] = ContextVar("labels", default=None)


@contextmanager
def labelled(labels: Mapping[str, str], names: Iterable[str] = ()) -> Iterator[None]:
    """Have codes called by these labels, beside the paper's; `names` that are cut are numbered in their order."""
    before = _IN_FORCE.set(_Names({**PAPER_LABELS, **labels}))
    try:
        for name in names:
            display_name(name)
        yield
    finally:
        _IN_FORCE.reset(before)


@contextmanager
def some_labels() -> Iterator[None]:
    """The labels in force, or the paper's where none are."""
    if _IN_FORCE.get() is not None:
        yield
        return
    with labelled({}):
        yield


def display_name(code: str) -> str:
    """What a method or level is called in print, cut if it is long; one without a label keeps its code.

    >>> display_name("asymmetric-2"), display_name("ramp")
    ('Asymmetric Force II', 'ramp')
    >>> with labelled({"r": "a slowly rising ramp with a sudden end"}):
    ...     display_name("r"), cut_names()
    ('a slowly rising ramp with a…[1]', {'[1]': 'a slowly rising ramp with a sudden end'})
    """
    names = _IN_FORCE.get() or _Names(PAPER_LABELS)
    label = names.labels.get(code, code)
    if text_columns(label) > LONGEST:
        label = f"{_shortened(label, LONGEST - 5)}{_ELLIPSIS}[{names.cut.setdefault(label, len(names.cut) + 1)}]"
    return f"{_OPEN}{label}{_CLOSE}" if _is_right_to_left(label) else label


def cut_names() -> dict[str, str]:
    """The names that were cut since the labels came into force, by what stands behind their first letters."""
    names = _IN_FORCE.get()
    return {} if names is None else {f"[{number}]": name for name, number in names.cut.items()}


def named(text: str, *, words: bool = False) -> str:
    """`text` with the codes in it that can be no words replaced by what they are called; with `words` all codes.

    >>> named("asymmetric-2 above vibration, asymmetric-10 below")
    'Asymmetric Force II above Vibration, asymmetric-10 below'
    """
    names = _IN_FORCE.get() or _Names(PAPER_LABELS)
    codes = [code for code in names.labels if words or code in PAPER_LABELS or _NO_WORD.search(code)]
    if not codes:
        return text
    any_code = "|".join(map(re.escape, sorted(codes, key=len, reverse=True)))
    return re.sub(rf"(?<![\w-])({any_code})(?![\w-])", lambda found: display_name(found[1]), text)


def lines_of(text: str, width: int) -> list[str]:
    """`text` in lines of at most so many columns, of which a Chinese character takes two.

    >>> lines_of("a slow ramp", 6), lines_of("不对称力", 6), lines_of("extraordinary", 8)
    (['a slow', 'ramp'], ['不对称', '力'], ['extraord', 'inary'])
    >>> lines_of("extraordinary…[1]", 7)  # the mark of a name that was cut stays whole
    ['extraor', 'dinary', '…[1]']
    """
    found = [""]
    for part in _kept_together(_parts(text, width)):
        if text_columns(found[-1] + part.rstrip()) > width and found[-1].strip():
            found.append("")
        found[-1] += part if found[-1] else part.lstrip()
    return [line.rstrip() for line in found if line.strip()]


def text_columns(text: str) -> int:
    """How many columns a text takes where every letter is as wide, Chinese ones twice; marks on letters take none.

    >>> text_columns("ramp"), text_columns("力"), text_columns("e\u0301")
    (4, 2, 1)
    """
    return sum(map(_width, text))


def _width(letter: str) -> int:
    if unicodedata.category(letter) in {"Mn", "Me", "Cf"}:
        return 0
    return 2 if unicodedata.east_asian_width(letter) in "WF" else 1


def _shortened(name: str, width: int) -> str:
    """The first words of a name that fit into so many columns, or of a long word its first letters."""
    cut = _cut(name, width)
    words = cut.rpartition(" ")[0]
    return (words if 2 * text_columns(words) > width and not name[len(cut) :].startswith(" ") else cut).rstrip()


def _cut(text: str, width: int) -> str:
    """The first letters of a text, as many as fit into so many columns."""
    taken, used = "", 0
    for letter in text:
        used += _width(letter)
        if used > width:
            break
        taken += letter
    return taken


def _parts(text: str, width: int) -> Iterator[str]:
    """What may not be broken, part by part: words, wide letters one by one, and pieces of words that are too long."""
    for part in _PART.findall(text):
        rest = part
        while rest and (text_columns(rest) > width or any(_width(letter) == 2 for letter in rest)):
            wide = [place for place, letter in enumerate(rest) if _width(letter) == 2]
            end = (1 if wide[0] == 0 else wide[0]) if wide else len(_cut(rest, width))
            piece = _cut(rest[:end], width)
            yield piece
            rest = rest[len(piece) :]
        if rest:
            yield rest


def _kept_together(parts: Iterable[str]) -> Iterator[str]:
    """The parts, wide signs that close joined to what stands before them, and those that open to what follows."""
    held = ""
    for part in parts:
        category = unicodedata.category(part[0]) if len(part) == 1 and _width(part) == 2 else ""
        opens = held and unicodedata.category(held[-1]) == "Ps" and _width(held[-1]) == 2
        if held and not opens and category not in {"Pe", "Po", "Pf"}:
            yield held
            held = ""
        held += part
    if held:
        yield held


def _is_right_to_left(text: str) -> bool:
    return any(unicodedata.bidirectional(letter) in {"R", "AL"} for letter in text)
