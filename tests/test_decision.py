"""Densities, closed forms, EZ-diffusion and the measures of the trade-off, against theory and other sources."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.times import trade
from analysis.times.first_passage import MEET_AT, distribution, moments, with_slopes
from analysis.times.own_trials import own_times
from analysis.times.trade import ez, ez_from_summary
from experiments.design.streams import generator
from tests.decisions import decide_all, log_density, reference

CASES = [(1.0, 2.0, 0.5), (-3.0, 1.2, 0.2), (0.0, 1.0, 0.9), (8.0, 3.0, 0.1), (0.3, 0.6, 0.03)]
TIMES = (1e-3, 0.05, 0.2999, 0.3001, 1.0, 4.0, 40.0)


@pytest.mark.slow
@pytest.mark.parametrize(("v", "a", "w"), CASES)
@pytest.mark.parametrize("upper", [True, False])
def test_the_log_density_agrees_with_the_series_of_200_digits(upper: bool, v: float, a: float, w: float) -> None:
    for t in TIMES:
        tau_s = t * a * a
        expected = reference(tau_s, upper, v, a, w)
        assert abs(log_density(tau_s, upper, v, a, w) - float(expected)) < 1e-12 * max(1.0, abs(float(expected)))


def test_the_log_density_of_the_far_tails_does_not_underflow() -> None:
    early, late = log_density(1e-6, True, 1.0, 1.0, 0.5), log_density(1e6, True, 1.0, 1.0, 0.5)
    assert early == pytest.approx(-125_000 - 1.5 * math.log(1e-6) + math.log(0.5 / math.sqrt(2 * math.pi)) + 0.5)
    assert late == pytest.approx(math.log(math.pi) + 0.5 - (1 + math.pi**2) * 5e5, rel=1e-14)


def test_the_two_series_agree_where_they_meet() -> None:
    near = np.linspace(0.001, 0.999, 41)
    images, waves = (with_slopes(np.full(41, tau), near) for tau in (MEET_AT, math.nextafter(MEET_AT, 1.0)))
    assert np.abs(images.value - waves.value).max() < 1e-12
    assert images.by_time == pytest.approx(waves.by_time, rel=1e-9)
    assert images.by_start == pytest.approx(waves.by_start, rel=1e-9)


def area(density: Callable[[np.ndarray], np.ndarray], cuts: list[float]) -> float:
    """The integral by Gauss and Legendre's 100 points between each two cuts."""
    nodes, weights = np.polynomial.legendre.leggauss(100)
    parts = ((low, (high - low) / 2) for low, high in pairwise(cuts))
    return sum(float(half * (weights @ density(low + half * (1 + nodes)))) for low, half in parts)


@pytest.mark.slow
@pytest.mark.parametrize(("v", "a", "w"), CASES)
def test_the_density_integrates_to_one_with_the_closed_moments(v: float, a: float, w: float) -> None:
    expected = moments(v, a, w)

    def both(t: np.ndarray, power: int) -> np.ndarray:
        return t**power * sum(np.exp(log_density(t, upper, v, a, w)) for upper in (True, False))

    cuts = [0.0, *np.geomspace(1e-5, 60.0, 16).tolist()]
    zeroth, first, second = (area(partial(both, power=n), cuts) for n in range(3))
    assert zeroth == pytest.approx(1.0, abs=1e-10)
    assert first == pytest.approx(expected.mean_s, rel=1e-10)
    assert second - first**2 == pytest.approx(expected.variance_s2, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("v", "a", "w"), CASES)
@pytest.mark.parametrize("upper", [True, False])
def test_the_distribution_is_the_integral_of_the_density(upper: bool, v: float, a: float, w: float) -> None:
    for t in (0.05, 0.2999 * a * a, 0.3001 * a * a, 2.0):
        cuts = [0.0, *np.geomspace(1e-5, t, 12).tolist()]
        expected = area(lambda s: np.exp(log_density(s, upper, v, a, w)), cuts)
        assert distribution(t, upper, v, a, w) == pytest.approx(expected, abs=1e-10)
    assert distribution(0.0, upper, v, a, w) == 0.0


