from __future__ import annotations

import math
import subprocess
import sys
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import special, stats
from scipy.optimize import elementwise

from analysis import studentized_range_isf, studentized_range_logsf, studentized_range_sf
from analysis.stats.studentized_tail import TABLE_PAYS
from tests.golden_range import AS_DOUBLE, DF, DFS, KS, LOG_P, K, P, Q

SHARES = np.concatenate([1.0 - np.geomspace(1e-6, 0.5, 30), np.geomspace(0.5, 1e-300, 170)])


@pytest.mark.parametrize(
    ("k", "df", "q"),
    [(3, 10, 3.877), (3, 20, 3.578), (4, 10, 4.327), (5, 20, 4.232), (3, 60, 3.399)],
)
def test_critical_values_of_five_percent_are_those_of_the_printed_tables(k: int, df: int, q: float) -> None:
    assert studentized_range_isf(0.05, k, df) == pytest.approx(q, abs=6e-4)  # Lawal 2003, table of q


def test_the_tail_agrees_with_mpmath_from_0_9999_down_to_1e_300() -> None:
    p = studentized_range_sf(Q, K, DF)
    assert AS_DOUBLE.sum() > 150
    assert P[AS_DOUBLE].min() < 1e-299
    assert p[AS_DOUBLE] == pytest.approx(P[AS_DOUBLE], rel=1e-12, abs=0.0)


def test_its_logarithm_agrees_with_mpmath_below_the_smallest_double_and_next_to_zero() -> None:
    assert LOG_P.min() < -1e5
    assert LOG_P.max() > -1e-5
    assert studentized_range_logsf(Q, K, DF) == pytest.approx(LOG_P, rel=1e-12, abs=0.0)


@cache
def quantiles(k: int, df: float) -> np.ndarray:
    return np.asarray(studentized_range_isf(SHARES, k, df))


@pytest.mark.slow
@pytest.mark.parametrize("k", KS)
@pytest.mark.parametrize("df", DFS)
def test_a_table_gives_what_the_sums_give(k: int, df: float) -> None:
    q = quantiles(k, df)
    many = studentized_range_logsf(np.tile(q, 6), k, df)[: q.size]
    assert 6 * q.size > TABLE_PAYS > q.size
    assert many == pytest.approx(studentized_range_logsf(q, k, df), rel=1e-13, abs=0.0)


@pytest.mark.parametrize("df", [2, 26, 1e5, np.inf])
def test_with_two_means_the_tail_is_the_two_sided_t_of_q_over_root_two(df: float) -> None:
    q = np.geomspace(0.01, 30.0, 50)
    t = special.erfc(q / 2.0) if df == np.inf else 2.0 * stats.t.sf(q / math.sqrt(2), df)
    assert studentized_range_sf(q, 2, df) == pytest.approx(t, rel=1e-11, abs=0.0)  # scipy's t: 1e-12


def test_with_three_means_and_known_variance_the_tail_is_a_closed_integral() -> None:
    q = np.array([0.1, 1.0, 3.0, 6.0, 12.0])
    w = q[:, None] + np.linspace(0.0, 14.0, 20_001)  # the density 3/√π exp(-w²/4) erf(w/√12), by Simpson's rule
    density = 3.0 / math.sqrt(math.pi) * np.exp(-np.square(w) / 4.0) * special.erf(w / math.sqrt(12.0))
    weights = np.tile([2.0, 4.0], 10_001)[:-1]
    weights[[0, -1]] = 1.0
    expected = density @ weights * (14.0 / 20_000 / 3.0)
    assert studentized_range_sf(q, 3, np.inf) == pytest.approx(expected, rel=1e-11, abs=0.0)


@pytest.mark.slow
@given(st.floats(0.01, 500.0), st.floats(2.0, 60.0), st.floats(0.5, 1e6))
@settings(max_examples=60)
def test_the_tail_lies_between_that_of_one_pair_and_the_sum_over_all_pairs(q: float, k: float, df: float) -> None:
    one = float(studentized_range_logsf(q, 2, df))
    slack = 1e-12 * abs(one) + 1e-15
    assert one - slack <= studentized_range_logsf(q, k, df) <= one + math.log(k * (k - 1) / 2) + slack


@pytest.mark.slow
@pytest.mark.parametrize("k", KS)
@pytest.mark.parametrize("df", DFS)
def test_a_larger_q_is_never_likelier(k: int, df: float) -> None:
    q = np.geomspace(1e-3, studentized_range_isf(1e-300, k, df), 5_000)
    table, logarithm = studentized_range_sf(q, k, df), studentized_range_logsf(q, k, df)
    few = q[::25]
    sums, mixed = studentized_range_sf(few, k, df), table[::25].copy()
    mixed[::2] = sums[::2]
    assert (np.diff(logarithm) < 0.0).all()
    assert (np.diff(table) <= 0.0).all()
    assert (np.diff(sums) <= 0.0).all()
    assert (np.diff(mixed) <= 0.0).all()


@pytest.mark.slow
@pytest.mark.parametrize("k", KS)
@pytest.mark.parametrize("df", DFS)
def test_isf_undoes_sf(k: int, df: float) -> None:
    assert studentized_range_sf(quantiles(k, df), k, df) == pytest.approx(SHARES, rel=1e-12, abs=0)


