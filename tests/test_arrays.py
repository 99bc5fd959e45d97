"""What the door of the statistics takes, and what it says of the rest."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from analysis import rm_anova
from analysis.stats.arrays import numbers


def test_fractions_decimals_and_large_whole_numbers_are_read_as_the_nearest_doubles() -> None:
    found = numbers([Fraction(1, 3), Decimal("0.1"), 10**30, True, np.float32(0.5)], "scores")
    assert found.tolist() == [1 / 3, 0.1, 1e30, 1.0, 0.5]


def test_an_anova_of_decimals_is_that_of_their_doubles() -> None:
    table = [["1.1", "2.5"], ["2.2", "2.0"], ["0.3", "4.4"]]
    decimals = [[Decimal(cell) for cell in row] for row in table]
    assert rm_anova(decimals) == rm_anova([[float(cell) for cell in row] for row in table])


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ([Decimal("NaN")], "scores must be finite, but the value at index (0,) is nan"),
        ([1, Decimal("sNaN")], "but the value at index (1,) is Decimal('sNaN')"),
        ([Fraction(10**400)], "scores must be finite, but one is beyond the largest double"),
        ([1.0, None], "the value at index (1,) is None"),
        ([1.0, "7"], "the value at index (1,) is '7'"),
        ([1j], "the value at index (0,) is 1j"),
        ("abc", "scores must be numbers in a full rectangle, not 'abc'"),
    ],
)
def test_what_is_no_finite_number_is_refused_with_its_place(values: list[object], said: str) -> None:
    with pytest.raises(ValueError, match="scores must be") as error:
        numbers(values, "scores")  # type: ignore[arg-type]
    assert said in str(error.value)
