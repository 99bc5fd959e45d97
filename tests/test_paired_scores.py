"""Paired comparison: choix's scores, ties, who cannot be scored, and circular triads."""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as some
from scipy.optimize import linprog
from scipy.stats import norm, t

from analysis.psychometric.paired import PairModel, circular_triads, paired_scores

GOLDEN: list[dict[str, Any]] = json.loads((Path(__file__).parent / "golden" / "choix.json").read_text())
WINS = np.array([[0, 7, 9], [3, 0, 6], [1, 4, 0]])
MODELS: tuple[PairModel, ...] = ("bradley-terry", "thurstone")


def scored(wins: Any, **more: Any) -> np.ndarray:
    found = paired_scores(range(len(wins)), wins, **more)
    assert found.reason is None
    return np.array([one.score for one in found.scores])


@pytest.mark.slow
@pytest.mark.parametrize("case", GOLDEN[:12], ids=str)
def test_scores_are_those_of_choix(case: dict[str, Any]) -> None:
    assert scored(case["wins"]) == pytest.approx(case["scores"], abs=1e-6)


def test_two_items_have_the_score_of_their_share() -> None:
    """By hand: the logit, or normal score, of 8 of 10; the se of a logit is 1 / √(n p (1 - p))."""
    wins = [[0, 8], [2, 0]]
    assert np.diff(scored(wins))[0] == pytest.approx(-np.log(4), abs=1e-9)
    assert np.diff(scored(wins, model="thurstone"))[0] == pytest.approx(norm.ppf(0.2), abs=1e-9)
    assert paired_scores(list("ab"), wins).scores[0].se == pytest.approx(0.5 / np.sqrt(10 * 0.8 * 0.2), rel=1e-6)


@pytest.mark.parametrize("model", MODELS)
def test_ties_are_fitted_as_often_as_they_come(model: PairModel) -> None:
    """Of two items alone the model has as many parameters as there are shares: 5 over, 3 under, 2 ties."""
    found = paired_scores(list("ab"), [[0, 5], [3, 0]], [[0, 2], [2, 0]], model=model)
    difference = found.scores[0].score - found.scores[1].score
    if model == "bradley-terry":
        weights = np.array([np.exp(difference / 2), np.exp(-difference / 2), found.tie])
        assert weights / weights.sum() == pytest.approx([0.5, 0.3, 0.2], abs=1e-6)
    else:
        assert norm.cdf(difference - found.tie) == pytest.approx(0.5, abs=1e-6)
        assert norm.cdf(-difference - found.tie) == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    ("wins", "ties"),
    [([[0, 0], [0, 0]], [[0, 4], [4, 0]]), ([[0, 5], [0, 0]], [[0, 2], [2, 0]])],
    ids=["ties alone", "never the other way"],
)
def test_ties_that_leave_no_best_scores_are_told(model: PairModel, wins: Any, ties: Any) -> None:
    found = paired_scores(["a", "b"], wins, ties, model=model)
    assert found.reason is not None
    assert "ties" in found.reason


def can_grow(wins: np.ndarray, ties: np.ndarray) -> bool:
    """By linear programming: whether scores and ties can grow for ever so that no answer becomes less likely."""
    rows = [(i, j, 1.0) for i, j in np.argwhere(wins > 0)] + [(i, j, -1.0) for i, j in np.argwhere(ties > 0)]
    bounds = np.zeros((len(rows), len(wins)))
    for bound, (i, j, of) in zip(bounds, rows, strict=True):
        bound[i], bound[j] = -of, of  # least 1 apart, and at most 1 apart
    return linprog(np.zeros(len(wins)), bounds, [-of for _, _, of in rows], bounds=(None, None)).status == 0


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
@given(some.lists(some.integers(0, 2), min_size=9, max_size=9))
def test_there_are_scores_where_they_and_the_ties_cannot_grow_together(model: PairModel, counts: list[int]) -> None:
    wins, ties = np.zeros((3, 3)), np.zeros((3, 3))
    for place, (i, j) in enumerate(combinations(range(3), 2)):
        wins[i, j], wins[j, i], ties[i, j] = counts[3 * place : 3 * place + 3]
    ties += ties.T
    found = paired_scores(range(3), wins, ties, model=model)
    told = found.reason or ""
    assume("never" not in told and ties.any())  # of those another rule tells
    assert ("ties" in told) == can_grow(wins, ties)


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
@given(some.permutations(range(3)))
def test_the_order_of_the_items_is_nothing(model: PairModel, order: list[int]) -> None:
    assert scored(WINS[np.ix_(order, order)], model=model) == pytest.approx(scored(WINS, model=model)[order], abs=1e-8)


