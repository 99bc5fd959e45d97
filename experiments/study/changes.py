"""What differs between configs as they were recorded and as they are: the keys of their files, with both values.

A record of a design, a gun or a study has all their keys, with their defaults. A key that it lacks was unknown to the
version of Recoil that wrote it: it stands for its default, which means what that version did. A key that this version
does not know is a change. So hashes can say that two records are the same, but for the order of
factors and questions, and not that something was changed.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence

from pydantic import JsonValue, ValidationError

from device.messages import first_few
from experiments.config.door import Model
from experiments.config.setup import GunConfig, Setup, orders_of, sha256
from experiments.design.config import DesignConfig
from experiments.synthetic.laws import SyntheticAnswers

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_TOLD = 5
"""So many keys are told."""
FileValues = Mapping[str, JsonValue]
Files = Mapping[str, FileValues]
"""The files of a study, by their place beside `study.toml`, as plain values."""
_OF_SETUP: dict[str, type[Model]] = {"experiment": DesignConfig, "gun": GunConfig, "synthetic": SyntheticAnswers}
"""The parts of a setup, as the head of a journal names them; the last where synthetic people are compared."""


class KeyChange(Model):
    """A key of a file that differs: what was frozen and what it is now; `None` where there is nothing.

    Of a file that is new or gone there is neither: it is one change, whose `key` says which.
    """

    file: str
    key: str
    frozen: JsonValue
    now: JsonValue

    @property
    def is_whole_file(self) -> bool:
        """Is the file itself new or gone?"""
        return self.frozen is None and self.now is None

    def __str__(self) -> str:
        if self.is_whole_file:
            return f"{self.file}: {self.key}"
        return f"{self.file}: {self.key}: frozen {plain_value(self.frozen)}, now {plain_value(self.now)}"


def plain_value(value: JsonValue) -> str:
    """A value as people read it.

    >>> plain_value(None), plain_value("random"), plain_value([1, True])
    ('none', '"random"', '[1, true]')
    """
    return "none" if value is None else json.dumps(value, ensure_ascii=False)


def changed_keys(
    file: str, frozen: FileValues, now: FileValues, model: type[Model] | None = None
) -> Iterator[KeyChange]:
    """The keys of one file that differ, and the tables whose names stand in another order.

    `model`: what it is read as, if its defaults are recorded.
    """
    frozen, now = (_of_people(model, values) for values in (frozen, now))
    before, after = (dict(_leaves(without_reasons(values))) for values in (frozen, now))
    if model is not None and before.keys() != after.keys():
        before, after = _with_defaults(model, frozen), _with_defaults(model, now)
    for key in dict.fromkeys([*before, *after]):
        if before.get(key) != after.get(key) or isinstance(before.get(key), bool) != isinstance(after.get(key), bool):
            yield KeyChange(file=file, key=key, frozen=before.get(key), now=after.get(key))
    was, is_now = orders_of(frozen), orders_of(now)
    for table in was.keys() & is_now.keys():
        if was[table] != is_now[table] and sorted(was[table]) == sorted(is_now[table]):
            yield KeyChange(file=file, key=table, frozen=[*was[table]], now=[*is_now[table]])


def _of_people(model: type[Model] | None, values: FileValues) -> FileValues:
    """A design without the file of its synthetic participants, whose answers are no part of what people do."""
    return {key: value for key, value in values.items() if model is not DesignConfig or key != "synthetic"}


def _with_defaults(model: type[Model], recorded: FileValues) -> dict[str, JsonValue]:
    """What was recorded by dotted keys, and for what it lacks this version's defaults.

    It stands as it is where this version refuses a value of it.
    """
    try:
        read = model.model_validate_json(json.dumps(recorded), extra="ignore")
    except ValidationError:
        return dict(_leaves(recorded))
    return {**dict(_leaves(read.model_dump(mode="json"))), **dict(_leaves(recorded))}


def setup_changes(before: object, after: object, files: Sequence[str] = (*_OF_SETUP,)) -> list[KeyChange]:
    """The keys that differ between two setups as journals hold them; `files`: what their first parts are called."""
    return [
        change
        for file, (part, model) in zip(files, _OF_SETUP.items(), strict=False)
        for change in changed_keys(file, table_in(before, part), table_in(after, part), model)
    ]


def people_changes(began: object, setup: Setup[DesignConfig]) -> list[KeyChange]:
    """The keys that differ of how synthetic people answer: as a journal's head holds it, if it does, and in a setup."""
    if not isinstance(began, Mapping):
        return []
    now = {} if setup.laws is None else setup.laws.model_dump(mode="json")
    return [*changed_keys(str(setup.config.synthetic), began, now, SyntheticAnswers)]


def changes_told(changes: Sequence[KeyChange]) -> str:
    """What is not as a run began with it, in words."""
    told = [f"{one.file}: {one.key} ({plain_value(one.frozen)}, now {plain_value(one.now)})" for one in changes]
    return first_few(told, _TOLD)


def setup_key(setup: object) -> str:
    """What setups share between which nothing differs, by whichever version they were recorded."""
    tables = [(model, _of_people(model, table_in(setup, part))) for part, model in _OF_SETUP.items()]
    parts = [_with_defaults(model, table) for model, table in tables]
    known = [{key: value for key, value in part.items() if value is not None} for part in parts]
    return sha256([known, [orders_of(table) for _, table in tables]])


def table_in(found: object, key: str) -> FileValues:
    """A table of what was recorded; empty if there is none."""
    inner = found.get(key) if isinstance(found, Mapping) else None
    return inner if isinstance(inner, Mapping) else {}


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
