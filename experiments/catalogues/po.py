"""What stands in a catalogue's `.po`, as gettext's own compiler reads it. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

_LINE = re.compile(r'(?:(msgctxt|msgid|msgid_plural|msgstr(?:\[\d\])?)\s+)?"((?:[^"\\]|\\.)*)"')
_LINE_END = re.compile(r"\r\n|\r|\n")
_ESCAPES = {"n": "\n", "t": "\t", "r": "\r", '"': '"', "\\": "\\"}


def texts_of_po(po: str) -> dict[str, str]:
    r"""Each text with what is said for it; for the empty one the head. `ValueError` names the line that is none.

    What is marked fuzzy counts as not translated, and so does a text in a context or with plurals: Recoil has none.

    >>> texts_of_po('msgid ""\nmsgstr "Language: de\\n"\n\n#, fuzzy\nmsgid "Done"\nmsgstr "Tun"\n')
    {'': 'Language: de\n'}
    """
    found: dict[str, str] = {}
    for entry in _entries(po):
        text = entry.parts.get("msgid")
        if text is None or not any(part.startswith("msgstr") for part in entry.parts):
            raise ValueError(f"line {entry.line}: an entry without its {'msgid' if text is None else 'msgstr'}")
        if "msgctxt" in entry.parts or "msgid_plural" in entry.parts or (entry.fuzzy and text):
            continue
        if "msgstr" not in entry.parts:
            raise ValueError(f"line {entry.line}: {text!r} has a msgstr of plurals and no msgid_plural")
        if text in found:
            raise ValueError(f"line {entry.line}: {text!r} stands there a second time")
        found[text] = entry.parts["msgstr"]
    return found


@dataclass(slots=True, kw_only=True)
class _Entry:
    """What belongs to a text, by keyword, and the line that it begins in."""

    line: int
    fuzzy: bool = False
    parts: dict[str, str] = field(default_factory=dict)


def _entries(po: str) -> Iterator[_Entry]:
    entry, name = _Entry(line=1), ""
    for number, line in enumerate(map(str.strip, _LINE_END.split(po)), 1):
        found, comment = _LINE.fullmatch(line), line.startswith("#")
        if line and not comment and (found is None or not (found[1] or name)):
            raise ValueError(f"line {number}: {line!r} is no line of a .po")
        name = "" if comment else (found and found[1]) or name
        if entry.parts and (comment or (found and (found[1] == "msgctxt" or found[1] in entry.parts))):
            yield entry
            entry = _Entry(line=number)
        entry.fuzzy |= line.startswith("#,") and "fuzzy" in line
        if found:
            entry.parts[name] = entry.parts.get(name, "") + _unescaped(found[2], number)
    if entry.parts:
        yield entry


def _unescaped(text: str, number: int) -> str:
    try:
        return re.sub(r"\\(.)", lambda found: _ESCAPES[found[1]], text)
    except KeyError as error:
        raise ValueError(f'line {number}: \\{error.args[0]} is none of \\n \\t \\r \\" \\\\') from error
