from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf
from scipy import special, stats

from analysis import binomial_test, binomial_test_log_p, binomial_test_p
from analysis.stats.binomial import Tail
from tests.golden_binomial import GOLDEN, digits_of


def _exact_p(k: int, n: int, p0: Fraction) -> Fraction:
    pmf = [math.comb(n, i) * p0**i * (1 - p0) ** (n - i) for i in range(n + 1)]
    return sum((p for p in pmf if p <= pmf[k]), Fraction(0))


@pytest.mark.parametrize(("successes", "p"), [(78, 0.205), (67, 0.673)])
def test_the_papers_binomial_tests_are_reproduced(successes: int, p: float) -> None:
    assert binomial_test(successes, 140).p == pytest.approx(p, abs=5e-4)


@pytest.mark.slow
@settings(max_examples=40)
@given(st.integers(1, 60), st.data(), st.sampled_from([Fraction(1, 2), Fraction(1, 3), Fraction(1, 10)]))
def test_p_is_the_exact_sum_of_all_outcomes_not_more_likely(n: int, data: st.DataObject, p0: Fraction) -> None:
    k = data.draw(st.integers(0, n))
    found = binomial_test(k, n, float(p0))
    assert found.p == pytest.approx(float(_exact_p(k, n, p0)), rel=1e-13)
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


@pytest.mark.slow
def test_p_and_its_logarithm_agree_with_sums_of_mpmath() -> None:
    cases = GOLDEN["tests"]
    found = binomial_test(*([case[name] for case in cases] for name in ("k", "n", "p0")))
    for case, p, log_p in zip(cases, found.p, found.log_p, strict=True):
        what, far = f"{case['k']} of {case['n']} at {case['p0']:.3g}", case["n"] > 10**6
        assert digits_of(log_p, case["log_p"]) >= (11 if far else 14), what
        if 0 < mpf(case["p"]) < 1e-300:
            assert p < 1e-299, what
        else:
            assert digits_of(p, case["p"]) >= (11 if far else 13), what


@pytest.mark.slow
@pytest.mark.parametrize("alternative", ["greater", "less"])
def test_one_sided_logarithms_agree_with_sums_of_mpmath(alternative: Tail) -> None:
    cases = GOLDEN["tests"]
    columns = ([case[name] for case in cases] for name in ("k", "n", "p0"))
    for case, log_p in zip(cases, np.asarray(binomial_test_log_p(*columns, alternative)), strict=True):
        exact, far = case[f"log_{alternative}"], case["n"] > 10**6
        if abs(mpf(exact)) > 1e-300:
            assert digits_of(log_p, exact) >= (11 if far else 14), f"{case['k']} of {case['n']} at {case['p0']:.3g}"
        else:
            assert -1e-299 < log_p <= 0.0


@pytest.mark.slow
@settings(max_examples=40)
@given(st.integers(1, 60), st.data(), st.sampled_from([Fraction(1, 2), Fraction(1, 3), Fraction(1, 10)]))
def test_one_sided_p_is_the_exact_sum_of_all_outcomes_beyond(n: int, data: st.DataObject, p0: Fraction) -> None:
    k = data.draw(st.integers(0, n))
    pmf = [math.comb(n, i) * Fraction(float(p0)) ** i * (1 - Fraction(float(p0))) ** (n - i) for i in range(n + 1)]
    for alternative, exact in (("greater", sum(pmf[k:])), ("less", sum(pmf[: k + 1]))):
        assert binomial_test_p(k, n, float(p0), alternative) == pytest.approx(float(exact), rel=1e-14)


@pytest.mark.parametrize("k", [0, 1, 5, 19, 20])
@pytest.mark.parametrize(("alternative", "confidence"), [("greater", 0.95), ("less", 0.95), ("less", 0.8)])
def test_one_sided_tests_and_intervals_are_those_of_scipy(k: int, alternative: Tail, confidence: float) -> None:
    theirs = stats.binomtest(k, 20, 0.3, alternative)
    found = binomial_test(k, 20, 0.3, alternative, confidence=confidence)
    exact, wilson = (theirs.proportion_ci(confidence, method) for method in ("exact", "wilson"))
    assert found.p == pytest.approx(theirs.pvalue, rel=1e-12)
    assert (found.ci_low, found.ci_high) == pytest.approx((exact.low, exact.high), rel=1e-9, abs=1e-12)
    assert (found.wilson_low, found.wilson_high) == pytest.approx((wilson.low, wilson.high), rel=1e-12, abs=1e-15)


def test_p_alone_is_that_of_the_test() -> None:
    k, n, p0 = np.arange(21)[:, None], [20, 30], 0.4
    found = binomial_test(k, n, p0)
    assert np.array_equal(binomial_test_p(k, n, p0), found.p)
    assert np.array_equal(binomial_test_log_p(k, n, p0), found.log_p)


def test_many_counts_of_many_trials_are_worked_out_as_one_by_one() -> None:
    rng = np.random.default_rng(3)
    n, p0 = rng.integers(1, 2000, size=5000), rng.choice([0.2, 0.5], size=5000)
    k = rng.binomial(n, p0)
    together = np.asarray(binomial_test_p(k, n, p0))
    for i in range(0, 5000, 250):
        assert together[i] == binomial_test_p(k[i], n[i], p0[i])
    assert binomial_test_p([], 10).shape == (0,)


