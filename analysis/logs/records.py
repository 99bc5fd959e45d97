"""The records of comma-separated text by RFC 4180, with the place of what is not."""

from __future__ import annotations

import csv
import io

from analysis.logs.rules import BadLogError


def records(content: bytes) -> list[tuple[int, list[str]]]:
    """The records of an RFC 4180 file, each with the line it starts on."""
    text = _text(content)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    records: list[tuple[int, list[str]]] = []
    start = 1
    try:
        for cells in reader:
            records.append((start, cells))
            start = reader.line_num + 1
    except csv.Error as error:
        raise BadLogError(f"is not comma-separated text by RFC 4180: {error}", start) from error
    if not text.endswith(("\n", "\r")):
        raise BadLogError(
            "the last line has no end (rule: every row ends with a line end; was the file cut off?)", start - 1
        )
    return records


def _text(content: bytes) -> str:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise BadLogError(f"byte 0x{content[error.start]:02x} is not UTF-8 (rule: UTF-8 text)", line) from error
    if not text.strip():
        raise BadLogError("is empty (rule: a header and one row a planned trial)")
    return text
