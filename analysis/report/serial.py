"""Results as JSON: the one place where a typed result becomes plain values."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any


def plain(value: Any) -> Any:
    """The value for JSON: results as objects, arrays as lists, what is not finite as null.

    >>> import numpy as np
    >>> plain({"a": np.array([1.0, np.nan]), "b": (True, None)})
    {'a': [1.0, None], 'b': [True, None]}
    """
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
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
