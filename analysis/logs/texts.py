"""Log files as columns of text, files with one header together, and blocks of texts joined into one typed table.

Arrow reads plain files, many at once. It is kinder than RFC 4180, so what it would mend is left to the csv module.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
from numpy.typing import NDArray

from analysis.logs.files import BadLogError
from experiments.record import tables
from experiments.record.tables import Column

Texts = Any
"""An Arrow array of texts, null for an empty cell. Arrow ships no types."""
CsvRecord = tuple[int, list[str]]
"""The line on which a record starts, and its cells."""

TEXT = pa.large_string()
_FEW = pa.dictionary(pa.int32(), pa.string())
_HEADER = re.compile(rb"[A-Za-z0-9_, ]+\r?\n")
_QUOTED = re.compile(rb'(?<![^,\r\n])"[^"]*(?:""[^"]*)*"(?=[,\r\n])')
"""A quoted cell, all of it: after a separator and before one."""
_LONE_CR = re.compile(rb"\r(?!\n)")
_MAX_BLOCK_BYTES = 1 << 30


def is_category(column: Column) -> bool:
    """Whether a column holds few values, and is kept as categories."""
    return column.type == "level" or column.name in {"participant_id", "gun"}


def has_many_values(column: Column) -> bool:
    """Whether nearly every row may hold another value."""
    return column.type == "number" or (column.type == "text" and not is_category(column))


_MANY = {column.name for table in tables.TABLES.values() for column in table if has_many_values(column)}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TextTable:
    """Rows of logs with one header, log after log.

    `texts` holds each column as an Arrow dictionary where values are few, else as an array of strings. For each log
    there are its number, how many rows it has, and the lines on which these start. `ragged` gives, for a row that has
    not as many fields as the header, how many it has; its cells are left empty.
    """

    header: tuple[str, ...]
    texts: Mapping[str, Texts]
    logs: tuple[int, ...]
    rows: tuple[int, ...]
    lines: tuple[Sequence[int], ...]
    ragged: Mapping[int, int]

    def column(self, name: str) -> Texts:
        """The texts of a column; nothing but empty cells if there is no such column."""
        if name in self.texts:
            return self.texts[name]
        return pa.nulls(sum(self.rows), TEXT if name in _MANY else _FEW)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plain:
    """A file that Arrow reads as RFC 4180 has it, if it finds as many rows."""

    number: int
    content: bytes
    header: bytes
    quoted: bool
    rows: int

    @property
    def lines(self) -> Sequence[int]:
        """The line on which each row starts: one after the other, unless a quoted cell holds a line end."""
        if self.quoted and (self.content.count(b"\n") > self.rows + 1 or _LONE_CR.search(self.content)):
            return [line for line, _ in records(self.content)[1:]]
        return range(2, self.rows + 2)


def text_tables(contents: Mapping[int, bytes]) -> tuple[list[TextTable], dict[int, BadLogError]]:
    """Numbered files' contents as tables, and why a file is no text as RFC 4180 has it."""
    tables = arrow_tables(contents)
    taken = {number for table in tables for number in table.logs}
    others, faults = csv_tables({number: content for number, content in contents.items() if number not in taken})
    return [*tables, *others], faults


def arrow_tables(contents: Mapping[int, bytes]) -> list[TextTable]:
    """The tables of those files that Arrow reads as RFC 4180 has it, as far as that is sure."""
    plain: dict[tuple[bytes, bool], list[_Plain]] = {}
    for number, content in contents.items():
        if file := _plain(number, content):
            plain.setdefault((file.header, file.quoted), []).append(file)
    return [table for files in plain.values() for table in _plain_tables(files)]


def _plain(number: int, content: bytes) -> _Plain | None:
    """How a file looks; `None` if Arrow might read it otherwise than RFC 4180 has it."""
    header = _HEADER.match(content)
    if header is None or not content.endswith(b"\n") or len(header[0]) == len(content) or _has_long_cell(content):
        return None
    quoted = b'"' in content
    bare = _QUOTED.sub(b"", content) if quoted else content
    if quoted and b'"' in bare:
        return None
    return _Plain(number=number, content=content, header=header[0], quoted=quoted, rows=bare.count(b"\n") - 1)


