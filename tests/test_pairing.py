"""Active pairing: the next pair follows from the choices, connects the items, and is where their order is in doubt."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from scipy.optimize import minimize
from scipy.special import expit, log_expit, ndtr

from experiments.design.procedures.pairing import (
    PairingRule,
    item_posterior,
    next_pair,
    order_gains,
    pair_after,
    pairing_rule,
)
from experiments.design.streams import Stream

ITEMS = 5
RULE = pairing_rule(ITEMS, Stream(7, "pairs"))
some_choices = some.lists(
    some.permutations(range(ITEMS)).flatmap(
        lambda order: some.tuples(some.just(order[0]), some.just(order[1]), some.sampled_from([0.0, 0.5, 1.0]))
    ),
    max_size=20,
)


def wins_of(choices: list[tuple[int, int, float]]) -> np.ndarray:
    wins = np.zeros((ITEMS, ITEMS))
    for first, second, chosen in choices:
        wins[first, second] += chosen
        wins[second, first] += 1 - chosen
    return wins


def run(rule: PairingRule, scores: np.ndarray, trials: int) -> list[tuple[int, int, float]]:
    """The comparisons of somebody who always chooses the better item."""
    choices = list[tuple[int, int, float]]()
    for _ in range(trials):
        first, second = pair_after(rule, choices)
        choices.append((first, second, float(scores[first] > scores[second])))
    return choices


def test_a_rule_has_each_pair_once_in_an_order_of_its_stream() -> None:
    assert sorted(tuple(sorted(pair)) for pair in RULE.pairs.tolist()) == list(combinations(range(ITEMS), 2))
    assert np.array_equal(RULE.pairs, pairing_rule(ITEMS, Stream(7, "pairs")).pairs)
    assert not np.array_equal(RULE.pairs, pairing_rule(ITEMS, Stream(8, "pairs")).pairs)


@pytest.mark.parametrize("items", [2, 3, 6])
def test_the_items_are_connected_first(items: int) -> None:
    choices = run(pairing_rule(items, Stream(items, "pairs")), np.arange(items), items - 1)
    groups = {item: {item} for item in range(items)}
    for first, second, _ in choices:
        assert groups[first] is not groups[second]
        groups[first] |= groups[second]
        groups.update(dict.fromkeys(groups[first], groups[first]))
    assert groups[0] == set(range(items))


def test_no_pair_comes_twice_in_a_row_and_its_items_change_places_when_it_comes_again() -> None:
    shown = [(first, second) for first, second, _ in run(RULE, np.array([0, 9, 1, 8, 4]), 24)]
    assert all(set(one) != set(other) for one, other in pairwise(shown))
    for pair in combinations(range(ITEMS), 2):
        again = [one for one in shown if set(one) == set(pair)]
        assert all(one == other[::-1] for one, other in pairwise(again))


def test_two_items_are_one_pair() -> None:
    assert len({frozenset(choice[:2]) for choice in run(pairing_rule(2, Stream(1, "pairs")), np.arange(2), 4)}) == 1


@pytest.mark.slow
@given(some_choices)
def test_what_comes_next_is_that_of_the_counts_and_of_the_pair_before(choices: list[tuple[int, int, float]]) -> None:
    """So a correction counts as if it had been said at once, and a resumed run goes on as the one that broke off."""
    pair = pair_after(RULE, choices)
    if choices:
        assert pair_after(RULE, [*choices[:-1][::-1], choices[-1]]) == pair
    last = next(
        (place for place, one in enumerate(RULE.pairs.tolist()) if choices and set(one) == set(choices[-1][:2])), -1
    )
    many = next_pair(RULE, np.stack([wins_of(choices)] * 2), np.array([last, last]))
    assert [set(RULE.pairs[place].tolist()) for place in many] == [set(pair)] * 2


@pytest.mark.slow
@given(some_choices, some.floats(0.3, 5.0))
def test_scores_are_the_posteriors_mode_and_the_covariance_its_curvature(
    choices: list[tuple[int, int, float]], spread: float
) -> None:
    """Against scipy's minimiser and its own formula for the information of a Bernoulli trial."""
    wins = wins_of(choices)

    def loss(scores: np.ndarray) -> float:
        return float((scores**2).sum() / (2 * spread**2) - (wins * log_expit(scores[:, None] - scores)).sum())

    found, covariance = item_posterior(wins, spread)
    assert found == pytest.approx(minimize(loss, np.zeros(ITEMS), tol=1e-9).x, abs=1e-4)
    information = np.eye(ITEMS) / spread**2
    for one, other in combinations(range(ITEMS), 2):
        contrast = np.eye(ITEMS)[one] - np.eye(ITEMS)[other]
        share = expit(found[one] - found[other])
        compared = wins[one, other] + wins[other, one]
        information += compared * share * (1 - share) * np.outer(contrast, contrast)
    assert covariance @ information == pytest.approx(np.eye(ITEMS), abs=1e-6)


def test_scores_are_found_however_one_sided_the_choices() -> None:
    wins = np.triu(np.full((ITEMS, ITEMS), 1e6), 1)
    scores, _ = item_posterior(wins, 2.0)
    share = expit(scores[:, None] - scores)
    slope = (wins - (wins + wins.T) * share).sum(axis=-1) - scores / 4
    assert slope == pytest.approx(np.zeros(ITEMS), abs=1e-3)
    assert np.all(np.diff(scores) < 0)


@pytest.mark.slow
@given(some_choices)
def test_gains_are_the_doubt_of_order_that_one_more_choice_takes_away(choices: list[tuple[int, int, float]]) -> None:
    """By hand for one pair: the normal posterior after either choice, and Σ π (1 - π) of all pairs."""
    scores, covariance = item_posterior(wins_of(choices), RULE.spread)
    one, other = RULE.pairs[3]
    contrast = np.eye(ITEMS)[one] - np.eye(ITEMS)[other]
    share, variance = expit(contrast @ scores), contrast @ covariance @ contrast
    information = np.linalg.inv(covariance) + share * (1 - share) * np.outer(contrast, contrast)
    after = np.linalg.inv(information)
    likely = expit(contrast @ scores / np.sqrt(1 + np.pi / 8 * variance))
    left = sum(
        weight * doubt_of_order(scores + after @ contrast * (chosen - share), after)
        for chosen, weight in ((1, likely), (0, 1 - likely))
    )
    found = order_gains(RULE, scores, covariance)[3]
    assert found == pytest.approx(doubt_of_order(scores, covariance) - left, abs=1e-9)


def doubt_of_order(scores: np.ndarray, covariance: np.ndarray) -> float:
    doubt = 0.0
    for one, other in combinations(range(ITEMS), 2):
        contrast = np.eye(ITEMS)[one] - np.eye(ITEMS)[other]
        above = ndtr(contrast @ scores / np.sqrt(contrast @ covariance @ contrast))
        doubt += above * (1 - above)
    return float(doubt)


def test_neighbours_are_compared_more_often_than_what_is_far_apart() -> None:
    shown = [abs(first - second) for first, second, _ in run(RULE, np.arange(ITEMS), 30)]
    assert sum(distance == 1 for distance in shown) > 2 * sum(distance >= 3 for distance in shown)


@pytest.mark.parametrize(("items", "spread"), [(1, 2.0), (3, 0.0), (3, float("nan"))])
def test_what_is_no_rule_is_refused(items: int, spread: float) -> None:
    with pytest.raises(ValueError, match=r"items must be at least 2 and spread above 0, not"):
        pairing_rule(items, Stream(1, "pairs"), spread)
