"""Which columns of a log that Recoil did not write mean what: the schema of `recoil analyze --columns MAP.toml`.

`configs/examples/columns.toml` shows every key. What a map says, in the words of its tables:

- `experiment`, `files_end_with`, `gun`, `response_source`: of which experiment the logs are, which files of a folder
  are read, what rendered the stimuli and whose hand answered;
- `[text]`: `delimiter`, `encoding`, `decimal` mark, and which cells are `missing`;
- `[participant]`: the `column` with the code, or `file_name`, a pattern whose one group is the code;
- `[columns]`: for `method`, `direction`, `response`, `rating`, ... the name of the column that holds it. Without
  `session` a session is all trials with one method, without `trial` they are numbered in the order of rows;
  `instruction` is what the participant was told, as speed or accuracy;
- `[values.NAME]`: what a cell of NAME's column means ("f" = "forward");
- `[response_time]`: the `unit`, s or ms; `[rating]`: `scale_min` and `scale_max`, mapped to 0 and 10;
- `[[skip]]`: rows to leave out, where a `column` is one of `values`, or `empty`.
"""

from __future__ import annotations

import re
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from experiments.config.door import Model

Text = Annotated[str, Field(min_length=1, max_length=500)]
MEASURES = {"direction": ("method", "direction", "response"), "preference": ("method", "rating")}
"""The columns without which there is nothing to analyse."""


def _with_one_group(pattern: str) -> str:
    try:
        groups = re.compile(pattern).groups
    except re.error as error:
        raise ValueError(f"must be a regular expression ({error})") from error
    if groups != 1:
        raise ValueError(f"has {groups} groups; it must have one, which is the code")
    return pattern


class TextFormat(Model):
    """How the file is written."""

    delimiter: Literal[",", ";", "\t", "|"] = ","
    encoding: Literal["utf-8", "utf-8-sig", "cp1252", "latin-1", "utf-16"] = "utf-8-sig"
    decimal: Literal[".", ","] = "."
    missing: tuple[str, ...] = ("", "None", "NA", "nan")


class Participant(Model):
    """Where the participant's code stands."""

    column: Text | None = None
    file_name: Annotated[Text, AfterValidator(_with_one_group)] | None = None

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.column is None) == (self.file_name is None):
            raise ValueError("give either `column` or `file_name`, not both and not none")
        return self


class Columns(Model):
    """The names of the columns."""

    method: Text
    direction: Text | None = None
    response: Text | None = None
    response_time: Text | None = None
    instruction: Text | None = None
    rating: Text | None = None
    study: Text | None = None
    session: Text | None = None
    set: Text | None = None
    trial: Text | None = None
    flags: Text | None = None
    note: Text | None = None
    comment: Text | None = None


class ResponseTime(Model):
    """In which unit response times are."""

    unit: Literal["s", "ms"]


class Scale(Model):
    """The ends of the rating scale, which become 0 and 10."""

    scale_min: float
    scale_max: float

    @model_validator(mode="after")
    def _is_a_scale(self) -> Self:
        if self.scale_min >= self.scale_max:
            raise ValueError(f"scale_min = {self.scale_min:g} must be below scale_max = {self.scale_max:g}")
        return self


class Skip(Model):
    """Rows to leave out."""

    column: Text
    values: tuple[str, ...] = ()
    empty: bool = False

    @model_validator(mode="after")
    def _says_which(self) -> Self:
        if not self.values and not self.empty:
            raise ValueError("give `values`, or `empty = true`")
        return self


class Values(Model):
    """What cells mean."""

    participant: dict[str, str] = Field(default_factory=dict)
    method: dict[str, str] = Field(default_factory=dict)
    direction: dict[str, Literal["forward", "backward"]] = Field(default_factory=dict)
    response: dict[str, Literal["forward", "backward"]] = Field(default_factory=dict)
    instruction: dict[str, str] = Field(default_factory=dict)


class ColumnMap(Model):
    """A whole map."""

    experiment: Literal["direction", "preference"]
    files_end_with: Annotated[tuple[Text, ...], Field(min_length=1)] = (".csv",)
    gun: Text = "not stated"
    response_source: Literal["participant", "experimenter", "synthetic"] = "participant"
    text: TextFormat = TextFormat()
    participant: Participant
    columns: Columns
    values: Values = Values()
    response_time: ResponseTime | None = None
    rating: Scale | None = None
    skip: tuple[Skip, ...] = ()

    @model_validator(mode="after")
    def _measures_are_named(self) -> Self:
        lacking = [name for name in MEASURES[self.experiment] if getattr(self.columns, name) is None]
        if lacking:
            raise ValueError(f"columns.{lacking[0]} is missing (rule: a {self.experiment} log has it)")
        if self.columns.response_time is not None and self.response_time is None:
            raise ValueError('response_time.unit is missing (rule: "s" or "ms" if columns.response_time is given)')
        return self

    @model_validator(mode="after")
    def _decimal_mark_does_not_part_cells(self) -> Self:
        if self.text.decimal == self.text.delimiter:
            raise ValueError(f"text.decimal = {self.text.decimal!r} is also text.delimiter (rule: they differ)")
        return self
