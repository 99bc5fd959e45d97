"""The door for TOML: file and model come to a frozen value, or to a message with file, line, key, value and rule.

Plain values are written as TOML here as well, so that reading it gives the very same ones. Below stand the types,
tables and rules that the experiments' own models share. Unknown keys, wrong types, infinities and contradictions are
refused here; inside, a config is trusted.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from device.words import RecoilError

SomeModel = TypeVar("SomeModel", bound=BaseModel)

_LONGEST, _DEEPEST = 1_000_000, 32
"""Characters of a file, and how deep its tables, lists and keys may go."""
_LIKE, _MOST_FINDINGS = 5, 2_000
"""Findings of a kind that are said, and findings that are looked at."""
_TOO_DEEP = f"tables and lists lie too deep in each other (rule: at most {_DEEPEST})"
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"""(?<![\w"'-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{_DEEPEST}}}""")
_DECIMAL_COMMA = re.compile(r"=\s*(-?\d+),(\d+)\b")
_MISSING = "is missing; it is required"
_UNKNOWN = "unknown key; remove it or correct its spelling"


class ConfigError(RecoilError):
    """What was given cannot be used; the message names file or option, place, value and rule, a line a finding."""


class Model(BaseModel):
    """A table of a file: unknown keys refused, types as written, no infinities, never changed."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


def load(model: type[SomeModel], path: Path) -> SomeModel:
    """A file's content. `ConfigError` with a line for every finding."""
    return checked(model, read_toml(path), path)


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file, unchecked."""
    return tables(read_text(path), path)


def read_text(path: Path) -> str:
    """A file's text."""
    try:
        return path.read_text(encoding="utf-8-sig")  # some editors begin a file with a mark
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: byte {error.start}: not UTF-8; save the file as UTF-8") from error
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror or error})") from error


def tables(text: str, source: Path | str) -> dict[str, Any]:
    """The tables of a TOML text, unchecked; `source` is what messages call it."""
    _check_size(text, source)
    try:
        found = tomllib.loads(text)
    except ValueError as error:  # also numbers beyond all reason
        raise ConfigError(f"{source}: not TOML: {error}{_comma(text, str(error))}") from error
    except RecursionError as error:
        raise ConfigError(f"{source}: {_TOO_DEEP}") from error
    if _is_deep(found):
        raise ConfigError(f"{source}: {_TOO_DEEP}")
    return found


def _check_size(text: str, source: Path | str) -> None:
    """`ConfigError` for what would be read for minutes: too much, or a key of ever more parts."""
    if len(text) > _LONGEST:
        raise ConfigError(f"{source}: is {len(text)} characters long (rule: at most {_LONGEST})")
    if found := _LONG_KEY.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise ConfigError(f"{source}:{line}: a key has too many parts (rule: at most {_DEEPEST})")


def _is_deep(value: object) -> bool:
    """Whether tables and lists lie in each other deeper than any file needs."""
    level: list[object] = [value]
    for _ in range(_DEEPEST):
        level = [
            inner
            for one in level
            if isinstance(one, dict | list)
            for inner in (one.values() if isinstance(one, dict) else one)
        ]
    return bool(level)


def _comma(text: str, said: str) -> str:
    """What to do where a decimal comma may be what is no TOML."""
    line = re.search(r"at line (\d+)", said)
    found = _DECIMAL_COMMA.search(text.splitlines()[int(line[1]) - 1]) if line else None
    return f"; a decimal comma? write {found[1]}.{found[2]}" if found else ""


def checked(model: type[SomeModel], table: dict[str, Any], path: Path) -> SomeModel:
    """The tables of a file as what they mean."""
    return checked_table(model, table, path, read_text(path))


def checked_table(model: type[SomeModel], table: dict[str, Any], source: Path | str, text: str = "") -> SomeModel:
    """Tables as what they mean; `source` and `text` are what messages take name and line from."""
    try:
        return _validated(model, table)
    except ValidationError as error:
        raise ConfigError(_findings(error, table, source, text)) from error


