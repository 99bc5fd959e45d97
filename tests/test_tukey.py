from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from analysis import rm_anova, rm_tukey_hsd, rm_tukey_hsd_paired, tukey_hsd
from analysis.stats.anova import check_scores, own_pairs, pooled_pairs
from tests.exact import digits, exact_squared_group_q, exact_squared_q

METHODS = ("vibration", "asymmetric-1", "asymmetric-2")
SCORES = np.random.default_rng(1).normal(size=(14, 3)) + np.array([0.0, 0.9, 1.6])


def test_pairs_name_the_later_condition_first_and_difference_is_first_minus_second() -> None:
    found = rm_tukey_hsd(SCORES, METHODS)
    assert [(c.a, c.b) for c in found] == [
        ("asymmetric-1", "vibration"),
        ("asymmetric-2", "vibration"),
        ("asymmetric-2", "asymmetric-1"),
    ]
    means = dict(zip(METHODS, SCORES.mean(axis=0), strict=True))
    assert [c.difference for c in found] == pytest.approx([means[c.a] - means[c.b] for c in found], rel=1e-12)


def test_the_pooled_test_uses_the_error_of_the_repeated_measures_anova() -> None:
    anova = rm_anova(SCORES)
    for c in rm_tukey_hsd(SCORES):
        q = abs(c.difference) / math.sqrt(anova.ms_error / 14)
        assert c.q == pytest.approx(q, rel=1e-12)
        assert c.p == pytest.approx(stats.studentized_range.sf(q, 3, 26), rel=1e-9)


def test_the_interval_ends_at_zero_exactly_when_p_is_one_minus_the_confidence() -> None:
    first = rm_tukey_hsd(SCORES)[0]
    edge = rm_tukey_hsd(SCORES, confidence=1.0 - first.p)[0]
    assert edge.ci_low == pytest.approx(0.0, abs=1e-6)
    assert first.ci_low < first.difference < first.ci_high


def test_the_paired_test_uses_each_pairs_own_error() -> None:
    for c in rm_tukey_hsd_paired(SCORES):
        t = stats.ttest_rel(SCORES[:, c.a], SCORES[:, c.b]).statistic
        assert c.q == pytest.approx(math.sqrt(2) * abs(t), rel=1e-12)
        assert c.p == pytest.approx(stats.studentized_range.sf(c.q, 3, 13), rel=1e-9)


def test_with_two_conditions_the_p_is_that_of_the_paired_t() -> None:
    pair = SCORES[:, :2]
    p = stats.ttest_rel(pair[:, 0], pair[:, 1]).pvalue
    assert rm_tukey_hsd(pair)[0].p == pytest.approx(p, rel=1e-8)
    assert rm_tukey_hsd_paired(pair)[0].p == pytest.approx(p, rel=1e-8)


def test_the_between_subjects_test_agrees_with_scipy_on_unequal_groups() -> None:
    groups = [SCORES[:5, 0], SCORES[:9, 1], SCORES[:, 2]]
    reference = stats.tukey_hsd(*groups)
    intervals = reference.confidence_interval(0.9)
    for c in tukey_hsd(groups, confidence=0.9):
        assert c.difference == pytest.approx(reference.statistic[c.a, c.b], rel=1e-12)
        assert c.p == pytest.approx(reference.pvalue[c.a, c.b], rel=1e-8)
        assert (c.ci_low, c.ci_high) == pytest.approx((intervals.low[c.a, c.b], intervals.high[c.a, c.b]), rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1e-300, 1e-160, 1.0, 1e154, 1e295])
@pytest.mark.parametrize("offset", [0.0, 1e6, 1e12])
def test_q_has_fourteen_digits_of_the_exact_one_at_any_offset_and_scale(offset: float, scale: float) -> None:
    scores = (SCORES + offset) * scale
    groups = [scores[:5, 0], scores[:9, 1], scores[:, 2]]
    for c in rm_tukey_hsd(scores):
        assert digits(c.q**2, exact_squared_q(scores, c.a, c.b)) >= 14
    for c in rm_tukey_hsd_paired(scores):
        assert digits(c.q**2, exact_squared_q(scores[:, [c.b, c.a]], 1, 0)) >= 14
    for c in tukey_hsd(groups):
        assert digits(c.q**2, exact_squared_group_q(groups, c.a, c.b)) >= 14


def test_two_means_that_nearly_agree_beside_one_far_off_keep_the_digits_of_their_difference() -> None:
    scores = SCORES - SCORES.mean(axis=0) + np.array([0.0, 1e-9, 1e6])
    near = rm_tukey_hsd(scores)[0]
    assert digits(near.q**2, exact_squared_q(scores, 1, 0)) >= 14


@pytest.mark.parametrize("scale", [2.0**-660, 2.0**530])
def test_scale_changes_neither_q_nor_p(scale: float) -> None:
    for test in (rm_tukey_hsd, rm_tukey_hsd_paired):
        for c, small in zip(test(SCORES), test(SCORES * scale), strict=True):
            assert (small.q, small.p) == (c.q, c.p)
            assert (small.ci_low, small.ci_high) == pytest.approx((c.ci_low * scale, c.ci_high * scale), rel=1e-12)
    between = tukey_hsd(list(SCORES.T * scale))
    assert [c.q for c in between] == [c.q for c in tukey_hsd(list(SCORES.T))]


@pytest.mark.parametrize("test", [rm_tukey_hsd, rm_tukey_hsd_paired])
def test_without_error_a_difference_is_certain_and_no_difference_undefined(test: object) -> None:
    scores = np.array([[0.1, 0.1, 0.3], [0.4, 0.4, 0.6], [0.7, 0.7, 0.9]])
    same, other, _ = test(scores)  # type: ignore[operator]
    assert (same.difference, same.ci_low, same.ci_high) == (0.0, 0.0, 0.0)
    assert math.isnan(same.q)
    assert math.isnan(same.p)
    assert (other.q, other.p) == (math.inf, 0.0)
    assert other.ci_low == other.ci_high == pytest.approx(0.2)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_order_of_participants_does_not_matter(seed: int) -> None:
    shuffled = np.random.default_rng(seed).permutation(SCORES, axis=0)
    for pairs in (pooled_pairs, own_pairs):
        assert pairs(check_scores(shuffled)).q == pytest.approx(pairs(SCORES).q, rel=1e-11)


def test_many_tables_at_once_are_the_same_as_one_after_the_other() -> None:
    tables = np.stack([SCORES, SCORES[::-1] * 3.0, SCORES**2])
    for test in (rm_tukey_hsd, rm_tukey_hsd_paired):
        together = test(tables)
        for i, table in enumerate(tables):
            for c, alone in zip(together, test(table), strict=True):
                assert (c.q[i], c.p[i], c.ci_low[i]) == pytest.approx((alone.q, alone.p, alone.ci_low), rel=1e-10)


@pytest.mark.parametrize("labels", [("a", "b"), ("a", "b", "b")])
def test_labels_must_be_as_many_and_different(labels: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match="3 different labels"):
        rm_tukey_hsd(SCORES, labels)


def test_a_confidence_of_one_is_refused() -> None:
    with pytest.raises(ValueError, match="confidence must lie between 0 and 1"):
        rm_tukey_hsd(SCORES, confidence=1.0)
