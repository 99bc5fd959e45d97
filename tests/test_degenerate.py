"""Data that most programs answer with a wrong number: each beside what is true of it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

from analysis import one_way_anova, rm_anova, rm_tukey_hsd, rm_tukey_hsd_paired, tukey_hsd
from analysis.stats.anova import F_UNDEFINED, NO_ERROR
from tests.exact import exact_rm_F
from tests.made_scores import ADDITIVE, COLUMNS, PEOPLE


@pytest.mark.parametrize(
    "scores",
    [
        ADDITIVE,
        np.arange(14)[:, None] + np.array([0.0, 1.0, 3.0]),
        np.arange(0, 1.4, 0.1)[:, None] + COLUMNS,
        ADDITIVE * 1e-300,
        ADDITIVE * 1e300,
        1e6 + ADDITIVE,
        np.array([[0.0, 1.0]] * 5),
    ],
    ids=["tenths", "whole numbers", "tenths by steps", "tiny", "huge", "far from zero", "everyone alike"],
)
def test_an_effect_that_is_the_same_in_everyone_has_an_infinite_F(scores: np.ndarray) -> None:
    found = rm_anova(scores)
    assert (found.F, found.p, found.ss_error, found.reason) == (math.inf, 0.0, 0.0, NO_ERROR)
    for comparison in (*rm_tukey_hsd(scores), *rm_tukey_hsd_paired(scores)):
        assert (comparison.q, comparison.p) == (math.inf, 0.0)
        assert comparison.ci_low == comparison.difference == comparison.ci_high


def test_an_infinite_F_stands_for_one_that_rounding_alone_bounds() -> None:
    assert exact_rm_F(ADDITIVE) > 10**28


@pytest.mark.parametrize(
    "scores",
    [np.ones((14, 3)), np.zeros((14, 3)), np.full((14, 3), 0.1), np.repeat(PEOPLE, 3, axis=1), np.full((2, 2), 1e300)],
    ids=["all at ceiling", "all at floor", "all 0.1", "identical conditions", "huge"],
)
def test_neither_effect_nor_error_is_undefined_and_says_so(scores: np.ndarray) -> None:
    found = rm_anova(scores)
    assert math.isnan(found.F)
    assert math.isnan(found.p)
    assert (found.ss_effect, found.ss_error, found.reason) == (0.0, 0.0, F_UNDEFINED)
    assert all(math.isnan(c.q) and math.isnan(c.p) and c.difference == 0.0 for c in rm_tukey_hsd(scores))


def test_one_condition_at_ceiling_is_an_ordinary_F() -> None:
    scores = np.random.default_rng(3).integers(4, 9, size=(14, 3)) / 10
    scores[:, 2] = 1.0
    found = rm_anova(scores)
    assert pytest.approx(float(exact_rm_F(scores)), rel=1e-15) == found.F
    assert found.reason == ""


def test_whole_numbers_whose_error_rounding_could_have_made_keep_their_own_F() -> None:
    scores = 2.0**52 + np.array([[0.0, 10.0, 30.0], [1.0, 11.0, 32.0], [4.0, 13.0, 33.0]])
    assert pytest.approx(float(exact_rm_F(scores)), rel=1e-15) == rm_anova(scores).F


def test_reasons_come_one_a_data_set() -> None:
    ordinary = np.random.default_rng(1).normal(size=(14, 3))
    found = rm_anova(np.stack([ordinary, ADDITIVE, np.ones((14, 3))]))
    assert list(found.reason) == ["", NO_ERROR, F_UNDEFINED]


def test_two_participants_or_fewer_than_conditions_are_enough() -> None:
    rng = np.random.default_rng(5)
    for shape in ((2, 3), (3, 6), (2, 2)):
        scores = rng.normal(size=shape)
        assert pytest.approx(float(exact_rm_F(scores)), rel=1e-15) == rm_anova(scores).F


def test_equal_groups_are_undefined_and_constant_different_groups_infinite() -> None:
    same, apart = [[0.1, 0.1], [0.1, 0.1, 0.1]], [[0.1, 0.1], [0.3, 0.3]]
    assert (math.isnan(one_way_anova(same).F), one_way_anova(same).reason) == (True, F_UNDEFINED)
    assert (one_way_anova(apart).F, one_way_anova(apart).p, one_way_anova(apart).reason) == (math.inf, 0.0, NO_ERROR)
    assert math.isnan(tukey_hsd(same)[0].p)
    assert tukey_hsd(apart)[0].p == 0.0


MISSING = pd.DataFrame({"a": [1.0, 2.0, 3.0], "b": [2.0, None, 4.0]})


@pytest.mark.parametrize("test", [rm_anova, rm_tukey_hsd, rm_tukey_hsd_paired])
@pytest.mark.parametrize(
    ("scores", "reason"),
    [
        (np.ones((1, 3)), "scores must be of at least 2 participants and 2 conditions, not 1 and 3"),
        (np.ones((14, 1)), "scores must be of at least 2 participants and 2 conditions, not 14 and 1"),
        (np.ones(3), r"two axes \(participants, conditions\), not 1"),
        ([], "two axes"),
        ([[1.0, 2.0], [3.0, math.nan]], r"finite, but the value at index \(1, 1\) is nan"),
        ([[1.0, 2.0], [-math.inf, 3.0]], r"finite, but the value at index \(1, 0\) is -inf"),
        (MISSING, r"scores\['b'\] must be finite, but the value at index \(1,\) is nan"),
        (MISSING.astype("Int64"), r"scores\['b'\] must be finite, but the value at index \(1,\) is nan"),
        ([[1.0, 2.0], [None, 3.0]], r"value at index \(1, 0\) is None"),
        (np.ma.masked_equal([[1.0, 2.0], [3.0, -1.0]], -1.0), r"index \(1, 1\) is masked"),
        ([["1", "2"], ["3", "4"]], r"must be numbers .* value at index \(0, 0\) is '1'"),
        ([[1.0, "two"], [3.0, 4.0]], "must be numbers"),
        ([[1.0, 2.0], [3.0]], "full rectangle: row 0 has 2 values, row 1 has 1"),
        ([[1.0 + 1j, 2.0], [3.0, 4.0]], "must be numbers"),
    ],
)
def test_what_cannot_be_tested_is_refused_with_its_place(
    test: Callable[[object], object], scores: object, reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        test(scores)


@pytest.mark.parametrize(
    ("groups", "reason"),
    [
        ([[1.0, 2.0]], "groups must be at least 2, not 1"),
        ([[1.0, 2.0], []], r"groups\[1\] must hold at least one value"),
        ([[1.0], [2.0]], "groups: none has two values"),
        ([[1.0, 2.0], [math.inf, 1.0]], r"groups\[1\] must be finite, but the value at index \(0,\) is inf"),
        ([[1.0, 2.0], ["a", "b"]], r"groups\[1\] must be numbers"),
    ],
)
def test_groups_that_cannot_be_tested_are_refused(groups: list[list[float]], reason: str) -> None:
    for test in (one_way_anova, tukey_hsd):
        with pytest.raises(ValueError, match=reason):
            test(groups)


def test_the_callers_table_is_left_as_it_was() -> None:
    for shape in ((14, 3), (2, 2), (1, 14, 3)):
        scores = np.random.default_rng(7).normal(size=shape) * 1e5
        before = scores.copy()
        rm_anova(scores)
        rm_tukey_hsd_paired(scores)
        one_way_anova([scores, scores + 1.0])
        assert (scores == before).all()


def test_a_batch_of_no_data_sets_gives_no_results() -> None:
    assert rm_anova(np.ones((0, 14, 3))).F.shape == (0,)
