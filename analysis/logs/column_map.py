"""Logs that Recoil did not write, by a column map (`recoil analyze --columns MAP.toml`), as records of Recoil's tables.

So the same rules check them. `configs/examples/columns.toml` shows every key. What a map says, by its tables:

- `experiment`, `files_end_with`, `gun`, `response_source`: of which experiment the logs are, which files of a folder
  are read, what rendered the stimuli and whose hand answered;
- `[text]`: `delimiter`, `encoding`, `decimal` mark, and which cells are `missing`;
- `[participant]`: the `column` with the code, with a `pattern` if only a part of it is the code (its one group), or
  `file_name`, such a pattern for the name of the file;
- `[columns]`: for `method`, `direction`, `response`, `rating`, ... the name of the column that holds it. Without
  `session` a session is all trials with one method, without `trial` they are numbered in the order of rows;
  `instruction` is what the participant was told, as speed or accuracy; `correct`, where the other program said so, is
  held against direction and response;
- `[values.NAME]`: what a cell of NAME's column means ("f" = "forward");
- `[method]`: `levels`, the methods in the order in which results show them, and `labels`, their names in print;
- `[response_time]`: the `unit`, s or ms; `[rating]`: `scale_min` and `scale_max`, mapped to 0 and 10, and the `grain`
  between ratings, if there is one;
- `[[skip]]`: rows to leave out, where a `column` is one of `values`, or `empty`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from analysis.logs.cell_rules import number_in
from analysis.logs.files import LONGEST_LOG, BadLogError
from analysis.logs.mapped_people import ShortText, check_person, code_in, same_letters, unlisted
from analysis.logs.measures import MEASURES, NOT_STATED
from analysis.logs.names import MethodNames
from analysis.logs.separated import LogMap, SeparatedLine, kept_lines
from analysis.logs.texts import CsvRecord
from device.messages import first_few
from experiments.config.door import Model, once
from experiments.config.lines import LineText
from experiments.design.language import NumberScale
from experiments.record import tables
from experiments.tasks.questions import on_scale


class ColumnNames(Model):
    """The names of the columns."""

    method: ShortText
    direction: ShortText | None = None
    response: ShortText | None = None
    response_time: ShortText | None = None
    instruction: ShortText | None = None
    correct: ShortText | None = None
    rating: ShortText | None = None
    onset_utc: ShortText | None = None
    study: ShortText | None = None
    session: ShortText | None = None
    set: ShortText | None = None
    trial: ShortText | None = None
    flags: ShortText | None = None
    note: ShortText | None = None
    comment: ShortText | None = None


class ResponseTimeMapping(Model):
    """In which unit response times are."""

    unit: Literal["s", "ms"]


class ScaleMapping(Model):
    """The ends of the rating scale, which become 0 and 10, and the distance of two ratings if it has one."""

    scale_min: float
    scale_max: float
    grain: Annotated[float, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _is_a_scale(self) -> Self:
        if self.scale_min >= self.scale_max:
            raise ValueError(f"scale_min = {self.scale_min:g} must be below scale_max = {self.scale_max:g}")
        return self


class ValuesMapping(Model):
    """What cells mean."""

    participant: dict[str, str] = Field(default_factory=dict)
    method: dict[str, str] = Field(default_factory=dict)
    direction: dict[str, Literal["forward", "backward"]] = Field(default_factory=dict)
    response: dict[str, Literal["forward", "backward"]] = Field(default_factory=dict)
    instruction: dict[str, str] = Field(default_factory=dict)
    correct: dict[str, bool] = Field(default_factory=dict)


class MethodsMapping(Model):
    """The methods in the order in which results show them, and what they are called in print."""

    levels: Annotated[tuple[LineText, ...], AfterValidator(once)] = ()
    labels: dict[str, LineText] = Field(default_factory=dict)

    @property
    def names(self) -> MethodNames:
        """What the map says of the methods' names."""
        return MethodNames(order=self.levels, labels=self.labels)