def _has_long_cell(content: bytes) -> bool:
    """Whether a cell may be longer than the csv module takes."""
    limit = csv.field_size_limit()
    return len(content) > limit and (b'"' in content or max(map(len, content.splitlines())) > limit)


def _plain_tables(files: Sequence[_Plain]) -> Iterator[TextTable]:
    """Files with one header; if not all have rows as they should be, each half by itself, and no single one."""
    table = _arrow_table(files)
    if table is not None:
        yield TextTable(
            header=tuple(table.column_names),
            texts={name: table.column(at).chunk(0) for at, name in enumerate(table.column_names)},
            logs=tuple(file.number for file in files),
            rows=tuple(file.rows for file in files),
            lines=tuple(file.lines for file in files),
            ragged={},
        )
    elif len(files) > 1:
        half = len(files) // 2
        yield from _plain_tables(files[:half])
        yield from _plain_tables(files[half:])


def _arrow_table(files: Sequence[_Plain]) -> pa.Table | None:
    """The rows of files with one header, one file after the other; `None` if they are not one a line."""
    header, quoted = files[0].header, files[0].quoted
    data = b"".join([header, *(memoryview(file.content)[len(header) :] for file in files)])
    names = header.decode("ascii").rstrip().split(",")
    try:
        found = pa.csv.read_csv(
            pa.BufferReader(data),
            pa.csv.ReadOptions(use_threads=False, block_size=min(len(data) + 1, _MAX_BLOCK_BYTES)),
            pa.csv.ParseOptions(
                quote_char='"' if quoted else False, newlines_in_values=quoted, ignore_empty_lines=False
            ),
            pa.csv.ConvertOptions(
                column_types={name: TEXT if name in _MANY else _FEW for name in names},
                null_values=[tables.MISSING],
                strings_can_be_null=True,
            ),
        )
    except pa.ArrowInvalid:
        return None
    blank = all(column.null_count for column in found.columns)  # a blank line is no row of empty cells
    return None if blank or found.num_rows != sum(file.rows for file in files) else found.combine_chunks()


def csv_tables(contents: Mapping[int, bytes]) -> tuple[list[TextTable], dict[int, BadLogError]]:
    """As `text_tables`, every file read by the csv module. Files without a row are in tables of their own."""
    groups: dict[tuple[tuple[str, ...], bool], dict[int, list[CsvRecord]]] = {}
    faults: dict[int, BadLogError] = {}
    for number, content in contents.items():
        try:
            (_, header), *rows = records(content)
        except BadLogError as bad:
            faults[number] = bad
        else:
            groups.setdefault((tuple(header), bool(rows)), {})[number] = rows
    return [table_of_records(header, logs) for (header, _), logs in groups.items()], faults


def table_of_records(header: Sequence[str], logs: Mapping[int, Sequence[CsvRecord]]) -> TextTable:
    """Records of numbered logs as a table."""
    cells = [row for rows in logs.values() for _, row in rows]
    empty = [tables.MISSING] * len(header)
    ragged = {at: len(row) for at, row in enumerate(cells) if len(row) != len(header)}
    whole = [empty if at in ragged else row for at, row in enumerate(cells)]
    return TextTable(
        header=tuple(header),
        texts={name: _column(name, texts) for name, texts in zip(header, zip(*whole, strict=True), strict=False)},
        logs=tuple(logs),
        rows=tuple(len(rows) for rows in logs.values()),
        lines=tuple([line for line, _ in rows] for rows in logs.values()),
        ragged=ragged,
    )


