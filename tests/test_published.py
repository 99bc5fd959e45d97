from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from analysis import rm_anova, rm_tukey_hsd
from analysis.paper.paper import Paper, load_paper
from analysis.paper.published import Prediction, Row, compare, rounds_to
from analysis.paper.recurrence import WHOLE_PATTERN, chance_recurs, odds_of, recurs, wilson_interval

METHODS = ("vibration", "asymmetric-1", "asymmetric-2")


@pytest.fixture(scope="module")
def paper() -> Paper:
    return load_paper(Path(__file__).parent.parent / "configs" / "paper.toml")


def _direction(**changes: Any) -> dict[str, Any]:
    """Statistics of experiment 1 exactly as the paper has them."""
    tukey = [
        ("asymmetric-1", "vibration", 1e-4),
        ("asymmetric-2", "vibration", 1e-9),
        ("asymmetric-2", "asymmetric-1", 0.02),
    ]
    found = {
        "n": 14,
        "means": {"vibration": 78 / 140, "asymmetric-1": 111 / 140, "asymmetric-2": 130 / 140},
        "sds": dict.fromkeys(METHODS, 0.1),
        "anova": {"F": 28.4512, "df": [2, 26], "p": 2.7e-7},
        "tukey": [{"a": a, "b": b, "difference": 0.2, "p": p} for a, b, p in tukey],
        "binomial": {"vibration": {"forward": {"p": 0.20473}, "backward": {"p": 0.67276}}},
        "backward": {"means": dict.fromkeys(METHODS, 0.5)},
    }
    return {"direction": found | changes}


def _row(rows: tuple[Row, ...], quantity: str, experiment: str = "direction") -> Row:
    (row,) = [row for row in rows if row.quantity == quantity and row.experiment == experiment]
    return row


def test_the_papers_own_numbers_agree_with_the_paper(paper: Paper) -> None:
    rows = [row for row in compare(_direction(), paper) if row.experiment == "direction"]
    assert {row.verdict for row in rows if row.published} == {"agrees"}
    assert {row.verdict for row in rows if not row.published} == {"not published"}


@pytest.mark.parametrize(
    ("changes", "quantity", "obtained"),
    [
        ({"n": 13}, "participants", 13),
        ({"anova": {"F": 28.46, "df": [2, 26], "p": 1e-7}}, "ANOVA F", 28.46),
        ({"anova": {"F": 28.45, "df": [2, 39], "p": 1e-7}}, "ANOVA df of the error", 39),
        ({"anova": {"F": 28.45, "df": [2, 26], "p": 0.001}}, "ANOVA p", 0.001),
        ({"means": dict.fromkeys(METHODS, 0.5564)}, "mean correct rate forward, vibration", 55.64),
        ({"binomial": {"vibration": {"forward": {"p": 0.3}}}}, "binomial p, vibration forward", 0.3),
    ],
)
def test_a_different_number_is_said_to_differ(
    changes: dict[str, Any], quantity: str, obtained: float, paper: Paper
) -> None:
    row = _row(compare(_direction(**changes), paper), quantity)
    assert row.verdict == "differs"
    assert row.obtained == pytest.approx(obtained)


def test_a_significant_difference_in_the_other_direction_is_no_agreement(paper: Paper) -> None:
    tukey = [{"a": "asymmetric-1", "b": "vibration", "difference": -0.2, "p": 1e-6}]
    row = _row(compare(_direction(tukey=tukey), paper), "Tukey p, asymmetric-1 above vibration")
    assert (row.verdict, row.note) == ("differs", "asymmetric-1 is not above vibration")


def test_a_difference_that_the_audit_predicted_is_said_to_be_one(paper: Paper) -> None:
    """28.51 is what the audit says the published means leave; 28.60 is not, and 28.45 agrees all the same."""
    predicted = {
        "direction: ANOVA F": Prediction(
            verdict="only under a reading", nearest=(28.0968, 28.5121), note="off the lattice"
        )
    }
    for obtained, verdict in ((28.51214, "differs as predicted"), (28.60, "differs"), (28.451, "agrees")):
        anova = {"F": obtained, "df": [2, 26], "p": 1e-7}
        row = _row(compare(_direction(anova=anova), paper, predicted), "ANOVA F")
        assert (row.verdict, row.audit, row.note) == (verdict, "only under a reading", "off the lattice")


