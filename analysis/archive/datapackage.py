"""The tables of an archive as a Frictionless data package: every column with its type, range and meaning. Pure.

Reference: Data Package and Table Schema, version 1, https://specs.frictionlessdata.io
"""

from __future__ import annotations

import csv
import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from analysis.archive.bids import NOT_AVAILABLE, PARTICIPANT_COLUMNS, json_bytes
from experiments.design.units import long_name
from experiments.record.tables import MISSING, Column, guard

DESCRIPTOR = "datapackage.json"
_TYPES = {"integer": "integer", "number": "number", "flag": "boolean", "text": "string", "level": "string"}
_CODES = frozenset(["study", "participant_id"])
"""Columns that hold text, also where it looks like numbers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Resource:
    """A table: its path in the package, its bytes, what it is, and the path of its schema there."""

    path: str
    data: bytes
    title: str
    schema: str


def schema(columns: Iterable[Column], keys: Sequence[str] = ()) -> bytes:
    """The Table Schema of a log's columns; `keys` are those that no two rows share."""
    found: dict[str, object] = {"fields": [_field(column) for column in columns], "missingValues": [MISSING]}
    return json_bytes(found | ({"primaryKey": [*keys]} if keys else {}))


def _field(column: Column) -> dict[str, object]:
    field: dict[str, object] = {
        "name": column.name,
        "title": long_name(column.name),
        "type": _TYPES[column.type],
        "description": column.description,
    }
    if column.unit:
        field["unit"] = column.unit
    if column.type == "flag":
        return field | {"trueValues": ["1"], "falseValues": ["0"]}
    limits = {"required": column.required or None, "enum": [guard(level) for level in column.levels] or None}
    bounds = {"minimum": column.least, "maximum": column.most}
    whole = column.type == "integer"
    rules = {key: int(value) if whole else value for key, value in bounds.items() if value is not None}
    constraints = {key: value for key, value in limits.items() if value is not None} | rules
    return field | ({"constraints": constraints} if constraints else {})


def schema_of_results(data: bytes) -> bytes:
    """The Table Schema of a table of results: a column whose cells are all numbers, or empty, holds numbers."""
    header, *rows = csv.reader(data.decode().splitlines())
    fields = [
        {"name": name, "title": long_name(name), "type": _type_of(name, [row[place] for row in rows])}
        for place, name in enumerate(header)
    ]
    return json_bytes({"fields": fields, "missingValues": [MISSING]})


def _type_of(name: str, cells: Sequence[str]) -> str:
    return "string" if name in _CODES or not all(map(_is_number, filter(None, cells))) else "number"


def _is_number(cell: str) -> bool:
    return re.fullmatch(r"[+-]?\d+(\.\d*)?(e[+-]?\d+)?", cell) is not None


def schema_of_participants(header: Sequence[str]) -> bytes:
    """The Table Schema of the table of participants in the BIDS data set."""
    fields = [
        {
            "name": name,
            "title": PARTICIPANT_COLUMNS[name]["LongName"],
            "type": "integer" if name == "age" else "string",
            "description": PARTICIPANT_COLUMNS[name]["Description"],
        }
        for name in header
    ]
    return json_bytes({"fields": fields, "missingValues": [NOT_AVAILABLE], "primaryKey": "participant_id"})


def descriptor(title: str, version: str, resources: Iterable[Resource]) -> bytes:
    """The package's `datapackage.json`."""
    return json_bytes(
        {
            "name": slug(title),
            "title": title,
            "profile": "tabular-data-package",
            "description": f"Written by Recoil {version} (`recoil export archive`); README.md says what is in it.",
            "resources": [_resource(one) for one in resources],
        }
    )


def _resource(one: Resource) -> Mapping[str, object]:
    delimiter = "\t" if one.path.endswith(".tsv") else ","
    return {
        "name": slug(one.path.rpartition(".")[0]),
        "title": one.title,
        "path": one.path,
        "profile": "tabular-data-resource",
        "scheme": "file",
        "format": one.path.rpartition(".")[2],
        "mediatype": "text/tab-separated-values" if delimiter == "\t" else "text/csv",
        "encoding": "utf-8",
        "bytes": len(one.data),
        "hash": f"sha256:{hashlib.sha256(one.data).hexdigest()}",
        "dialect": {"delimiter": delimiter, "quoteChar": '"', "doubleQuote": True, "skipInitialSpace": False},
        "schema": one.schema,
    }


def slug(text: str) -> str:
    """A name as packages have them.

    >>> slug("Recoil: direction & preference")
    'recoil-direction-preference'
    """
    return re.sub(r"[^a-z0-9_]+", "-", text.lower()).strip("-") or "study"
