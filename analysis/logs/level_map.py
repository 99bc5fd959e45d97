"""Answers of other programs at levels of a stimulus, by a map (`recoil fit thresholds --columns MAP.toml`).

A file has a row a trial. `configs/examples/levels.toml` shows every key of such a map: which column holds the level,
which whether the answer was a success (right, or yes), and what makes conditions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self

import pandas as pd
from pydantic import Field, model_validator

from analysis.logs.cell_rules import number_in
from analysis.logs.files import LONGEST_MAPPED, BadLogError, Problem, check_length, find_logs, read_content
from analysis.logs.mapped_people import ShortText, check_person, code_in, same_letters, unlisted
from analysis.logs.separated import LogMap, SeparatedLine, kept_lines
from device.messages import first_few
from experiments.config.door import Model
from experiments.design.language import ColumnName
from experiments.record import tables

_Row = dict[str, object]
_TRUTHS = {"1": True, "1.0": True, "true": True, "yes": True, "0": False, "0.0": False, "false": False, "no": False}


class LevelColumns(Model):
    """The names of the columns: of the level, the success, and, where there are several conditions, of these."""

    level: ShortText
    success: ShortText
    condition: ShortText | None = None


class LevelValues(Model):
    """What cells mean."""

    participant: dict[str, str] = Field(default_factory=dict)
    success: dict[str, bool] = Field(default_factory=dict)
    condition: dict[str, str] = Field(default_factory=dict)


class LevelMap(LogMap):
    """A whole map. `name` is the level's, with its unit; `answers`: of right ones, among how many who guesses chooses.

    `falling`: successes become fewer the higher the level.
    """

    name: ColumnName
    share: Literal["right", "yes"]
    answers: Annotated[int, Field(ge=2, le=100)] | None = None
    falling: bool = False
    columns: LevelColumns
    values: LevelValues = LevelValues()

    @model_validator(mode="after")
    def _chance_is_known_of_right_answers(self) -> Self:
        if self.share == "right" and self.answers is None:
            raise ValueError("answers is missing: of right answers say among how many who guesses chooses, such as 2")
        if self.share == "yes" and self.answers is not None:
            raise ValueError('answers is of share = "right": of yes the guess rate is fitted; remove it')
        return self


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MappedLevels:
    """The rows of all good files: `participant_id`, `level` (NaN without a stimulus), `success` and `condition`."""

    table: pd.DataFrame
    files: tuple[Path, ...]
    problems: tuple[Problem, ...]


def read_levels(paths: Sequence[Path], mapping: LevelMap) -> MappedLevels:
    """The answers in `paths`, files or folders. A file that breaks a rule is a problem, and left out whole."""
    found = find_logs(list(paths), mapping.files_end_with)
    rows, files, problems = list[_Row](), list[Path](), list(found.problems)
    for path in map(Path, found.logs):
        try:
            content = read_content(str(path))
            check_length(content, LONGEST_MAPPED)
            rows += _answered(kept_lines(content, mapping), path.name, mapping)
            files.append(path)
        except BadLogError as bad:
            problems.append(bad.of(path, "", "", ""))
    names = ["participant_id", "level", "success", "condition"]
    return MappedLevels(table=pd.DataFrame(rows, columns=names), files=tuple(files), problems=tuple(problems))


def _answered(lines: Sequence[SeparatedLine], file_name: str, mapping: LevelMap) -> list[_Row]:
    """Rows with an answer; whoever did not answer tells nothing. `BadLogError`: what is wrong, and with which rows."""
    rows, faults, column = list[_Row | None](), list[BadLogError](), mapping.participant.column
    people, same = dict[str, str](), same_letters(line.cells[column] for line in lines) if column else ()
    for line in lines:
        try:
            code, text = _whose(line, file_name, mapping)
            names = unlisted((people.setdefault(code, text), text), mapping.values.participant)
            check_person(code, mapping.participant, line.number, names, same)
            rows.append(_row(code, line, mapping))
        except BadLogError as bad:
            faults.append(bad)
    if faults:
        first, on = faults[0], first_few([one.line for one in faults], _SHOWN)
        others = f"; {len(faults):,} rows are bad, on lines {on}" if len(faults) > 1 else ""
        raise BadLogError(f"{first.message}{others}; the whole file is left out", first.line, first.column)
    return [row for row in rows if row is not None]


_SHOWN = 5
"""So many lines are named in a message."""


def _whose(line: SeparatedLine, file_name: str, mapping: LevelMap) -> tuple[str, str]:
    """The participant of a row, and the text that says so."""
    where = mapping.participant
    text = file_name if where.column is None else line.cells[where.column]
    return code_in(text, where, mapping.values.participant, line.number), text


def _row(code: str, line: SeparatedLine, mapping: LevelMap) -> _Row | None:
    """A row with an answer; `None` without one."""
    columns = mapping.columns
    success = _success(line, columns.success, mapping.values.success)
    if success is None:
        return None
    condition = line.cells[columns.condition] if columns.condition else tables.MISSING
    return {
        "participant_id": code,
        "level": _level(line, mapping),
        "success": float(success),
        "condition": mapping.values.condition.get(condition, condition) or None,
    }


def _success(line: SeparatedLine, column: str, known: Mapping[str, bool]) -> bool | None:
    cell = line.cells[column]
    if not cell:
        return None
    said = known.get(cell, _TRUTHS.get(cell.lower()))
    if said is None:
        rule = "(rule: 1 or 0, true or false, yes or no; values.success says what others mean)"
        raise BadLogError(f"{cell!r} is no success and no failure {rule}", line.number, column)
    return said


_LARGEST_LEVEL = 1e50
"""Of larger ones the squares of differences are no numbers."""


def _level(line: SeparatedLine, mapping: LevelMap) -> float:
    """The level; NaN of an empty cell, a trial without a stimulus."""
    column = mapping.columns.level
    cell = line.cells[column]
    level = number_in(cell.replace(mapping.text.decimal, ".")) if cell else math.nan
    if level is None or abs(level) > _LARGEST_LEVEL:
        rule = f"(rule: a number up to {_LARGEST_LEVEL:g}, text.decimal as its mark)"
        raise BadLogError(f"{cell!r} is no level {rule}", line.number, column)
    return level
