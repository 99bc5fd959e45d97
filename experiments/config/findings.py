"""What is wrong in a file, said to its owner: place, value and rule of each finding, in plain words. Pure."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, Tag, ValidationError
from pydantic.fields import FieldInfo

_LIKE, _MOST_FINDINGS = 5, 2_000
_LONG_NUMBER = 1e15
"""Findings of a kind that are said, and findings that are looked at."""
_MISSING = "is missing; it is required"

CODE = r"[A-Za-z0-9]{1,32}"
"""A participant's code, as a pattern."""
DESIGN_NAME, COLUMN_NAME = r"^[a-z]{1,32}$", r"^[A-Za-z][A-Za-z0-9_]{0,31}$"
OWN_KEY, CODE_PREFIX = r"^[a-z0-9]$|^(left|right|up|down)$", r"^[A-Za-z0-9]{1,29}$"
LANGUAGE_CODE = r"^[A-Za-z]{2,8}([_-][A-Za-z0-9]{1,8})*$"
PATTERNS: Mapping[str, str] = {
    DESIGN_NAME: "1 to 32 letters a to z and nothing else",
    COLUMN_NAME: "a letter and up to 31 letters, digits or _ (a to z, A to Z)",
    OWN_KEY: "a letter a to z, a digit, left, right, up or down",
    CODE_PREFIX: "1 to 29 letters and digits (a to z, A to Z)",
    LANGUAGE_CODE: "a language's code, such as zh or pt-BR",
    f"^{CODE}$": "1 to 32 letters and digits (a to z, A to Z)",
    r"^[A-Za-z0-9_-]{1,40}$": "1 to 40 letters, digits, _ or - (a to z, A to Z)",
    r"^[a-z][a-z0-9-]{0,31}$": "a letter and up to 31 letters, digits or - (a to z)",
    r"^[0-9]+(\.[0-9]+)?$": "digits as they are printed, such as 0.71",
}
"""What the patterns of texts ask for, in words."""


def validation_text(
    error: ValidationError, model: type[BaseModel], table: dict[str, Any], source: Path | str, text: str
) -> str:
    """A line for every finding: file, line, key, value and rule; of many alike the first five."""
    found: dict[tuple[str, ...], list[Any]] = {}
    for finding in error.errors(include_url=False)[:_MOST_FINDINGS]:
        if finding["type"] == "extra_forbidden":
            finding["ctx"] = {"rule": _unknown_key(model, finding["loc"])}
        if finding["type"] == "dict_type":
            example = _example(_kind_at(model, finding["loc"]))
            finding["ctx"] = {"example": example and f", such as {example}"}
        found.setdefault(_place(finding, model, table), []).append(finding)
    inner = {place[:length] for place in found for length in range(len(place))}
    said = [(place, findings) for place, findings in found.items() if not (place in inner and _follows(findings))]
    lines = [_finding(place, findings, source, text) for place, findings in _few(said)]
    return "\n".join([*lines, *_more(len(said) - len(lines), error.error_count() - _MOST_FINDINGS)])


Found = tuple[tuple[str, ...], Sequence[Any]]


def _few(findings: Sequence[Found]) -> Iterator[Found]:
    """The first five findings of each kind: of the same key of some table, and the same rule."""
    seen = Counter[tuple[object, ...]]()
    for place, found in findings:
        kind = (tuple(part for part in place if not part.isdigit()), found[0]["type"])
        seen[kind] += 1
        if seen[kind] <= _LIKE:
            yield place, found


def _more(like: int, unread: int) -> Iterator[str]:
    if like > 0:
        yield f"... and {like} more like {'it' if like == 1 else 'them'}"
    if unread > 0:
        yield f"... and {unread} more"


def _unknown_key(model: type[BaseModel], loc: Sequence[int | str]) -> str:
    """What is said of a key that is unknown: which one is most like it, and those of its table."""
    kind, key = _kind_at(model, loc[:-1]), str(loc[-1])
    if not _is_table(kind):
        return "unknown key; remove it or correct its spelling"
    like = get_close_matches(key, kind.model_fields, n=1) if len(key) <= _LINE else []
    rule = f"did you mean {like[0]}?" if like else "remove it or correct its spelling;"
    return f"unknown key; {rule} known are {', '.join(kind.model_fields)}"


def _kind_at(model: type[BaseModel], loc: Sequence[int | str]) -> Any:
    """What may stand at a place; `None` where that is not known."""
    kind: Any = model
    for part in loc:
        kind = _kind_inside(kind, part)
    return get_args(kind)[0] if get_origin(kind) is Annotated else kind


def _example(kind: Any) -> str:
    """How a table of names of one's own is written, empty where it is not known."""
    inner = get_args(kind)
    if get_origin(kind) is Annotated:
        return _example(inner[0])
    if get_origin(kind) is dict:
        value = _example(inner[1])
        return value and f"{{ NAME = {value} }}"
    return _WRITTEN.get(kind, "") if isinstance(kind, type) else ""