def test_what_the_audit_says_of_a_mean_is_compared_in_percent(paper: Paper) -> None:
    name = "mean correct rate forward, vibration"
    predicted = {f"direction: {name}": Prediction(verdict="not attainable", nearest=(55.0, 55.714))}
    means = dict.fromkeys(METHODS, 0.55)
    assert _row(compare(_direction(means=means), paper, predicted), name).verdict == "differs as predicted"
    assert _row(compare(_direction(means=means), paper), name).audit == ""


def test_what_was_not_run_or_not_testable_is_not_obtained(paper: Paper) -> None:
    rows = compare(_direction(anova=None, tukey=None), paper)
    assert _row(rows, "ANOVA F").verdict == "not obtained"
    assert _row(rows, "Tukey p, asymmetric-1 above vibration").obtained is None
    preference = [row for row in rows if row.experiment == "preference"]
    assert {row.verdict for row in preference if row.published} == {"not obtained"}


def test_orders_of_ratings_are_counted_by_participant(paper: Paper) -> None:
    ratings = [(1, 5, 5), (0, 3, 7), (4, 4, 9)]
    people = {f"P{i}": dict(zip(METHODS, row, strict=True)) for i, row in enumerate(ratings)}
    rows = compare({"preference": {"participants": people}}, paper)
    assert _row(rows, "participants who rated vibration lowest", "preference").obtained == 2
    assert _row(rows, "participants with one score for asymmetric-1 and asymmetric-2", "preference").obtained == 1


@pytest.mark.parametrize(
    ("value", "printed", "agrees"),
    [(33.8104, "33.810", True), (33.8106, "33.810", False), (0.5, "0", True), (0.5, "1", True), (14.0, "14", True)],
)
def test_rounding_is_to_the_printed_digits_with_ties_either_way(value: float, printed: str, agrees: bool) -> None:
    assert rounds_to(value, printed) is agrees


def test_recurrence_says_what_the_tests_say_of_each_replication(paper: Paper) -> None:
    rng = np.random.default_rng(3)
    scores = rng.binomial(10, [0.557, 0.793, 0.929], size=(4, 5, 14, 3)) / 10
    found = recurs(scores, paper.direction)
    assert {held.shape for held in found.values()} == {(4, 5)}
    for place in np.ndindex(4, 5):
        p = {(c.a, c.b): (c.p, c.difference) for c in rm_tukey_hsd(scores[place], METHODS)}
        claims = [rm_anova(scores[place]).p < 0.001]
        for claim in paper.direction.tukey:
            value, difference = p[claim.higher, claim.lower]
            claims.append(value < float(claim.p_below) and difference > 0)
        assert [bool(held[place]) for held in found.values()] == claims


def test_the_reverse_order_recurs_in_nothing_but_the_anova(paper: Paper) -> None:
    scores = np.random.default_rng(4).normal([2.0, 1.0, 0.0], 0.3, size=(14, 3))
    held = {claim: bool(value) for claim, value in recurs(scores, paper.preference).items()}
    assert [claim for claim, value in held.items() if value] == ["ANOVA p < 0.001"]


def test_nothing_recurs_where_nothing_varies(paper: Paper) -> None:
    assert not any(value.any() for value in recurs(np.ones((2, 14, 3)), paper.direction).values())


def test_the_number_of_methods_must_be_the_papers(paper: Paper) -> None:
    with pytest.raises(ValueError, match="3 methods, not 2"):
        recurs(np.ones((14, 2)), paper.direction)


def test_odds_are_shares_with_wilson_intervals() -> None:
    odds = odds_of("direction", {"one": np.arange(100) < 66, "other": np.arange(100) >= 66}, "assumed")
    assert odds.replications == 100
    one, _, whole = odds.rows
    assert whole.claim == WHOLE_PATTERN
    interval = stats.binomtest(66, 100).proportion_ci(method="wilson")
    assert (one.share, one.ci_low, one.ci_high) == pytest.approx((0.66, interval.low, interval.high), rel=1e-9)
    assert (whole.share, whole.ci_low) == (0.0, 0.0)
    assert wilson_interval(10, 10)[1] == 1.0


def test_chance_recurs_where_the_binomial_test_rejects_as_published(paper: Paper) -> None:
    correct = np.full((3, 3, 2), 120)
    correct[:, 0, :] = [[78, 67], [95, 67], [78, 40]]
    forward, backward = chance_recurs(correct, (140, 140), paper.direction).values()
    assert forward.tolist() == [True, False, True]
    assert backward.tolist() == [True, True, False]


def test_odds_need_replications() -> None:
    with pytest.raises(ValueError, match="same number of replications"):
        odds_of("direction", {"one": []}, "")
