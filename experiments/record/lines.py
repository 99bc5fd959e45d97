"""A line of a journal or register as it is read: a JSON object that follows from the line before. Pure."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NoReturn

from pydantic import JsonValue

from device.messages import RecoilError


class LineError(RecoilError):
    """A line that is no record, or does not follow from the one before; the message has no place.

    `said` has … where the message has `value`, which stands in the line.
    """

    def __init__(self, said: str, value: str = "") -> None:
        super().__init__(said.replace("…", value))
        self.said, self.value = said, value


def strict_json(data: bytes, pairs: Callable[[Sequence[tuple[str, JsonValue]]], object] | None = None) -> object:
    """JSON that can be hashed; `ValueError` for NaN, infinities and what is none, `RecursionError` if it is too deep.

    Python reads NaN, Infinity and 1e999, of which no hash can be made. `pairs` makes the objects, else they are dicts.
    """
    return json.loads(data.decode(), parse_constant=_no_number, parse_float=_finite, object_pairs_hook=pairs)


def parsed_line(line: bytes) -> dict[str, object]:
    """The JSON object on a line; else `LineError`. NaN and halves of characters are no JSON that can be written."""
    try:
        value = strict_json(line)
        if b"\\u" in line:
            json.dumps(value, ensure_ascii=False).encode()
    except (ValueError, RecursionError) as error:
        raise LineError("not a JSON record (…); it was changed or damaged", _why_no_json(error)) from error
    if not isinstance(value, dict):
        raise LineError("not a JSON object; it was changed or damaged")
    return value


def _why_no_json(error: ValueError | RecursionError) -> str:
    """Why a line is no record; advice on Python is nothing to whoever reads a journal."""
    if isinstance(error, RecursionError):
        return "it nests too deep"
    if isinstance(error, UnicodeDecodeError):
        return f"byte {error.start} is not UTF-8"
    return "a number has thousands of digits" if "integer string conversion" in str(error) else str(error)


def _no_number(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number of JSON")


def _finite(text: str) -> float:
    value = float(text)
    if math.isinf(value):
        _no_number(text)
    return value


def check_chain(value: dict[str, object], number: int, before: str) -> None:
    """`LineError` unless the record's number `n` and its `link` follow from the line before."""
    if value.get("n") != number:
        raise LineError(f"record number is …, must be {number}; a line was lost or added", repr(value.get("n")))
    if value.get("link") != before:
        raise LineError(f"does not follow from line {number}, which was changed after it was written")


def ending_of(data: bytes) -> tuple[str, str, str]:
    """Of the bytes of a finished journal the hash of its table, that of itself, and when it ended; else empty.

    The second is empty as well if any byte before the last record was changed. Much quicker than reading every record.
    """
    before, line = data[: data.rfind(b"\n", 0, -1) + 1], data[data.rfind(b"\n", 0, -1) + 1 :]
    with suppress(LineError):
        value = parsed_line(line)
        if value.get("kind") == "finished" and line.endswith(b"\n"):
            itself, said = hashlib.sha256(before).hexdigest(), value.get("journal_sha256")
            return str(value.get("table_sha256")), itself if itself == said else "", str(value.get("utc"))
    return "", "", ""