def _validated(model: type[SomeModel], table: dict[str, Any]) -> SomeModel:
    """By way of JSON: types stay strict, while TOML's arrays may become tuples."""
    return model.model_validate_json(json.dumps(table, default=_no_json))


def _no_json(value: object) -> dict[str, str]:
    """Dates and times, which no file has: as something that is neither text nor number."""
    return {"date": str(value)}


def _findings(error: ValidationError, table: dict[str, Any], source: Path | str, text: str) -> str:
    found: dict[tuple[str, ...], list[Any]] = {}
    for finding in error.errors(include_url=False)[:_MOST_FINDINGS]:
        found.setdefault(_place(finding, table), []).append(finding)
    inner = {place[:length] for place in found for length in range(len(place))}
    said = [(place, findings) for place, findings in found.items() if not (_all_of_kind(findings) and place in inner)]
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


def _all_of_kind(findings: Sequence[Any]) -> bool:
    """Whether a value was only of another kind than one that may stand there, as where several kinds may."""
    return all(finding["type"].endswith("_type") for finding in findings)


def _place(finding: Any, table: dict[str, Any]) -> tuple[str, ...]:
    """The keys of a finding as they stand in the file, without the names of the kinds that were tried."""
    keys: list[str] = []
    value: Any = table
    tagged = False
    for number, part in enumerate(finding["loc"], start=1):
        last = number == len(finding["loc"])
        if isinstance(value, dict) and not tagged and not last and _is_tag(part, value):
            tagged = True
        elif (isinstance(value, dict) and part in value) or (isinstance(value, list) and part in range(len(value))):
            value, tagged = value[part], False
            keys.append(str(part))
        elif last and finding["type"] == "missing":
            keys.append(str(part))
    return tuple(keys)


def _is_tag(part: object, table: dict[str, Any]) -> bool:
    """Whether a part of a place only says of which kind a table is, by its `law` or its `kind`."""
    return part == table.get("law") or (part == table.get("kind") and part not in table)


def _finding(place: tuple[str, ...], findings: Sequence[Any], source: Path | str, text: str) -> str:
    if not _all_of_kind(findings):
        findings = [finding for finding in findings if not finding["type"].endswith("_type")]
    value = findings[0]["input"]
    shown = f" = {_shortened(value)}" if place and isinstance(value, str | int | float | bool) else ""
    said = dict.fromkeys(_RULES_BY_TYPE.get(one["type"], _own_words)(one) for one in findings)
    rule = " or ".join(said) if len(said) > 1 else next(iter(said))
    line = line_of(text, [*place] or _keys_in(rule))
    key = ".".join(part if len(part) <= _LINE else _shortened(part) for part in place)
    return f"{source}{f':{line}' if line else ''}: {key}{shown}{': ' if place else ''}{rule}"


def _own_words(finding: Any) -> str:
    return str(finding["msg"]).removeprefix("Value error, ")


def _a_kind(finding: Any) -> str:
    """What a key that says of which kind a table is must say."""
    key, known = finding["ctx"]["discriminator"].strip("'"), finding["ctx"].get("expected_tags")
    if known is None:
        return f"the key {key} is missing: it says of which kind this is"
    return f"{key} = {finding['ctx']['tag']!r} is none of {known.replace(chr(39), '')}"


_RULES_BY_TYPE: Mapping[str, Callable[[Any], str]] = {
    "extra_forbidden": lambda _: _UNKNOWN,
    "missing": lambda _: _MISSING,
    "union_tag_not_found": _a_kind,
    "union_tag_invalid": _a_kind,
    "too_short": lambda finding: f"holds too few; give at least {finding['ctx']['min_length']}",
    "tuple_type": lambda _: "must be a list",
    "dict_type": lambda _: "must be a table",
    "model_type": lambda _: "must be a table",
    "model_attributes_type": lambda _: "must be a table",
}
"""The rules that are broken, in words of our own, by what the checker calls them."""


