"""The sampled diffusion against theory: closed forms, its distribution, and the far corners."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kstwo

from analysis.times.first_passage import distribution, moments
from experiments.design.streams import Stream, generator
from experiments.synthetic.decision import decide, upper_probabilities
from experiments.synthetic.diffusion import Diffusion, Lapses, People, person
from tests.decisions import EXTREMES, decide_all, law, scalar

GRID = [(v, a, w) for v in (-2.0, 0.0, 0.5, 3.0) for a in (0.7, 2.0) for w in (0.2, 0.5, 0.9)]


@pytest.mark.slow
@pytest.mark.parametrize(("v", "a", "w"), GRID)
def test_a_batch_has_the_accuracy_mean_and_variance_of_theory(v: float, a: float, w: float) -> None:
    n = 40_000
    drawn = decide_all(v, a, w, 0.25, generator=generator(3, "grid", str((v, a, w))), shape=(n,))
    expected = moments(v, a, w)
    t = drawn.time_s - 0.25
    p = float(expected.upper)
    assert abs(drawn.upper.mean() - p) < 4.5 * math.sqrt(p * (1 - p) / n)
    assert abs(t.mean() - expected.mean_s) < 4.5 * t.std() / math.sqrt(n)
    squares = (t - float(expected.mean_s)) ** 2
    assert abs(squares.mean() - expected.variance_s2) < 4.5 * squares.std() / math.sqrt(n)


@pytest.mark.slow
@pytest.mark.parametrize(("v", "a", "w"), [(0.0, 1.0, 0.5), (1.5, 2.0, 0.5), (-3.0, 1.2, 0.8), (40.0, 3.0, 0.05)])
@pytest.mark.parametrize("how", ["scalar", "batch"])
def test_times_given_the_answer_follow_the_distribution(v: float, a: float, w: float, how: str) -> None:
    if how == "batch":
        drawn = decide_all(v, a, w, 0.0, generator=generator(5, "ks"), shape=(20_000,))
        upper, times = drawn.upper, drawn.time_s
    else:
        decisions = scalar(law(v, a, w), 1_000)
        upper, times = np.array([d.upper for d in decisions]), np.array([d.time_s for d in decisions])
    for answer in (True, False):
        t = np.sort(times[upper == answer])
        if t.size > 50:
            assert ks_p(t, answer, v, a, w) > 1e-4


def ks_p(t: np.ndarray, answer: bool, v: float, a: float, w: float) -> float:
    """The exact p of Kolmogorov and Smirnov's largest distance."""
    whole = float(upper_probabilities(v, a, w))
    share = np.asarray(distribution(t, answer, v, a, w)) / (whole if answer else 1.0 - whole)
    steps = np.arange(t.size + 1) / t.size
    distance = max((steps[1:] - share).max(), (share - steps[:-1]).max())
    return float(kstwo.sf(distance, t.size))


@pytest.mark.slow
def test_the_scalar_sampler_has_the_accuracy_and_mean_of_theory() -> None:
    for v, a, w in [(0.0, 1.0, 0.5), (1.0, 2.0, 0.5), (-2.0, 1.5, 0.7)]:
        n = 1_000
        decisions = scalar(law(v, a, w), n, seed=11)
        expected = moments(v, a, w)
        t, p = np.array([d.time_s for d in decisions]), float(expected.upper)
        assert abs(np.mean([d.upper for d in decisions]) - p) < 4.5 * math.sqrt(p * (1 - p) / n)
        assert abs(t.mean() - expected.mean_s) < 4.5 * t.std() / math.sqrt(n)


@pytest.mark.slow
@pytest.mark.parametrize("extreme", EXTREMES)
def test_an_extreme_ends_with_a_finite_time(extreme: Diffusion) -> None:
    decisions = scalar(extreme, 100)
    batch = decide_all(
        extreme.drift,
        extreme.boundary,
        extreme.start,
        extreme.non_decision_s,
        generator=generator(1, "extreme"),
        shape=(2_000,),
    )
    times = np.array([d.time_s for d in decisions])
    assert np.isfinite(times).all()
    assert (times >= extreme.non_decision_s).all()
    assert np.isfinite(batch.time_s).all()
    assert (batch.time_s >= extreme.non_decision_s).all()


def test_a_start_at_a_boundary_is_answered_at_once() -> None:
    assert {(d.upper, d.time_s) for d in scalar(law(3.0, 1.0, 0.0, 0.2), 20)} == {(False, 0.2)}
    assert {(d.upper, d.time_s) for d in scalar(law(-3.0, 1.0, 1.0, 0.2), 20)} == {(True, 0.2)}


def test_huge_drift_takes_the_time_of_the_way() -> None:
    times = [d.time_s for d in scalar(law(1e6, 1e6, 0.5), 50)]
    assert times == pytest.approx([0.5] * 50, abs=5e-6)  # SD sqrt(d / v^3)


def test_without_drift_huge_caution_takes_the_time_of_theory() -> None:
    drawn = decide_all(0.0, 1e6, 0.5, 0.0, generator=generator(2, "slow"), shape=(20_000,))
    assert drawn.time_s.mean() == pytest.approx(1e12 / 4, rel=0.03)


