"""Comma-separated bytes of many files into columns of cells at once. Pure.

Only plain text is taken: no quotes, no control characters, one kind of line end, as many cells in every row. Text with
quotes can be made plain by `plain`: what the quotes protect then stands there as control characters.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Words = NDArray[np.uint64]
Flags = NDArray[np.bool_]

MAX_CELL_BYTES = 512
_WORD = 8
_MASKS = np.array([(1 << 8 * count) - 1 for count in range(_WORD + 1)], dtype=np.uint64)
"""What keeps the first so many bytes of a word."""
_ONES = np.uint64(0x0101010101010101)
_SHORT_NUMBER, _LONGEST_NUMBER = 15, 3 * _WORD
_TENS = 10.0 ** np.arange(_SHORT_NUMBER + 1)
_COMMA, _QUOTE, _CR, _LF = b',"\r\n'
_PROTECTED = str.maketrans(',"\r\n', "\x01\x02\x03\x04")
_FREED = {stand_in: mark for mark, stand_in in _PROTECTED.items()}
_HARMLESS = np.array([byte for byte in range(ord(" "), _COMMA) if byte != _QUOTE], dtype=np.uint8)
"""Printable bytes up to the comma that mean nothing to the format."""
_STAND_INS = np.array(list(_FREED), dtype=np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """The cells of several texts: where they start in `data`, their lengths, both (columns, rows); each row's text."""

    data: NDArray[np.uint8]
    starts: Integers
    lengths: Integers
    text: Integers
    quoted: bool = False


def plain(records: Iterable[Sequence[str]]) -> str:
    """Records as text without quotes; what needed them is replaced."""
    return "".join(",".join(cell.translate(_PROTECTED) for cell in cells) + "\n" for cells in records)


def grid(texts: Sequence[bytes], columns: int, line_end: bytes, *, quoted: bool = False) -> tuple[Grid, list[int]]:
    """The cells of those `texts` that are plain, and the numbers of these; `Grid.text` counts among them.

    `quoted` says that all were made so by `plain`.
    """
    kept = [number for number, text in enumerate(texts) if text.endswith(line_end)]
    while True:
        data = np.frombuffer(b"".join([*(texts[number] for number in kept), bytes(MAX_CELL_BYTES)]), dtype=np.uint8)
        body = data[: len(data) - MAX_CELL_BYTES]
        ends = np.cumsum([len(texts[number]) for number in kept], dtype=np.int64)
        marks = _marks(body, quoted=quoted)
        pattern = np.array([_COMMA] * (columns - 1) + list(line_end), dtype=np.uint8)
        odd = _odd_places(body, marks, pattern)
        if not len(odd):
            breaks = marks.reshape(-1, len(pattern))[:, :columns]
            return replace(_grid(data, breaks, len(line_end), ends), quoted=quoted), kept
        spoilt = set(np.searchsorted(ends, odd, side="right").tolist())
        kept = [number for place, number in enumerate(kept) if place not in spoilt]


def _marks(body: NDArray[np.uint8], *, quoted: bool) -> Integers:
    """Where the bytes are that mean something, or should not be there."""
    marks = np.flatnonzero(body <= _COMMA)
    harmless = np.isin(body[marks], np.concatenate([_HARMLESS, _STAND_INS]) if quoted else _HARMLESS)
    return np.asarray(marks[~harmless]) if harmless.any() else marks


def _odd_places(body: NDArray[np.uint8], marks: Integers, pattern: NDArray[np.uint8]) -> Integers:
    """One place in every row that is not: cells of a bearable length with commas between and the line end behind."""
    kinds, width = body[marks], len(pattern)
    if len(kinds) % width == 0 and (kinds.reshape(-1, width) == pattern).all():
        rows = marks.reshape(-1, width)
    else:
        line_feeds = np.flatnonzero(kinds == _LF)
        strange = np.diff(line_feeds, prepend=-1) != width
        rows_at = line_feeds[~strange, None] + np.arange(1 - width, 1)
        wrong = (kinds[rows_at] != pattern).any(axis=1)
        return np.concatenate([marks[line_feeds[strange]], marks[rows_at[wrong, -1]]])
    gaps = np.diff(marks, prepend=-1).reshape(-1, width)
    too_long = (gaps > MAX_CELL_BYTES).any(axis=1)
    parted = gaps[:, -1] != 1 if pattern[-2] == _CR else np.zeros(len(rows), dtype=np.bool_)
    return np.asarray(rows[too_long | parted, -1])


def _grid(data: NDArray[np.uint8], breaks: Integers, line_end_bytes: int, ends: Integers) -> Grid:
    stops = np.ascontiguousarray(breaks.T)
    starts = np.empty_like(stops)
    starts[1:] = stops[:-1] + 1
    starts[0, 1:] = stops[-1, :-1] + line_end_bytes
    starts[0, :1] = 0
    text = np.searchsorted(ends, starts[0], side="right")
    return Grid(data=data, starts=starts, lengths=stops - starts, text=text)


