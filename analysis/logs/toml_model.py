"""TOML files checked by a pydantic model; every refusal names file, key, value and rule."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

SomeModel = TypeVar("SomeModel", bound=BaseModel)


class Model(BaseModel):
    """A table of a file: unknown keys refused, types as written, no infinities, never changed."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


def load_model(model: type[SomeModel], path: Path) -> SomeModel:
    """The file's content; `ValueError` with a line for every fault."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:  # not UTF-8, or not TOML
        raise ValueError(f"{path}: not a TOML file: {error}") from error
    try:
        # JSON on the way: strict types, while TOML's arrays may become tuples
        return model.model_validate_json(json.dumps(content, default=lambda value: {"date": str(value)}))
    except ValidationError as error:
        raise ValueError("\n".join(f"{path}: {_fault(fault)}" for fault in error.errors())) from error


def _fault(fault: Any) -> str:
    key = ".".join(str(part) for part in fault["loc"])
    if fault["type"] == "missing":
        return f"key {key} is missing (rule: it is required)"
    if fault["type"] == "extra_forbidden":
        return f"key {key} = {fault['input']!r} is unknown (rule: no other keys)"
    rule = fault["msg"].removeprefix("Value error, ")
    shown = f" = {fault['input']!r}" if isinstance(fault["input"], str | int | float | bool) else ""
    return f"key {key}{shown}: {rule}" if key else rule
