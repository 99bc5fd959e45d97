"""Data sets from published numbers: samples that existed are found again, and what is found meets every constraint."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations_with_replacement, product
from pathlib import Path
from random import Random

import numpy as np
import pytest

from analysis import rm_anova, rm_tukey_hsd
from analysis.paper.audit.means import scale_of
from analysis.paper.audit.participants import attainable_f, backward_counts, forward_counts, rating_grains
from analysis.paper.audit.printed import Interval, read_printed
from analysis.paper.audit.reconstruct import (
    ColumnOrder,
    ConditionColumn,
    Constraints,
    meets,
    reconstruct,
)
from analysis.paper.audit.variance_ratios import repeated_f
from analysis.paper.paper import Paper, load_paper
from analysis.stats.binomial import binomial_test
from tests.exact import exact_rm_F
from tests.summarised_data import DESIGNS, MEANS, cases, printed_constraints, summarised

METHODS = ["vibration", "asymmetric-1", "asymmetric-2"]
ASSUMED = {"vibration": 0.479, "asymmetric-1": 0.793, "asymmetric-2": 0.929}
"""Conditions, and whether SDs are printed beside the means and F."""


@pytest.fixture(scope="module")
def paper() -> Paper:
    return load_paper(Path(__file__).parent.parent / "configs" / "paper.toml")


@pytest.mark.slow
@pytest.mark.parametrize(("k", "with_sds"), DESIGNS)
def test_samples_that_existed_are_found_again(k: int, with_sds: bool) -> None:
    """Twelve a design here; `make soak` takes a thousand, and their times."""
    for seed, wanted in enumerate(cases(k, with_sds, 12)):
        found = reconstruct(wanted, seed)
        assert found.data, wanted
        assert meets(found.data[0], wanted)


@pytest.mark.parametrize(("n", "k", "top"), [(4, 1, 5), (3, 2, 2), (4, 2, 1), (3, 3, 1)])
def test_small_spaces_are_counted_in_full(n: int, k: int, top: int) -> None:
    """Against a plain loop over all multisets of rows, F by exact sums."""
    every = list(combinations_with_replacement(list(product(range(top + 1), repeat=k)), n))
    random = Random(n * k)
    for rows in random.sample(every, min(12, len(every))):
        wanted = summarised(rows, top, with_sds=True)
        if wanted is None:
            continue
        found = reconstruct(wanted, 0, count=10**6)
        mine = [other for other in every if meets(other, wanted)]
        assert (found.space, found.exists) == (len(mine), True)
        assert {tuple(sorted(one)) for one in found.data} == {tuple(sorted(one)) for one in mine}


def test_that_there_are_none_is_said_by_proof_only() -> None:
    """F = 28.45 is off the lattice of these column sums; no two people answer yes or no with a mean of .3."""
    rates = scale_of("0.1", "0", "1")
    off = printed_constraints(14, ["55.7%", "79.3%", "92.9%"], rates, F="28.45")
    assert (reconstruct(off).exists, reconstruct(off).data) == (False, ())
    assert reconstruct(printed_constraints(2, [".30"], scale_of("1", "0", "1"))).exists is False
    contradiction = (ColumnOrder(one=0, other=1, above=14), ColumnOrder(one=1, other=0, above=14))
    open_case = Constraints(
        n=14, top=10, columns=(ConditionColumn(sums=[70]), ConditionColumn(sums=[70])), orders=contradiction
    )
    assert reconstruct(open_case, starts=2).exists is None


def test_orders_and_column_sums_are_kept() -> None:
    orders = (ColumnOrder(one=1, other=0, above=9), ColumnOrder(one=2, other=1, tied=4))
    wanted = Constraints(
        n=12, top=20, columns=tuple(ConditionColumn(sums=[total]) for total in (60, 90, 95)), orders=orders
    )
    for rows in reconstruct(wanted, 3, count=20).data:
        table = np.array(rows)
        assert table.sum(axis=0).tolist() == [60, 90, 95]
        assert (table[:, 1] > table[:, 0]).sum() == 9
        assert (table[:, 2] == table[:, 1]).sum() == 4


def test_the_same_seed_gives_the_same_data_and_others_differ() -> None:
    wanted = printed_constraints(14, ["55.7%", "79.3%", "92.9%"], scale_of("0.1", "0", "1"), F="28.51")
    assert reconstruct(wanted, 1).data == reconstruct(wanted, 1).data
    many = reconstruct(wanted, 1, count=20)
    assert len({tuple(sorted(rows)) for rows in many.data}) == 20
    assert many.succeeded <= many.starts


def test_the_nearest_attainable_f_takes_the_place_of_the_published_one() -> None:
    found = repeated_f("28.45", 14, 3, ["55.7%", "79.3%", "92.9%"], grain="0.1", low="0", high="1")
    assert attainable_f("28.45", found) == (Interval(Fraction(27001, 947), Fraction(27001, 947)), "28.51")
    plain = repeated_f("28.51", 14, 3, ["55.7%", "79.3%", "92.9%"], grain="0.1", low="0", high="1")
    assert attainable_f("28.51", plain)[1] == "28.51"


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_rebuilt_answers_of_experiment_1_give_all_that_is_published(paper: Paper, seed: int) -> None:
    """By other routes than the search: exact fractions, our ANOVA, Tukey and binomial tests."""
    forward = forward_counts(paper.direction, seed)
    table = np.array(forward.rows)
    assert (forward.F, forward.nearest_only) == ("28.51", True)
    assert table.sum(axis=0).tolist() == [78, 111, 130]
    assert table.min() >= 0
    assert table.max() <= 10
    assert exact_rm_F(table.astype(float)) == Fraction(27001, 947)
    _check_pattern(table / 10)
    backward = np.array(backward_counts(paper.direction, ASSUMED, seed).data[0])
    for column, p in ((table, 0.205), (backward, 0.673)):
        assert round(float(binomial_test(int(column[:, 0].sum()), 140).p), 3) == p
    assert backward.sum(axis=0).tolist() == [67, 111, 130]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_rebuilt_ratings_of_experiment_2_give_all_that_is_published(paper: Paper, seed: int) -> None:
    table = np.array(rating_grains(paper.preference, MEANS, "0.1", 0.6, seed).rows)
    assert table.shape == (14, 3)
    assert f"{float(exact_rm_F(table.astype(float))):.3f}" == "33.810"
    _check_pattern(table / 10)
    assert (table[:, 0] < table[:, 1:].min(axis=1)).all()
    assert (table[:, 1] == table[:, 2]).sum() == 2
    assert np.abs(table.mean(axis=0) / 10 - [2.4, 6.0, 7.8]).max() <= 0.3 + 1e-9


def _check_pattern(scores: np.ndarray) -> None:
    """Two and one stars' worth: .001 for both against vibration, .05 but not .01 between the two."""
    assert rm_anova(scores).p < 0.001
    p = {frozenset((c.a, c.b)): c.p for c in rm_tukey_hsd(scores, METHODS)}
    assert p[frozenset(METHODS[:2])] < 0.001
    assert p[frozenset((METHODS[0], METHODS[2]))] < 0.001
    assert 0.01 <= p[frozenset(METHODS[1:])] < 0.05


def test_numbers_that_contradict_each_other_are_refused_in_words(paper: Paper) -> None:
    means = {"vibration": 7.8, "asymmetric-1": 6.0, "asymmetric-2": 2.4}
    with pytest.raises(ValueError, match="no participants meet the published numbers together"):
        rating_grains(paper.preference, means, "0.1", 0.6, 1)


def test_a_reconstruction_needs_a_scale_with_ends() -> None:
    with pytest.raises(ValueError, match="both ends"):
        printed_constraints(5, ["2.0"], scale_of("1"))
    assert read_printed("2.0").digits == 20
