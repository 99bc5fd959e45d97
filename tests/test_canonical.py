import hashlib
import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.config.setup import canonical_json, sha256

words = st.text(st.characters(codec="utf-8"))
scalars = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | words
values = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(words, inner, max_size=4), max_leaves=12
)


@pytest.mark.slow
@settings(deadline=None)
@given(values)
def test_canonical_json_is_json_of_the_same_value(value: object) -> None:
    assert json.loads(canonical_json(value)) == value


@pytest.mark.slow
@settings(deadline=None)
@given(st.dictionaries(words, scalars, max_size=6), st.randoms(use_true_random=False))
def test_the_order_of_keys_does_not_matter(table: dict[str, object], random: object) -> None:
    keys = list(table)
    random.shuffle(keys)
    assert canonical_json({key: table[key] for key in keys}) == canonical_json(table)


@pytest.mark.slow
@settings(deadline=None)
@given(values)
def test_a_record_is_one_line(value: object) -> None:
    assert canonical_json(value).splitlines() == [canonical_json(value)]


def test_there_are_no_blanks_and_floats_are_the_shortest_that_read_back() -> None:
    assert canonical_json({"b": [1, 2.50], "a": 1e-7}) == b'{"a":1e-07,"b":[1,2.5]}'


def test_tuples_and_lists_are_the_same() -> None:
    assert canonical_json(((1, 2), 3)) == canonical_json([[1, 2], 3])


@pytest.mark.parametrize("value", [float("nan"), float("inf"), [1.0, -float("inf")], {"a": {"b": float("nan")}}])
def test_what_json_cannot_say_is_refused(value: object) -> None:
    with pytest.raises(ValueError, match="JSON compliant"):
        canonical_json(value)


def test_the_hash_is_that_of_sha256sum() -> None:
    # printf '{"a":1}' | sha256sum
    assert sha256({"a": 1}) == "015abd7f5cc57a2dd94b7590f04ad8084273905ee33ec5cebeae62276a97f862"
    assert sha256("é") == hashlib.sha256('"é"'.encode()).hexdigest()


def test_equal_numbers_of_different_type_have_different_hashes() -> None:
    assert len({sha256(1), sha256(1.0), sha256(True), sha256("1")}) == 4
