from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from analysis import binomial_test


def _exact_p(k: int, n: int, p0: Fraction) -> Fraction:
    pmf = [math.comb(n, i) * p0**i * (1 - p0) ** (n - i) for i in range(n + 1)]
    return sum((p for p in pmf if p <= pmf[k]), Fraction(0))


@pytest.mark.parametrize(("successes", "p"), [(78, 0.205), (67, 0.673)])
def test_the_papers_binomial_tests_are_reproduced(successes: int, p: float) -> None:
    assert binomial_test(successes, 140).p == pytest.approx(p, abs=5e-4)


@given(st.integers(1, 60), st.data(), st.sampled_from([Fraction(1, 2), Fraction(1, 3), Fraction(1, 10)]))
def test_p_is_the_exact_sum_of_all_outcomes_not_more_likely(n: int, data: st.DataObject, p0: Fraction) -> None:
    k = data.draw(st.integers(0, n))
    found = binomial_test(k, n, float(p0))
    assert found.p == pytest.approx(float(_exact_p(k, n, p0)), rel=1e-11)
    assert found.log_p == pytest.approx(math.log(found.p), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize(
    ("k", "n", "p0"), [(0, 20, 0.5), (1, 20, 0.3), (20, 20, 0.5), (999, 1000, 0.9), (60, 140, 0.4)]
)
def test_p_and_interval_agree_with_scipy(k: int, n: int, p0: float) -> None:
    reference = stats.binomtest(k, n, p0)
    interval = reference.proportion_ci()
    found = binomial_test(k, n, p0)
    assert found.p == pytest.approx(reference.pvalue, rel=1e-11)
    assert (found.ci_low, found.ci_high) == pytest.approx((interval.low, interval.high), rel=1e-9, abs=1e-12)
    assert found.estimate == k / n


def test_certain_chances_give_certain_answers() -> None:
    found = binomial_test([0, 1, 10, 9], 10, [0.0, 0.0, 1.0, 1.0])
    assert found.p.tolist() == [1.0, 0.0, 1.0, 0.0]


def test_the_logarithm_goes_on_where_p_underflows() -> None:
    found = binomial_test(7000, 10_000)
    assert found.p == 0.0
    assert found.log_p / math.log(10) == pytest.approx(math.log10(1.4) - 359, abs=0.02)  # mpmath, 1.4e-359
    exact = sum(math.comb(3000, i) for i in range(301))  # each tail of 2700 in 3000
    expected = math.log(2 * exact) - 3000 * math.log(2)
    assert binomial_test(2700, 3000).log_p == pytest.approx(expected, rel=1e-10)


def test_the_tie_tolerance_is_the_documented_one() -> None:
    assert binomial_test(0, 10**9, 1e-9).p == 1.0  # strict comparison would give .6321


def test_the_tolerance_moves_the_other_side_alone_as_in_scipy_and_R() -> None:
    k, n = 5 * 10**8 + 10, 10**9
    assert binomial_test(k, n).p == pytest.approx(stats.binomtest(k, n).pvalue, rel=1e-8)


def test_rare_successes_keep_the_digits_of_the_interval() -> None:
    found = binomial_test(1, 10**6)
    assert found.ci_low == pytest.approx(2.5317807663794211e-08, rel=1e-8)  # R binom.test
    assert found.ci_high == pytest.approx(5.5716306551722366e-06, rel=1e-8)


def test_broadcasting_is_the_same_as_looping() -> None:
    successes, chances = np.arange(0, 21)[:, None], np.array([0.2, 0.5, 0.9])
    together = binomial_test(successes, 20, chances)
    for i, j in np.ndindex(together.p.shape):
        alone = binomial_test(i, 20, chances[j])
        assert (together.p[i, j], together.ci_low[i, j], together.log_p[i, j]) == (alone.p, alone.ci_low, alone.log_p)


@pytest.mark.parametrize(
    ("k", "n", "p0", "reason"),
    [
        (11, 10, 0.5, r"0\.\.trials, not 11"),
        (-1, 10, 0.5, r"0\.\.trials, not -1"),
        (1.5, 10, 0.5, "whole"),
        (0, 0, 0.5, "at least 1"),
        (1, 10, 1.5, "p0 must lie"),
        (np.nan, 10, 0.5, "finite"),
    ],
)
def test_impossible_counts_are_refused(k: float, n: float, p0: float, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        binomial_test(k, n, p0)
