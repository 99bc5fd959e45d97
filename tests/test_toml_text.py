"""What is written as TOML is read back by Python's own reader as the very same values."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.config.door import read_toml
from experiments.config.setup import canonical_json
from experiments.config.toml_text import toml_text
from experiments.load import shipped_folder

texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
numbers = st.integers() | st.floats(allow_nan=False, allow_infinity=False)
scalars = texts | st.booleans() | numbers
values = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner, max_size=4),
    max_leaves=20,
)


@pytest.mark.slow
@given(st.dictionaries(texts, values, max_size=6))
def test_whatever_a_config_can_hold_is_read_back_as_it_was(table: dict[str, Any]) -> None:
    read = tomllib.loads(toml_text(table))
    assert read == table
    assert canonical_json(read) == canonical_json(table)  # 1 and 1.0, 0.0 and -0.0 are equal, but not the same


@pytest.mark.parametrize("name", sorted(path.name for path in shipped_folder().glob("*.toml")))
def test_a_shipped_config_is_read_back_as_it_was(name: str) -> None:
    table = read_toml(shipped_folder() / name)
    assert tomllib.loads(toml_text(table)) == table


def test_what_is_none_is_left_out() -> None:
    assert tomllib.loads(toml_text({"a": None, "b": {"c": None, "d": 1}, "e": [{"f": None}]})) == {
        "b": {"d": 1},
        "e": [{}],
    }


@pytest.mark.parametrize("value", [[None], {1, 2}, b"bytes", object()])
def test_what_toml_cannot_hold_is_refused(value: object) -> None:
    with pytest.raises(ValueError, match="cannot be written as TOML"):
        toml_text({"key": value})
