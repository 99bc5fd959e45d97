"""Comma-separated bytes of many files into columns at once, by Arrow. Pure.

Arrow is kinder than RFC 4180: what it would mend is not given to it.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Sequence

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
from numpy.typing import NDArray

from analysis.logs.frames import Texts
from experiments.record import columns

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
