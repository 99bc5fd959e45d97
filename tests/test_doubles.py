"""Copied rows are found wherever they stand; people who only happen to agree, and made logs, are no copies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.logs.doubles import STRETCH, Double, ToldRows, doubles_among

ROWS = 60


def told(number: int, answer: np.ndarray, time_ms: np.ndarray) -> ToldRows:
    """A log of as many rows, asked one of two things in turn."""
    asked = np.arange(len(answer), dtype=np.uint64) % np.uint64(2) + np.uint64(1)
    return ToldRows(
        number=np.array([number]),
        rows=np.array([len(answer)]),
        asked=asked,
        answer=answer.astype(np.uint64) + np.uint64(1),
        time_ms=time_ms.astype(np.int64),
    )


def person(number: int, seed: int) -> ToldRows:
    """Somebody who is right in three of four trials, with times of half a second and more."""
    rng = np.random.default_rng(seed)
    return told(number, rng.random(ROWS) < 0.75, 500 + rng.gamma(2.0, 150.0, ROWS))


def untimed(one: ToldRows, number: int) -> ToldRows:
    return told(number, one.answer - np.uint64(1), np.full(ROWS, -1))


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_people_who_answer_by_themselves_are_no_doubles(seed: int) -> None:
    some = [person(number, seed + number) for number in range(8)]
    assert doubles_among(some, range(8)) == []
    assert doubles_among([untimed(one, number) for number, one in enumerate(some)], range(8)) == []


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32), here=st.integers(0, 25), there=st.integers(0, 25), count=st.integers(STRETCH, 30))
def test_a_stretch_of_rows_is_found_wherever_it_was_copied_to(seed: int, here: int, there: int, count: int) -> None:
    one, other = person(3, seed), person(5, seed + 1)
    there = there // 2 * 2 + here % 2  # what was asked is copied as well
    for name in ("answer", "time_ms"):
        getattr(other, name)[there : there + count] = getattr(one, name)[here : here + count]
    (found,) = doubles_among([one, other], [3, 5])
    assert (found.first, found.second, found.whole, found.timed) == (3, 5, False, True)
    assert found.at == (here + 1, there + 1)


def test_a_whole_log_is_found_without_times_and_of_several_each_once() -> None:
    one = person(0, 1)
    some = [untimed(one, number) for number in (0, 1, 2)]
    assert doubles_among(some, [0, 1, 2]) == [Double(first=0, second=n, whole=True, timed=False) for n in (1, 2)]


def test_logs_that_are_not_asked_for_are_not_looked_at() -> None:
    assert doubles_among([untimed(person(0, 1), number) for number in (0, 1)], [1]) == []


@pytest.mark.parametrize("often", [2, 3, 5, 6])
def test_a_log_that_is_written_several_times_over_is_found(often: int) -> None:
    one = person(0, 4)
    for written in (np.tile, np.repeat):
        cells = {name: written(getattr(one, name), often) for name in ("asked", "answer", "time_ms")}
        (found,) = doubles_among([ToldRows(number=one.number, rows=one.rows * often, **cells)], [0])
        assert (found.first, found.second) == (0, 0)


def test_people_who_are_always_right_agree_without_being_copies() -> None:
    right = np.arange(ROWS) % 2
    assert doubles_among([told(number, right, np.full(ROWS, -1)) for number in (0, 1)], [0, 1]) == []


def test_made_logs_with_times_in_equal_steps_are_no_copies() -> None:
    first_right = np.arange(ROWS) < 40
    times = 500 + 10 * np.arange(ROWS)
    assert doubles_among([told(number, first_right, times) for number in (0, 1)], [0, 1]) == []


@pytest.mark.parametrize("turns", [(0, 1), (0, 0, 1), (0, 0, 1, 1)])
def test_people_who_press_the_keys_in_turn_whatever_is_asked_are_no_copies(turns: tuple[int, ...]) -> None:
    asked = np.random.default_rng(5).integers(1, 7, ROWS).astype(np.uint64)
    some = [told(number, np.resize(turns, ROWS), np.full(ROWS, -1)) for number in (0, 1)]
    assert doubles_among([replace(one, asked=asked) for one in some], [0, 1]) == []


def test_people_who_answer_what_was_asked_the_trial_before_are_no_copies() -> None:
    asked = np.random.default_rng(6).integers(1, 7, ROWS).astype(np.uint64)
    late = np.append(0, asked[:-1] % np.uint64(2))
    some = [told(number, late, np.full(ROWS, -1)) for number in (0, 1)]
    assert doubles_among([replace(one, asked=asked) for one in some], [0, 1]) == []
