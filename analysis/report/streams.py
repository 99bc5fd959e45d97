"""Terminals and pipes that cannot encode every letter get a replacement for it, never an error."""

from __future__ import annotations

import codecs
import io
import os
import sys
import unicodedata
from typing import TextIO

from device.messages import escaped

_PLAIN = {
    **dict.fromkeys("−‐‑‒–—", "-"),
    **dict.fromkeys("‘’′", "'"),
    **dict.fromkeys("“”″", '"'),
    "→": "->",
    "←": "<-",
    "×": "x",
    "·": "*",
    "•": "*",
    "≤": "<=",
    "≥": ">=",
    "≈": "~",
    "±": "+-",
    "√": "sqrt",
    "°": "deg",
    "µ": "u",
}
_ESCAPED_BYTE = range(0xDC80, 0xDD00)
"""What stands for a byte of a file's name that is no text (PEP 383)."""
_HANDLER = "recoil.plain"


def plain_letter(letter: str) -> str:
    r"""ASCII for a letter that a stream cannot encode: one that looks like it, else its escape.

    >>> "".join(map(plain_letter, "p −0.5, η²┃é中, 80 °C"))
    'p -0.5, eta2|e\\u4e2d, 80 degC'
    """
    if letter in _PLAIN:
        return _PLAIN[letter]
    name = unicodedata.name(letter, "")
    if name.startswith("BOX DRAWINGS"):
        lines = [way for way in ("HORIZONTAL", "VERTICAL") if way in name]
        return "+" if len(lines) != 1 or " AND " in name else {"HORIZONTAL": "-", "VERTICAL": "|"}[lines[0]]
    if name.startswith("GREEK"):
        return name.split()[3].lower() if name.count(" ") >= 3 else name.rsplit(" ", 1)[-1].lower()
    if ord(letter) in _ESCAPED_BYTE:
        return f"\\x{ord(letter) - 0xDC00:02x}"
    apart = "".join(part for part in unicodedata.normalize("NFKD", letter) if not unicodedata.combining(part))
    plain = "".join(_PLAIN.get(part, part) for part in apart)
    return plain if plain.isascii() else letter.encode("ascii", "backslashreplace").decode()


def _replace(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(plain_letter, error.object[error.start : error.end])), error.end


def forgive_streams() -> None:
    """From now on no letter, and no byte that is none, stops what is printed or typed."""
    codecs.register_error(_HANDLER, _replace)
    for name in ("stdout", "stderr"):  # closed by who started this: nobody reads what is printed
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))
    for stream, errors in ((sys.stdin, "backslashreplace"), (sys.stdout, _HANDLER), (sys.stderr, _HANDLER)):
        if isinstance(stream, io.TextIOWrapper):  # not where a test or a notebook reads along
            stream.reconfigure(errors=errors)


def drop_unreadable() -> None:
    """Forget what is still to be printed on a terminal that is gone: Python would end with a code of its own."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


_results: TextIO | None = None


def keep_results_apart() -> None:
    """From now on standard output is for results alone: what libraries and plug-ins print goes to standard error."""
    global _results  # noqa: PLW0603 - the process has one standard output
    if isinstance(sys.stdout, io.TextIOWrapper):  # not where a test or a notebook reads along
        sys.stdout.flush()
        _results = os.fdopen(os.dup(1), "w", encoding=sys.stdout.encoding, errors=sys.stdout.errors)
        os.dup2(2, 1)
        sys.stdout = sys.stderr


def results() -> TextIO:
    """Where results go: standard output."""
    return _results or sys.stdout


def visible(text: str) -> str:
    r"""Text whose control characters, which would steer a terminal, are escapes; lines and tabs stay.

    >>> visible("a\x1b[2J\n")
    'a\\x1b[2J\n'
    """
    return escaped(text, kept="\t\n")


def takes_all(stream: object) -> bool:
    """Whether a stream encodes every letter."""
    encoding = getattr(stream, "encoding", None) or "utf-8"
    return codecs.lookup(encoding).name.startswith("utf")
