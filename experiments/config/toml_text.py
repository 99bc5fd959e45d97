"""Plain values as the text of a TOML file: reading it gives the very same ones."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_LINE = 100
"""A longer list gets a line for each of its values."""
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\b": "\\b", "\t": "\\t", "\n": "\\n", "\f": "\\f", "\r": "\\r"}


def toml_text(values: Mapping[str, object]) -> str:
    r"""A table as the text of a TOML file: its own values first, then its tables in their order.

    `ValueError` for what TOML cannot hold and read back: a value of another kind, or `None` in a list.

    >>> print(toml_text({"pulse_s": 0.01, "seed": None, "methods": {"soft one": {"label": 'so "soft"'}}}), end="")
    pulse_s = 0.01
    <BLANKLINE>
    [methods]
    <BLANKLINE>
    [methods."soft one"]
    label = "so \"soft\""
    """
    return "\n".join(_table(values, ())).lstrip("\n") + "\n"


def _table(values: Mapping[str, object], keys: tuple[str, ...]) -> Iterator[str]:
    if keys:
        yield f"\n[{'.'.join(map(_key, keys))}]"
    for key, value in values.items():
        if value is not None and not isinstance(value, Mapping):
            yield f"{_key(key)} = {_value(value)}"
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _table(value, (*keys, key))


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _string(key)


def _value(value: object) -> str:
    match value:
        case bool():
            return str(value).lower()
        case str():
            return _string(value)
        case int() | float():
            return repr(value)  # Python's shortest form that reads back, which is TOML's as well
        case list() | tuple():
            return _list([_value(one) for one in value])
        case Mapping():
            given = {key: inner for key, inner in value.items() if inner is not None}
            return f"{{{', '.join(f'{_key(key)} = {_value(inner)}' for key, inner in given.items())}}}"
    raise ValueError(f"{value!r} cannot be written as TOML; only texts, numbers, true, false, lists and tables can")


def _list(items: list[str]) -> str:
    in_one = f"[{', '.join(items)}]"
    return in_one if len(in_one) <= _LINE else "".join(["[\n", *(f"    {item},\n" for item in items), "]"])


def _string(text: str) -> str:
    return f'"{"".join(map(_letter, text))}"'


def _letter(letter: str) -> str:
    if letter in _ESCAPES:
        return _ESCAPES[letter]
    return f"\\u{ord(letter):04x}" if ord(letter) < 0x20 or ord(letter) == 0x7F else letter
