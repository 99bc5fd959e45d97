"""Planned contrasts and two one-sided tests beyond what R is asked: scale, rounding, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analysis.stats.anova import rm_anova
from analysis.stats.contrasts import planned_contrasts
from analysis.stats.corrections import benjamini_hochberg, corrected
from analysis.stats.equivalence import NO_VARIANCE, tost_one_sample, tost_paired, tost_two_samples
from analysis.stats.paired import CONSTANT, EQUAL, paired_t_tests

SCORES = np.random.default_rng(5).normal(size=(12, 4)).round(2) + np.arange(4)
FORCE = {"force": (-1.0, 1 / 3, 1 / 3, 1 / 3)}


def test_a_contrast_of_two_conditions_is_their_paired_t_test():
    (found,) = planned_contrasts(SCORES, {"last": (-1.0, 0.0, 0.0, 1.0)})
    pair = next(pair for pair in paired_t_tests(SCORES) if (pair.a, pair.b) == (3, 0))
    assert (found.estimate, found.t, found.p, found.d_z) == (pair.difference, pair.t, pair.p, pair.d_z)
    assert (found.ci_low, found.ci_high) == (pair.ci_low, pair.ci_high)


def test_orthogonal_contrasts_share_out_the_sum_of_squares_of_the_anova():
    weights = {"a": (-3, -1, 1, 3), "b": (1, -1, -1, 1), "c": (-1, 3, -3, 1)}
    found = planned_contrasts(SCORES, weights)
    parts = [len(SCORES) * one.estimate**2 / sum(w * w for w in one.weights) for one in found]
    assert sum(parts) == pytest.approx(rm_anova(SCORES).ss_effect, rel=1e-12)


@pytest.mark.parametrize("scale", [1e-300, 1e-9, 1e9, 1e300])
def test_t_does_not_depend_on_the_unit(scale):
    (here,), (there,) = planned_contrasts(SCORES, FORCE), planned_contrasts(SCORES * scale, FORCE)
    assert there.t == pytest.approx(here.t, rel=1e-12)
    assert there.estimate == pytest.approx(here.estimate * scale, rel=1e-12)
    assert tost_paired(*(SCORES * scale).T[:2], -scale, scale).p == pytest.approx(
        tost_paired(*SCORES.T[:2], -1.0, 1.0).p, rel=1e-9
    )


def test_t_keeps_the_digits_that_an_offset_leaves():
    (here,), (there,) = planned_contrasts(SCORES, FORCE), planned_contrasts(SCORES + 2.0**40, FORCE)
    assert there.t == pytest.approx(here.t, rel=1e-3)  # scores of 2^40 have a grain of 1e-4
    (exact,) = planned_contrasts(SCORES.round() + 2.0**40, FORCE)
    (whole,) = planned_contrasts(SCORES.round(), FORCE)
    assert exact.t == pytest.approx(whole.t, rel=1e-3)


def test_a_contrast_without_variance_says_so_also_where_rounding_left_some():
    tenths = np.array([[0.1, 0.2, 0.3], [0.7, 0.8, 0.9], [0.3, 0.4, 0.5], [0.6, 0.7, 0.8]])
    constant, equal = planned_contrasts(tenths, {"rise": (-1, 0, 1), "bend": (1, -2, 1)}, "holm")
    assert (constant.reason, constant.t, constant.p_adjusted) == (CONSTANT, None, None)
    assert constant.estimate == pytest.approx(0.2)
    assert (equal.reason, equal.estimate) == (EQUAL, 0.0)


def test_p_is_corrected_over_the_contrasts_that_have_one():
    found = planned_contrasts(
        SCORES, {"a": (-1, 1, 0, 0), "b": (0, -1, 1, 0), "c": (0, 0, -1, 1)}, "benjamini-hochberg"
    )
    assert [one.p_adjusted for one in found] == pytest.approx(benjamini_hochberg([one.p for one in found]).tolist())


@pytest.mark.parametrize(
    ("weights", "said"),
    [
        ((1, 0, 0, 0), "must add up to 0"),
        ((0.333, 0.333, 0.333, -1), "must add up to 0"),
        ((0, 0, 0, 0), "not all be 0"),
        ((1, -1), "4 numbers are needed, one a condition"),
        ((1, -1, math.nan, 0), "weights of 'x' must be finite"),
        (
            {"a": 1, "b": -1},
            "weights of 'x' must be 4 numbers in the order of the conditions in `scores`, not a mapping",
        ),
    ],
)
def test_what_is_no_contrast_is_refused_by_its_name(weights, said):
    with pytest.raises(ValueError, match=said):
        planned_contrasts(SCORES, {"x": weights})


@pytest.mark.parametrize("correction", ["holm", "benjamini-hochberg", "none"])
def test_no_p_values_are_none_after_correction(correction):
    assert corrected([], correction).size == 0


# ---- equivalence ----


def test_the_interval_lies_within_the_bounds_exactly_where_p_is_below_alpha():
    differences = SCORES[:, 1] - SCORES[:, 0]
    for bound in np.linspace(0.5, 3.0, 40):
        found = tost_one_sample(differences, -bound, bound, alpha=0.1)
        assert (found.p < 0.1) == (-bound < found.ci_low and found.ci_high < bound)


def test_paired_is_one_sample_of_the_differences():
    paired = tost_paired(SCORES[:, 1], SCORES[:, 0], -2.0, 2.0)
    alone = tost_one_sample(SCORES[:, 1] - SCORES[:, 0], -2.0, 2.0)
    assert (paired.difference, paired.p, paired.df) == pytest.approx((alone.difference, alone.p, alone.df), rel=1e-12)


def test_without_variance_there_is_no_test():
    found = tost_paired([0.3, 0.9, 0.4], [0.2, 0.8, 0.3], -1.0, 1.0)
    assert (found.p, found.reason) == (None, NO_VARIANCE)
    assert tost_two_samples([1.0, 1.0], [1.0, 1.0, 1.0], -1.0, 1.0).reason == NO_VARIANCE


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: tost_one_sample([1.0, 2.0], 1.0, 1.0), "low must be below high"),
        (lambda: tost_one_sample([1.0, 2.0], -math.inf, 1.0), "low must be finite, not -inf"),
        (lambda: tost_one_sample([1.0], -1.0, 1.0), "at least two numbers"),
        (lambda: tost_one_sample([1.0, 2.0], -1.0, 1.0, alpha=0.5), "alpha must lie between 0 and 0.5"),
        (lambda: tost_paired([1.0, 2.0], [1.0, 2.0, 3.0], -1.0, 1.0), "the same people, not 2 and 3"),
    ],
)
def test_what_is_no_question_is_refused(ask, said):
    with pytest.raises(ValueError, match=said):
        ask()
