"""Results as JSON: the one place where a typed result becomes plain values."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

LEFT_OUT_IF_NONE = {"json": "left out if none"}
"""Metadata of a result's field that was not asked for where it is None, so that the file has no such key."""


def plain(value: Any) -> Any:
    """The value for JSON: results and config models as objects, arrays as lists, what is not finite as null.

    >>> import numpy as np
    >>> plain({"a": np.array([1.0, np.nan]), "b": (True, None)})
    {'a': [1.0, None], 'b': [True, None]}
    """
    if is_dataclass(value) and not isinstance(value, type):
        found = {one: getattr(value, one.name) for one in fields(value)}
        return {
            one.name: plain(part) for one, part in found.items() if part is not None or one.metadata != LEFT_OUT_IF_NONE
        }
    if hasattr(value, "model_dump"):  # pydantic's, which is not imported for this either
        return value.model_dump(mode="json", exclude_none=True)
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if hasattr(value, "tolist"):  # numpy's, which is not imported for this: commands are to answer at once
        return plain(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def as_json(result: Any) -> bytes:
    """A result as the text of a JSON file."""
    return (json.dumps(plain(result), indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()