@pytest.mark.parametrize("case", GOLDEN["intervals"], ids=lambda case: f"{case['k']} of {case['n']}")
def test_both_intervals_have_fourteen_digits(case: dict[str, Any]) -> None:
    found = binomial_test(case["k"], case["n"])
    for limit in ("ci_low", "ci_high", "wilson_low", "wilson_high"):
        assert digits_of(getattr(found, limit), case[limit]) >= 14


@pytest.mark.slow
@settings(max_examples=40)
@given(st.integers(0, 400), st.data(), st.sampled_from([1e-9, 0.5, 0.9, 0.999]))
def test_clopper_pearson_limits_leave_the_tail_they_promise(k: int, data: st.DataObject, confidence: float) -> None:
    n = data.draw(st.integers(max(k, 1), 10**6))
    found, tail = binomial_test(k, n, confidence=confidence), (1 - confidence) / 2
    if k > 0:
        assert special.bdtrc(k - 1, n, found.ci_low) == pytest.approx(tail, rel=1e-8)
    if k < n:
        assert special.bdtr(k, n, found.ci_high) == pytest.approx(tail, rel=1e-8)
    assert 0.0 <= found.wilson_low <= found.estimate <= found.wilson_high <= 1.0


@pytest.mark.parametrize(("k", "low", "high"), [(0, 0.0, 0.1611), (1, 0.0089, 0.2361), (20, 0.8389, 1.0)])
def test_wilson_interval_of_a_few_in_twenty(k: int, low: float, high: float) -> None:
    found = binomial_test(k, 20)  # statsmodels.proportion_confint(k, 20, method="wilson")
    assert (found.wilson_low, found.wilson_high) == pytest.approx((low, high), abs=5e-5)


def test_the_logarithm_goes_on_where_p_underflows() -> None:
    found = binomial_test(2700, 3000)
    exact = sum(math.comb(3000, i) for i in range(301))  # each tail of 2700 in 3000
    assert found.log_p == pytest.approx(math.log(2 * exact) - 3000 * math.log(2), rel=1e-14)


def test_the_logarithm_keeps_its_digits_where_p_is_nearly_one() -> None:
    found = binomial_test(500_001, 10**6)
    with mp.workdps(30):  # all but the mode counts
        middle = mp.exp(mp.loggamma(10**6 + 1) - 2 * mp.loggamma(500_001) - 10**6 * mp.log(2))
        assert found.log_p == pytest.approx(float(mp.log1p(-middle)), rel=1e-14)


def test_the_tie_tolerance_is_the_documented_one() -> None:
    assert binomial_test(0, 10**9, 1e-9).p == 1.0  # strict comparison would give .6321


def test_outcomes_as_likely_but_for_rounding_count_as_ties() -> None:
    assert binomial_test(3, 9, 1 / 3 + 1e-12).p == 1.0
    assert binomial_test(2, 5).p == binomial_test(3, 5).p == 1.0


def test_the_tolerance_moves_the_other_side_alone_as_in_scipy_and_R() -> None:
    k, n = 5 * 10**8 + 10, 10**9
    assert binomial_test(k, n).p == pytest.approx(stats.binomtest(k, n).pvalue, rel=1e-8)


def test_rare_successes_keep_the_digits_of_the_interval() -> None:
    found = binomial_test(1, 10**6)
    assert found.ci_low == pytest.approx(2.5317807663794211e-08, rel=1e-8)  # R binom.test
    assert found.ci_high == pytest.approx(5.5716306551722366e-06, rel=1e-8)


def test_broadcasting_is_the_same_as_looping() -> None:
    successes, chances = np.arange(0, 21, 4)[:, None], np.array([0.2, 0.5, 0.9])
    together = binomial_test(successes, 20, chances)
    for i, j in np.ndindex(together.p.shape):
        alone = binomial_test(successes[i, 0], 20, chances[j])
        assert (together.p[i, j], together.ci_low[i, j], together.log_p[i, j]) == (alone.p, alone.ci_low, alone.log_p)


@pytest.mark.parametrize(
    ("k", "n", "p0", "reason"),
    [
        (2, [1.5], 0.5, r"trials must be whole numbers, not 1\.5"),
        ([1, 2], [3, 4, 5], 0.5, r"do not fit together: successes \(2,\), trials \(3,\), p0 \(\)"),
        (11, 10, 0.5, r"0\.\.trials, not 11"),
        (-1, 10, 0.5, r"0\.\.trials, not -1"),
        (1.5, 10, 0.5, "whole"),
        (0, 0, 0.5, "at least 1"),
        (0, 2.0**54, 0.5, r"at most 1e\+10"),
        (1, 10, 1.5, "p0 must lie"),
        (np.nan, 10, 0.5, "finite"),
    ],
)
def test_impossible_counts_are_refused(k: float, n: float, p0: float, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        binomial_test(k, n, p0)


def test_an_alternative_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="alternative must be one of two-sided, greater, less, not 'larger'"):
        binomial_test(7, 10, alternative="larger")  # type: ignore[arg-type]
