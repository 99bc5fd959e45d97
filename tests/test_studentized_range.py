from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from analysis import studentized_range_isf, studentized_range_logsf, studentized_range_sf


@pytest.mark.parametrize(
    ("k", "df", "q"),
    [(3, 10, 3.877), (3, 20, 3.578), (4, 10, 4.327), (5, 20, 4.232), (3, 60, 3.399)],
)
def test_critical_values_of_five_percent_are_those_of_the_printed_tables(k: int, df: int, q: float) -> None:
    assert studentized_range_isf(0.05, k, df) == pytest.approx(q, abs=6e-4)  # Lawal 2003, table of q


@pytest.mark.parametrize("q", [0.5, 2.0, 5.0, 8.0])
def test_with_two_means_the_tail_is_the_two_sided_t_of_q_over_root_two(q: float) -> None:
    assert studentized_range_sf(q, 2, 13) == pytest.approx(2 * stats.t.sf(q / math.sqrt(2), 13), rel=1e-9)


@pytest.mark.parametrize("p", [0.5, 0.05, 0.001])
def test_isf_undoes_sf(p: float) -> None:
    assert studentized_range_sf(studentized_range_isf(p, 3, 26), 3, 26) == pytest.approx(p, rel=1e-9)


def test_the_logarithm_is_that_of_the_tail() -> None:
    assert studentized_range_logsf(3.5, 3, 26) == pytest.approx(math.log(studentized_range_sf(3.5, 3, 26)))


def test_the_ends_of_the_range_are_exact() -> None:
    assert studentized_range_sf([-1.0, 0.0, np.inf], 3, 26).tolist() == [1.0, 1.0, 0.0]
    assert studentized_range_isf([0.0, 1.0], 3, 26).tolist() == [np.inf, 0.0]
    assert math.isnan(studentized_range_sf(np.nan, 3, 26))
    assert studentized_range_logsf(np.inf, 3, 26) == -np.inf


def test_arguments_broadcast() -> None:
    q, k = np.array([[2.0], [4.0]]), np.array([2, 3])
    together = studentized_range_sf(q, k, 26)
    assert together.shape == (2, 2)
    assert together[1, 0] == studentized_range_sf(4.0, 2, 26)


@pytest.mark.parametrize(("k", "df", "reason"), [(1, 5, "at least 2"), (3, 0, "above 0"), (3, np.nan, "above 0")])
def test_impossible_parameters_are_refused(k: float, df: float, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        studentized_range_sf(1.0, k, df)


def test_a_probability_outside_its_range_is_refused() -> None:
    with pytest.raises(ValueError, match=r"0\.\.1, not 1\.5"):
        studentized_range_isf(1.5, 3, 26)
