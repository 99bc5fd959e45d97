"""Separated text of other programs, read line by line: what every map says of it, and the cells of named columns."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from analysis.logs.files import BadLogError
from analysis.logs.mapped_people import ParticipantMapping, ShortText
from experiments.config.door import Model
from experiments.record import tables


class TextFormat(Model):
    """How the file is written."""

    delimiter: Literal[",", ";", "\t", "|"] = ","
    encoding: Literal["utf-8", "utf-8-sig", "cp1252", "latin-1", "utf-16"] = "utf-8-sig"
    decimal: Literal[".", ","] = "."
    missing: tuple[str, ...] = ("", "None", "NA", "nan")

    @model_validator(mode="after")
    def _decimal_mark_does_not_part_cells(self) -> Self:
        if self.decimal == self.delimiter:
            raise ValueError(f"decimal = {self.decimal!r} is also the delimiter (rule: they differ)")
        return self


class Skip(Model):
    """Rows to leave out."""

    column: ShortText
    values: tuple[str, ...] = ()
    empty: bool = False

    @model_validator(mode="after")
    def _says_which(self) -> Self:
        if not self.values and not self.empty:
            raise ValueError("give `values`, or `empty = true`")
        return self

    def leaves_out(self, cell: str) -> bool:
        """Is a row with this cell left out?"""
        return cell in self.values or (self.empty and cell == tables.MISSING)


class LogMap(Model):
    """What every map says: which files and how they are written, whose rows, the columns by name, rows to leave out."""

    files_end_with: Annotated[tuple[ShortText, ...], Field(min_length=1)] = (".csv",)
    text: TextFormat = TextFormat()
    participant: ParticipantMapping
    columns: Model
    skip: tuple[Skip, ...] = ()

    @property
    def named(self) -> tuple[str, ...]:
        """Every column of a file that the map names."""
        named = [*self.columns.model_dump(exclude_none=True).values(), *(skip.column for skip in self.skip)]
        return tuple(filter(None, [self.participant.column, *named]))


@dataclass(frozen=True, slots=True, kw_only=True)
class SeparatedLine:
    """A row by its columns, and the line it begins on; a cell that says there is nothing is empty."""

    number: int
    cells: dict[str, str]


def kept_lines(content: bytes, mapping: LogMap) -> list[SeparatedLine]:
    """The rows of a file that `skip` does not leave out. `BadLogError`: it has none, or is no such text."""
    every = _separated_lines(content, mapping.text, mapping.named)
    kept = [line for line in every if not any(skip.leaves_out(line.cells[skip.column]) for skip in mapping.skip)]
    if not kept:
        raise BadLogError("has no row left to read (rule: at least one that `skip` does not leave out)")
    return kept


def _separated_lines(content: bytes, text: TextFormat, named: Sequence[str]) -> Iterator[SeparatedLine]:
    """The rows of a file that has all `named` columns. `BadLogError`: it has not, or is no such text."""
    try:
        decoded = content.decode(text.encoding)
    except UnicodeDecodeError as error:
        rule = f"(rule: {text.encoding} text, as the map says)"
        raise BadLogError(
            f"byte 0x{content[error.start]:02x} is not {text.encoding} {rule}",
            content[: error.start].count(b"\n") + 1,
        ) from error
    reader = csv.reader(io.StringIO(decoded, newline=""), delimiter=text.delimiter, strict=True)
    start = 1
    try:
        header = next(reader, [])
        _check_header(header, named)
        start = reader.line_num + 1
        for cells in reader:
            if any(cells):
                yield SeparatedLine(number=start, cells=_cells(header, cells, start, text))
            start = reader.line_num + 1
    except csv.Error as error:
        raise BadLogError(f"is not separated text: {error}", start) from error


def _cells(header: list[str], cells: list[str], line: int, text: TextFormat) -> dict[str, str]:
    if len(cells) != len(header):
        raise BadLogError(f"has {len(cells)} fields (rule: {len(header)}, as in the header)", line)
    return {
        name: tables.MISSING if cell.strip() in text.missing else cell.strip()
        for name, cell in zip(header, cells, strict=True)
    }


def _check_header(header: list[str], named: Sequence[str]) -> None:
    for name in named:
        if name not in header:
            raise BadLogError(f"column {name!r} is missing (rule: the map names it)", 1, name)
        if header.count(name) > 1:
            raise BadLogError(f"column {name!r} stands {header.count(name)} times in the header (rule: once)", 1, name)
