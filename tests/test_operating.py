from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from analysis import rm_tukey_hsd, rm_tukey_hsd_paired
from analysis.stats.anova import pairs_of
from analysis.stats.operating import ALPHA, POST_HOCS, box_epsilon, characteristics

DATA_SETS = 4_000


@pytest.fixture(scope="module")
def found():
    return characteristics(7, data_sets=DATA_SETS)


def of(found, name):
    return [one for one in found if one.post_hoc == name]


@pytest.mark.slow
def test_every_post_hoc_keeps_the_error_that_it_claims(found) -> None:
    claimed = [one for one in found if one.claimed is not None]
    assert len(claimed) == 7
    for one in claimed:
        bound = one.claimed + 3 * one.monte_carlo_error(one.claimed)
        assert max(one.null_error, one.partial_error) < bound, one


@pytest.mark.slow
def test_pooling_the_error_is_nominal_at_sphericity_and_liberal_far_from_it(found) -> None:
    at_one, _, far = of(found, "Tukey, pooled error")
    assert at_one.epsilon == pytest.approx(1.0)
    assert abs(at_one.null_error - ALPHA) < 3 * at_one.monte_carlo_error(ALPHA)
    assert far.epsilon < 0.55
    assert far.null_error > ALPHA + 2 * far.monte_carlo_error(ALPHA)


@pytest.mark.slow
def test_taking_the_same_people_for_others_costs_most_of_the_power(found) -> None:
    assert of(found, "Tukey between participants, misused")[0].power < 0.4 * of(found, "Tukey, pooled error")[0].power


def test_the_same_seed_gives_the_same_shares_and_another_does_not(found) -> None:
    small = {"data_sets": 200, "ratios": (1.0,)}
    assert characteristics(1, **small) == characteristics(1, **small)
    assert characteristics(1, **small) != characteristics(2, **small)


def test_more_data_sets_than_a_chunk_are_all_counted() -> None:
    one = characteristics(3, data_sets=5_001, ratios=(1.0,))[0]
    assert (one.null_error * 5_001) == pytest.approx(round(one.null_error * 5_001), abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_what_a_post_hoc_finds_is_what_its_own_function_says(seed: int) -> None:
    scores = np.random.default_rng(seed).normal([0.0, 0.4, 0.9], [1.0, 1.0, 2.0], (14, 3))
    pooled, paired, holm, between = (post_hoc.rejects(scores).tolist() for post_hoc in POST_HOCS)
    assert pooled == [one.p < ALPHA for one in rm_tukey_hsd(scores)]
    assert paired == [one.p < ALPHA for one in rm_tukey_hsd_paired(scores)]
    p = [float(stats.ttest_rel(scores[:, a], scores[:, b]).pvalue) for a, b in pairs_of(3)]
    assert holm == holm_by_hand(p)
    theirs = stats.tukey_hsd(*scores.T).pvalue
    assert between == [bool(theirs[a, b] < ALPHA) for a, b in pairs_of(3)]


def holm_by_hand(p: list[float]) -> list[bool]:
    rejected = [False] * len(p)
    for tried, i in enumerate(sorted(range(len(p)), key=lambda i: p[i])):
        if p[i] > ALPHA / (len(p) - tried):
            break
        rejected[i] = True
    return rejected


def test_epsilon_is_one_at_sphericity_and_reaches_its_least_value() -> None:
    common = np.full((4, 4), 0.7) + 0.3 * np.eye(4)
    assert box_epsilon(common) == pytest.approx(1.0)
    assert box_epsilon(np.diag([1e-12, 1e-12, 1.0])) == pytest.approx(0.5)
