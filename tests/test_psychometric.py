"""Psychometric fits: psignifit's means, honest ends, what follows from levels that are moved or stretched, pooling."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from analysis.psychometric.fit import PsychometricFit, psychometric_fit
from analysis.psychometric.pooling import difference, pooled_group
from analysis.psychometric.priors import ListedPrior, default_priors

GOLDEN: list[dict[str, Any]] = json.loads((Path(__file__).parent / "golden" / "psignifit.json").read_text())
LEVELS, TRIALS = np.array([6.0, 8.0, 10.0, 12.0, 14.0]), np.full(5, 20)
RIGHT = np.array([10, 12, 15, 19, 20])


@pytest.fixture(scope="module")
def fit() -> PsychometricFit:
    return psychometric_fit(LEVELS, RIGHT, TRIALS, guess=0.5)


@pytest.mark.parametrize("case", GOLDEN, ids=lambda case: f"{case['kind']}{' overdispersed' * case['overdispersed']}")
def test_means_are_those_of_psignifit_under_its_priors(case: dict[str, Any]) -> None:
    """Within 0.02 of the standard deviation, 2, that the data were drawn with; its own grid is coarser."""
    guess = 0.5 if case["kind"] == "2AFC" else None
    trials = [case["trials"]] * len(case["levels"])
    found = psychometric_fit(case["levels"], case["right"], trials, guess=guess, overdispersed=case["overdispersed"])
    assert found.threshold.mean == pytest.approx(case["mean"]["threshold"], abs=0.04)
    assert found.width.mean == pytest.approx(case["mean"]["width"], abs=0.04 * 3.29)
    for rate in ("lapse", "guess", "overdispersion"):
        assert getattr(found, rate).mean == pytest.approx(case["mean"][rate], abs=0.005)


def test_the_lower_end_of_a_width_is_where_the_posterior_has_it() -> None:
    """1.929 to 20.65 by sums over 199 thresholds, 238 widths and 100 lapse rates; the prior begins at the step, 1."""
    levels = [6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 14.0, 16.0, 18.0]
    found = psychometric_fit(levels, [5, 6, 4, 7, 6, 9, 10, 9, 10], [10] * 9, guess=0.5)
    assert (found.width.low, found.width.median, found.width.high) == pytest.approx((1.929, 7.544, 20.65), rel=0.02)


@pytest.mark.parametrize(
    ("right", "trials", "exact"),
    [
        ([4, 4, 9, 9, 9, 10, 10], 10, (0.0314, 0.1175)),
        ([49, 45, 54, 56, 75, 92, 97, 98, 100], 100, (0.0118, 0.0325)),
    ],
)
def test_a_lapse_rates_median_and_upper_end_are_where_the_posterior_has_them(
    right: list[int], trials: int, exact: tuple[float, float]
) -> None:
    """By sums over 401 thresholds, 300 widths and 400 lapse rates; between 7 places the end was 16 % too high."""
    levels = np.linspace(4.0, 16.0, len(right))
    found = psychometric_fit(levels, right, [trials] * len(right), guess=0.5)
    assert (found.lapse.median, found.lapse.high) == pytest.approx(exact, rel=0.08)


def test_a_listed_prior_is_a_density_between_its_values_and_one_value_is_known() -> None:
    """Without data to speak of, draws are those of the prior: even over the logarithm of the width, from 1 to 16."""
    widths, lapses = np.geomspace(1.0, 16.0, 33), np.linspace(0.0, 0.08, 5)
    own = replace(
        default_priors(np.array([4.0, 20.0])),
        width=ListedPrior(values=widths, weights=np.ones(33)),
        lapse=ListedPrior(values=lapses, weights=np.ones(5)),
    )
    few = {"levels": [4.0, 20.0], "right": [1, 1], "trials": [2, 2], "guess": 0.5}
    found = psychometric_fit(**few, priors=own)
    assert found.draws[:, 2].max() <= 0.08
    assert np.median(found.draws[:, 1]) == pytest.approx(4.0, rel=0.15)
    one = replace(own, lapse=ListedPrior(values=np.array([0.03]), weights=np.ones(1)))
    assert set(psychometric_fit(**few, priors=one).draws[:, 2]) == {0.03}


def test_a_fit_moves_and_stretches_with_its_levels(fit: PsychometricFit) -> None:
    moved = psychometric_fit(LEVELS * 1e-6 + 3.0, RIGHT, TRIALS, guess=0.5)
    assert moved.threshold.median == pytest.approx(fit.threshold.median * 1e-6 + 3.0, rel=1e-9)
    assert moved.width.median == pytest.approx(fit.width.median * 1e-6, rel=1e-6)
    assert moved.goodness.p == fit.goodness.p


def test_a_logarithmic_axis_is_a_fit_of_logarithms(fit: PsychometricFit) -> None:
    of_logs = psychometric_fit(np.log(LEVELS), RIGHT, TRIALS, guess=0.5)
    logarithmic = psychometric_fit(LEVELS, RIGHT, TRIALS, guess=0.5, log=True)
    assert logarithmic.threshold.median == pytest.approx(np.exp(of_logs.threshold.median))
    assert logarithmic.jnd.median == pytest.approx(np.exp(of_logs.jnd.median))
    assert logarithmic.curve([9.0])[0] == pytest.approx(of_logs.curve(np.log([9.0]))[0])


def test_levels_in_any_order_and_split_are_the_same_data(fit: PsychometricFit) -> None:
    split = psychometric_fit(
        np.concatenate([LEVELS[::-1], LEVELS]),
        np.concatenate([RIGHT[::-1] - 5, [5] * 5]),
        [15] * 5 + [5] * 5,
        guess=0.5,
    )
    assert split.threshold.median == pytest.approx(fit.threshold.median, rel=1e-9)


@pytest.mark.parametrize(
    ("right", "guess", "where", "said"),
    [
        ([0] * 5, None, "above", "it lies above 14"),
        ([20] * 5, None, "below", "it lies below 6"),
        ([20] * 5, 0.5, "below", "it lies below 6"),
        ([10] * 5, 0.5, "above", "it lies above 14"),
    ],
)
def test_data_without_a_threshold_get_none(right: list[int], guess: float | None, where: str, said: str) -> None:
    found = psychometric_fit(LEVELS, right, TRIALS, guess=guess)
    assert found.where == where
    assert found.reason is not None
    assert found.reason.startswith("no threshold within the levels")
    assert said in found.reason


def test_answers_that_vary_more_than_binomially_are_told_and_fitted() -> None:
    """Shares of 0.1 and 0.9 by turns are no function: the fit check says so, and overdispersion widens the interval."""
    right = [2, 18, 2, 18, 2, 18, 2, 18]
    levels, trials = np.arange(8.0), [20] * 8
    plain = psychometric_fit(levels, right, trials, guess=None)
    wide = psychometric_fit(levels, right, trials, guess=None, overdispersed=True)
    assert plain.goodness.p < 0.001
    assert wide.goodness.p > 0.01
    assert wide.overdispersion.low > 0.1
    assert wide.threshold.high - wide.threshold.low > plain.threshold.high - plain.threshold.low


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """Forty data sets whose parameters are drawn from the priors; all of 2,000 are in `make soak`."""
    draws, held = np.random.default_rng(8), 0
    for _ in range(40):
        threshold, width, lapse = draws.uniform(6, 14), draws.uniform(4, 8), draws.beta(1, 10) / 2
        shares = 0.5 + (0.5 - lapse) * norm.cdf((LEVELS - threshold) / width * 3.2897)
        found = psychometric_fit(LEVELS, draws.binomial(20, shares), TRIALS, guess=0.5)
        held += found.threshold.low <= threshold <= found.threshold.high
    assert held >= 34  # 38 are expected; fewer than 34 come once in a hundred such tests


def test_levels_at_shares_of_the_function(fit: PsychometricFit) -> None:
    assert fit.level_at(0.5) == fit.threshold
    assert fit.level_at(0.75).median - fit.level_at(0.25).median == pytest.approx(2 * fit.jnd.median, rel=0.1)
    middle, low, high = fit.curve([6.0, 10.0, 14.0])
    assert np.all((low <= middle) & (middle <= high))
    assert np.all(np.diff(middle) > 0)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"levels": [6.0] * 5}, "levels must hold at least two different ones with trials"),
        ({"right": [21, 0, 0, 0, 0]}, "right must be whole numbers from 0 to trials .*, not 21 of 20 at index 0"),
        ({"right": [0.5, 0, 0, 0, 0]}, "right must be whole numbers"),
        ({"trials": [20] * 4}, "levels, right and trials must be rows of one length"),
        ({"levels": [-1.0, 0, 1, 2, 3], "log": True}, "levels must be above 0 for a logarithmic axis, not -1"),
        ({"guess": 1.0}, "guess must be at least 0 and below 1, not 1"),
        ({"guess": float("nan")}, "guess must be finite, not nan"),
        ({"confidence": 1.0}, "confidence must lie between 0 and 1, not 1"),
    ],
)
def test_what_cannot_be_fitted_is_refused_by_name(change: dict[str, Any], said: str) -> None:
    given: dict[str, Any] = {"levels": LEVELS, "right": RIGHT, "trials": TRIALS, "guess": 0.5}
    with pytest.raises(ValueError, match=said):
        psychometric_fit(**(given | change))


def test_a_group_draws_its_people_towards_each_other_by_how_little_they_say() -> None:
    stream = np.random.default_rng(4)
    sure, vague = [stream.normal(10 + place, 0.2, 2000) for place in range(5)], stream.normal(30, 12, 2000)
    group = pooled_group([*sure, vague])
    assert group.people[0].median == pytest.approx(10, abs=0.2)
    assert group.people[5].median < 20
    assert group.mean.low < 12 < group.mean.high


@pytest.mark.slow
@pytest.mark.parametrize(("people", "own_sd"), [(2, 0.05), (3, 0.5), (14, 0.3), (14, 2.0), (60, 0.3)])
def test_a_group_is_that_of_normal_values_known_with_normal_errors(people: int, own_sd: float) -> None:
    """There the posterior of the mean and SD is a sum over a plane, without draws, cells and ends."""
    centres = norm.ppf((np.arange(people) + 0.5) / people)
    own = norm.ppf((np.arange(4000) + 0.5) / 4000) * own_sd
    found = pooled_group([centre + own for centre in centres])
    mean, sd = np.linspace(-30, 30, 12_001)[:, None], np.geomspace(1e-3, 100, 300)
    spread = np.hypot(sd, own_sd)
    log_density = sum(norm.logpdf(centre, mean, spread) for centre in centres)
    log_density += np.log(sd / (1 + (sd / centres.std(ddof=1)) ** 2))
    weights = np.exp(log_density - log_density.max())
    of_mean, of_sd = np.cumsum(weights.sum(axis=1)), np.cumsum(weights.sum(axis=0))
    low, high = np.interp([0.025, 0.975], of_mean / of_mean[-1], mean[:, 0])
    assert (found.mean.low, found.mean.high) == pytest.approx((low, high), abs=0.06 * (high - low))
    middle, most = np.interp([0.5, 0.975], of_sd / of_sd[-1], sd)
    assert (found.sd.median, found.sd.high) == pytest.approx((middle, most), rel=0.08, abs=0.06 * own_sd)


def test_a_difference_does_not_pair_draws() -> None:
    ordered = np.sort(np.random.default_rng(1).normal(size=4000))
    assert np.std(difference(ordered, ordered)) == pytest.approx(np.sqrt(2), abs=0.05)


def test_catch_trials_tell_the_guess_rate() -> None:
    without = psychometric_fit(LEVELS, RIGHT, TRIALS, guess=None)
    told = psychometric_fit(LEVELS, RIGHT, TRIALS, guess=None, catch=(300, 1000))
    assert told.guess.median == pytest.approx(0.3, abs=0.03)
    assert told.guess.high - told.guess.low < (without.guess.high - without.guess.low) / 2
    assert told.reason is None
    with pytest.raises(ValueError, match=r"catch must be two whole numbers, .*, not \(5, 4\)"):
        psychometric_fit(LEVELS, RIGHT, TRIALS, guess=None, catch=(5, 4))


def test_many_catch_trials_leave_the_guess_rate_where_they_have_it() -> None:
    """A tenth of 240; the numbers by two million draws from the priors, weighted by the likelihood."""
    found = psychometric_fit([3.0, 4.0, 5.0, 6.0], [6, 20, 35, 38], [40] * 4, guess=None, catch=(24, 240))
    assert found.guess.median == pytest.approx(0.0975, abs=0.002)
    assert (found.guess.low, found.guess.high) == pytest.approx((0.0657, 0.1372), abs=0.004)
    assert found.threshold.median == pytest.approx(4.0587, abs=0.005)
