"""The door for TOML: file and model come to a frozen value, or to a message with file, line, key, value and rule.

Below stand the types, tables and rules that the experiments' own models share. Unknown keys, wrong types, infinities
and contradictions are refused here; inside, a config is trusted.
"""

from __future__ import annotations

import json
import re
import tomllib
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from device.messages import RecoilError
from experiments.config.findings import CODE_PREFIX, keys_in, line_of, validation_text

SomeModel = TypeVar("SomeModel", bound=BaseModel)

_LONGEST, _DEEPEST = 1_000_000, 32
"""Characters of a file, and how deep its tables, lists and keys may go."""
_TOO_DEEP = f"tables and lists lie too deep in each other (rule: at most {_DEEPEST})"
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"""(?<![\w"'-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{_DEEPEST}}}""")
_DECIMAL_COMMA = re.compile(r"=\s*(-?\d+),(\d+)\b")
_WITH_UNIT = re.compile(r"=\s*(-?\d+(?:\.\d+)?) *[^\W\d_]")


class ConfigError(RecoilError):
    """What was given cannot be used; the message names file or option, place, value and rule, a line a finding."""


class Model(BaseModel):
    """A table of a file: unknown keys refused, types as written, no infinities, never changed."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, defer_build=True)


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
        raise ConfigError(f"{path}: cannot be read ({why_unread(error)})") from error


def why_unread(error: Exception) -> str:
    """Why a file cannot be read, without numbers of errors and names of codecs."""
    if isinstance(error, UnicodeDecodeError):
        return f"byte {error.start} is not UTF-8; save the file as UTF-8"
    return error.strerror or str(error) if isinstance(error, OSError) else str(error)


def tables(text: str, source: Path | str) -> dict[str, Any]:
    """The tables of a TOML text, unchecked; `source` is what messages call it."""
    _check_size(text, source)
    try:
        found = tomllib.loads(text)
    except ValueError as error:  # also numbers beyond all reason
        raise ConfigError(_not_toml(str(error), text, source)) from error
    except RecursionError as error:
        raise ConfigError(f"{source}: {_TOO_DEEP}") from error
    if _is_deep(found):
        raise ConfigError(f"{source}: {_TOO_DEEP}")
    return found


def _not_toml(said: str, text: str, source: Path | str) -> str:
    """What the reader says of a text, behind its line as all messages are, and what to write instead."""
    if "digits" in said:  # and how Python could be made to read them
        return f"{source}: not TOML: a whole number has thousands of digits; write what is meant"
    if "overwrite" in said:
        said = f"a key or table of that name stands there already: {said}"
    elif twice := _TWICE.search(said):
        table = ".".join(re.findall(r"'([^']*)'", twice[0]))
        said = said.replace(twice[0], f"the table [{table}] stands there twice; put all of it into one")
    if (place := _PLACE.search(said)) is None:
        return f"{source}: not TOML: {said}"
    line, column = text.split("\n")[int(place[1]) - 1], int(place[2])
    said = f"{said.removesuffix(place[0])} (column {column}){_advice(said, line, column)}"
    return f"{source}:{place[1]}: not TOML: {said}"


_PLACE = re.compile(r" \(at line (\d+), column (\d+)\)$")
_TWICE = re.compile(r"Cannot declare \(.*\) twice")
_INSTEAD = {
    r"(?i)(true|yes|on|false|no|off)(?=[\s,\]}#]|$)": "write true or false",
    r"[“”„‘’«»]": 'put words in straight quotes, as in "off"',
    r"[^\W\d]": 'put words in quotes, as in "off"',
    r"[-+]?\.\d": "write a digit before the point, as in 0.5",
}
"""What is to be written where no value begins so."""


def _advice(said: str, line: str, column: int) -> str:
    """What to do about what is often written in a line and is no TOML."""
    if said.startswith("Invalid value"):
        found = (advice for start, advice in _INSTEAD.items() if re.match(start, line[column - 1 :]))
        return "".join(f"; {advice}" for advice in [*found][:1])
    comma, unit = _DECIMAL_COMMA.search(line), _WITH_UNIT.search(line)
    if comma:
        return f"; a decimal comma? write {comma[1]}.{comma[2]}"
    return f"; a unit? write {unit[1]} alone, in the unit that the key's name says" if unit else ""


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


def checked(model: type[SomeModel], table: dict[str, Any], path: Path) -> SomeModel:
    """The tables of a file as what they mean."""
    return checked_table(model, table, path, read_text(path))


def checked_table(model: type[SomeModel], table: dict[str, Any], source: Path | str, text: str = "") -> SomeModel:
    """Tables as what they mean; `source` and `text` are what messages take name and line from."""
    try:
        return _validated(model, table)
    except ValidationError as error:
        raise ConfigError(validation_text(error, model, table, source, text)) from error


def _validated(model: type[SomeModel], table: dict[str, Any]) -> SomeModel:
    """By way of JSON: types stay strict, while TOML's arrays may become tuples."""
    return model.model_validate_json(json.dumps(table, default=_no_json))


