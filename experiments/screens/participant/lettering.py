"""How text is laid out that PsychoPy cannot: from right to left, and in scripts that have no blanks between words.

PsychoPy turns a whole text round before it breaks it into lines, so that the last line of two would come first; and it
breaks at blanks alone. Here the lines are made first, by the widths of their letters. Text that needs neither is left
as it is.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Iterator

Width = Callable[[str], float]
"""How wide a text is in one line."""

_CLOSING, _OPENING = "，。！？、：；）」』》〉】〕…—,.!?:;)]}", "（「『《〈【〔([{"
"""What never begins a line, and what never ends one."""
_ROOM = 0.99
"""A line is no wider than this part of its box: what is measured and what is drawn differ by rounding."""


def laid_out(text: str, width: float, measure: Width, turn: Callable[[str], str] | None) -> str:
    """A text in lines as they are drawn; `turn` brings a line into the order that it is drawn in, from the left.

    >>> laid_out("one two three", 7.1, len, lambda line: line[::-1]).split(chr(10))
    ['owt eno', 'eerht']
    >>> laid_out("请稍候，谢谢。", 3.1, len, None).split(chr(10))
    ['请稍', '候，谢', '谢。']
    >>> laid_out("one two three", 7, len, None)
    'one two three'
    """
    if turn is None and not any(map(_is_wide, text)):
        return text
    lines = (line for part in text.split("\n") for line in _lines(part, width * _ROOM, measure))
    return "\n".join(line if turn is None else turn(line) for line in lines)


def _lines(text: str, width: float, measure: Width) -> Iterator[str]:
    """A paragraph in lines of at most a width; a piece that is wider by itself has a line of its own."""
    line = ""
    for piece in _pieces(text):
        if line.strip() and measure((line + piece).rstrip()) > width:
            yield line.strip()
            line = ""
        line += piece
    yield line.strip()


def _pieces(text: str) -> Iterator[str]:
    """The parts of a paragraph between which a line may be broken."""
    piece = ""
    for letter in text:
        if piece and _may_break(piece[-1], letter):
            yield piece
            piece = ""
        piece += letter
    yield piece


def _may_break(before: str, after: str) -> bool:
    if after in _CLOSING or before in _OPENING or after.isspace():
        return False
    return before.isspace() or _is_wide(before) or _is_wide(after)


def _is_wide(letter: str) -> bool:
    """Whether a letter is of a script that has no blanks between words."""
    return unicodedata.east_asian_width(letter) in ("W", "F")
