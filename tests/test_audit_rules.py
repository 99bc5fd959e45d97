"""The rules below the checks: how numbers print, how verdicts follow, and what the searches prove."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations_with_replacement

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.paper.audit.binomial import binomial_p
from analysis.paper.audit.freedom import Term, total
from analysis.paper.audit.lattices import (
    BudgetError,
    effect,
    find_groups,
    find_rows,
    numbers_with_sums,
    ratio,
    search_rows,
    within_rows,
)
from analysis.paper.audit.means import grim, grimmer
from analysis.paper.audit.p_values import Statistic, p_against_statistic, p_bounds
from analysis.paper.audit.printed import (
    NONE_EXISTS,
    UNKNOWN,
    DataExistence,
    Interval,
    Rounding,
    decimal,
    judge_readings,
    read_printed,
)
from analysis.paper.audit.variance_ratios import between_f, repeated_f
from tests.exact import exact_rm_F


@pytest.mark.parametrize(
    ("text", "rounding", "inside", "outside"),
    [
        ("1.62", Rounding.HALF_UP, "1.615", "1.625"),
        ("1.62", Rounding.HALF_EVEN, "1.625", "1.626"),
        ("1.63", Rounding.HALF_EVEN, "1.626", "1.625"),
        ("1.62", Rounding.HALF_DOWN, "1.625", "1.615"),
        ("1.62", Rounding.TRUNCATION, "1.6299", "1.6199"),
        ("-1.62", Rounding.HALF_UP, "-1.615", "-1.625"),
        ("0.0", Rounding.TRUNCATION, "-0.09", "0.1"),
        ("50%", Rounding.HALF_UP, "0.495", "0.505"),
        ("< .001", Rounding.HALF_UP, "0.00099", "0.001"),
        (">= 2", Rounding.TRUNCATION, "2", "1.99"),
    ],
)
def test_a_printed_number_stands_for_what_prints_so(text: str, rounding: Rounding, inside: str, outside: str) -> None:
    interval = read_printed(text).interval(rounding)
    assert interval.holds(Fraction(inside))
    assert not interval.holds(Fraction(outside))


@pytest.mark.slow
@given(st.fractions(min_value=-9, max_value=9, max_denominator=999), st.integers(0, 3))
def test_the_mixed_interval_holds_what_any_rounding_prints(value: Fraction, digits: int) -> None:
    cut = int(value * 10**digits)
    for units in (cut - 1, cut, cut + 1):
        number = read_printed(f"{'-' if units < 0 else ''}{decimal(Fraction(abs(units), 10**digits))}")
        held = [number.interval(r).holds(value) for r in Rounding if r is not Rounding.ANY]
        assert not any(held) or number.interval(Rounding.ANY).holds(value)


@pytest.mark.parametrize("text", ["", "%", "1.2.3", "abc", "1e5", "< "])
def test_what_is_no_number_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="no printed number"):
        read_printed(text)


def test_integers_within_an_interval_respect_open_ends() -> None:
    assert list(Interval(Fraction(1), Fraction(3), False, False).integers()) == [2]
    assert list(Interval(Fraction(5, 2), Fraction(3)).integers()) == [3]
    assert list(Interval(Fraction(3), Fraction(2)).integers()) == []


def test_verdicts_follow_from_attempts() -> None:
    def under(*roundings: Rounding) -> object:
        return lambda r: DataExistence(True) if r in {*roundings, Rounding.ANY} else NONE_EXISTS

    both = under(Rounding.HALF_UP, Rounding.HALF_EVEN)
    assert (judge_readings(both).verdict, judge_readings(both).rounding) == ("attainable", "")  # type: ignore[arg-type]
    alone = judge_readings(under(Rounding.HALF_EVEN))  # type: ignore[arg-type]
    assert (alone.verdict, alone.rounding) == ("attainable", "rounding half to even")
    assert judge_readings(under(Rounding.TRUNCATION)).readings == ("truncation",)  # type: ignore[arg-type]
    assert judge_readings(under()).readings == ("roundings mixed",)  # type: ignore[arg-type]
    assert judge_readings(lambda _: NONE_EXISTS).verdict == "not attainable"
    assert judge_readings(lambda _: NONE_EXISTS, [("other", both)]).readings == ("other",)  # type: ignore[list-item]
    assert judge_readings(lambda _: NONE_EXISTS, [("other", lambda _: UNKNOWN)]).verdict == "undecided"
    assert judge_readings(lambda _: UNKNOWN, [("other", both)]).verdict == "undecided"  # type: ignore[list-item]


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_the_search_for_sums_is_complete(n: int) -> None:
    data = list(combinations_with_replacement(range(-3, 5), n))
    every = {(sum(values), sum(v * v for v in values)) for values in data}
    for sums in range(-3 * n - 1, 4 * n + 2):
        for squares in range(16 * n + 2):
            found = numbers_with_sums(n, sums, squares, -3, 4)
            assert (found is not None) == ((sums, squares) in every)
            assert found is None or (sum(found), sum(v * v for v in found)) == (sums, squares)


def test_a_search_that_runs_out_says_so() -> None:
    with pytest.raises(BudgetError):
        numbers_with_sums(4, 2, 4 * 7 * 1024 + 2, budget=0)


def test_the_identity_of_the_repeated_lattice_holds() -> None:
    rows = ((1, 3, 4), (0, 5, 2), (2, 2, 6))
    columns = tuple(map(sum, zip(*rows, strict=True)))
    assert (columns, effect(columns), within_rows(rows)) == ((3, 10, 12), 134, 84)  # by hand
    assert ratio(columns, within_rows(rows), 3) == exact_rm_F(np.array(rows, dtype=float))


def test_rows_found_have_the_sums_asked_for() -> None:
    rows = search_rows((78, 111, 130), 14, range(432, 433), 10)
    assert rows is not None
    assert tuple(map(sum, zip(*rows, strict=True))) == (78, 111, 130)
    assert within_rows(rows) == 432
    assert find_rows((3, 3), 2, range(1, 2), 2) is False  # W is even with T


def test_groups_beyond_enumeration_are_found_too() -> None:
    groups = find_groups((1500, 900), (30, 30), range(112_000, 112_001, 2), 100)
    assert isinstance(groups, tuple)
    assert ([sum(g) for g in groups], sum(v * v for g in groups for v in g)) == ([1500, 900], 112_000)


def test_p_bounds_hold_the_value_and_are_narrow() -> None:
    low, high = p_bounds("t", Fraction(11, 5), [Fraction(28)], "two-sided")
    assert low < Fraction("0.0362") + Fraction(1, 10**4)
    assert 0 < high - low < Fraction(1, 10**9)
    assert p_bounds("z", Fraction(0), [], "one-sided") == (Fraction(1, 2), Fraction(1, 2))
    assert p_bounds("r", Fraction(2), [Fraction(5)], "two-sided")[0] == 0


@pytest.mark.parametrize(
    ("statistic", "value", "df", "p", "rule"),
    [
        ("F", "-2.20", ["2", "28"], ".13", "F is never below 0"),
        ("F", "-0.01", ["2", "28"], "> .90", "F is never below 0"),
        ("chi2", "-3.84", ["1"], ".05", "chi-squared is never below 0"),
        ("Q", "-3.84", ["1"], ".05", "Q is never below 0"),
        ("q", "-3.84", ["3", "26"], ".05", "q is never below 0"),
        ("r", "1.2", ["10"], "< .001", "a correlation lies between -1 and 1"),
        ("r", "-1.01", ["10"], "< .001", "a correlation lies between -1 and 1"),
    ],
)
def test_a_statistic_that_cannot_be_is_not_attainable_whatever_its_p(
    statistic: Statistic, value: str, df: list[str], p: str, rule: str
) -> None:
    result = p_against_statistic(statistic, value, df, p)
    assert (result.verdict, result.reason) == ("not attainable", rule)


@pytest.mark.parametrize(
    ("statistic", "value", "df", "p"),
    [
        ("F", "-0.00", ["2", "28"], "> .90"),
        ("chi2", "0.00", ["1"], "> .90"),
        ("r", "1.00", ["10"], "< .001"),
        ("r", "-1.0", ["10"], "< .001"),
        ("t", "-2.20", ["28"], ".036"),
    ],
)
def test_a_statistic_that_prints_so_can_be(statistic: Statistic, value: str, df: list[str], p: str) -> None:
    assert p_against_statistic(statistic, value, df, p).verdict == "attainable"


def test_sides_are_said_of_the_statistics_that_have_two() -> None:
    assert p_against_statistic("t", "2.20", ["28"], ".036").reason.endswith(", two-sided")
    assert p_against_statistic("t", "2.20", ["28"], ".018", sides="one-sided").reason.endswith(", one-sided")
    for statistic, df in (("F", ["2", "28"]), ("chi2", ["1"]), ("Q", ["1"]), ("q", ["3", "26"])):
        assert "sided" not in p_against_statistic(statistic, "2.20", df, ".13").reason  # type: ignore[arg-type]


def test_totals_take_the_rounding_of_their_parts() -> None:
    assert total("10.0", [Term(times=["3.3"]), Term(times=["6.8"])]).verdict == "attainable"  # 3.25 + 6.75
    assert total("10.4", [Term(times=["3.3"]), Term(times=["6.8"])]).verdict == "not attainable"
    assert total("30", [Term(times=[9, 20], over=[60])], "at least").verdict == "attainable"
    assert total("2", [Term(times=[9, 20], over=[60])], "at least").verdict == "not attainable"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: repeated_f("3.2", 1, 3), "n - 1"),
        (lambda: repeated_f("< 3", 5, 3), "F must be a number"),
        (lambda: repeated_f("3.2", 5, 3, ["1"]), "3 means are needed"),
        (lambda: repeated_f("3.2", 5, 2, ["1", "2"], low="0"), "both ends"),
        (lambda: repeated_f("3.2", 5, 2, ["1", "2"], transforms=["arcsine"]), "scale with both ends"),
        (lambda: between_f("3.2", [5]), "groups"),
        (lambda: grimmer("1.0", "1.0", 1), "n - 1"),
        (lambda: grimmer("1.0", "1.0", 5, low="1", high="2.5"), "whole number of steps"),
        (lambda: binomial_p("0.1", 5, chance="1"), "chance"),
        (lambda: binomial_p("0.1", 5, chance="1/0"), "chance"),
        (lambda: binomial_p("0.1", 5, chance="1e-999999999"), "chance"),
        (lambda: binomial_p("0.1", 1_000_001), "at most 1,000,000"),
        (lambda: grim("3.47", 10**9), "at most 1,000,000"),
        (lambda: grim("3,47", 23), r"a comma\? write '3.47'"),
        (lambda: grim("1,234.5", 23), "no mark between thousands"),
        (lambda: grim("9" * 5_000, 23), "at most 40 characters, not 5000"),
        (lambda: binomial_p("0.1", 5, counts=[6]), "counts"),
        (lambda: p_against_statistic("t", "< 2", ["3"], ".1"), "not the bound"),
        (lambda: p_against_statistic("t", "2", [], ".1"), "degrees of freedom"),
        (lambda: p_against_statistic("t", "2", ["< 28"], ".1"), "'< 28' is a bound"),
        (lambda: p_against_statistic("t", "2", ["28%"], ".1"), "'28%' is a percentage"),
        (lambda: p_against_statistic("F", "2", ["1", "28"], ".1", sides="one-sided"), "not F: leave it out"),
        (lambda: total("3", []), "at least one term"),
        (lambda: total("3", [Term(times=[1], over=[0])]), "may be 0"),
    ],
)
def test_numbers_that_make_no_claim_are_refused(call: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()  # type: ignore[operator]