def _column(name: str, texts: Iterable[str]) -> Texts:
    """The texts of a column, as Arrow reads them."""
    cells = [text or None for text in texts]
    return pa.array(cells, TEXT) if name in _MANY else pa.array(cells, pa.string()).dictionary_encode()


def records(content: bytes) -> list[CsvRecord]:
    """The records of an RFC 4180 file. `BadLogError` if it is none."""
    text = _text(content)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    found: list[CsvRecord] = []
    start = 1
    try:
        for cells in reader:
            found.append((start, cells))
            start = reader.line_num + 1
    except csv.Error as error:
        raise BadLogError(f"is not comma-separated text by RFC 4180: {error}", start) from error
    if not text.endswith(("\n", "\r")):
        raise BadLogError(
            "the last line has no end (rule: every row ends with a line end; was the file cut off?)", start - 1
        )
    return found


def _text(content: bytes) -> str:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise BadLogError(f"byte 0x{content[error.start]:02x} is not UTF-8 (rule: UTF-8 text)", line) from error
    if not text.strip():
        raise BadLogError("is empty (rule: a header and one row a planned trial)")
    return text


def few(cells: pa.DictionaryArray) -> tuple[NDArray[np.int32], list[str]]:
    """For every cell the number of its text, and these texts; the last is the empty cell's, whether there is one."""
    texts = cells.dictionary.to_pylist()
    return cells.indices.fill_null(len(texts)).to_numpy(), [*texts, tables.MISSING]


def decimals(cells: Texts) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Texts as numbers, NaN for none; and the rows, here NaN too, with more than digits and one point, or too many."""
    plain = pc.ascii_is_decimal(pc.replace_substring(cells, ".", "", max_replacements=1))
    numbers = pc.if_else(plain, cells, None).cast(pa.float64()).to_numpy(zero_copy_only=False)
    odd = np.flatnonzero(~np.isfinite(numbers) & cells.is_valid().to_numpy(zero_copy_only=False))
    return numbers, odd


def unguarded(cells: Texts) -> Texts:
    """The texts without the guard against formulas (`tables.unguard`)."""
    guarded = pc.starts_with(cells, "'")
    return pc.if_else(guarded, pc.utf8_slice_codeunits(cells, 1), cells) if pc.any(guarded).as_py() else cells


STUDY = "study"

Cell = str | int | float | None
"""The value of a cell; `None` if it is empty."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Coded:
    """A column of few values: the number of each row's value, and the values, None for an empty cell."""

    codes: NDArray[np.int32]
    values: tuple[Cell, ...]


Cells = Coded | NDArray[np.float64] | Texts
"""A column: coded, or numbers, or texts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """Checked rows of an experiment, log after log: the logs' numbers, and how many rows each has."""

    experiment: str
    columns: Mapping[str, Cells]
    log: NDArray[np.int64]
    rows: NDArray[np.int64]


def levels(names: Iterable[str]) -> pd.Index:
    """Categories of text, of one type even if there are none."""
    return pd.Index(list(names), dtype="str")


def chosen(cells: Cells, rows: NDArray[np.int64]) -> Cells:
    """Some rows of a column."""
    if isinstance(cells, Coded):
        return replace(cells, codes=cells.codes[rows])
    return cells[rows] if isinstance(cells, np.ndarray) else cells.take(pa.array(rows))


def joined(experiment: str, blocks: Iterable[Block], studies: Mapping[int, str]) -> pd.DataFrame:
    """The rows of an experiment in the order of their logs, with the study that `studies` names for each log.

    Rows of logs without a study are left out. If there are several studies, a participant is `study/code`.
    """
    mine = [block for block in blocks if block.experiment == experiment]
    none = np.empty(0, dtype=np.int64)
    log = np.concatenate([none, *(block.log for block in mine)])
    rows = np.concatenate([none, *(block.rows for block in mine)])
    known = np.array([number in studies for number in log.tolist()], dtype=np.bool_)
    order = np.argsort(log)
    order = order[known[order]]
    chosen_rows = None if np.array_equal(order, np.arange(len(log))) else rows_of_logs(order, rows)
    made: dict[str, Any] = {}
    for column in tables.TABLES[experiment]:
        made[column.name] = _made(column, [block.columns[column.name] for block in mine], chosen_rows)
    made[STUDY] = _studies([studies[number] for number in log[order].tolist()], rows[order], set(studies.values()))
    if len(set(studies.values())) > 1:
        made["participant_id"] = _persons(made[STUDY], made["participant_id"])
    return pd.DataFrame(made, copy=False)


