from __future__ import annotations

import numpy as np
import pingouin
import pytest
from scipy import stats
from statsmodels.stats.multitest import multipletests

from analysis.stats.anova import rm_anova
from analysis.stats.paired import CONSTANT, EQUAL, holm, paired_t_tests
from tests.made_scores import RIGHT


def test_t_p_and_interval_equal_r() -> None:
    # R 4.2.2: t.test(x[, a], x[, b], paired = TRUE)
    expected = [
        (4.57768761282342, 0.000518317601715638, 1.35788274700723, 3.78497439584992),
        (7.48331477354788, 4.60848229321291e-06, 2.84523437977016, 5.15476562022984),
        (5.25923706140778, 0.000154372559646192, 0.841748491752172, 2.01539436539068),
    ]
    found = paired_t_tests(RIGHT)
    assert [(c.a, c.b, c.df) for c in found] == [(1, 0, 13), (2, 0, 13), (2, 1, 13)]
    for pair, numbers in zip(found, expected, strict=True):
        assert (pair.t, pair.p, pair.ci_low, pair.ci_high) == pytest.approx(numbers, rel=1e-12)


@pytest.mark.slow
def test_holm_equals_r_pingouin_and_statsmodels() -> None:
    p = [1.31e-3, 1e-5, 0.02, 0.03]
    assert holm(p).tolist() == pytest.approx([0.00393, 0.00004, 0.04, 0.04])  # R 4.2.2: p.adjust(p, "holm")
    many = np.random.default_rng(1).uniform(size=50) ** 3
    assert holm(many).tolist() == pytest.approx(pingouin.multicomp(many, method="holm")[1].tolist())
    for size in (1, 2, 3, 7):
        few = np.random.default_rng(size).uniform(size=size)
        assert holm(few).tolist() == multipletests(few, method="holm")[1].tolist()
    assert holm([]).size == 0


def test_holm_is_over_all_pairs() -> None:
    found = paired_t_tests(RIGHT)
    assert [pair.p_holm for pair in found] == pytest.approx(holm([pair.p for pair in found if pair.p]).tolist())


def test_the_square_of_t_is_f_for_two_conditions() -> None:
    (pair,) = paired_t_tests(RIGHT[:, :2], ["v", "a"])
    assert pair.t is not None
    assert pair.t**2 == pytest.approx(rm_anova(RIGHT[:, :2]).F)
    assert (pair.a, pair.b, pair.p_holm) == ("a", "v", pair.p)


def test_d_z_is_the_mean_over_the_sd_of_the_differences() -> None:
    difference = RIGHT[:, 1] - RIGHT[:, 0]
    assert paired_t_tests(RIGHT)[0].d_z == pytest.approx(difference.mean() / difference.std(ddof=1))


def test_scipy_agrees_on_many_participants() -> None:
    scores = np.random.default_rng(2).normal(size=(10_000, 3))
    for pair in paired_t_tests(scores):
        other = stats.ttest_rel(scores[:, int(pair.a)], scores[:, int(pair.b)])
        assert (pair.t, pair.p) == pytest.approx((other.statistic, other.pvalue))


def test_pairs_without_variance_are_left_out_of_holm_and_say_why() -> None:
    scores = np.column_stack([RIGHT[:, 0] / 10.0, RIGHT[:, 0] / 10.0, RIGHT[:, 0] / 10.0 + 0.1, RIGHT[:, 1] / 10.0])
    found = {(pair.a, pair.b): pair for pair in paired_t_tests(scores)}
    assert (found[1, 0].t, found[1, 0].p_holm, found[1, 0].reason) == (None, None, EQUAL)
    assert (found[2, 0].t, found[2, 0].ci_low, found[2, 0].reason) == (None, None, CONSTANT)
    assert found[2, 0].difference == pytest.approx(0.1)
    tested = [pair for pair in found.values() if pair.p is not None]
    assert len(tested) == 3
    assert [pair.p_holm for pair in tested] == pytest.approx(holm([pair.p or 0.0 for pair in tested]).tolist())