@pytest.mark.parametrize(("v", "a", "w"), CASES)
def test_the_distribution_ends_at_the_answer_s_probability(v: float, a: float, w: float) -> None:
    whole = float(moments(v, a, w).upper)
    assert distribution(1e3, True, v, a, w) == pytest.approx(whole, abs=1e-14)
    assert distribution(1e3, False, v, a, w) == pytest.approx(1 - whole, abs=1e-14)


def test_moments_without_drift_are_theory_s() -> None:
    """Exit of Brownian motion: E T = z (a - z), V T = a^4 / 24 from the middle."""
    assert moments(0.0, 3.0, 0.2).mean_s == pytest.approx(0.6 * 2.4)
    assert moments(0.0, 3.0).variance_s2 == pytest.approx(81 / 24)
    assert moments(1e-9, 3.0).variance_s2 == pytest.approx(81 / 24)


@given(st.floats(-8, 8), st.floats(0.2, 4), st.floats(0.01, 0.99))
def test_the_mean_time_is_wald_s(v: float, a: float, w: float) -> None:
    """Wald's identity: v E T = E X(T) - z."""
    found = moments(v, a, w)
    assert v * found.mean_s == pytest.approx(a * found.upper - w * a, abs=1e-12)


def test_huge_values_keep_the_moments_finite() -> None:
    found = moments([1e5, -1e5, 0.0], [1e3, 1e3, 1e6])
    for value in (found.upper, found.mean_s, found.variance_s2, found.lower_mean_s):
        assert np.isfinite(value).all()