def at_key(path: Path, message: str) -> str:
    """A message about a file, with the line of the key that the message begins with, if it does with one."""
    line = line_of(read_text(path), _keys_in(message))
    return f"{path}{f':{line}' if line else ''}: {message}"


def _keys_in(message: str) -> list[str]:
    """The dotted key that a message begins with; none of one that begins otherwise.

    >>> _keys_in("order.sets = 7: cannot be shared"), _keys_in("the planned duration")
    (['order', 'sets'], ['the'])
    """
    found = re.match(r"[A-Za-z_][\w\-]*(\.[\w\-]+)*", message)
    return found[0].split(".") if found else []


def _shortened(value: object) -> str:
    """A value as messages show it: all on one line, and no longer than a line."""
    text = ascii(value) if isinstance(value, str) and not value.isprintable() else repr(value)
    return text if len(text) <= _LINE else f"{text[:_LINE]}… ({len(text)} characters)"


def line_of(text: str, keys: list[str]) -> int | None:
    r"""The line of a dotted key in a TOML text, or of the nearest table around it; `None` for the whole file.

    >>> line_of("a = 1\n[b]\nc = 2", ["b", "c"]), line_of("[b]", ["b", "missing"]), line_of("a = 1", [])
    (3, 1, None)
    >>> line_of("[[b]]\nc = 1\n[[b]]\nc = 2", ["b", "1", "c"])
    4
    """
    places = _places(text)
    return next((places[tuple(keys[:n])] for n in range(len(keys), 0, -1) if tuple(keys[:n]) in places), None)


@lru_cache(maxsize=4)
def _places(text: str) -> Mapping[tuple[str, ...], int]:
    """The lines of the tables and keys of a TOML text."""
    places: dict[tuple[str, ...], int] = {}
    table: tuple[str, ...] = ()
    elements = Counter[tuple[str, ...]]()
    for number, line in enumerate(text.split("\n"), start=1):
        if header := re.match(r"\s*(\[\[?)([^\[\]]+)\]", line):
            table = _key_parts(header[2])
            if header[1] == "[[":
                elements[table] += 1
                table = (*table, str(elements[table] - 1))
            places.setdefault(table, number)
        elif entry := re.match(r'\s*((?:"[^"]*"|[\w.\-])+)\s*=', line):
            places.setdefault((*table, *_key_parts(entry[1])), number)
    return places


def _key_parts(dotted: str) -> tuple[str, ...]:
    """The parts of a dotted key, of which one in quotes may hold points."""
    return tuple(part.strip('"') for part in re.findall(r'"[^"]*"|[^.\s"]+', dotted))


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


Order = Literal["random", "williams", "latin-square"]
Fact = Literal["age_years", "sex", "handedness"]
"""What may be asked of a participant before a run."""
Sex = Literal["female", "male", "other", "undisclosed"]
Handedness = Literal["right", "left", "both"]

CODE = r"[A-Za-z0-9]{1,32}"
"""A participant's code, as a pattern."""


def _distinct(methods: tuple[str, ...]) -> tuple[str, ...]:
    doubled = sorted({name for name in methods if methods.count(name) > 1})
    if doubled:
        raise ValueError(f"{', '.join(doubled)} stands there more than once; name each method once")
    return methods


Count = Annotated[int, Field(ge=1, le=10_000)]
Seconds = Annotated[float, Field(ge=0, le=86_400)]
PositiveSeconds = Annotated[float, Field(gt=0, le=3_600)]
Share = Annotated[float, Field(ge=0, le=1)]
InnerShare = Annotated[float, Field(gt=0, lt=1)]
Spread = Annotated[float, Field(ge=0, le=100)]
Text = Annotated[str, Field(min_length=1, max_length=2_000)]
Methods = Annotated[tuple[Text, ...], Field(min_length=1, max_length=26), AfterValidator(_distinct)]