def _no_json(value: object) -> dict[str, str]:
    """Dates and times, which no file has: as something that is neither text nor number."""
    return {"date": str(value)}


def at_key(path: Path, message: str) -> str:
    """A message about a file, with the line of the key that the message begins with, if it does with one."""
    line = line_of(read_text(path), keys_in(message))
    return f"{path}{f':{line}' if line else ''}: {message}"


@contextmanager
def said_of(path: Path) -> Iterator[None]:
    """What goes wrong inside is said of a file."""
    try:
        yield
    except ConfigError as error:
        raise ConfigError(at_key(path, str(error))) from error


Order = Literal["random", "williams", "latin-square"]
Fact = Literal["age_years", "sex", "handedness"]
"""What may be asked of a participant before a run."""
Sex = Literal["female", "male", "other", "undisclosed"]
Handedness = Literal["right", "left", "both"]


Seconds = Annotated[float, Field(ge=0, le=86_400)]
PositiveSeconds = Annotated[float, Field(gt=0, le=3_600)]
Share = Annotated[float, Field(ge=0, le=1)]
InnerShare = Annotated[float, Field(gt=0, lt=1)]
Spread = Annotated[float, Field(ge=0, le=100)]


def printable(text: str) -> str:
    """The text; `ValueError` for control characters and marks that turn the direction of writing."""
    for letter in text:
        if unicodedata.category(letter) in {"Cc", "Cf", "Cs", "Zl", "Zp"}:
            raise ValueError(f"holds the character U+{ord(letter):04X}, which is not printed; remove it")
    return text


Text = Annotated[str, Field(min_length=1, max_length=2_000), AfterValidator(printable)]


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


class PreregistrationConfig(Model):
    """What is set beforehand beside the designs: `recoil freeze` writes it down with them.

    `stop_rule`: when nobody comes any more; without, when the study has its participants. `rules`, `requests` and
    `codebook` are the files for the same options of `recoil analyze`, beside the study; `fits` is its option `--fits`.
    """

    hypotheses: tuple[Text, ...] = ()
    stop_rule: Text | None = None
    rules: Text | None = None
    requests: Text | None = None
    codebook: Text | None = None
    fits: bool = False


class StudyConfig(Model):
    """A study: how many people, which experiments, who may take part, what to compare with, and what is set before."""

    title: Text
    participants: Annotated[int, Field(ge=1, le=999)]
    code_prefix: Annotated[str, Field(pattern=CODE_PREFIX)] = "P"
    experiments: Annotated[tuple[Text, ...], Field(min_length=1), AfterValidator(once)]
    paper: Text | None = None
    replications: Annotated[int, Field(ge=0, le=1_000_000)] = 2000
    eligibility: EligibilityConfig = EligibilityConfig()
    preregistration: PreregistrationConfig = PreregistrationConfig()

    def codes(self) -> list[str]:
        """The participants' codes, P01 onwards."""
        return participant_codes(self.participants, self.code_prefix)


def participant_codes(count: int, prefix: str = "P") -> list[str]:
    """Codes for so many participants, all of one length.

    >>> participant_codes(2)
    ['P01', 'P02']
    """
    return [numbered_code(number, count, prefix) for number in range(1, count + 1)]


def numbered_code(number: int, count: int, prefix: str) -> str:
    """The code of one of so many participants."""
    return f"{prefix}{number:0{max(2, len(str(count)))}d}"


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