class ColumnMap(LogMap):
    """A whole map."""

    experiment: Literal["direction", "preference"]
    gun: ShortText = NOT_STATED
    response_source: Literal["participant", "experimenter", "synthetic"] = "participant"
    columns: ColumnNames
    values: ValuesMapping = ValuesMapping()
    method: MethodsMapping = MethodsMapping()
    response_time: ResponseTimeMapping | None = None
    rating: ScaleMapping | None = None

    @property
    def own_columns(self) -> dict[str, str]:
        """The file's own column for each of Recoil's that the map names."""
        named = {"participant_id": self.participant.column, **self.columns.model_dump()}
        named["response_time_s"] = named.pop("response_time")
        return {name: column for name, column in named.items() if column is not None}

    @property
    def rated_from(self) -> tuple[float, float] | None:
        """The ends of the scale of another program's ratings; `None` of other answers."""
        if self.experiment != "preference":
            return None
        return (0.0, 10.0) if self.rating is None else (self.rating.scale_min, self.rating.scale_max)

    @model_validator(mode="after")
    def _measures_are_named(self) -> Self:
        lacking = [name for name in MEASURES[self.experiment].named if getattr(self.columns, name) is None]
        if lacking:
            raise ValueError(f"columns.{lacking[0]} is missing (rule: a {self.experiment} log has it)")
        if self.columns.response_time is not None and self.response_time is None:
            raise ValueError('response_time.unit is missing (rule: "s" or "ms" if columns.response_time is given)')
        return self

    @model_validator(mode="after")
    def _answers_stand_by_themselves(self) -> Self:
        roles = {f"columns.{role}": name for role, name in self.columns.model_dump(exclude_none=True).items()}
        roles |= {"participant.column": self.participant.column} if self.participant.column else {}
        for answer in (f"columns.{name}" for name in _ANSWERS):
            for role, name in roles.items():
                if role != answer and name == roles.get(answer):
                    rule = "(rule: what a participant did stands in a column of its own)"
                    raise ValueError(f"{answer} and {role} are both the column {name!r} {rule}")
        return self

    def logs_in(self, content: bytes, file_name: str) -> list[MappedLog]:
        """The logs in a file, one a participant and study; `BadLogError` if it is no such table."""
        lines = kept_lines(content, self)
        people: dict[tuple[str | None, str], list[SeparatedLine]] = {}
        nobodys: list[BadLogError] = []
        for line in lines:
            study = line.cells[self.columns.study] if self.columns.study else None
            try:
                people.setdefault((study, _code(line, file_name, self)), []).append(line)
            except BadLogError as bad:
                nobodys.append(bad)
        if not people:
            raise nobodys[0]
        same = same_letters(code for _, code in people)
        found = [
            MappedLog(
                study=study,
                participant=code,
                experiment=self.experiment,
                records=_records_or_fault(code, group, self, same),
            )
            for (study, code), group in people.items()
        ]
        return [*found, _nobodys(nobodys, self)] if nobodys else found