def distinct(grid: Grid, column: int) -> tuple[Integers, list[str]]:
    """A number for every cell of a column, equal for equal bytes, and the text of each number."""
    starts, lengths = grid.starts[column], grid.lengths[column]
    if int(lengths.max(initial=0)) <= 2:
        return _distinct_short(grid, starts, lengths)
    words = _words(grid.data, starts, lengths)
    codes, keys = pd.factorize(_mixed(words))
    first = np.empty(len(keys), dtype=np.int64)
    first[codes[::-1]] = np.arange(len(codes) - 1, -1, -1)
    if words.shape[1] > 1 and not (words[first[codes]] == words).all():  # two contents that mix to the same number
        _, first, codes = np.unique(words, axis=0, return_index=True, return_inverse=True)
    return codes, cells(grid, column, first)


def _distinct_short(grid: Grid, starts: Integers, lengths: Integers) -> tuple[Integers, list[str]]:
    """`distinct` of cells of two bytes at most, by a table of all there can be."""
    longest = int(lengths.max(initial=0))
    keys = np.zeros(len(starts), dtype=np.uint16)
    for place in range(longest):
        byte = grid.data[starts + place].astype(np.uint16) << np.uint16(8 * place)
        keys |= np.where(lengths > place, byte, np.uint16(0))
    seen: Integers = np.flatnonzero(np.bincount(keys, minlength=1 << 8 * max(1, longest)))
    places = np.zeros(1 << 16, dtype=np.int64)
    places[seen] = np.arange(len(seen))
    texts = [key.to_bytes(2, "little").rstrip(b"\0").decode("utf-8") for key in seen.tolist()]
    return places[keys], [text.translate(_FREED) for text in texts] if grid.quoted else texts


def cells(grid: Grid, column: int, rows: Integers) -> list[str]:
    """The text of a column's cells in some rows."""
    words = _words(grid.data, grid.starts[column, rows], grid.lengths[column, rows])
    lines = np.full((len(words), words.shape[1] * _WORD + 1), _LF, dtype=np.uint8)
    lines[:, :-1] = words.view(np.uint8)
    texts = lines.tobytes().replace(b"\0", b"").decode("utf-8").split("\n")[:-1]
    return [text.translate(_FREED) for text in texts] if grid.quoted else texts


def _packed(words: Words) -> NDArray[np.bytes_]:
    return words.view(f"S{words.shape[1] * _WORD}")[:, 0]


def decimals(grid: Grid, column: int) -> tuple[NDArray[np.float64], Flags]:
    """The cells of a column as numbers, NaN if empty, and which are neither empty nor plain digits with one point."""
    lengths = grid.lengths[column]
    words = _words(grid.data, grid.starts[column], np.minimum(lengths, _LONGEST_NUMBER))
    wide = words.view(np.uint8)
    points = wide == ord(".")
    pointed = _counts(points)
    plain = (_counts((wide - np.uint8(ord("0"))) < 10) + pointed == lengths) & (pointed <= 1) & (lengths > pointed)
    short = plain & (lengths <= _SHORT_NUMBER)
    numbers = np.full(len(lengths), np.nan)
    numbers[short] = _short_numbers(wide[short], points[short])
    long = plain & ~short
    if long.any():
        numbers[long] = _packed(words)[long].astype(np.float64)
    return numbers, (lengths > 0) & ~plain


def _short_numbers(wide: NDArray[np.uint8], points: Flags) -> NDArray[np.float64]:
    """Decimals of at most 15 digits, as rows of bytes.

    A whole number below 2**53 over a power of ten up to 10**22 is the nearest number there is to the decimal
    (Clinger 1990, doi:10.1145/93542.93557), so that nothing is rounded twice.
    """
    whole, behind = np.zeros(len(wide)), np.zeros(len(wide), dtype=np.int64)
    after = np.zeros(len(wide), dtype=np.bool_)
    for byte, point in zip(wide.T[:_SHORT_NUMBER].copy(), points.T[:_SHORT_NUMBER].copy(), strict=True):
        digit = (byte != 0) & ~point
        if not digit.any() and not point.any():
            break
        whole = np.where(digit, 10.0 * whole + (byte - np.float64(ord("0"))), whole)
        behind += digit & after
        after |= point
    return np.asarray(whole / _TENS[behind])


def _counts(flags: Flags) -> Words:
    """How many of each row's bytes are set: the bytes of a word add up in its highest byte if multiplied by ones."""
    return np.asarray((flags.view("<u8") * _ONES >> np.uint64(56)).sum(axis=1))


def _words(data: NDArray[np.uint8], starts: Integers, lengths: Integers) -> Words:
    """The cells as rows of words, filled up with zeros, which no plain text holds."""
    count = max(1, -(-int(lengths.max(initial=0)) // _WORD))
    window = as_strided(data, (len(data) - count * _WORD + 1, count * _WORD), (1, 1), writeable=False)
    words = window[starts].view("<u8")
    if count == 1:
        return np.asarray(words & _MASKS[lengths, None])
    left = np.clip(lengths[:, None] - _WORD * np.arange(count), 0, _WORD)
    return np.asarray(words & _MASKS[left])


def _mixed(words: Words) -> Words:
    """One number a row: the word itself, or all its words multiplied and added up."""
    key = words[:, 0]
    for word in words.T[1:]:
        key = (key ^ (key >> np.uint64(29))) * np.uint64(0x9E3779B97F4A7C15) + word
    return key
