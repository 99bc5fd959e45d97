"""Every check of the audit against brute force: `tests/brute_force.py` says how."""

from __future__ import annotations

from fractions import Fraction

import pytest

from analysis.paper.audit.tukey_pattern import ClaimedComparison, tukey_pattern
from tests import brute_force as brute

pytestmark = pytest.mark.slow


def test_grim_says_what_enumeration_says() -> None:
    assert brute.compared(brute.grim_cases(range(1, 40, 3), 2, 2)) > 1_000


def test_percentages_say_what_enumeration_says() -> None:
    assert brute.compared(brute.percent_cases((1, 2, 9), 0)) > 1_000
    assert brute.compared(brute.percent_cases((3,), 1)) > 4_000


@pytest.mark.parametrize(("n", "top", "digits"), [(2, 4, (1, 1)), (3, 4, (1, 2)), (4, 3, (2, 1)), (5, 4, (1, 1))])
def test_grimmer_says_what_enumeration_says(n: int, top: int, digits: tuple[int, int]) -> None:
    assert brute.compared(brute.grimmer_cases(n, top, digits, 61)) > 25


@pytest.mark.parametrize("n", [2, 3, 4])
def test_grimmer_without_a_scale_says_what_enumeration_says(n: int) -> None:
    assert brute.compared(brute.unbounded_grimmer_cases(n, 37)) > 80


def test_debit_says_what_enumeration_says() -> None:
    assert brute.compared(brute.debit_cases((2, 3, 8), 1)) > 300
    assert brute.compared(brute.debit_cases((3,), 2, 15)) > 500


@pytest.mark.parametrize("chance", [Fraction(1, 2), Fraction(1, 3)])
def test_binomial_p_says_what_enumeration_says(chance: Fraction) -> None:
    assert brute.compared(brute.binomial_cases((1, 4, 9), chance, 2)) > 300


@pytest.mark.parametrize(("n", "k", "top", "every"), [(3, 2, 3, 197), (2, 3, 2, 397), (3, 3, 1, 83), (4, 2, 2, 119)])
def test_repeated_f_says_what_enumeration_says(n: int, k: int, top: int, every: int) -> None:
    assert brute.compared(brute.repeated_cases(n, k, top, 1, every)) > 100


def test_between_f_says_what_enumeration_says() -> None:
    assert brute.compared(brute.between_cases((3, 2), 3, 109)) > 150
    assert brute.compared(brute.between_cases((2, 2, 1), 2, 197)) > 100


def test_p_says_what_mpmath_says() -> None:
    assert brute.compared(brute.p_cases(120, 1)) > 80


def test_tukey_never_accuses_data_that_exist() -> None:
    assert brute.tukey_accusations(2, 1)[0] == 2


def test_tukeys_p_values_that_print_so_for_other_means_than_the_printed_ones_are_found() -> None:
    """The p-values are scipy's of the means 5.12, 6.33 and 7.81 of 12 values each and an error term of 2.9."""
    claimed = ((1, 0, "= .206"), (2, 0, "= .001"), (2, 1, "= .099"))
    comparisons = [ClaimedComparison(higher=higher, lower=lower, p=p) for higher, lower, p in claimed]
    wrong = [*comparisons[:2], ClaimedComparison(higher=2, lower=1, p="= .300")]
    for given, verdict in ((comparisons, "attainable"), (wrong, "not attainable")):
        found = tukey_pattern("7.51", [12] * 3, given, ["5.1", "6.3", "7.8"], repeated=False)
        assert found.judged.verdict == verdict


def test_df_say_what_their_definitions_say() -> None:
    assert brute.compared(brute.df_cases(5)) > 300
