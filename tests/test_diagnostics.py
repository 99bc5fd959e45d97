from __future__ import annotations

import numpy as np
import pytest

from analysis.stats.diagnostics import NO_RESIDUALS, TOO_MANY, ends, normality, outliers
from tests.made_scores import RIGHT


def test_shapiro_wilk_of_the_residuals_equals_r() -> None:
    found = normality(RIGHT)  # R 4.2.2: shapiro.test(residuals(lm(y ~ m + id, d)))
    assert (found.W, found.p) == pytest.approx((0.949001646180764, 0.0594847110701181), rel=1e-6)
    assert found.n == 42


def test_beyond_5000_residuals_there_is_shape_and_a_reason() -> None:
    found = normality(np.random.default_rng(1).exponential(size=(2000, 3)))
    assert (found.W, found.p, found.reason) == (None, None, TOO_MANY)
    assert found.excess_kurtosis is not None
    assert found.excess_kurtosis > 1.0


@pytest.mark.parametrize("scores", [np.ones((5, 3)), np.add.outer([0.1, 0.4], [0.1, 0.2])])
def test_no_residuals_give_a_reason(scores: object) -> None:
    found = normality(scores)  # type: ignore[arg-type]
    assert (found.W, found.skewness, found.reason) == (None, None, NO_RESIDUALS)


def test_the_fences_are_one_and_a_half_interquartile_ranges_from_the_quartiles() -> None:
    """By hand: 1..9 and 20 have quartiles 3.25 and 7.75, an upper fence of 14.5 and a lower of -3.5."""
    column = np.array([1, 2, 3, 4, 5, 6, 7, 8, 9, 20.0])
    (found,) = outliers(np.column_stack([column, np.arange(10.0)]))
    assert (found.row, found.column, found.score, found.fence) == (9, 0, 20.0, 14.5)


def test_a_score_on_the_fence_is_no_outlier_in_tenths() -> None:
    tenths = np.array([0.5, 0.8, 0.8, 0.8, 0.9, 0.9, 1.0, 1.0, 1.0])[:, None]  # quartiles 0.8 and 1.0, fence 0.5
    assert outliers(tenths) == ()


def test_where_three_quarters_agree_any_other_score_is_out() -> None:
    assert [o.row for o in outliers(np.array([1.0] * 12 + [0.9, 0.2])[:, None])] == [12, 13]


def test_floor_and_ceiling_are_counted() -> None:
    found = ends([[0.0, 1.0], [0.5, 1.0], [0.0, 0.9]], (0.0, 1.0))
    assert (found.floor, found.ceiling) == ((2, 0), (0, 2))
