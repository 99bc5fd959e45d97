"""Separated text of other programs, read line by line: how it is written, and the cells of named columns."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from analysis.logs.files import BadLogError
from experiments.config.door import Model
from experiments.record import tables


class TextFormat(Model):
    """How the file is written."""

    delimiter: Literal[",", ";", "\t", "|"] = ","
    encoding: Literal["utf-8", "utf-8-sig", "cp1252", "latin-1", "utf-16"] = "utf-8-sig"
    decimal: Literal[".", ","] = "."
    missing: tuple[str, ...] = ("", "None", "NA", "nan")


@dataclass(frozen=True, slots=True, kw_only=True)
class SeparatedLine:
    """A row by its columns, and the line it begins on; a cell that says there is nothing is empty."""

    number: int
    cells: dict[str, str]


def separated_lines(content: bytes, text: TextFormat, named: Sequence[str]) -> Iterator[SeparatedLine]:
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