def rows_of_logs(logs: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """The places of the rows of some logs, in the order of these."""
    starts, counts = (np.cumsum(rows) - rows)[logs], rows[logs]
    return np.asarray(np.arange(counts.sum()) + np.repeat(starts - (np.cumsum(counts) - counts), counts))


def _made(column: Column, parts: Sequence[Cells], rows: NDArray[np.int64] | None) -> Any:
    """Some rows of a column's parts, of the column's type."""
    if column.type == "number":
        numbers = np.concatenate([np.empty(0), *parts])
        return pd.array(numbers if rows is None else numbers[rows], dtype="float64")
    if has_many_values(column):
        texts = pa.chunked_array(parts, TEXT)
        return pd.array(texts if rows is None else texts.take(pa.array(rows)), dtype="string")
    codes, values = _recoded([part for part in parts if isinstance(part, Coded)])
    codes = codes if rows is None else codes[rows]
    return _categories(codes, values) if is_category(column) else _integers(codes, values)


def _recoded(parts: Sequence[Coded]) -> tuple[NDArray[np.int32], list[Cell]]:
    """The parts' codes with one list of values for all."""
    places: dict[Cell, int] = {}
    codes = [np.empty(0, dtype=np.int32)]
    for part in parts:
        new = np.array([places.setdefault(value, len(places)) for value in part.values], dtype=np.int32)
        codes.append(new[part.codes])
    return np.concatenate(codes), list(places)


def _categories(codes: NDArray[np.int32], values: Sequence[Cell]) -> pd.Categorical:
    """Categories that occur, in the order of their names, so that equal columns are equal however they were read."""
    counts = np.bincount(codes, minlength=len(values))
    used = sorted((str(value), i) for i, value in enumerate(values) if counts[i] and value is not None)
    places = np.full(len(values), -1, dtype=np.int32)
    places[[i for _, i in used]] = np.arange(len(used))
    return pd.Categorical.from_codes(places[codes], categories=levels(name for name, _ in used))


def _integers(codes: NDArray[np.int32], values: Sequence[Cell]) -> pd.arrays.IntegerArray:
    missing = np.array([value is None for value in values], dtype=np.bool_)
    numbers = np.array([0 if value is None else value for value in values], dtype=np.int64)
    return pd.arrays.IntegerArray(numbers[codes], missing[codes])


def _studies(studies: Sequence[str], rows: NDArray[np.int64], all_studies: Iterable[str]) -> pd.Categorical:
    """The study of each row, from the study of each log."""
    places = {name: place for place, name in enumerate(sorted(all_studies))}
    codes = np.array([places[study] for study in studies], dtype=np.int32)
    return _categories(np.repeat(codes, rows), list(places))


def _persons(study: pd.Categorical, code: pd.Categorical) -> pd.Categorical:
    width = max(1, len(code.categories))
    found, place = np.unique(study.codes.astype(np.int64) * width + code.codes, return_inverse=True)
    names = [f"{study.categories[pair // width]}/{code.categories[pair % width]}" for pair in found.tolist()]
    return _categories(place.astype(np.int32), names)


def is_recoils(content: bytes) -> bool:
    """Whether a file has the header of one of Recoil's own tables, so that no map is needed."""
    header = set(content.partition(b"\n")[0].decode("utf-8-sig", errors="replace").strip().split(","))
    return any({one.name for one in table if one.required} <= header for table in tables.TABLES.values())