@pytest.mark.parametrize(
    ("wins", "said"),
    [
        ([[0, 3, 0, 0], [1, 0, 0, 0], [0, 0, 0, 2], [0, 0, 2, 0]], "never compared with each other: a, b | c, d"),
        ([[0, 7, 9, 1], [0, 0, 6, 1], [0, 4, 0, 1], [0, 1, 1, 0]], "never chosen over the others, or always"),
        (np.zeros((4, 4)), "never compared with each other: a | b | c | d"),
    ],
)
def test_items_without_scores_are_named(wins: Any, said: str) -> None:
    found = paired_scores(list("abcd"), wins)
    assert found.scores == ()
    assert found.reason is not None
    assert found.reason.startswith(said)


@pytest.mark.parametrize(
    ("items", "wins", "more", "said"),
    [
        ("aab", WINS, {}, "items must be at least two, each once"),
        ("ab", WINS, {}, r"wins must be of the shape \(2, 2\)"),
        ("abc", -WINS, {}, "wins must not be below 0"),
        ("abc", WINS + np.eye(3), {}, "wins must not be below 0, and 0 for an item and itself"),
        ("abc", WINS, {"ties": WINS}, "ties must be the same on both sides"),
        ("abc", WINS, {"confidence": 0.0}, "confidence must lie between 0 and 1"),
    ],
)
def test_counts_that_are_none_are_refused(items: str, wins: Any, more: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        paired_scores(list(items), wins, **more)


@pytest.mark.slow
@given(some.integers(3, 7), some.randoms(use_true_random=False))
def test_circular_triads_are_counted_as_by_hand(n: int, draws: Any) -> None:
    wins = np.zeros((n, n), int)
    for one, other in combinations(range(n), 2):
        first = draws.random() < 0.5
        wins[(one, other) if first else (other, one)] = 1
    found = circular_triads(range(n), wins)
    by_hand = sum(
        len({(wins[a, b], wins[b, c], wins[c, a])} & {(0, 0, 0), (1, 1, 1)}) for a, b, c in combinations(range(n), 3)
    )
    assert (found.triads, found.circular) == (n * (n - 1) * (n - 2) // 6, by_hand)
    assert found.zeta is not None
    assert -1e-12 <= found.zeta <= 1


def test_an_incomplete_design_has_no_coefficient() -> None:
    assert circular_triads(list("abc"), [[0, 1, 0], [0, 0, 0], [0, 0, 0]]).zeta is None


def test_people_who_differ_widen_the_intervals_and_leave_the_scores() -> None:
    """Half of the people choose all one way, half the other, against people who all choose alike."""
    one = np.array([[0, 8, 8], [2, 0, 8], [2, 2, 0]])
    alike, apart = np.stack([one + one.T] * 8), np.stack([one * 2, one.T * 2] * 4)
    together = paired_scores(["a", "b", "c"], alike)
    differing = paired_scores(["a", "b", "c"], apart)
    assert [x.score for x in differing.scores] == pytest.approx([x.score for x in together.scores], abs=1e-8)
    assert differing.people == 8
    assert differing.scores[0].high > 2 * together.scores[0].high


def test_of_two_items_the_sandwich_is_that_of_a_mean_of_shares() -> None:
    """By hand: the logit of a share p has the slope 1 / (p (1 - p)); the share is the mean over 5 people."""
    shares = np.array([0.9, 0.8, 0.4, 0.6, 0.8])
    wins = np.array([[[0, 10 * p], [10 * (1 - p), 0]] for p in shares]).round()
    found = paired_scores(["a", "b"], wins)
    mean, se = shares.mean(), shares.std(ddof=1) / np.sqrt(5)
    reach = t.ppf(0.975, 4) * se / (mean * (1 - mean)) / 2
    assert found.scores[0].high - found.scores[0].score == pytest.approx(reach, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_scores_and_errors_are_those_of_r(model: PairModel) -> None:
    """`glm` with a logit or probit. Its errors are by the expected information, of a logit the observed one."""
    by_r = json.loads((Path(__file__).parent / "golden" / "r" / "pairs_expected.json").read_text())["cases"]
    for ours, theirs in list(zip(GOLDEN, by_r, strict=True))[12:18]:
        found = paired_scores(range(len(ours["wins"])), ours["wins"], model=model)
        assert [one.score for one in found.scores] == pytest.approx(theirs[model]["scores"], abs=1e-6)
        errors = [one.se for one in found.scores]
        assert errors == pytest.approx(theirs[model]["se"], rel=1e-6 if model == "bradley-terry" else 0.06)