def test_slopes_are_those_of_the_log_density() -> None:
    tau, near, h = np.linspace(0.05, 2.0, 40), np.linspace(0.2, 0.8, 40), 1e-6
    found = with_slopes(tau, near)
    by_time = (with_slopes(tau + h, near).value - with_slopes(tau - h, near).value) / (2 * h)
    by_start = (with_slopes(tau, near + h).value - with_slopes(tau, near - h).value) / (2 * h)
    assert found.by_time == pytest.approx(by_time, rel=1e-6, abs=1e-6)
    assert found.by_start == pytest.approx(by_start, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(("a", "w"), [(0.0, 0.5), (math.nan, 0.5), (1.0, 0.0), (1.0, math.nan)])
def test_an_impossible_boundary_or_start_is_refused(a: float, w: float) -> None:
    with pytest.raises(ValueError, match=r"boundary|start"):
        distribution(0.5, True, 1.0, a, w)


# EZ-diffusion


def published(accuracy: float, variance: float, mean: float) -> tuple[float, float, float]:
    """The formulas as Wagenmakers et al. 2007 print them, with s = 1."""
    L = math.log(accuracy / (1 - accuracy))
    x = L * (L * accuracy**2 - L * accuracy + accuracy - 0.5) / variance
    v = math.copysign(x**0.25, accuracy - 0.5)
    a = L / v
    y = -v * a
    return v, a, mean - a / (2 * v) * (1 - math.exp(y)) / (1 + math.exp(y))


def test_ez_gives_the_published_example() -> None:
    """Wagenmakers et al. 2007, p. 9: Pc .802, VRT .112, MRT .723 give v .0999, a .1400, Ter .300 with s = .1."""
    found = ez_from_summary(0.802, 0.723, 0.112, 500)
    assert (round(found.drift / 10, 4), round(found.boundary / 10, 4), round(found.non_decision_s, 3)) == (
        0.0999,
        0.14,
        0.3,
    )


@given(st.one_of(st.floats(0.02, 0.45), st.floats(0.55, 0.98)), st.floats(0.01, 1.0))
def test_ez_is_the_published_formula(accuracy: float, variance: float) -> None:
    found = ez_from_summary(accuracy, 5.0, variance, 100)
    expected = published(accuracy, variance, 5.0)
    assert (found.drift, found.boundary, found.non_decision_s) == pytest.approx(expected, rel=1e-8)


def test_ez_undoes_the_closed_forms_even_without_drift() -> None:
    for v in (-2.0, -1e-5, 0.0, 1e-3, 1.0, 4.0):
        exact = moments(v, 1.4)
        found = ez_from_summary(float(exact.upper), 0.3 + exact.upper_mean_s, float(exact.upper_variance_s2), 100)
        assert (found.drift, found.boundary, found.non_decision_s) == pytest.approx((v, 1.4, 0.3), abs=1e-7)


@pytest.mark.parametrize(("accuracy", "moved"), [(1.0, 0.99), (0.0, 0.01)])
def test_ez_moves_a_perfect_accuracy_by_half_an_answer(accuracy: float, moved: float) -> None:
    found = ez_from_summary(accuracy, 0.8, 0.05, 50)
    assert found.corrected
    assert found.accuracy == pytest.approx(moved)
    assert found.drift == pytest.approx(published(moved, 0.05, 0.8)[0])


def test_ez_says_why_it_refuses() -> None:
    assert "variance" in (ez_from_summary(0.8, 0.7, 0.0, 50).reason or "")
    assert "below 0" in (ez_from_summary(0.8, 0.1, 0.3, 50).reason or "")
    few = ez([1] * 9 + [0] * 20, np.linspace(0.4, 1.0, 29), ["participant"] * 29)
    assert "9 correct" in (few.reason or "")
    assert math.isnan(few.drift)
    with pytest.raises(ValueError, match="accuracy"):
        ez_from_summary(1.2, 0.7, 0.1, 50)


def test_ez_of_many_trials_finds_what_they_were_drawn_with() -> None:
    drawn = decide_all(1.3, 1.6, 0.5, 0.35, generator=generator(8, "ez"), shape=(100_000,))
    found = ez(drawn.upper, drawn.time_s, ["synthetic"] * 100_000)
    assert (found.drift, found.boundary, found.non_decision_s) == pytest.approx((1.3, 1.6, 0.35), rel=0.02)


# Whose times they are


def test_a_time_from_the_experimenter_s_hand_is_refused_with_the_reason() -> None:
    sources = ["participant", "experimenter", "participant"]
    with pytest.raises(ValueError, match=r"1 of 3 .* row 1, has response_source 'experimenter': .*reaction"):
        own_times([0.5, 0.6, 0.7], sources)
    calls = (
        lambda: ez([1, 1, 0], [0.5, 0.6, 0.7], sources),
        lambda: trade.conditional_accuracy([1, 1, 0], [0.5, 0.6, 0.7], sources, ["a"] * 3),
        lambda: trade.quantile_probability([1, 1, 0], [0.5, 0.6, 0.7], sources, ["a"] * 3),
    )
    for call in calls:
        with pytest.raises(ValueError, match="experimenter"):
            call()


@pytest.mark.parametrize(
    ("times", "sources", "words"),
    [
        ([0.5, 0.0], ["participant"] * 2, "row 1 has 0"),
        ([0.5], ["participant"] * 2, "one length"),
        ([math.nan], ["participant"], "finite"),
        ([0.5], [""], "''"),
    ],
)
def test_a_column_that_holds_no_own_times_is_refused(times: list[float], sources: list[str], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        own_times(times, sources)


# Measures of the trade-off


def test_conditional_accuracy_averages_people_not_trials() -> None:
    """By hand: one fast and one slow person, two bins of two."""
    times = [0.1, 0.2, 0.3, 0.4, 1.1, 1.2, 1.3, 1.4, 9.0]
    correct = [0, 1, 1, 1, 0, 0, 1, 0, 1]
    found = trade.conditional_accuracy(correct, times, ["participant"] * 9, list("aaaabbbbc"), bins=2)
    assert found.mean_time_s.tolist() == pytest.approx([0.65, 0.85])
    assert found.accuracy.tolist() == [0.25, 0.75]
    assert (found.people, found.trials, found.left_out) == (2, 4, 1)


def test_conditional_accuracy_without_enough_trials_is_nan() -> None:
    found = trade.conditional_accuracy([1], [0.5], ["participant"], ["a"], bins=5)
    assert np.isnan(found.accuracy).all()
    assert found.trials == 0
    with pytest.raises(ValueError, match="bins"):
        trade.conditional_accuracy([1], [0.5], ["participant"], ["a"], bins=0)


def test_an_unbiased_diffusion_has_a_flat_conditional_accuracy() -> None:
    """Theory: from the middle the answer and the time are independent."""
    drawn = decide_all(0.8, 1.5, 0.5, 0.3, generator=generator(2, "caf"), shape=(50_000,))
    people = np.repeat(np.arange(10), 5_000)
    found = trade.conditional_accuracy(drawn.upper, drawn.time_s, ["synthetic"] * 50_000, people)
    assert found.accuracy == pytest.approx(float(moments(0.8, 1.5).upper), abs=4.5 * 0.0042)


def test_quantile_probability_points_are_those_of_theory() -> None:
    drawn = decide_all(0.8, 1.5, 0.5, 0.3, generator=generator(2, "qpp"), shape=(50_000,))
    people = np.repeat(np.arange(10), 5_000)
    found = trade.quantile_probability(drawn.upper, drawn.time_s, ["synthetic"] * 50_000, people)
    whole = float(moments(0.8, 1.5).upper)
    assert found.probability[1] == pytest.approx(whole, abs=0.01)
    assert found.people.tolist() == [10, 10]
    for answer, p in ((1, whole), (0, 1 - whole)):
        shares = np.asarray(distribution(found.quantiles_s[answer] - 0.3, bool(answer), 0.8, 1.5, 0.5)) / p
        assert shares == pytest.approx(trade.QUANTILES, abs=0.02)


def test_quantiles_of_answers_that_nobody_gave_are_nan() -> None:
    found = trade.quantile_probability([1] * 6, np.linspace(0.4, 0.9, 6), ["participant"] * 6, ["a"] * 6)
    assert np.isnan(found.quantiles_s[0]).all()
    assert (found.people.tolist(), found.answers.tolist()) == ([0, 1], [0, 6])
    assert found.quantiles_s[1] == pytest.approx(np.quantile(np.linspace(0.4, 0.9, 6), trade.QUANTILES))


def test_the_balanced_score_weighs_speed_and_accuracy_alike() -> None:
    """By hand: z with the population SD of (0.8, 0.9, 1.0) and (0.6, 0.5, 0.7)."""
    root = math.sqrt(1.5)
    found = trade.balanced_integration([0.8, 0.9, 1.0], [0.6, 0.5, 0.7])
    assert found == pytest.approx([-root, root, 0.0], abs=1e-12)
    assert found.mean() == pytest.approx(0.0, abs=1e-12)
    assert trade.balanced_integration([0.9, 0.9], [0.5, 0.7]) == pytest.approx([1.0, -1.0])


def test_inverse_efficiency_is_infinite_where_nothing_is_right() -> None:
    assert trade.inverse_efficiency([0.0], [0.5]).tolist() == [math.inf]


@pytest.mark.parametrize("score", [trade.balanced_integration, trade.inverse_efficiency])
def test_scores_refuse_what_is_no_rate_or_time(score: object) -> None:
    assert callable(score)
    for rates, times in (([1.1], [0.5]), ([0.5], [0.0]), ([0.5, 0.6], [0.5])):
        with pytest.raises(ValueError, match="correct_rate"):
            score(rates, times)


def test_nothing_is_decided_before_the_onset_and_all_is_in_the_end() -> None:
    times = [math.nan, -1.0, 0.0, math.inf]
    after = distribution(times, True, 1.0, 1.0, 0.5)
    assert str(after[:3].tolist()) == "[nan, 0.0, 0.0]"  # type: ignore[index]
    assert after[3] == pytest.approx(moments(1.0, 1.0).upper, rel=1e-14)  # type: ignore[index]
