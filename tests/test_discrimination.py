"""d′ of tasks with several intervals, against people who are simulated by their strategy and against known values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from analysis.stats.discrimination import CHANCE, SHARE_RIGHT, discrimination

TASKS = list(CHANCE)
N = 400_000


def simulated(task, d):
    """How often who follows the task's strategy is right: N trials, each drawn anew."""
    random = np.random.default_rng(8)
    if task == "two-interval":
        return np.mean(random.normal(d, size=N) > random.normal(size=N))
    if task == "abx":
        a, b, x_is_b = random.normal(size=N), random.normal(d, size=N), random.random(N) < 0.5
        x = random.normal(np.where(x_is_b, d, 0.0))
        return np.mean((np.abs(x - b) < np.abs(x - a)) == x_is_b)
    odd = np.stack([random.normal(d, size=N), random.normal(size=N), random.normal(size=N)])
    between = [np.abs(odd[1] - odd[2]), np.abs(odd[0] - odd[2]), np.abs(odd[0] - odd[1])]
    return np.mean(np.argmin(between, axis=0) == 0)


@pytest.mark.slow
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("d", [0.0, 0.5, 1.0, 2.0, 3.5])
def test_it_is_what_people_of_that_strategy_get_right(task, d):
    p = float(SHARE_RIGHT[task](np.asarray(d)))
    assert p == pytest.approx(simulated(task, d), abs=5 * np.sqrt(p * (1 - p) / N) + 1e-9)


@pytest.mark.parametrize("task", TASKS)
def test_it_begins_at_chance_and_ends_at_certainty(task):
    p = SHARE_RIGHT[task](np.linspace(0, 20, 400))
    assert p[0] == pytest.approx(CHANCE[task], abs=1e-12)
    assert p[-1] == pytest.approx(1.0, abs=1e-12)
    assert np.all(np.diff(p) >= -1e-15)


@pytest.mark.slow
@given(st.sampled_from(TASKS), st.integers(1, 2000), st.data())
def test_the_share_of_its_d_prime_is_the_one_it_came_from(task, trials, data):
    right = data.draw(st.integers(0, trials))
    found = discrimination(right, trials, task)
    share = (right + 0.5) / (trials + 1) if found.corrected else right / trials
    assert float(SHARE_RIGHT[task](np.asarray(found.d_prime))) == pytest.approx(max(share, CHANCE[task]), abs=1e-9)
    assert found.corrected == (right in (0, trials))
    assert np.isnan(found.se) == (share <= CHANCE[task])


def test_two_intervals_have_the_textbooks_d_prime_and_its_error():
    found = discrimination(80, 100, "two-interval")
    assert found.d_prime == pytest.approx(np.sqrt(2) * stats.norm.ppf(0.8), rel=1e-12)
    z = stats.norm.ppf(0.8)
    assert found.se == pytest.approx(np.sqrt(2) * np.sqrt(0.8 * 0.2 / 100) / stats.norm.pdf(z), rel=1e-6)


@pytest.mark.parametrize(("right", "trials"), [(-1, 10), (11, 10), (0, 0)])
def test_what_no_count_is_is_refused(right, trials):
    with pytest.raises(
        ValueError, match=r"right must be a whole number from 0 to 10|trials must be a whole number from 1"
    ):
        discrimination(right, trials, "oddity")
