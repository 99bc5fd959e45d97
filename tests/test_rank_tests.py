from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
import pingouin
import pytest
from scipy import stats

from analysis.stats.paired import (
    ALL_TIED,
    NOTHING_TO_RANK,
    TWO_CONDITIONS,
    exact_signed_rank_p,
    friedman,
    signed_rank_tests,
)
from tests.made_scores import RIGHT

_ROUNDING = """
    5.40 5.50 5.55, 5.85 5.70 5.75, 5.20 5.60 5.50, 5.55 5.50 5.40, 5.90 5.85 5.70, 5.45 5.55 5.60, 5.40 5.40 5.35,
    5.45 5.50 5.35, 5.25 5.15 5.00, 5.85 5.80 5.70, 5.25 5.20 5.10, 5.65 5.55 5.45, 5.60 5.35 5.45, 5.05 5.00 4.95,
    5.50 5.50 5.40, 5.45 5.55 5.50, 5.55 5.55 5.35, 5.45 5.50 5.55, 5.50 5.45 5.25, 5.65 5.60 5.40, 5.70 5.65 5.55,
    6.30 6.30 6.25"""
ROUNDING_FIRST_BASE = np.array([row.split() for row in _ROUNDING.split(",")], dtype=np.float64)
"""Hollander & Wolfe 1973, page 140: three ways to round first base; the example of R's friedman.test."""

_DEPRESSION = "1.83 0.878, 0.50 0.647, 1.62 0.598, 2.48 2.05, 1.68 1.06, 1.88 1.29, 1.55 1.06, 3.06 3.14, 1.30 1.29"
DEPRESSION = np.array([row.split() for row in _DEPRESSION.split(",")], dtype=np.float64)
"""Hollander & Wolfe 1973, page 29: the example of R's wilcox.test."""


def test_friedman_equals_the_textbook() -> None:
    found = friedman(ROUNDING_FIRST_BASE)  # R 4.2.2: friedman.test(RoundingTimes) = 11.143, df = 2, p = 0.003805
    assert (found.chi2, found.p) == pytest.approx((11.1428571428571, 0.00380504077551136))
    assert found.df == 2


def test_friedman_equals_r_and_pingouin_with_ties() -> None:
    found = friedman(RIGHT)  # R 4.2.2: friedman.test(x)
    assert (found.chi2, found.p) == pytest.approx((25.5294117647059, 2.85995152564038e-06))
    assert found.kendall_w == pytest.approx(found.chi2 / 28 if found.chi2 else None)
    wide = pingouin.friedman(pd.DataFrame(RIGHT, columns=["v", "a", "b"]))
    assert found.kendall_w == pytest.approx(float(wide["W"].iloc[0]))
    assert found.mean_ranks == tuple(stats.rankdata(RIGHT, axis=1).mean(axis=0))


def test_full_agreement_is_a_kendall_w_of_one() -> None:
    assert friedman(np.tile([1.0, 2.0, 3.0], (5, 1))).kendall_w == pytest.approx(1.0)


def test_two_conditions_or_only_ties_give_a_reason() -> None:
    assert (friedman(RIGHT[:, :2]).p, friedman(RIGHT[:, :2]).reason) == (None, TWO_CONDITIONS)
    assert (friedman(np.ones((4, 3))).p, friedman(np.ones((4, 3))).reason) == (None, ALL_TIED)


def test_signed_ranks_equal_the_textbook() -> None:
    (found,) = signed_rank_tests(DEPRESSION)  # R 4.2.2: wilcox.test(x, y, paired = TRUE): V = 40, p = 0.0390625
    assert (found.n, found.W, found.exact) == (9, 5.0, True)
    assert found.p == pytest.approx(0.0390625, rel=1e-14)
    assert found.r == pytest.approx((5.0 - 40.0) / 45.0)  # the second column less the first


def test_exact_p_with_ties_counts_all_signs() -> None:
    ranks = stats.rankdata([1, 1, 2, 3, 3, 3, 4, 5])
    sums = np.array([np.dot(signs, ranks) for signs in itertools.product((0, 1), repeat=8)])
    for statistic in (0.0, 5.0, 9.5, 17.0):
        assert exact_signed_rank_p(ranks, statistic) == pytest.approx(min(1.0, 2.0 * float((sums <= statistic).mean())))


def test_exact_p_equals_scipy_without_ties() -> None:
    differences = np.random.default_rng(3).normal(0.3, 1.0, 50)
    other = stats.wilcoxon(differences, method="exact")
    assert exact_signed_rank_p(np.arange(1.0, 51.0), float(other.statistic)) == pytest.approx(other.pvalue)


def test_beyond_fifty_differences_p_is_scipys_normal_one() -> None:
    scores = np.random.default_rng(4).normal(size=(200, 2))
    (found,) = signed_rank_tests(scores)
    assert not found.exact
    assert found.p == pytest.approx(stats.wilcoxon(scores[:, 1] - scores[:, 0], method="asymptotic").pvalue)


def test_ties_in_tenths_stay_ties() -> None:
    tenths = signed_rank_tests(RIGHT / 10.0)  # 0.9 - 0.8 and 0.8 - 0.7 differ in their last digit
    whole = signed_rank_tests(RIGHT)
    assert [(t.n, t.W, t.p, t.p_holm) for t in tenths] == [(w.n, w.W, w.p, w.p_holm) for w in whole]


def test_equal_conditions_are_left_out_of_holm_and_say_why() -> None:
    first, second, third = signed_rank_tests(RIGHT[:, [0, 0, 1]])
    assert (first.p, first.p_holm, first.reason, first.n) == (None, None, NOTHING_TO_RANK, 0)
    assert second.p is not None
    assert second.p_holm == third.p_holm == 2.0 * second.p
