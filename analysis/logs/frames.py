"""Log tables as data frames: one type a column, whoever read it, and many frames put together in the order of logs.

Arrow is kinder than RFC 4180: what it would mend is not given to it.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
from numpy.typing import NDArray

from analysis.logs.rules import Cell, Row
from experiments.record import columns
from experiments.record.columns import Column

STUDY = "study"


@dataclass(frozen=True, slots=True, kw_only=True)
class Coded:
    """A column of few values: the number of each row's value, and the values, None for an empty cell."""

    codes: NDArray[np.int32]
    values: tuple[Cell, ...]


Texts = Any
"""An Arrow array of texts, null for an empty cell. Arrow ships no types."""

Cells = Coded | NDArray[np.float64] | Texts
"""A column: coded, or numbers, or texts. The parts of a column need not be of one kind."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """Checked rows of an experiment, log after log: the logs' numbers, and how many rows each has."""

    experiment: str
    columns: Mapping[str, Cells]
    log: NDArray[np.int64]
    rows: NDArray[np.int64]


def is_category(column: Column) -> bool:
    """Columns of few values, which are kept as categories."""
    return column.type == "level" or column.name in {"participant_id", "gun"}


def levels(names: Iterable[str]) -> pd.Index:
    """Categories of text, of one type even if there are none."""
    return pd.Index(list(names), dtype="str")


def block_of_rows(experiment: str, rows: Sequence[Row], log: int) -> Block:
    """The rows of one log as a block."""
    made = {column.name: _coded([row[column.name] for row in rows]) for column in columns.TABLES[experiment]}
    return Block(experiment=experiment, columns=made, log=np.array([log]), rows=np.array([len(rows)]))


def _coded(cells: Sequence[Cell]) -> Coded:
    values = tuple(dict.fromkeys(cells))
    places = {value: place for place, value in enumerate(values)}
    return Coded(codes=np.array([places[cell] for cell in cells], dtype=np.int32), values=values)


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
    chosen_rows = None if np.array_equal(order, np.arange(len(log))) else _rows_of(order, rows)
    made: dict[str, Any] = {}
    for column in columns.TABLES[experiment]:
        made[column.name] = _made(column, [block.columns[column.name] for block in mine], chosen_rows)
    made[STUDY] = _studies([studies[number] for number in log[order].tolist()], rows[order], set(studies.values()))
    if len(set(studies.values())) > 1:
        made["participant_id"] = _persons(made[STUDY], made["participant_id"])
    return pd.DataFrame(made, copy=False)


def _rows_of(logs: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """The places of the rows of some logs, in the order of these."""
    starts, counts = (np.cumsum(rows) - rows)[logs], rows[logs]
    return np.asarray(np.arange(counts.sum()) + np.repeat(starts - (np.cumsum(counts) - counts), counts))


def _made(column: Column, parts: Sequence[Cells], rows: NDArray[np.int64] | None) -> Any:
    """Some rows of a column's parts, of the column's type."""
    if column.type == "text" and not is_category(column):
        texts = pa.chunked_array([_texts(part) for part in parts], pa.large_string())
        return pd.array(texts if rows is None else texts.take(pa.array(rows)), dtype="string")
    if column.type == "number":
        numbers = np.concatenate([np.empty(0), *(_numbers(part) for part in parts)])
        return pd.array(numbers if rows is None else numbers[rows], dtype="float64")
    codes, values = _recoded([part for part in parts if isinstance(part, Coded)])
    codes = codes if rows is None else codes[rows]
    return _categories(codes, values) if is_category(column) else _integers(codes, values)


def _texts(part: Cells) -> Texts:
    return pa.array(part.values, pa.large_string()).take(pa.array(part.codes)) if isinstance(part, Coded) else part


def _numbers(part: Cells) -> NDArray[np.float64]:
    return np.array(part.values, dtype=np.float64)[part.codes] if isinstance(part, Coded) else np.asarray(part)


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


TEXT = pa.large_string()
_FEW = pa.dictionary(pa.int32(), pa.string())
_HEADER = re.compile(rb"[A-Za-z0-9_, ]+\r?\n")
_QUOTED = re.compile(rb'(?<![^,\r\n])"[^"]*(?:""[^"]*)*"(?=[,\r\n])')
"""A quoted cell, all of it: after a separator and before one."""
_MAX_BLOCK_BYTES = 1 << 30


def layout(content: bytes) -> tuple[bytes, bool, int] | None:
    """A file's header, whether there are quotes, and how many rows if no line ends in CR; None if it is in doubt."""
    header = _HEADER.match(content)
    if header is None or not content.endswith(b"\n") or len(header[0]) == len(content) or _has_long_cell(content):
        return None
    quoted = b'"' in content
    bare = _QUOTED.sub(b"", content) if quoted else content
    return None if quoted and b'"' in bare else (header[0], quoted, bare.count(b"\n") - 1)


def names_in(header: bytes) -> list[str]:
    """The columns' names."""
    return header.decode("ascii").rstrip().split(",")


def _has_long_cell(content: bytes) -> bool:
    """Whether a cell may be longer than the careful reader's module takes."""
    limit = csv.field_size_limit()
    return len(content) > limit and (b'"' in content or max(map(len, content.splitlines())) > limit)


def table(
    header: bytes, contents: Sequence[bytes], rows: int, many: Collection[str], *, quoted: bool
) -> pa.Table | None:
    """The rows of files with the same header, one file after the other; None if they are not as many.

    Columns named in `many` are texts; the others, of few values, are dictionaries.
    """
    data = b"".join([header, *(memoryview(content)[len(header) :] for content in contents)])
    try:
        found = pa.csv.read_csv(
            pa.BufferReader(data),
            pa.csv.ReadOptions(use_threads=False, block_size=min(len(data) + 1, _MAX_BLOCK_BYTES)),
            pa.csv.ParseOptions(
                quote_char='"' if quoted else False, newlines_in_values=quoted, ignore_empty_lines=False
            ),
            pa.csv.ConvertOptions(
                column_types={name: TEXT if name in many else _FEW for name in names_in(header)},
                null_values=[columns.MISSING],
                strings_can_be_null=True,
            ),
        )
    except pa.ArrowInvalid:
        return None
    return found.combine_chunks() if found.num_rows == rows else None


def few(cells: pa.DictionaryArray) -> tuple[NDArray[np.int32], list[str]]:
    """For every cell the number of its text, and these texts; the last is the empty cell's, whether there is one."""
    texts = cells.dictionary.to_pylist()
    return cells.indices.fill_null(len(texts)).to_numpy(), [*texts, columns.MISSING]


def decimals(cells: Texts) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Texts as numbers, NaN for none; and the rows, here NaN too, with more than digits and one point, or too many."""
    plain = pc.ascii_is_decimal(pc.replace_substring(cells, ".", "", max_replacements=1))
    numbers = pc.if_else(plain, cells, None).cast(pa.float64()).to_numpy(zero_copy_only=False)
    odd = np.flatnonzero(~np.isfinite(numbers) & cells.is_valid().to_numpy(zero_copy_only=False))
    return numbers, odd


def unguarded(cells: Texts) -> Texts:
    """The texts without the guard against formulas (`columns.unguard`)."""
    guarded = pc.starts_with(cells, "'")
    return pc.if_else(guarded, pc.utf8_slice_codeunits(cells, 1), cells) if pc.any(guarded).as_py() else cells
