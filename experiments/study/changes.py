"""What differs between configs as they were recorded and as they are: the keys of their files, with both values."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping

from pydantic import JsonValue

from experiments.config.door import Model

_BARE = re.compile(r"[A-Za-z0-9_-]+")
FileValues = Mapping[str, JsonValue]
Files = Mapping[str, FileValues]
"""The files of a study, by their place beside `study.toml`, as plain values."""


class KeyChange(Model):
    """A key of a file that differs: what was frozen and what it is now; `None` where there is nothing."""

    file: str
    key: str
    frozen: JsonValue
    now: JsonValue

    def __str__(self) -> str:
        return f"{self.file}: {self.key}: frozen {plain_value(self.frozen)}, now {plain_value(self.now)}"


def plain_value(value: JsonValue) -> str:
    """A value as people read it.

    >>> plain_value(None), plain_value("random"), plain_value([1, True])
    ('none', '"random"', '[1, true]')
    """
    return "none" if value is None else json.dumps(value, ensure_ascii=False)


def changed_keys(file: str, frozen: FileValues, now: FileValues) -> Iterator[KeyChange]:
    """The keys of one file that differ."""
    before, after = (dict(_leaves(without_reasons(values))) for values in (frozen, now))
    for key in dict.fromkeys([*before, *after]):
        if before.get(key) != after.get(key) or isinstance(before.get(key), bool) != isinstance(after.get(key), bool):
            yield KeyChange(file=file, key=key, frozen=before.get(key), now=after.get(key))


def _leaves(value: JsonValue | FileValues, key: str = "") -> Iterator[tuple[str, JsonValue]]:
    """Dotted keys with what is no table; the tables of a list are numbered from 0, as everywhere."""
    if isinstance(value, list) and any(isinstance(one, dict) for one in value):
        value = {str(number): one for number, one in enumerate(value)}
    if not isinstance(value, Mapping):
        yield key, value
        return
    for name, inner in value.items():
        part = name if _BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)
        yield from _leaves(inner, f"{key}.{part}" if key else part)


def without_reasons(values: FileValues) -> FileValues:
    """The values of a file without why people are excluded by code."""
    listed = values.get("excluded")
    return {**values, "excluded": [_without_reason(one) for one in listed]} if isinstance(listed, list) else values


def _without_reason(entry: JsonValue) -> JsonValue:
    return {key: value for key, value in entry.items() if key != "reason"} if isinstance(entry, dict) else entry
