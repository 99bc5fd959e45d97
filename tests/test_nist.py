from __future__ import annotations

from fractions import Fraction

import pytest

from analysis import one_way_anova
from tests.exact import digits, exact_one_way_F
from tests.nist import FOLDER, NAMES, read

CEILINGS = dict(zip(NAMES, (10.15, 13.05, 15.0, 15.0, 15.0, 10.35, 10.15, 10.15, 4.35, 4.15, 4.15), strict=True))
"""Digits of the certified F that are left once the data are doubles, rounded down to half a tenth."""

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="this scipy comes without its test data")


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_F_has_fourteen_digits_of_the_exact_one_and_all_certified_ones_that_doubles_leave(name: str) -> None:
    groups, certified = read(name)
    F = one_way_anova(groups).F
    assert digits(F, exact_one_way_F(groups)) >= 14
    assert digits(F, Fraction(certified)) >= CEILINGS[name]
