from collections import Counter
from itertools import pairwise, permutations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.design.plan import square_rows
from experiments.study.balance import least_used

COUNTS = range(2, 9)
SQUARES = ("latin-square", "williams")


@pytest.mark.parametrize("count", [1, *COUNTS, 26])
def test_a_latin_square_has_each_method_once_at_each_place(count: int) -> None:
    square = square_rows("latin-square", count)
    assert len(square) == count
    for line in [*square, *zip(*square, strict=True)]:
        assert sorted(line) == list(range(count))


@pytest.mark.parametrize("count", COUNTS)
def test_williams_has_each_method_equally_often_at_each_place(count: int) -> None:
    square = square_rows("williams", count)
    times = 2 if count % 2 else 1
    assert len(square) == times * count
    for place in zip(*square, strict=True):
        assert Counter(place) == dict.fromkeys(range(count), times)


@pytest.mark.parametrize("count", COUNTS)
def test_williams_has_each_ordered_pair_of_neighbours_equally_often(count: int) -> None:
    pairs = Counter(pair for row in square_rows("williams", count) for pair in pairwise(row))
    assert pairs == dict.fromkeys(permutations(range(count), 2), 2 if count % 2 else 1)


@pytest.mark.parametrize("count", COUNTS)
def test_every_row_of_a_square_is_a_permutation(count: int) -> None:
    for order in SQUARES:
        assert all(sorted(row) == list(range(count)) for row in square_rows(order, count))


def test_a_random_order_has_no_rows() -> None:
    assert square_rows("random", 3) == []


def test_the_first_participants_take_the_rows_in_turn() -> None:
    used: list[int] = []
    for _ in range(12):
        used.append(least_used(6, used))
    assert used == [*range(6), *range(6)]


@pytest.mark.slow
@settings(deadline=None)
@given(st.sampled_from(SQUARES), st.integers(2, 8), st.lists(st.none() | st.integers(0, 99), max_size=60))
def test_counts_stay_within_one_after_any_drop_outs(order: str, count: int, events: list[int | None]) -> None:
    # None: someone comes and takes a row; a number: who took that row drops out and it is free again
    used: list[int] = []
    for event in events:
        if event is None:
            used.append(least_used(len(square_rows(order, count)), used))
        elif used:
            used.pop(event % len(used))
    for _ in range(len(used) + 2 * len(square_rows(order, count))):
        used.append(least_used(len(square_rows(order, count)), used))
    times = Counter(used)
    assert len(times) == len(square_rows(order, count))
    assert max(times.values()) - min(times.values()) <= 1


@pytest.mark.slow
@settings(deadline=None)
@given(st.sampled_from(SQUARES), st.integers(2, 8), st.integers(0, 200))
def test_without_drop_outs_counts_differ_by_one_at_most_at_any_time(order: str, count: int, people: int) -> None:
    used: list[int] = []
    for _ in range(people):
        used.append(least_used(len(square_rows(order, count)), used))
    times = [used.count(row) for row in range(len(square_rows(order, count)))]
    assert max(times) - min(times) <= 1


@pytest.mark.slow
@settings(deadline=None)
@given(st.sampled_from(SQUARES), st.integers(2, 8), st.lists(st.integers(0, 15), max_size=40))
def test_the_next_row_is_one_that_no_other_was_used_less_than(order: str, count: int, taken: list[int]) -> None:
    square = square_rows(order, count)
    used = [row % len(square) for row in taken]
    row = least_used(len(square), used)
    assert used.count(row) == min(used.count(other) for other in range(len(square)))
