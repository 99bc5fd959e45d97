"""The percept: what the force says, and what three rates say of the percept."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.predict.fit.percept_model import PAPER_RATES, PerceptFit, best_percept, fit_percept, predicted_rate
from device.methods import paper_methods
from device.parameters import GunParameters, VibrationParameters
from device.physics import simulate, trace
from experiments.synthetic.decision import forward_rates, upper_probabilities
from experiments.synthetic.diffusion import Diffusion, Lapses, People
from experiments.synthetic.percept import (
    SILENT,
    Percept,
    PerceptParameters,
    diffusion_of,
    evidence,
    felt_course,
    percept_of,
    percept_of_summary,
    percepts_of,
)

pytestmark = pytest.mark.slow

DEFAULT = PerceptParameters()
METHODS = paper_methods()
FELT = percepts_of(METHODS, DEFAULT.leak_s)


@pytest.fixture(scope="module")
def paper() -> PerceptFit:
    return fit_percept(PAPER_RATES, METHODS)


def test_a_constant_force_is_felt_as_itself_after_a_while() -> None:
    """The leaky mean of a step of 3 N: 3 (1 - exp(-t / leak))."""
    times = np.linspace(0, 0.2, 50).tolist()
    course = felt_course(times, [3.0] * 50, 0.02)
    assert course == pytest.approx([3.0 * (1 - math.exp(-t / 0.02)) for t in times], abs=1e-12)


def test_a_ramp_is_felt_as_theory_has_it() -> None:
    """The leaky mean of F = t: t - leak (1 - exp(-t / leak)), whatever the steps."""
    times = [0.0, 0.001, 0.001, 0.01, 0.05, 0.3]
    expected = [t - 0.02 * (1 - math.exp(-t / 0.02)) for t in times]
    assert felt_course(times, times, 0.02) == pytest.approx(expected, abs=1e-14)


def test_a_sharp_pulse_is_felt_above_a_long_weak_one_of_the_same_impulse() -> None:
    """1 Ns within 10 ms against 1 Ns within 100 ms."""
    times = np.linspace(0, 0.2, 2001)
    sharp, weak = (
        max(felt_course(times.tolist(), np.where(times < d, 1 / d, 0.0).tolist(), 0.02)) for d in (0.01, 0.1)
    )
    assert sharp > 3 * weak


def test_a_vibration_says_nothing_of_the_direction() -> None:
    assert percept_of(VibrationParameters(), 0.02) == SILENT
    assert evidence(SILENT, DEFAULT) == 0.0


def test_the_damped_shot_says_more_than_the_undamped() -> None:
    said = {name: evidence(percept, DEFAULT) for name, percept in FELT.items()}
    assert said["asymmetric-2"] > said["asymmetric-1"] > said["vibration"] == 0.0


def test_without_confusion_the_damper_would_not_help() -> None:
    """What makes method II better is the missing second pulse: the first is weaker, the reaction stronger."""
    certain = replace(DEFAULT, confusion=0.0)
    assert evidence(FELT["asymmetric-2"], certain) < evidence(FELT["asymmetric-1"], certain)


def test_the_undamped_magnet_lands_with_a_second_pulse() -> None:
    undamped, damped = FELT["asymmetric-1"], FELT["asymmetric-2"]
    assert undamped.second / undamped.first > 2.5 * damped.second / damped.first
    for percept in (undamped, damped):
        assert percept.first > 2 * percept.reaction


def test_the_whole_force_of_a_shot_sums_to_nothing() -> None:
    """Momentum: so a percept that is linear in the force would have no direction to go by."""
    gun = METHODS["asymmetric-1"]
    assert isinstance(gun, GunParameters)
    shot = trace(gun, 8000)
    blow = gun.magnet_mass_kg * (shot.summary.impact_speed_m_s or 0.0)
    assert np.trapezoid(shot.force_N, shot.time_s) + blow == pytest.approx(0.0, abs=0.01 * 0.2)


@pytest.mark.parametrize("method", ["asymmetric-1", "asymmetric-2"])
def test_the_summary_alone_gives_nearly_the_same_first_pulse_and_reaction(method: str) -> None:
    gun = METHODS[method]
    assert isinstance(gun, GunParameters)
    short = percept_of_summary(simulate(gun), gun.magnet_mass_kg, 0.02)
    assert short.first == pytest.approx(FELT[method].first, rel=0.02)
    assert short.reaction == pytest.approx(FELT[method].reaction, rel=0.08)
    assert short.second < FELT[method].second


@pytest.mark.parametrize("changes", [{"voltage_V": 0.0}, {"friction_N": 40.0}, {"friction_N": 1.6}])
def test_a_gun_that_does_not_shoot_or_come_home_has_a_percept_too(changes: dict[str, float]) -> None:
    percept = percept_of(GunParameters(**changes), 0.02)
    assert min(percept.first, percept.reaction, percept.second) >= 0.0
    assert math.isfinite(evidence(percept, DEFAULT))


def test_a_gun_that_does_not_move_says_nothing() -> None:
    assert evidence(percept_of(GunParameters(voltage_V=0.0), 0.02), DEFAULT) == 0.0
    assert percept_of_summary(simulate(GunParameters(voltage_V=0.0)), 0.114, 0.02) == SILENT


@given(st.floats(0, 50), st.floats(0, 50), st.floats(0, 50), st.floats(0.01, 10))
def test_evidence_changes_its_sign_with_the_force(first: float, reaction: float, second: float, more: float) -> None:
    there = evidence(Percept(first=first, reaction=reaction, second=second), DEFAULT)
    back = evidence(Percept(first=reaction, reaction=first, second=second), DEFAULT)
    assert there == pytest.approx(-back)
    confused = evidence(Percept(first=first, reaction=reaction, second=second + more), DEFAULT)
    assert abs(confused) <= abs(there)


def test_the_diffusion_of_an_evidence_has_its_log_odds() -> None:
    unbiased = replace(DEFAULT, start=0.5)
    diffusion = diffusion_of(1.3, unbiased, boundary=1.7, non_decision_s=0.3, lapses=Lapses())
    assert isinstance(diffusion, Diffusion)
    p = float(upper_probabilities(diffusion.drift, diffusion.boundary, diffusion.start))
    assert math.log(p / (1 - p)) == pytest.approx(1.3)


def test_the_mean_rate_over_people_is_that_of_many() -> None:
    people = People(drift_factor_sd=0.4, log_boundary_sd=0.3, logit_start_sd=0.5)
    draws = np.random.Generator(np.random.PCG64(1)).normal(size=(20_000, 3))
    rates = [
        upper_probabilities(1.5 * (1 + 0.4 * x) * math.exp(0.3 * y), 1.0, 0.56 / (0.56 + 0.44 * math.exp(-0.5 * z)))
        for x, y, z in draws
    ]
    error = 4.5 * np.std(rates) / math.sqrt(20_000)
    assert forward_rates(1.5, 0.56, people) == pytest.approx(np.mean(rates), abs=error)
    assert forward_rates(1.5, 0.56, People(), lapse_rate=1.0) == 0.5


def test_the_shipped_numbers_are_the_fit_to_the_paper_s_rates(paper: PerceptFit) -> None:
    for name, fitted in paper.fitted.items():
        assert getattr(DEFAULT, name) == pytest.approx(fitted.value, rel=5e-3)
    assert paper.predicted == pytest.approx(PAPER_RATES, abs=1e-6)
    assert (paper.freedom, paper.deviance) == (0, pytest.approx(0.0, abs=1e-9))


def test_the_vibration_s_rate_is_the_bias(paper: PerceptFit) -> None:
    """From 0 drift the answer is the start; its standard error is the binomial one."""
    start = paper.fitted["start"]
    assert start.value == pytest.approx(0.557, abs=1e-6)
    assert start.se == pytest.approx(math.sqrt(0.557 * 0.443 / 140), rel=1e-3)
    assert start.ci_low < 0.5 < start.ci_high


def test_the_fit_says_what_it_cannot_tell(paper: PerceptFit) -> None:
    assert paper.rank == 3
    assert paper.untold["boundary"] == pytest.approx(1.0)
    assert paper.untold["start"] == pytest.approx(0.0, abs=1e-6)
    assert 0.1 < paper.untold["sensitivity"] <= 1.0
    said = " ".join(paper.unknown)
    for words in ("exponent", "Drift and boundary cannot be told apart", "no evidence for the model", "No bias"):
        assert words in said


def test_another_exponent_meets_the_rates_as_well(paper: PerceptFit) -> None:
    other = best_percept(PAPER_RATES, METHODS, base=PerceptParameters(exponent=1.3, leak_s=0.015))
    assert other.deviance == pytest.approx(0.0, abs=1e-9)
    assert other.parameters.sensitivity > 1.5 * paper.parameters.sensitivity


def test_the_fit_without_its_intervals_is_the_fit(paper: PerceptFit) -> None:
    alone = best_percept(PAPER_RATES, METHODS)
    assert (alone.parameters, alone.deviance) == (paper.parameters, paper.deviance)
    assert alone.covariance == paper.covariance


def test_the_interval_s_ends_have_the_deviance_of_the_chi_squared_quantile(paper: PerceptFit) -> None:
    """For the start alone by hand: the others are free to meet the other rates, so it is the vibration's binomial."""
    start = paper.fitted["start"]
    for end in (start.ci_low, start.ci_high):
        fall = 0.557 * math.log(0.557 / end) + 0.443 * math.log(0.443 / (1 - end))
        assert 2 * 140 * fall == pytest.approx(3.841459, rel=1e-4)


