"""Roots of a step's series, by what their coefficients' sums say: exact sums of fractions are the judge."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from device.physics.equations import ORDER, StepSeries
from device.physics.polynomial import (
    bernstein_over,
    bracketed_root,
    falling_crossing,
    falls,
    sign_changes,
    value_at_end,
)

PARTS = [Fraction(k, 64) for k in range(65)]
fading = st.floats(0.05, 1.0)


@st.composite
def coefficients(draw: st.DrawFn) -> list[float]:
    """Of a series like a step's: each coefficient a part of the one before it, or none at all."""
    size, falling = 1.0, draw(fading)
    found = [draw(st.floats(0.01, 3.0))]
    for _ in range(ORDER):
        found.append(size * draw(st.floats(-1.0, 0.2)))
        size *= falling
    return found


def value(c: list[float], s: Fraction) -> Fraction:
    return sum((Fraction(c[n]) * s**n for n in range(ORDER + 1)), Fraction(0))


def slope(c: list[float], s: Fraction) -> Fraction:
    return sum((n * Fraction(c[n]) * s ** (n - 1) for n in range(1, ORDER + 1)), Fraction(0))


@pytest.mark.slow
@given(coefficients())
def test_what_is_said_to_fall_falls_everywhere(c: list[float]) -> None:
    assume(falls(c) > 0.0)
    assert max(slope(c, s) for s in PARTS) < Fraction(1, 10**12)


def test_a_parabola_that_only_just_turns_is_not_said_to_fall() -> None:
    for most in (0.499, 0.501):
        c = [1.0, -1.0, most] + [0.0] * (ORDER - 2)  # its slope at the end is 2 most - 1
        assert (falls(c) > 0.0) == (most < 0.5)


def test_what_is_no_number_is_not_said_to_fall() -> None:
    for n in range(1, ORDER + 1):
        c = [1.0] + [-1.0] * ORDER
        c[n] = math.nan
        assert not falls(c) > 0.0


@pytest.mark.slow
@given(coefficients())
def test_where_it_falls_the_root_is_that_of_the_search_in_the_bernstein_basis(c: list[float]) -> None:
    assume(falls(c) > 0.0)
    at = falling_crossing(c, 1.0)
    if value_at_end(c) > 0.0:
        assert at == 2.0
        return
    assert 0.0 < at <= 1.0
    series, rounding = StepSeries(), 1e-14 * sum(map(abs, c))
    series.other[:] = c
    bernstein_over(series, 0.0, 1.0)
    assert sign_changes(series.bernstein) <= 1
    for root in (at, bracketed_root(series, 0.0, 1.0)):
        assert abs(float(value(c, Fraction(root)))) <= rounding