def test_isf_with_different_parameters_at_once_gives_what_it_gives_one_by_one() -> None:
    p, k, df = [0.999, 0.05, 1e-30, 1e-300], [2, 3.5, 20, 4], [0.7, 26, np.inf, 2]
    together = studentized_range_isf(p, k, df)
    assert together == pytest.approx([studentized_range_isf(*each) for each in zip(p, k, df, strict=True)], rel=1e-14)


@pytest.mark.parametrize("k", [2, 3, 10, 20])
@pytest.mark.parametrize(("df", "p"), [(1, 1e-300), (1, 1e-160), (1.5, 1e-300), (2, 1e-300)])
def test_a_q_whose_square_is_no_double_is_found(k: int, df: float, p: float) -> None:
    """P(Q > q) falls like q^-df: isf was inf from 1e154 on."""
    q = studentized_range_isf(p, k, df)
    assert 1e100 < q < 1e308
    assert studentized_range_sf(q, k, df) == pytest.approx(p, rel=1e-12)


def test_of_two_means_the_smallest_level_of_a_cauchy_is_its_closed_form() -> None:
    # df = 1: q = sqrt(2) cot(pi p / 2)
    assert studentized_range_isf(1e-300, 2, 1) == pytest.approx(math.sqrt(2) * 2 / math.pi * 1e300, rel=1e-12)


def test_a_q_beyond_the_largest_double_is_infinite() -> None:
    assert studentized_range_isf(1e-300, 3, 0.5) == np.inf


def test_many_degrees_of_freedom_lead_to_known_variance() -> None:
    q = np.geomspace(0.1, 50.0, 20)
    assert studentized_range_logsf(q, 5, 1e18) == pytest.approx(studentized_range_logsf(q, 5, np.inf), rel=1e-13)


def test_the_logarithm_is_that_of_the_tail() -> None:
    assert studentized_range_logsf(3.5, 3, 26) == pytest.approx(math.log(studentized_range_sf(3.5, 3, 26)))


def test_the_ends_of_the_range_are_exact() -> None:
    assert studentized_range_sf([-1.0, 0.0, np.inf], 3, 26).tolist() == [1.0, 1.0, 0.0]
    assert studentized_range_isf([0.0, 1.0], 3, 26).tolist() == [np.inf, 0.0]
    assert math.isnan(studentized_range_sf(np.nan, 3, 26))
    assert math.isnan(studentized_range_isf(np.nan, 3, 26))
    assert studentized_range_logsf(np.inf, 3, 26) == -np.inf
    assert studentized_range_logsf([-1.0, 0.0], 3, 26).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("df", [1e-3, 0.5, 2, 1e300, np.inf])
@pytest.mark.parametrize("k", [2, 3.5, 1000])
def test_no_double_is_too_small_or_too_large(k: float, df: float) -> None:
    p = studentized_range_sf([5e-324, 1e-300, 1e-8, 1.0, 1e8, 1e160, 1.7e308], k, df)
    assert np.isfinite(p).all()
    assert (np.diff(p) <= 0.0).all()


def test_arguments_broadcast() -> None:
    q, k = np.array([[2.0], [4.0]]), np.array([2, 3])
    together = studentized_range_sf(q, k, 26)
    assert together.shape == (2, 2)
    assert together[1, 0] == studentized_range_sf(4.0, 2, 26)
    assert studentized_range_sf([], 3, 26).shape == studentized_range_isf(np.empty((0, 2)), 3, 26).shape[:1] == (0,)


@pytest.mark.parametrize(
    ("k", "df", "reason"),
    [
        (1, 5, "at least 2"),
        (np.inf, 5, "at most 1e"),
        (np.nan, 5, "at least 2"),
        (3, 0, "above 0"),
        (3, np.nan, "above 0"),
    ],
)
def test_impossible_parameters_are_refused(k: float, df: float, reason: str) -> None:
    for function in (studentized_range_sf, studentized_range_logsf, studentized_range_isf):
        with pytest.raises(ValueError, match=reason):
            function(0.5, k, df)


def test_quantiles_are_those_of_scipys_root_finder() -> None:
    p = np.array([0.9, 0.5, 0.05, 1e-3, 1e-12, 1e-200])
    k, df = np.array([2.0, 3.0, 3.0, 4.0, 10.0, 20.0]), np.array([2.0, 12.0, 26.0, np.inf, 100.0, 5.0])
    found = studentized_range_isf(p, k, df)
    tails = elementwise.find_root(
        lambda x, k, df, log_p: studentized_range_logsf(np.exp(x), k, df) - log_p,
        (np.log(0.5 * found), np.log(2.0 * found)),
        args=(k, df, np.log(p)),
    )
    assert tails.success.all()
    assert np.exp(tails.x) == pytest.approx(found, rel=1e-12)


def test_a_probability_outside_its_range_is_refused() -> None:
    with pytest.raises(ValueError, match=r"0\.\.1, not 1\.5"):
        studentized_range_isf(1.5, 3, 26)


@pytest.mark.slow
def test_importing_it_loads_neither_scipy_stats_nor_scipy_linalg() -> None:
    heavy = "{'scipy.stats', 'scipy.linalg'}"
    code = f"import sys, analysis.stats.studentized_tail\nsys.exit(bool({heavy} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
