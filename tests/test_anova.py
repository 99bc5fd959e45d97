from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats
from statsmodels.stats.anova import AnovaRM

from analysis import one_way_anova, rm_anova
from tests.exact import digits, exact_one_way_F, exact_rm_F, p_digits
from tests.made_scores import KINDS, made_scores

TENTHS = arrays(np.int64, st.tuples(st.integers(2, 8), st.integers(2, 5)), elements=st.integers(0, 10))
FINITE = arrays(
    np.float64,
    st.tuples(st.integers(2, 6), st.integers(2, 4)),
    elements=st.floats(-1e300, 1e300, allow_nan=False, allow_subnormal=True),
)


def _table(seed: int, n: int = 14, k: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(n, k)) + np.arange(k) * 0.5


@pytest.mark.parametrize("seed", range(5))
def test_F_and_p_agree_with_statsmodels_AnovaRM_to_ten_digits(seed: int) -> None:
    scores = _table(seed)
    frame = pd.DataFrame(scores).reset_index().melt(id_vars="index")
    row = AnovaRM(frame, "value", "index", within=["variable"]).fit().anova_table.iloc[0]
    found = rm_anova(scores)
    assert pytest.approx(row["F Value"], rel=1e-10) == found.F
    assert found.p == pytest.approx(row["Pr > F"], rel=1e-9)
    assert (found.df_effect, found.df_error) == (row["Num DF"], row["Den DF"]) == (2, 26)


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e6, 1e9, 1e12])
@pytest.mark.parametrize("exponent", [-1000, -500, 0, 500, 950])
def test_repeated_measures_F_keeps_fifteen_digits_at_any_offset_and_scale(offset: float, exponent: int) -> None:
    scores = np.ldexp(_table(1) + offset, exponent)
    assert digits(rm_anova(scores).F, exact_rm_F(scores)) >= 15


@pytest.mark.parametrize("scale", [1e-300, 1e-160, 1e154, 1e290, 1e300])
def test_repeated_measures_F_keeps_fifteen_digits_at_scales_that_are_no_powers_of_two(scale: float) -> None:
    scores = (_table(1) + 7.0) * scale
    assert digits(rm_anova(scores).F, exact_rm_F(scores)) >= 15


@pytest.mark.slow
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(2, 40),
    k=st.integers(2, 10),
    offset=st.sampled_from([1.0, 1e4, 1e8, 1e12]),
    exponent=st.integers(-990, 950),
    kind=st.sampled_from(KINDS),
)
@settings(max_examples=80)
def test_F_has_fifteen_digits_and_p_thirteen(exponent: int, **table: Any) -> None:
    scores = np.ldexp(made_scores(**table), exponent)
    found = rm_anova(scores)
    assert found.ss_error >= 0.0
    assert digits(found.F, exact_rm_F(scores)) >= 15
    assert p_digits(found) >= 13


@pytest.mark.parametrize("offset", [0.0, 1e6, 1e12])
@pytest.mark.parametrize("exponent", [-1000, 0, 950])
def test_between_subjects_F_keeps_fifteen_digits_at_any_offset_and_scale(offset: float, exponent: int) -> None:
    rng = np.random.default_rng(2)
    groups = [np.ldexp(rng.normal(size=n) + 0.3 * n + offset, exponent) for n in (5, 6, 9)]
    assert digits(one_way_anova(groups).F, exact_one_way_F(groups)) >= 15


def test_a_huge_effect_with_tiny_residuals_keeps_its_digits() -> None:
    scores = np.arange(3.0) + 1e-7 * _table(3)
    assert digits(rm_anova(scores).F, exact_rm_F(scores)) >= 15


def test_between_subjects_anova_agrees_with_scipy() -> None:
    groups = [_table(4, n, 2)[:, 0] for n in (4, 7, 9)]
    F, p = stats.f_oneway(*groups)
    found = one_way_anova(groups)
    assert (found.F, found.p) == (pytest.approx(F, rel=1e-12), pytest.approx(p, rel=1e-11))
    assert (found.df_effect, found.df_error) == (2, 17)


def test_two_conditions_give_the_square_of_the_paired_t() -> None:
    scores = _table(5, k=2)
    t = stats.ttest_rel(scores[:, 0], scores[:, 1]).statistic
    assert pytest.approx(t**2, rel=1e-12) == rm_anova(scores).F


def test_sums_of_squares_add_up_to_the_total() -> None:
    scores = _table(6)
    found = rm_anova(scores)
    total = np.square(scores - scores.mean()).sum()
    assert found.ss_effect + found.ss_error + found.ss_participants == pytest.approx(total, rel=1e-13)
    assert found.ms_error == pytest.approx(found.ss_error / 26, rel=1e-15)


@pytest.mark.slow
@given(TENTHS)
def test_tenths_give_the_F_of_exact_arithmetic(counts: np.ndarray) -> None:
    found = rm_anova(counts / 10)
    try:
        expected = float(exact_rm_F(counts))
    except ZeroDivisionError:
        assert math.isnan(found.F) or math.inf == found.F
        return
    assert pytest.approx(expected, rel=1e-11, abs=1e-25) == found.F


@pytest.mark.slow
@given(FINITE)
def test_the_error_sum_of_squares_is_never_negative_and_p_is_a_probability(scores: np.ndarray) -> None:
    found = rm_anova(scores)
    assert found.ss_error >= 0.0
    assert math.isnan(found.p) or 0.0 <= found.p <= 1.0


@given(st.integers(0, 2**32 - 1), st.integers(-900, 900))
@settings(max_examples=50)
def test_F_does_not_know_the_unit_nor_the_order_of_participants(seed: int, exponent: int) -> None:
    scores = _table(seed)
    F = rm_anova(scores).F
    assert rm_anova(np.ldexp(scores, exponent)).F == F
    shuffled = np.random.default_rng(seed).permutation(scores, axis=0)
    assert pytest.approx(F, rel=1e-12) == rm_anova(shuffled).F


@given(st.integers(0, 2**32 - 1), st.integers(-(2**20), 2**20))
@settings(max_examples=50)
def test_F_does_not_know_the_zero_of_the_scale(seed: int, shift: int) -> None:
    scores = np.random.default_rng(seed).integers(0, 101, size=(8, 3)).astype(float)
    assert pytest.approx(rm_anova(scores).F, rel=1e-12, nan_ok=True) == rm_anova(scores + shift).F


def test_many_tables_at_once_are_the_same_as_one_after_the_other() -> None:
    tables = np.stack([_table(seed) * 10.0**seed for seed in range(6)]).reshape(2, 3, 14, 3)
    together = rm_anova(tables)
    alone = [rm_anova(table) for table in tables.reshape(6, 14, 3)]
    assert together.F.shape == (2, 3)
    for name in ("F", "p", "ss_effect", "ss_error", "ms_error", "ss_participants"):
        assert getattr(together, name).ravel() == pytest.approx([getattr(one, name) for one in alone], rel=1e-13)


def test_groups_broadcast_over_their_leading_axes() -> None:
    rng = np.random.default_rng(8)
    first, second = rng.normal(size=(4, 5)), rng.normal(size=(7,))
    together = one_way_anova([first, second])
    assert pytest.approx([one_way_anova([row, second]).F for row in first], rel=1e-13) == together.F


def test_one_table_gives_plain_floats() -> None:
    found = rm_anova(_table(9))
    assert type(found.F) is float
    assert type(found.p) is float