def test_with_people_who_differ_the_mean_rates_are_still_met() -> None:
    people = People(drift_factor_sd=0.3, logit_start_sd=0.3)
    found = best_percept(PAPER_RATES, METHODS, people=people)
    assert found.deviance == pytest.approx(0.0, abs=1e-9)
    assert found.parameters.sensitivity > DEFAULT.sensitivity


def test_rates_in_the_wrong_order_are_not_met_and_it_is_said() -> None:
    """Confusion can only help the method without a second pulse."""
    found = fit_percept(PAPER_RATES | {"asymmetric-1": 0.97, "asymmetric-2": 0.75}, METHODS)
    assert found.deviance > 10
    assert any("does not meet" in words for words in found.unknown)
    assert found.fitted["confusion"].ci_low == 0.0


def test_more_trials_make_narrower_intervals(paper: PerceptFit) -> None:
    many = fit_percept(PAPER_RATES, METHODS, trials=14_000)
    for name in paper.fitted:
        assert many.fitted[name].se == pytest.approx(paper.fitted[name].se / 10, rel=1e-6)
        assert (
            paper.fitted[name].ci_low
            < many.fitted[name].ci_low
            < many.fitted[name].ci_high
            < paper.fitted[name].ci_high
        )


def test_the_prediction_for_a_fitted_method_has_the_binomial_error(paper: PerceptFit) -> None:
    """Three numbers for three rates: each predicted rate is as sure as its own 140 answers make it."""
    for name, rate in PAPER_RATES.items():
        found = predicted_rate(paper, FELT[name])
        assert found.value == pytest.approx(rate, abs=1e-6)
        assert found.se == pytest.approx(math.sqrt(rate * (1 - rate) / 140), rel=1e-3)
        assert found.ci_low < rate < found.ci_high


@pytest.mark.parametrize(
    ("rates", "trials", "words"),
    [
        ({"vibration": 0.5, "asymmetric-1": 0.8}, 140, "at least 3"),
        (PAPER_RATES | {"vibration": 1.2}, 140, "vibration is 1.2"),
        (PAPER_RATES | {"other": 0.5}, 140, "no such method"),
        (PAPER_RATES, 0, "at least 1"),
    ],
)
def test_rates_that_are_none_are_refused(rates: dict[str, float], trials: int, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        fit_percept(rates, METHODS, trials=trials)


@pytest.mark.parametrize("values", [{"exponent": 0.0}, {"leak_s": math.nan}, {"confusion": -1.0}, {"start": 1.0}])
def test_impossible_numbers_are_refused(values: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(values))):
        PerceptParameters(**values)