_ANSWERS = ("response", "rating", "response_time", "correct")
"""What a participant did, or another program said of it: no such column can say anything else."""
_Row = dict[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class MappedLog:
    """One participant's log in a file, or why it cannot be mapped; the study if the map knows it."""

    study: str | None
    participant: str
    experiment: str
    records: tuple[CsvRecord, ...] | BadLogError


def _nobodys(faults: Sequence[BadLogError], mapping: ColumnMap) -> MappedLog:
    """The rows that nobody's code is on: they are left out, and the rows of others are used."""
    count, first = len(faults), faults[0]
    lines = first_few([one.line for one in faults], _SHOWN)
    rows = "this row is left out" if count == 1 else f"{count} such rows are left out, on lines {lines}"
    bad = BadLogError(f"{first.message}; {rows}, and the others used", first.line, first.column)
    return MappedLog(study=None, participant="", experiment=mapping.experiment, records=bad)


_SHOWN = 5
"""So many lines are named in a message."""


def _code(line: SeparatedLine, file_name: str, mapping: ColumnMap) -> str:
    """The participant of a row."""
    column = mapping.participant.column
    text = file_name if column is None else line.cells[column]
    return code_in(text, mapping.participant, mapping.values.participant, line.number)


def _records_or_fault(
    code: str, lines: Sequence[SeparatedLine], mapping: ColumnMap, same: Collection[str]
) -> tuple[CsvRecord, ...] | BadLogError:
    try:
        return _records(code, lines, mapping, same)
    except BadLogError as bad:
        return bad


def _records(
    code: str, lines: Sequence[SeparatedLine], mapping: ColumnMap, same: Collection[str]
) -> tuple[CsvRecord, ...]:
    """A participant's rows with the columns of Recoil's own table."""
    if len(lines) > LONGEST_LOG:
        raise BadLogError(f"participant {code} has {len(lines):,} rows (rule: at most {LONGEST_LOG:,})")
    column = mapping.participant.column
    names = unlisted([line.cells[column] for line in lines] if column else (), mapping.values.participant)
    check_person(code, mapping.participant, lines[0].number, names, same)
    make = _rating if tables.is_rated(mapping.experiment) else _trial
    rows = [make(line, mapping) | _common(code, line, mapping) for line in lines]
    if tables.is_rated(mapping.experiment) and mapping.columns.trial is None:
        _check_rated_once(rows, lines, mapping)
    _number(rows, mapping)
    header = tables.names(mapping.experiment)
    return tuple(
        (line.number, [row.get(name, tables.MISSING) for name in header]) for line, row in zip(lines, rows, strict=True)
    )


def _check_rated_once(rows: Sequence[_Row], lines: Sequence[SeparatedLine], mapping: ColumnMap) -> None:
    first: dict[str, int] = {}
    for row, line in zip(rows, lines, strict=True):
        if (before := first.setdefault(row["method"], line.number)) != line.number:
            rule = "(rule: once; a column `trial` in the map tells repeated ratings apart)"
            message = f"{row['method']!r} is rated here and on line {before} {rule}"
            raise BadLogError(message, line.number, mapping.columns.rating)


def _common(code: str, line: SeparatedLine, mapping: ColumnMap) -> _Row:
    named = mapping.columns.model_dump(exclude_none=True)
    row = {name: line.cells[named[name]] for name in named if name in ("session", "set", "trial", "onset_utc")}
    row |= {name: tables.guard(line.cells[named[name]]) for name in named if name in ("flags", "note", "comment")}
    method = line.cells[mapping.columns.method]
    return row | {
        "participant_id": code,
        "experiment": mapping.experiment,
        "method": tables.guard(mapping.values.method.get(method, method)),
        "gun": mapping.gun,
    }


def _trial(line: SeparatedLine, mapping: ColumnMap) -> _Row:
    direction = _translated(line, "direction", mapping)
    response = _translated(line, "response", mapping)
    time, own = _seconds(line, mapping), str(int(mapping.response_source != "experimenter"))
    correct = str(int(response == direction)) if response else tables.MISSING
    _check_correct(line, correct, f"the direction is {direction}, the response {response or 'empty'}", mapping)
    return {
        "direction": direction,
        "response": response,
        "correct": correct,
        "response_time_s": time,
        "response_source": mapping.response_source if response else tables.MISSING,
        "response_time_valid": own if time else tables.MISSING,
        "instruction": _instruction(line, mapping),
    }


_TRUTHS = {"1": True, "1.0": True, "true": True, "0": False, "0.0": False, "false": False}


def _check_correct(line: SeparatedLine, correct: str, because: str, mapping: ColumnMap) -> None:
    """`BadLogError` if the other program said otherwise of an answer; of no answer it may say what it likes."""
    name = mapping.columns.correct
    cell = line.cells[name] if name else tables.MISSING
    if not (cell and correct):
        return
    said = mapping.values.correct.get(cell, _TRUTHS.get(cell.lower()))
    if said is None:
        rule = "(rule: 1 or 0, true or false; values.correct says what others mean)"
        raise BadLogError(f"{cell!r} is not allowed {rule}", line.number, name)
    if said != (correct == "1"):
        rule = "(rule: right if they are the same; does the map turn one of them round?)"
        raise BadLogError(f"correct is {cell}, but {because} {rule}", line.number, name)


def _instruction(line: SeparatedLine, mapping: ColumnMap) -> str:
    """The instruction; one that the map does not name keeps its name."""
    cell = line.cells[mapping.columns.instruction] if mapping.columns.instruction else tables.MISSING
    return tables.guard(mapping.values.instruction.get(cell, cell))


def _rating(line: SeparatedLine, mapping: ColumnMap) -> _Row:
    cell = _decimal(line, str(mapping.columns.rating), mapping)
    if mapping.rating is not None and (value := number_in(cell)) is not None:
        scale = mapping.rating
        if not scale.scale_min <= value <= scale.scale_max:
            rule = f"(rule: {scale.scale_min:g} to {scale.scale_max:g}, as the map says)"
            raise BadLogError(f"rating {cell} is out of range {rule}", line.number, mapping.columns.rating)
        if scale.grain and on_scale(value, NumberScale(scale.scale_min, scale.scale_max, scale.grain)) != value:
            rule = f"(rule: by {scale.grain:g} from {scale.scale_min:g}, as the map says)"
            raise BadLogError(f"rating {cell} is off the grain {rule}", line.number, mapping.columns.rating)
        cell = repr(10.0 * (value - scale.scale_min) / (scale.scale_max - scale.scale_min))
    return {"rating": cell, "rating_by": mapping.response_source if cell else tables.MISSING}


def _translated(line: SeparatedLine, name: str, mapping: ColumnMap) -> str:
    """What a cell of the column means; `BadLogError` if the map does not say."""
    column, known = getattr(mapping.columns, name), getattr(mapping.values, name)
    cell = line.cells[column]
    if cell == tables.MISSING or cell in known or cell in ("forward", "backward"):
        return str(known.get(cell, cell))
    rule = f"(rule: one of {', '.join([*known, 'forward', 'backward'])}; values.{name} says what they mean)"
    raise BadLogError(f"{cell!r} is not allowed {rule}", line.number, column)


def _seconds(line: SeparatedLine, mapping: ColumnMap) -> str:
    if mapping.columns.response_time is None or mapping.response_time is None:
        return tables.MISSING
    cell = _decimal(line, mapping.columns.response_time, mapping)
    value = number_in(cell)  # what is none stays as it is: the rules say what is wrong with it
    return repr(value / 1000.0) if value is not None and mapping.response_time.unit == "ms" else cell


def _decimal(line: SeparatedLine, column: str, mapping: ColumnMap) -> str:
    """A cell's number with a decimal point. `BadLogError`: it has a comma, and the map does not say so."""
    cell = line.cells[column]
    if "," in cell and mapping.text.decimal == "." and number_in(cell.replace(",", ".")) is not None:
        how = 'write decimal = "," under [text] in the map'
        raise BadLogError(f"{cell!r} has a decimal comma (rule: text.decimal, a point); {how}", line.number, column)
    return cell.replace(mapping.text.decimal, ".")


def _number(rows: list[_Row], mapping: ColumnMap) -> None:
    """Sessions by method, sets and trials in the order of rows, where the map names no column for them."""
    methods: dict[str, int] = {}
    counts = Counter[str]()
    for row in rows:
        session = row.setdefault("session", str(methods.setdefault(row["method"], len(methods) + 1)))
        block = "" if tables.is_rated(mapping.experiment) else session
        counts[block] += 1
        row.setdefault("trial", str(counts[block]))
        row.setdefault("set", "1")
