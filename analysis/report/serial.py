"""Results as JSON: the one place where a typed result becomes plain values."""

from __future__ import annotations

import csv
import io
import json
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    import pandas as pd

OPTIONAL: Final = {"optional": True}
"""Metadata of a field that is left out where it is None."""
SPREAD: Final = {"spread": True}
"""Metadata of a mapping whose values stand under their own names beside its neighbours."""

UNWRITTEN: Final = {"unwritten": True}
"""Metadata of a field that stands in no file and no table: what others are worked out from."""


def beside(result: type) -> dict[str, type]:
    """Metadata of a field whose own fields, those of `result`, stand beside its neighbours; all null for None."""
    return {"beside": result}


def written(how: Callable[[Any], Any], name: str = "") -> dict[str, Any]:
    """Metadata of a field that is written as `how` makes it of the value, under another name if one is given."""
    return {"how": how} | ({"name": name} if name else {})


def plain(value: Any) -> Any:
    """The value for JSON: results and models as objects, arrays as lists, fractions twice, what is not finite as null.

    >>> import numpy as np
    >>> plain({"a": np.array([1.0, np.nan]), "b": (True, None)})
    {'a': [1.0, None], 'b': [True, None]}
    """
    if type(value) in _MOST:  # first, as the values of ten thousand people are mostly these
        return value if type(value) is not float or math.isfinite(value) else None
    if is_dataclass(value) and not isinstance(value, type):
        return {name: plain(one) for name, one in _members(value)}
    if hasattr(value, "model_dump"):  # pydantic's, which is not imported for this either
        return value.model_dump(mode="json", exclude_none=True)
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, Fraction):
        return {"exact": str(value), "value": float(value)}
    if hasattr(value, "tolist"):  # numpy's, which is not imported for this: commands are to answer at once
        return plain(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


_MOST: Final = frozenset([str, float, int, bool, type(None)])


def undefined(value: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """Every number that `plain` writes as null because it is not finite, with its place in the file.

    A mapping whose attribute `finite` says that all its numbers are is believed, not walked through.

    >>> list(undefined({"a": [1.0, float("inf")], "b": {"c": 2.0}}))
    [('a[1]', inf)]
    """
    if is_dataclass(value) and not isinstance(value, type):
        value = dict(_members(value))
    if isinstance(value, Mapping) and not getattr(value, "finite", False):
        for key, one in value.items():
            yield from undefined(one, f"{place}.{key}".lstrip("."))
    elif isinstance(value, list | tuple):
        for i, one in enumerate(value):
            yield from undefined(one, f"{place}[{i}]")
    elif isinstance(value, float) and not math.isfinite(value):
        yield place, value


class NotebookResult(ABC):
    """A result in a notebook: rows as a DataFrame and as a table, all of it as plain values."""

    __slots__ = ()

    @abstractmethod
    def rows(self) -> list[dict[str, object]]:
        """What the table shows."""

    def to_dict(self) -> dict[str, Any]:
        """The content of the file that its command writes."""
        written: dict[str, Any] = plain(self)
        return written

    def to_frame(self) -> pd.DataFrame:
        """The rows."""
        import pandas as pd  # noqa: PLC0415 - commands are to answer at once

        return pd.DataFrame(self.rows())

    def _repr_html_(self) -> str:
        """The rows as a table."""
        return self.to_frame().to_html(index=False, float_format="{:.4g}".format)


def as_json(result: Any, *, in_ascii: bool = False) -> bytes:
    """A result as the text of a JSON file; what is no text, as in names of files, is escaped."""
    text = json.dumps(plain(result), indent=1, ensure_ascii=in_ascii, allow_nan=False) + "\n"
    return text.encode("utf-8", "backslashreplace")


def as_csv(header: Iterable[str], rows: Iterable[Iterable[object]]) -> bytes:
    """A header and rows as the content of a CSV file: RFC 4180, UTF-8, no text of it a formula."""
    from experiments.record.tables import guard  # noqa: PLC0415 - commands are to answer at once

    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(header)
    writer.writerows([guard(cell) if isinstance(cell, str) else cell for cell in row] for row in rows)
    return text.getvalue().encode("utf-8", "backslashreplace")


def _members(result: Any) -> Iterator[tuple[str, Any]]:
    """The names and values of a result as they are written."""
    for field in fields(result):
        value, inner = getattr(result, field.name), field.metadata.get("beside")
        if field.metadata.get("unwritten"):
            continue
        if field.metadata.get("spread"):
            yield from value.items()
        elif inner is not None:
            yield from dict.fromkeys(f.name for f in fields(inner)).items() if value is None else _members(value)
        elif value is not None or not field.metadata.get("optional"):
            how = field.metadata.get("how")
            yield field.metadata.get("name", field.name), how(value) if how else value
