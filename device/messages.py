"""Messages for people: the root of all errors that have one, and how names, counts and others' errors stand in it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

QUOTED = 200
"""Characters of a value that a message quotes."""
_LONG_QUOTE = re.compile(rf"""(?<!\w)(['"])([^'"\n]{{{QUOTED}}})[^'"\n]+\1(?!\w)""")
_LONG_WORD = re.compile(rf"([^\s/\\]{{{QUOTED}}})[^\s/\\]{{100,}}")
_PARTICULARS = re.compile(r"""'[^'\n]*'|"[^"\n]*"|\S*[/\\]\S*|\S+\.[a-z]\w*|\d[\d.,]*""")
_LIKE = 5


def cut_values(message: str) -> str:
    """A message with long values, in quotes or in one word, cut; names of files, at most 255 characters, stay whole.

    >>> len(cut_values(f"{'9' * 5000} is no trial"))
    231
    """
    short = _LONG_QUOTE.sub(lambda found: f"{found[1]}{found[2]}… ({len(found[0]) - 2} characters){found[1]}", message)
    return _LONG_WORD.sub(lambda found: f"{found[1]}… ({len(found[0])} characters)", short)


def few_of_each(messages: Iterable[str]) -> Iterator[str]:
    """The first five messages of each kind, and how many more there are: files, numbers and quotes make no kind.

    >>> list(few_of_each(f"P{n}: no answer" for n in range(200)))[-2:]
    ['P4: no answer', '... and 195 more like it']
    >>> list(few_of_each(["a", *(f"P{n}: edited; `recoil rebuild /x/{n}` helps" for n in range(7))]))[-1]
    '... and 2 more like it (edited)'
    >>> list(few_of_each(["a", *(f"or P{n}, and P{n} beside it" for n in range(7))]))[-1]
    '... and 2 more like it'
    """
    seen: Counter[str] = Counter()
    for message in messages:
        kind = _PARTICULARS.sub(_ANY, message)
        seen[kind] += 1
        if seen[kind] <= _LIKE:
            yield message
    for kind, count in seen.items():
        if count > _LIKE:
            said = _whole_clause(kind) if len(seen) > 1 else ""
            yield f"... and {count - _LIKE} more like it{f' ({said})' if said else ''}"


_ANY = "\0"
"""Stands where messages of a kind have names, numbers and quotes of their own."""
_ASIDE = re.compile(r" \([^()]*\)")


def _whole_clause(kind: str) -> str:
    """The first clause behind the place that all messages of a kind share to the letter; empty if each has a hole."""
    clauses = [one.strip() for one in re.split(r"[:;]\s", _ASIDE.sub("", kind))]
    first = next((number for number, one in enumerate(clauses) if _ANY in one), 0)
    shared = (one.removeprefix(_ANY).strip() for one in clauses[first:])
    return next((one for one in shared if one and not set(one) & {_ANY, "(", ")"} and one.count("`") % 2 == 0), "")


def escaped(text: str, kept: str = "") -> str:
    r"""A text whose characters that break a line or steer a terminal are escapes; those that are `kept` stay.

    >>> escaped("a\r\nb\x1b[2J"), escaped("a\tb\n", kept="\t\n")
    ('a\\r\\nb\\x1b[2J', 'a\tb\n')
    """
    return _STEERING.sub(lambda found: found[0] if found[0] in kept else ascii(found[0])[1:-1], text)


_STEERING = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")


def first_few(names: Sequence[object], most: int, noun: str = "", *, apart: str = ", ") -> str:
    """The first names of a list, and how many more there are.

    >>> first_few(["P1", "P2", "P3"], 2), first_few(["P1", "P2"], 2)
    ('P1, P2 and 1 more', 'P1, P2')
    >>> first_few(["a 1, 2", "b 3, 4", "c 5, 6"], 1, "method", apart="; ")
    'a 1, 2; and 2 more methods'
    """
    shown, more = apart.join(map(str, names[:most])), len(names) - most
    said = how_many(more, f"more {noun}") if noun else f"{more:,} more"
    return f"{shown}{';' * (apart == '; ')} and {said}" if more > 0 else shown


def how_many(number: int, noun: str) -> str:
    """So many of them; a noun of several words has its plural at its end.

    >>> how_many(1, "log file"), how_many(1_200, "log file")
    ('1 log file', '1,200 log files')
    """
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


class RecoilError(Exception):
    """Anything that goes wrong and has a message for people: the root of all errors of this product.

    A value that the message quotes is cut at 200 characters.

    >>> try:
    ...     raise RecoilError("voltage_V is 30; it must be a number between 0 and 24")
    ... except RecoilError as error:
    ...     print(error)
    voltage_V is 30; it must be a number between 0 and 24
    """

    def __init__(self, *args: object) -> None:
        super().__init__(*(cut_values(one) if isinstance(one, str) else one for one in args))


def said_by(error: BaseException) -> str:
    r"""What an exception of somebody else's code says, on one line that can be shown and written down.

    >>> said_by(ValueError("no\n\x1b[2Jcard\udcff")), said_by(SystemExit())
    ('ValueError: no \\x1b[2Jcard\\udcff', 'SystemExit')
    """
    text = error_line(error)
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def error_line(error: BaseException) -> str:
    """The same without the kind of exception; empty where it says nothing."""
    try:
        text = " ".join(str(error).split())
    except Exception:  # noqa: BLE001 - it says nothing
        return ""
    return "".join(one if one.isprintable() else ascii(one)[1:-1] for one in text)
