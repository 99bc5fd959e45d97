"""The maximum-likelihood fit: its likelihood, gradient and intervals, and what it says of data that tell little."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analysis.times.fit import fit, profile, starts
from analysis.times.likelihood import coordinates, log_likelihood, model_of, natural, trials_of
from analysis.times.people import fit_people
from experiments.design.streams import generator
from tests.decisions import (
    BOUNDARIES,
    DRIFTS,
    INSTRUCTIONS,
    METHODS,
    RANGE_S,
    START,
    T0_S,
    TRUTH,
    decide_all,
    log_density,
    made,
)

pytestmark = pytest.mark.slow

STUDY = made(1)


def test_the_likelihood_is_the_sum_of_the_densities() -> None:
    model = model_of(STUDY)
    at = coordinates(model, np.array([*DRIFTS, *BOUNDARIES, START, 0.9 * model.cap_s]))
    t0 = natural(model, at)[-1]
    v = STUDY.sign * np.array(DRIFTS)[STUDY.condition]
    a = np.array(BOUNDARIES)[STUDY.instruction]
    expected = np.sum(log_density(STUDY.time_s - t0, STUDY.upper, v, a, START))
    assert log_likelihood(model, at)[0] == pytest.approx(float(expected), rel=1e-12)


@pytest.mark.parametrize("lapses", [False, True, RANGE_S])
@pytest.mark.parametrize("bias", [True, False])
def test_the_gradient_is_that_of_the_likelihood(bias: bool, lapses: bool | tuple[float, float]) -> None:
    model = model_of(made(3, people=4, lapse=0.05), bias=bias, lapses=lapses)
    at, h = starts(model)[0] + 0.1, 1e-6
    _, slope = log_likelihood(model, at)
    steps = h * np.eye(at.size)
    numeric = [(log_likelihood(model, at + s)[0] - log_likelihood(model, at - s)[0]) / (2 * h) for s in steps]
    assert slope == pytest.approx(numeric, rel=1e-6, abs=1e-4)


def test_coordinates_and_parameters_are_each_other_s_inverse() -> None:
    model = model_of(STUDY, lapses=True)
    values = np.array([*DRIFTS, *BOUNDARIES, START, 0.3, 0.05])
    assert natural(model, coordinates(model, values)) == pytest.approx(values, rel=1e-12)


def test_a_large_study_gives_back_what_it_was_made_with() -> None:
    found = fit(made(2, times=10))
    assert found.reason is None
    assert found.unidentified == ()
    assert {e.name for e in found.estimates} == set(TRUTH)
    for estimate in found.estimates:
        assert abs(estimate.value - TRUTH[estimate.name]) < 4 * estimate.se
        assert estimate.ci_low < estimate.value < estimate.ci_high


def test_no_other_start_climbs_higher() -> None:
    found = fit(STUDY)
    model = model_of(STUDY)
    truth = coordinates(model, np.array([*DRIFTS, *BOUNDARIES, START, min(T0_S, 0.99 * model.cap_s)]))
    assert found.log_likelihood >= log_likelihood(model, truth)[0]


def test_the_order_of_the_trials_changes_nothing() -> None:
    order = np.argsort(STUDY.time_s)
    names = np.array(METHODS)[STUDY.condition]
    shuffled = trials_of(
        upper=STUDY.upper[order],
        time_s=STUDY.time_s[order],
        sources=["participant"] * order.size,
        towards_upper=STUDY.sign[order] > 0,
        condition=names[order],
        instruction=np.array(INSTRUCTIONS)[STUDY.instruction][order],
    )
    for one, other in zip(fit(STUDY).estimates, fit(shuffled).estimates, strict=True):
        assert one.value == pytest.approx(other.value, abs=1e-5)


def test_swapping_forward_and_backward_turns_the_bias_round() -> None:
    names = np.array(METHODS)[STUDY.condition]
    mirrored = trials_of(
        upper=~STUDY.upper,
        time_s=STUDY.time_s,
        sources=["participant"] * names.size,
        towards_upper=STUDY.sign < 0,
        condition=names,
        instruction=np.array(INSTRUCTIONS)[STUDY.instruction],
    )
    one, other = fit(STUDY), fit(mirrored)
    assert one["start"].value == pytest.approx(1.0 - other["start"].value, abs=1e-5)
    assert one["drift vibration"].value == pytest.approx(other["drift vibration"].value, abs=1e-4)


@pytest.mark.soak
def test_the_profile_interval_is_wald_s_where_there_are_many_trials() -> None:
    large = made(2, times=5)
    found = fit(large)
    for name in ("drift asymmetric-2", "non_decision_s"):
        low, high = profile(large, name)
        assert (low, high) == pytest.approx((found[name].ci_low, found[name].ci_high), abs=0.15 * found[name].se)


def test_lapses_are_found_where_their_range_is_known() -> None:
    found = fit(made(5, times=5, lapse=0.05), lapses=RANGE_S)
    assert found["lapse"].ci_low < 0.05 < found["lapse"].ci_high
    assert abs(found["non_decision_s"].value - T0_S) < 4 * found["non_decision_s"].se


def test_no_lapses_are_said_to_be_at_the_edge_and_their_profile_begins_at_0() -> None:
    never = made(9)
    found = fit(never, lapses=RANGE_S)
    low, high = profile(never, "lapse", lapses=RANGE_S)
    assert found["lapse"].value < 1e-3
    assert low == pytest.approx(0.0, abs=1e-9)
    assert 0.0 < high < 0.05
    assert "lapse" in found.unidentified
    assert math.isnan(found["lapse"].ci_low)
    assert math.isfinite(found["start"].se)


def test_intervals_over_people_are_wider_where_people_differ() -> None:
    differing = made(6, spread=0.4)
    plain, robust = fit(differing), fit(differing, by_person=True)
    assert robust.clusters == 14
    assert robust["boundary speed"].se > 1.5 * plain["boundary speed"].se
    assert robust["boundary speed"].value == plain["boundary speed"].value


def test_the_mean_person_is_found_where_people_differ() -> None:
    """Fitted together, t0 comes out too short; each alone it does not."""
    differing = made(6, times=5, spread=0.3)
    together, each = fit(differing, by_person=True), fit_people(differing)
    means = {mean.name: mean for mean in each.means}
    assert together["non_decision_s"].ci_high < T0_S
    for name, true in TRUTH.items():
        assert abs(means[name].value - true) < 3.5 * means[name].se
    assert len(each.fits) == means["start"].people == 14
    assert means["drift vibration"].ci_low < means["drift vibration"].value < means["drift vibration"].ci_high
    assert "lapse" not in means


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_no_mean_share_of_lapses_reaches_below_none(seed: int) -> None:
    """Most people have none: the mean less its half interval would be below 0."""
    found = {mean.name: mean for mean in fit_people(made(seed, people=4, lapse=0.01), lapses=RANGE_S).means}
    lapse = found["lapse"]
    assert lapse.value < 2 * lapse.se
    assert lapse.ci_low == 0.0 < lapse.value < lapse.ci_high < 1.0
    assert all(found[name].ci_low > 0.0 for name in ("boundary speed", "boundary accuracy", "non_decision_s"))


def test_lapses_that_nobody_has_get_no_interval_and_not_that_from_0_to_0() -> None:
    (lapse,) = (mean for mean in fit_people(STUDY, lapses=(0.0, 5.0)).means if mean.name == "lapse")
    assert (lapse.value < 1e-4, lapse.people) == (True, 14)
    assert [math.isnan(one) for one in (lapse.se, lapse.ci_low, lapse.ci_high)] == [True] * 3


def test_a_person_who_lacks_a_method_is_left_out_and_named() -> None:
    kept = ~((STUDY.person == 3) & (STUDY.condition == 0))
    some = trials_of(
        upper=STUDY.upper[kept],
        time_s=STUDY.time_s[kept],
        sources=["synthetic"] * int(kept.sum()),
        towards_upper=STUDY.sign[kept] > 0,
        condition=np.array(METHODS)[STUDY.condition[kept]],
        person=STUDY.person[kept],
    )
    found = fit_people(some)
    assert found.left_out == (int(np.flatnonzero(np.unique(STUDY.person.astype(np.str_)) == "3")[0]),)
    assert {mean.name: mean.people for mean in found.means}["start"] == 13


def test_a_method_without_an_error_still_has_a_finite_drift() -> None:
    """The times bound it, which the rate alone would not."""
    drawn = decide_all(np.tile([6.0, -6.0], 100), 2.0, 0.5, 0.3, generator=generator(1, "perfect"))
    found = fit(
        trials_of(
            upper=drawn.upper,
            time_s=drawn.time_s,
            sources=["synthetic"] * 200,
            towards_upper=np.tile([1, 0], 100),
            condition=["strong"] * 200,
        )
    )
    assert found.reason is None
    assert [e.name for e in found.estimates] == ["drift strong", "boundary", "start", "non_decision_s"]
    assert found["drift strong"].ci_low < 6.0 < found["drift strong"].ci_high


def test_a_handful_of_trials_gives_no_crash() -> None:
    for count in (1, 2, 3, 5):
        found = fit(
            trials_of(
                upper=[1, 0, 1, 1, 0][:count],
                time_s=[0.5, 0.6, 0.8, 0.55, 0.9][:count],
                sources=["participant"] * count,
                towards_upper=[1] * count,
                condition=["a"] * count,
            )
        )
        assert len(found.estimates) == 4
        assert math.isnan(found["boundary"].se) == (found.reason is not None)


def test_times_by_the_experimenter_s_hand_are_refused() -> None:
    with pytest.raises(ValueError, match="experimenter's reaction"):
        trials_of(upper=[1], time_s=[0.5], sources=["experimenter"], towards_upper=[1], condition=["a"])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"upper": [2]}, "upper"),
        ({"towards_upper": [1, 0]}, "towards_upper"),
        ({"condition": []}, "condition"),
        ({"time_s": [], "sources": []}, "at least 1 trial"),
    ],
)
def test_columns_that_do_not_fit_together_are_refused(changes: dict[str, object], words: str) -> None:
    columns = {"upper": [1], "time_s": [0.5], "sources": ["participant"], "towards_upper": [1], "condition": ["a"]}
    with pytest.raises(ValueError, match=words):
        trials_of(**(columns | changes))


def test_a_lapse_range_without_width_is_refused() -> None:
    with pytest.raises(ValueError, match="range"):
        model_of(STUDY, lapses=(1.0, 1.0))
    with pytest.raises(KeyError):
        profile(STUDY, "lapse")
    with pytest.raises(KeyError):
        _ = fit(STUDY)["lapse"]
