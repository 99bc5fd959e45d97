"""The JSON Schema of `statistics.json`, from the dataclasses that are written to it, and its page."""

from __future__ import annotations

import inspect
import json
import types
import typing
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from analysis.logs.exclusion_rules import KeptTrials
from analysis.summary.question_results import QuestionSummary
from analysis.summary.remarks_coding import CodedRemarks
from analysis.summary.requests import Requested
from analysis.summary.results import StudyStatistics

SELDOM = {one.__name__: one for one in (CodedRemarks, KeptTrials, QuestionSummary, Requested)}
"""What statistics name and import only where something was asked for."""

NULL = {"type": "null"}
PLAIN = {str: {"type": "string"}, int: {"type": "integer"}, bool: {"type": "boolean"}, type(None): NULL}
NUMBER = {"type": ["number", "null"]}
"""A number that is not finite is written as null."""
HEAD = """# statistics.json

What `recoil analyze` writes for programs. Nothing is rounded; rates are 0 to 1, times in s, SDs with n − 1. p of t, z,
signed-rank and binomial tests are two-sided unless it is said otherwise. A number that is not defined is `null`, and a
line of `warnings` or a `reason` beside it says why. A key that may be missing is marked. The same as a file:
{download}`statistics.schema.json <statistics.schema.json>` (JSON Schema, draft 2020-12).
Every `statistics.json` that these pages make is held against it.

A design other than `direction` and `preference` stands under its own name, as a `DesignSummary`.

"""


class _Schema:
    """Schemas of types; dataclasses go to `definitions`."""

    def __init__(self) -> None:
        self.definitions: dict[str, Any] = {}

    def of(self, kind: Any) -> dict[str, Any]:
        """The schema of a type as it is written."""
        origin, inner = typing.get_origin(kind), typing.get_args(kind)
        if isinstance(kind, type) and is_dataclass(kind):
            return self._reference(kind)
        if origin in (typing.Union, types.UnionType):
            return self._one_of([self.of(one) for one in inner])
        if origin is typing.Literal:
            return {"enum": list(inner)}
        if origin is typing.Annotated:
            return self.of(inner[0])
        if origin is tuple:
            return self._tuple(inner)
        if isinstance(origin, type) and issubclass(origin, Mapping):
            return {"type": "object", "additionalProperties": self.of(inner[1])}
        return NUMBER if kind is float else PLAIN.get(kind, {})

    def _tuple(self, inner: tuple[Any, ...]) -> dict[str, Any]:
        if len(inner) == 2 and inner[1] is Ellipsis:
            return {"type": "array", "items": self.of(inner[0])}
        return {"type": "array", "prefixItems": [self.of(one) for one in inner], "items": False}

    def _one_of(self, several: list[dict[str, Any]]) -> dict[str, Any]:
        distinct = [one for i, one in enumerate(several) if one not in several[:i]]
        if NUMBER in distinct and NULL in distinct:
            distinct.remove(NULL)
        return distinct[0] if len(distinct) == 1 else {"anyOf": distinct}

    def _reference(self, kind: type) -> dict[str, Any]:
        if kind.__name__ not in self.definitions:
            self.definitions[kind.__name__] = {}
            self.definitions[kind.__name__] = self.object(kind)
        return {"$ref": f"#/$defs/{kind.__name__}"}

    def object(self, kind: type) -> dict[str, Any]:
        """A dataclass as an object."""
        properties: dict[str, Any] = {}
        required: list[str] = []
        others: Any = False
        for name, schema, needed in self._members(kind):
            if name == "*":
                others = schema
                continue
            properties[name] = schema
            required += [name] if needed else []
        return {
            "type": "object",
            "description": inspect.cleandoc(kind.__doc__ or "").replace("\n", " "),
            "properties": properties,
            "required": required,
            "additionalProperties": others,
        }

    def _members(self, kind: type) -> Iterator[tuple[str, dict[str, Any], bool]]:
        """Name, schema and whether it is always there; `*` for what stands under names of its own."""
        hints = typing.get_type_hints(kind, localns=SELDOM, include_extras=True)
        for field in fields(kind):
            schema, inner = self.of(hints[field.name]), field.metadata.get("beside")
            if field.metadata.get("unwritten"):
                continue
            if field.metadata.get("spread"):
                yield "*", schema["additionalProperties"], False
            elif inner is not None:
                may_miss = type(None) in typing.get_args(hints[field.name])
                for name, one, needed in self._members(inner):
                    yield name, self._one_of([one, NULL]) if may_miss else one, needed
            elif field.metadata.get("how"):
                yield field.metadata.get("name", field.name), {}, True
            else:
                yield field.name, schema, not field.metadata.get("optional")


def schema() -> dict[str, Any]:
    """The whole schema."""
    made = _Schema()
    top = made.object(StudyStatistics)
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Recoil: statistics.json"}
    return head | top | {"$defs": made.definitions | {StudyStatistics.__name__: top}}


def text() -> str:
    """The schema as the text of its file."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


def page() -> str:
    """The schema to read: a table of keys for the file and each object in it."""
    found = schema()
    parts = {"Top of the file": found} | {f"`{name}`": one for name, one in sorted(found["$defs"].items())}
    del parts[f"`{StudyStatistics.__name__}`"]
    return HEAD + "\n".join(f"## {name}\n\n{one['description']}\n\n{_keys(one)}" for name, one in parts.items())


def _keys(part: Mapping[str, Any]) -> str:
    rows = "".join(
        f"| `{name}` | {_words(one)} | {'' if name in part['required'] else 'may be missing'} |\n"
        for name, one in part["properties"].items()
    )
    return f"| key | what stands there | |\n| --- | --- | --- |\n{rows}"


def _words(one: Mapping[str, Any]) -> str:
    """A schema in a few words."""
    if "$ref" in one:
        return f"`{one['$ref'].rpartition('/')[2]}`"
    if "anyOf" in one:
        return " or ".join(map(_words, one["anyOf"]))
    if "enum" in one:
        return ", ".join(f"`{value}`" for value in one["enum"])
    kind = one.get("type")
    if kind == "array":
        items = one["items"]
        return f"list of {_words(items)}" if items else f"[{', '.join(map(_words, one['prefixItems']))}]"
    if kind == "object":
        return f"by name: {_words(one['additionalProperties'])}"
    return {"string": "text", "integer": "whole number", "null": "null", "boolean": "true, false"}.get(
        str(kind), "number" if kind else "any"
    )
