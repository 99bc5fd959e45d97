from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from analysis import rm_anova, rm_tukey_hsd
from analysis.logs.reading import read_logs
from analysis.paper.paper import ComparisonRow, Paper, Prediction, load_paper, rounds_to
from analysis.paper.recurrence import WHOLE_PATTERN, chance_recurs, odds_of, recurs, wilson_interval
from analysis.summary.comparison import compare
from analysis.summary.results import DirectionStatistics, Pair, StudyStatistics
from analysis.summary.summary import summarize
from tests.log_files import write_study
from tests.made_scores import ratings_of

METHODS = ("vibration", "asymmetric-1", "asymmetric-2")


@pytest.fixture(scope="module")
def paper() -> Paper:
    return load_paper(Path(__file__).parent.parent / "configs" / "paper.toml")


@pytest.fixture(scope="module")
def direction(tmp_path_factory: pytest.TempPathFactory) -> DirectionStatistics:
    """Statistics of experiment 1 exactly as the paper has them, the rest of a small study."""
    found = summarize(read_logs([write_study(tmp_path_factory.mktemp("study"), participants=2)])).direction
    assert found is not None
    assert found.anova is not None
    assert found.tukey is not None
    counts = {"vibration": 78, "asymmetric-1": 111, "asymmetric-2": 130}
    tests = {way: replace(test, p=p) for (way, test), p in zip(found.binomial["vibration"].items(), P, strict=True)}
    return replace(
        found,
        n=14,
        means={method: right / 140 for method, right in counts.items()},
        anova=replace(found.anova, F=28.4512, df=(2, 26), p=2.7e-7),
        tukey=(
            _pair("asymmetric-1", "vibration", 1e-4),
            _pair("asymmetric-2", "vibration", 1e-9),
            _pair("asymmetric-2", "asymmetric-1", 0.02),
        ),
        binomial={"vibration": tests},
    )


P = 0.20473, 0.67276
"""The paper's, of vibration forward and backward."""


def _pair(a: str, b: str, p: float, difference: float = 0.2) -> Pair:
    return Pair(a=a, b=b, difference=difference, q=5.0, p=p, ci_low=0.0, ci_high=0.4)


def _with_anova(found: DirectionStatistics, F: float, df: tuple[int, int], p: float) -> DirectionStatistics:
    assert found.anova is not None
    return replace(found, anova=replace(found.anova, F=F, df=df, p=p))


def _of(direction: DirectionStatistics | None) -> StudyStatistics:
    return StudyStatistics(direction=direction)


def _row(rows: tuple[ComparisonRow, ...], quantity: str, experiment: str = "direction") -> ComparisonRow:
    (row,) = [row for row in rows if row.quantity == quantity and row.experiment == experiment]
    return row


def test_the_papers_own_numbers_agree_with_the_paper(paper: Paper, direction: DirectionStatistics) -> None:
    rows = [row for row in compare(_of(direction), paper) if row.experiment == "direction"]
    assert {row.verdict for row in rows if row.published} == {"agrees"}
    assert {row.verdict for row in rows if not row.published} == {"not published"}


@pytest.mark.parametrize(
    ("changed", "quantity", "obtained"),
    [
        (lambda found: replace(found, n=13), "participants", 13),
        (lambda found: _with_anova(found, 28.46, (2, 26), 1e-7), "ANOVA F", 28.46),
        (lambda found: _with_anova(found, 28.45, (2, 39), 1e-7), "ANOVA df of the error", 39),
        (lambda found: _with_anova(found, 28.45, (2, 26), 0.001), "ANOVA p", 0.001),
        (
            lambda found: replace(found, means=dict.fromkeys(METHODS, 0.5564)),
            "mean correct rate forward, vibration",
            55.64,
        ),
        (
            lambda found: replace(
                found, binomial={"vibration": {"forward": replace(found.binomial["vibration"]["forward"], p=0.3)}}
            ),
            "binomial p, vibration forward",
            0.3,
        ),
    ],
)
def test_a_different_number_is_said_to_differ(
    changed: Callable[[DirectionStatistics], DirectionStatistics],
    quantity: str,
    obtained: float,
    paper: Paper,
    direction: DirectionStatistics,
) -> None:
    row = _row(compare(_of(changed(direction)), paper), quantity)
    assert row.verdict == "differs"
    assert row.obtained == pytest.approx(obtained)


def test_a_significant_difference_in_the_other_direction_is_no_agreement(
    paper: Paper, direction: DirectionStatistics
) -> None:
    turned = replace(direction, tukey=(_pair("asymmetric-1", "vibration", 1e-6, difference=-0.2),))
    row = _row(compare(_of(turned), paper), "Tukey p, asymmetric-1 above vibration")
    assert (row.verdict, row.note) == ("differs", "asymmetric-1 is not above vibration")


def test_a_difference_that_the_audit_predicted_is_said_to_be_one(paper: Paper, direction: DirectionStatistics) -> None:
    """28.51 is what the audit says the published means leave; 28.60 is not, and 28.45 agrees all the same."""
    predicted = {
        "direction: ANOVA F": Prediction(
            verdict="only under a reading", nearest=(28.0968, 28.5121), note="off the lattice"
        )
    }
    for obtained, verdict in ((28.51214, "differs as predicted"), (28.60, "differs"), (28.451, "agrees")):
        found = _with_anova(direction, obtained, (2, 26), 1e-7)
        row = _row(compare(_of(found), paper, predicted), "ANOVA F")
        assert (row.verdict, row.audit, row.note) == (verdict, "only under a reading", "off the lattice")


def test_what_the_audit_says_of_a_mean_is_compared_in_percent(paper: Paper, direction: DirectionStatistics) -> None:
    name = "mean correct rate forward, vibration"
    predicted = {f"direction: {name}": Prediction(verdict="not attainable", nearest=(55.0, 55.714))}
    found = _of(replace(direction, means=dict.fromkeys(METHODS, 0.55)))
    assert _row(compare(found, paper, predicted), name).verdict == "differs as predicted"
    assert _row(compare(found, paper), name).audit == ""


def test_what_was_not_run_or_not_testable_is_not_obtained(paper: Paper, direction: DirectionStatistics) -> None:
    rows = compare(_of(replace(direction, anova=None, tukey=None)), paper)
    assert _row(rows, "ANOVA F").verdict == "not obtained"
    assert _row(rows, "Tukey p, asymmetric-1 above vibration").obtained is None
    preference = [row for row in rows if row.experiment == "preference"]
    assert {row.verdict for row in preference if row.published} == {"not obtained"}


def test_orders_of_ratings_are_counted_by_participant(paper: Paper, tmp_path: Path) -> None:
    rows = compare(ratings_of(tmp_path, [(1, 5, 5), (0, 3, 7), (4, 4, 9)]), paper)
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