_WRITTEN: Mapping[type, str] = {str: '"..."', int: "2", float: "0.5"}
"""Values as examples have them."""


def _kind_inside(kind: Any, part: int | str) -> Any:
    """What a key, a place in a list or the name of one of several kinds leads to; `None` where that is no table."""
    inner = get_args(kind)
    if _is_table(kind):
        return _kind_of_field(kind.model_fields[part]) if part in kind.model_fields else None
    if get_origin(kind) is Annotated:
        return _kind_inside(inner[0], part)
    if get_origin(kind) is dict:
        return inner[1]
    if get_origin(kind) in (tuple, list):
        return inner[0]
    return next((one for one in inner if part in _tags(one)), None)


def _kind_of_field(field: FieldInfo) -> Any:
    """What stands in a field; of several kinds with the key that tells them apart, which a field keeps to itself."""
    return Annotated[field.annotation, field] if field.discriminator else field.annotation


def _told_apart_by(kind: Any) -> str | None:
    """The key that says which of several kinds a table is, if the kind is such a choice."""
    notes = get_args(kind)[1:] if get_origin(kind) is Annotated else ()
    return next((note.discriminator for note in notes if isinstance(getattr(note, "discriminator", None), str)), None)


def _is_table(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _tags(kind: Any) -> list[object]:
    """The names of a kind among several: what the key that tells them apart may say, or its own tag."""
    if get_origin(kind) is Annotated:
        return [note.tag for note in get_args(kind)[1:] if isinstance(note, Tag)]
    return (
        []
        if not _is_table(kind)
        else [name for field in kind.model_fields.values() for name in get_args(field.annotation)]
    )


def _all_of_kind(findings: Sequence[Any]) -> bool:
    """Whether a value was only of another kind than one that may stand there, as where several kinds may."""
    return all(finding["type"].endswith("_type") for finding in findings)


def _follows(findings: Sequence[Any]) -> bool:
    """Whether a table or list was refused for what is inside alone: of another kind, or empty without what is wrong."""
    return _all_of_kind(findings) or all(finding["type"] == "too_short" for finding in findings)


def _place(finding: Any, model: type[BaseModel], table: dict[str, Any]) -> tuple[str, ...]:
    """The keys of a finding as they stand in the file, without the names of the kinds that were tried."""
    keys: list[str] = []
    value: Any = table
    kind: Any = model
    tagged = False
    for number, part in enumerate(finding["loc"], start=1):
        last = number == len(finding["loc"])
        if isinstance(value, dict) and not tagged and _is_tag(part, value, _told_apart_by(kind), last=last):
            tagged = True
        elif (isinstance(value, dict) and part in value) or (isinstance(value, list) and part in range(len(value))):
            value, tagged = value[part], False
            keys.append(str(part))
        elif last and finding["type"] == "missing":
            keys.append(str(part))
        kind = _kind_inside(kind, part)
    return tuple(keys)


def _is_tag(part: object, table: dict[str, Any], told_apart_by: str | None, *, last: bool) -> bool:
    """Whether a part of a place only says of which kind a table is.

    A kind may be called as a key of its table is, such as "percent": where the model says which key tells the kinds
    apart, the part in that place is the kind's name. Elsewhere it is one by the table's `law` or `kind`.
    """
    if told_apart_by is not None:
        return part == table.get(told_apart_by)
    return not last and (part == table.get("law") or (part == table.get("kind") and part not in table))


def _finding(place: tuple[str, ...], findings: Sequence[Any], source: Path | str, text: str) -> str:
    if not _all_of_kind(findings):
        findings = [finding for finding in findings if not finding["type"].endswith("_type")]
    value = findings[0]["input"]
    shown = f" = {_shortened(value)}" if place and isinstance(value, str | int | float) else ""
    said = dict.fromkeys(_RULES_BY_TYPE.get(one["type"], _own_words)(one) for one in findings)
    rule = " or ".join(said) if len(said) > 1 else next(iter(said))
    inner = keys_in(rule)
    own = isinstance(value, dict) and bool(inner) and inner[0] in value
    line = line_of(text, [*place, *(inner if own or not place else ())])
    key = ".".join(part if len(part) <= _LINE else _shortened(part) for part in place)
    return f"{source}{f':{line}' if line else ''}: {key}{shown}{('.' if own else ': ') if place else ''}{rule}"


def _own_words(finding: Any) -> str:
    return str(finding["msg"]).removeprefix("Value error, ")


def _a_kind(finding: Any) -> str:
    """What a key that says of which kind a table is must say."""
    key, known = finding["ctx"]["discriminator"].strip("'"), finding["ctx"].get("expected_tags")
    if known is None:
        return f"the key {key} is missing: it says of which kind this is"
    return f"{key} = {finding['ctx']['tag']!r} is none of {known.replace(chr(39), '')}"


def _bound(value: float) -> str:
    """The end of a range in full digits: 1,000,000 and not 1e+06."""
    return f"{value:,.0f}" if float(value).is_integer() and abs(value) < _LONG_NUMBER else f"{value:g}"


_RULES_BY_TYPE: Mapping[str, Callable[[Any], str]] = {
    "extra_forbidden": lambda finding: str(finding["ctx"]["rule"]),
    "missing": lambda _: _MISSING,
    "union_tag_not_found": _a_kind,
    "union_tag_invalid": _a_kind,
    "too_short": lambda finding: f"holds too few; give at least {finding['ctx']['min_length']}",
    "too_long": lambda finding: f"holds too many; give at most {finding['ctx']['max_length']}",
    "float_type": lambda _: "must be a number",
    "int_type": lambda _: "must be a whole number",
    "int_from_float": lambda _: "must be a whole number",
    "bool_type": lambda _: "must be true or false",
    "string_type": lambda _: "must be text, in quotes",
    "finite_number": lambda _: "must be a finite number",
    "greater_than": lambda finding: f"must be above {_bound(finding['ctx']['gt'])}",
    "greater_than_equal": lambda finding: f"must be at least {_bound(finding['ctx']['ge'])}",
    "less_than": lambda finding: f"must be below {_bound(finding['ctx']['lt'])}",
    "less_than_equal": lambda finding: f"must be at most {_bound(finding['ctx']['le'])}",
    "literal_error": lambda finding: f"must be {finding['ctx']['expected']}",
    "string_too_short": lambda _: "must not be empty",
    "string_too_long": lambda finding: f"is too long; write at most {finding['ctx']['max_length']:,} characters",
    "string_pattern_mismatch": lambda finding: f"must be {PATTERNS.get(finding['ctx']['pattern'], 'spelt otherwise')}",
    "list_type": lambda _: "must be a list",
    "tuple_type": lambda _: "must be a list",
    "dict_type": lambda finding: f"must be a table{finding['ctx']['example']}",
    "model_type": lambda _: "must be a table",
    "model_attributes_type": lambda _: "must be a table",
}
"""The rules that are broken, in words of our own, by what the checker calls them."""


def keys_in(message: str) -> list[str]:
    """The dotted key that a message begins with; none of one that begins otherwise.

    >>> keys_in("order.sets = 7: cannot be shared"), keys_in("the planned duration")
    (['order', 'sets'], ['the'])
    >>> keys_in('questions.q.share."a/b": nobody meets that')
    ['questions', 'q', 'share', 'a/b']
    """
    found = re.match(r'[A-Za-z_][\w\-]*(\.([\w\-]+|"[^"]*"))*', message)
    return list(_key_parts(found[0])) if found else []


_LINE = 100


def _shortened(value: object) -> str:
    """A value as messages show it: all on one line, and no longer than a line."""
    if isinstance(value, bool):
        return str(value).lower()
    text = ascii(value) if isinstance(value, str) and not value.isprintable() else repr(value)
    return text if len(text) <= _LINE else f"{text[:_LINE]}… ({len(text)} characters)"


def line_of(text: str, keys: list[str]) -> int | None:
    r"""The line of a dotted key in a TOML text, or of the nearest table around it; `None` for the whole file.

    >>> line_of("a = 1\n[b]\nc = 2", ["b", "c"]), line_of("[b]", ["b", "missing"]), line_of("a = 1", [])
    (3, 1, None)
    >>> line_of("[[b]]\nc = 1\n[[b]]\nc = 2", ["b", "1", "c"]), line_of("a = 1\n[b.c]", ["b"])
    (4, 2)
    """
    places = _places(text)
    return next((places[tuple(keys[:n])] for n in range(len(keys), 0, -1) if tuple(keys[:n]) in places), None)


@lru_cache(maxsize=4)
def _places(text: str) -> Mapping[tuple[str, ...], int]:
    """The lines of the tables and keys of a TOML text; of a table that has no header, that of the first in it."""
    places: dict[tuple[str, ...], int] = {}
    parents: dict[tuple[str, ...], int] = {}
    table: tuple[str, ...] = ()
    elements = Counter[tuple[str, ...]]()
    for number, line in enumerate(text.split("\n"), start=1):
        if header := re.match(r"\s*(\[\[?)([^\[\]]+)\]", line):
            table = _key_parts(header[2])
            if header[1] == "[[":
                elements[table] += 1
                table = (*table, str(elements[table] - 1))
            places.setdefault(table, number)
            for length in range(1, len(table)):
                parents.setdefault(table[:length], number)
        elif entry := re.match(r'\s*((?:"[^"]*"|[\w.\-])+)\s*=', line):
            places.setdefault((*table, *_key_parts(entry[1])), number)
    return parents | places


def _key_parts(dotted: str) -> tuple[str, ...]:
    """The parts of a dotted key, of which one in quotes may hold points."""
    return tuple(part.strip('"') for part in re.findall(r'"[^"]*"|[^.\s"]+', dotted))