def test_the_same_stream_gives_the_same_decision_and_a_seed_the_same_batch() -> None:
    diffusion = law(1.0, 1.5, 0.5, 0.3)
    assert decide(diffusion, Stream(7, "a")) == decide(diffusion, Stream(7, "a"))
    first, again = (decide_all(1.0, 1.5, 0.5, 0.3, generator=generator(7, "b"), shape=(500,)) for _ in range(2))
    assert np.array_equal(first.upper, again.upper)
    assert np.array_equal(first.time_s, again.time_s)


def test_the_first_draws_of_a_seed_are_what_they_were_in_the_first_release() -> None:
    """Golden: from this code, on raw PCG64 output. Last digits may differ where the C library's exp does."""
    decisions = [decide(law(1.0, 1.5, 0.5, 0.3), Stream(7, "golden", str(i))) for i in range(3)]
    batch = decide_all(1.0, 1.5, 0.5, 0.3, generator=generator(7, "golden"), shape=(3,))
    assert [d.upper for d in decisions] == GOLDEN_UPPER
    assert [d.time_s for d in decisions] == pytest.approx(GOLDEN_S, rel=1e-12)
    assert batch.upper.tolist() == GOLDEN_BATCH_UPPER
    assert batch.time_s.tolist() == pytest.approx(GOLDEN_BATCH_S, rel=1e-12)


@given(st.integers(0, 2**40), st.floats(-5, 5), st.floats(0, 3))
@settings(max_examples=60)
def test_more_drift_never_turns_an_upper_answer_lower(seed: int, drift: float, more: float) -> None:
    before = decide(law(drift, 1.2, 0.5), Stream(seed, "common"))
    after = decide(law(drift + more, 1.2, 0.5), Stream(seed, "common"))
    assert after.upper >= before.upper


@given(st.floats(-30, 30), st.floats(0.1, 5), st.floats(0, 1))
def test_the_two_answers_mirror_each_other(v: float, a: float, w: float) -> None:
    assert float(upper_probabilities(v, a, w)) == pytest.approx(
        1.0 - float(upper_probabilities(-v, a, 1.0 - w)), abs=1e-12
    )


def test_the_probability_is_theory_s() -> None:
    for v, a, w in GRID:
        assert float(upper_probabilities(v, a, w)) == pytest.approx(float(moments(v, a, w).upper), abs=1e-14)


@pytest.mark.slow
def test_lapses_are_coins_at_uniform_times() -> None:
    lapsing = Diffusion(
        drift=50.0, boundary=3.0, non_decision_s=0.3, lapses=Lapses(rate=0.2, earliest_s=1.0, latest_s=2.0)
    )
    decisions = scalar(lapsing, 1_500)
    lapsed = [d for d in decisions if d.lapse]
    assert len(lapsed) == pytest.approx(300, abs=4.5 * math.sqrt(240))
    assert sum(d.upper for d in lapsed) == pytest.approx(len(lapsed) / 2, abs=4.5 * math.sqrt(len(lapsed) / 4))
    assert all(1.0 < d.time_s < 2.0 for d in lapsed)
    assert np.mean([d.time_s for d in lapsed]) == pytest.approx(1.5, abs=4.5 / math.sqrt(12 * len(lapsed)))
    assert all(d.upper for d in decisions if not d.lapse)


def test_people_differ_as_asked_and_the_median_person_is_the_mean_one() -> None:
    people = People(drift_factor_sd=0.3, log_boundary_sd=0.2, log_non_decision_sd=0.1, logit_start_sd=0.4)
    drawn = [person(people, Stream(1, "person", str(i))) for i in range(3_000)]
    assert np.std([p.drift_factor for p in drawn]) == pytest.approx(0.3, rel=0.07)
    assert np.std([math.log(p.boundary_factor) for p in drawn]) == pytest.approx(0.2, rel=0.07)
    assert np.median([p.logit_start for p in drawn]) == pytest.approx(0.0, abs=0.04)
    same = person(People(), Stream(1, "person"))
    assert same.own(law(1.0, 1.5, 0.5, 0.3)) == law(1.0, 1.5, 0.5, 0.3)


def test_another_spread_leaves_a_person_s_other_traits_alone() -> None:
    one, other = (person(People(drift_factor_sd=sd, log_boundary_sd=0.2), Stream(4, "person")) for sd in (0.1, 0.5))
    assert one.boundary_factor == other.boundary_factor


NAN = math.nan


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ({"drift": NAN}, "drift"),
        ({"drift": 1e7}, "drift"),
        ({"boundary": 0.0}, "boundary"),
        ({"boundary": NAN}, "boundary"),
        ({"start": 1.1}, "start"),
        ({"non_decision_s": -0.1}, "non_decision_s"),
    ],
)
def test_an_impossible_diffusion_cannot_be_built(values: dict[str, float], word: str) -> None:
    with pytest.raises(ValueError, match=word):
        Diffusion(**({"drift": 1.0, "boundary": 1.0} | values))


@pytest.mark.parametrize("values", [{"rate": 1.1}, {"earliest_s": 3.0}, {"latest_s": NAN}])
def test_impossible_lapses_cannot_be_built(values: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="laps"):
        Lapses(**values)


def test_an_impossible_spread_cannot_be_built() -> None:
    with pytest.raises(ValueError, match="logit_start_sd"):
        People(logit_start_sd=-0.1)


GOLDEN_UPPER = [True, True, True]
GOLDEN_S = [0.9260612512354491, 0.5704705889680048, 0.5817071532970681]
GOLDEN_BATCH_UPPER = [True, True, False]
GOLDEN_BATCH_S = [0.34806728804050147, 1.1696475915011262, 0.8993543888092956]