class ConsoleConfig(Model):
    """What the experimenter's screen does.

    `guard_s`: for so long after a change of what is on the screen nothing is taken that answers, fires or goes on; 0
    switches the guard off. `response_times`: a strip of the participant's own response times, never of correctness.
    """

    guard_s: Annotated[float, Field(ge=0, le=5)] = 0.25
    response_times: bool = False


AgeYears = Annotated[int, Field(ge=1, le=120)]
Some = TypeVar("Some", bound=str)


def once(levels: tuple[Some, ...]) -> tuple[Some, ...]:
    """The levels; `ValueError` if one stands there twice."""
    doubled = sorted({level for level in levels if levels.count(level) > 1})
    if doubled:
        raise ValueError(f"{', '.join(doubled)} stands there more than once; name each once")
    return levels


class EligibilityConfig(Model):
    """What is asked of a participant before a run, and who may take part. Empty levels and missing ages: any."""

    ask: Annotated[tuple[Fact, ...], AfterValidator(once)] = ()
    handedness: Annotated[tuple[Handedness, ...], AfterValidator(once)] = ()
    sex: Annotated[tuple[Sex, ...], AfterValidator(once)] = ()
    age_years_min: AgeYears | None = None
    age_years_max: AgeYears | None = None

    @model_validator(mode="after")
    def _ages_are_possible(self) -> Self:
        low, high = self.age_years_min, self.age_years_max
        if low is not None and high is not None and low > high:
            raise ValueError(f"age_years_min = {low} is above age_years_max = {high}, so nobody could take part")
        return self

    @model_validator(mode="after")
    def _rules_are_about_what_is_asked(self) -> Self:
        for key, fact in _RULES.items():
            value = getattr(self, key)
            if value not in ((), None) and fact not in self.ask:
                shown = list(value) if isinstance(value, tuple) else value
                raise ValueError(f'{key} = {shown} is a rule about {fact}, which is not asked; add "{fact}" to ask')
        return self


_RULES: dict[str, Fact] = {
    "handedness": "handedness",
    "sex": "sex",
    "age_years_min": "age_years",
    "age_years_max": "age_years",
}
"""Which fact each rule is about."""


class StudyConfig(Model):
    """A study: how many people, which experiments, who may take part, and what to compare with."""

    title: Text
    participants: Annotated[int, Field(ge=1, le=999)]
    code_prefix: Annotated[str, Field(pattern=r"^[A-Za-z0-9]{1,29}$")] = "P"
    experiments: Annotated[tuple[Text, ...], Field(min_length=1)]
    paper: Text | None = None
    replications: Annotated[int, Field(ge=0, le=1_000_000)] = 2000
    eligibility: EligibilityConfig = EligibilityConfig()

    def codes(self) -> list[str]:
        """The participants' codes, P01 onwards."""
        return participant_codes(self.participants, self.code_prefix)


def participant_codes(count: int, prefix: str = "P") -> list[str]:
    """Codes for so many participants, all of one length.

    >>> participant_codes(2)
    ['P01', 'P02']
    """
    width = max(2, len(str(count)))
    return [f"{prefix}{number:0{width}d}" for number in range(1, count + 1)]


def leaves(model: BaseModel, prefix: str = "") -> Iterator[str]:
    """The dotted keys of a config, tables and values alike."""
    for name in type(model).model_fields:
        yield f"{prefix}{name}"
        yield from _inner_leaves(getattr(model, name), f"{prefix}{name}.")


def _inner_leaves(value: object, prefix: str) -> Iterator[str]:
    if isinstance(value, BaseModel):
        yield from leaves(value, prefix)
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield f"{prefix}{key}"
            yield from _inner_leaves(inner, f"{prefix}{key}.")
