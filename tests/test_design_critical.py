"""The critical contour: 75 % where it says so, inside its band, and a band that means what it claims."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from analysis.predict.design_search.choice import (
    THRESHOLD_SHARE,
    Contour,
    band_of,
    contour_of,
    crossings,
    drawn_contours,
    rate_at,
)
from analysis.predict.design_search.space import DesignRequest, Layer, Space, layers, make_space, rows_of, simulate_rows
from analysis.predict.fit.percept_model import PAPER_RATES, PerceptFit, fit_percept, predicted_rate
from analysis.predict.jobs import on_processes
from analysis.stats.arrays import FloatArray
from device.methods import paper_methods
from experiments.synthetic.percept import percept_of

pytestmark = pytest.mark.slow

SPACE = make_space(DesignRequest(grid=7, voltage="1-24", pulse="0.01"))


@pytest.fixture(scope="module")
def layer() -> Layer:
    rows = rows_of(SPACE, (0.01,), (0.02,))
    with on_processes(1) as run:
        return layers(SPACE, rows, simulate_rows(rows, run, lambda _done: None))[0.01]


@pytest.fixture(scope="module")
def fit() -> PerceptFit:
    return fit_percept(PAPER_RATES, paper_methods())


@pytest.fixture(scope="module")
def contour(layer: Layer, fit: PerceptFit) -> Contour:
    return contour_of(SPACE, layer, fit, 1)


def points(contour: Contour, space: Space = SPACE) -> list[tuple[float, float]]:
    return [(f, v) for f, v in zip(space.friction_N, contour.voltage_V.tolist(), strict=True) if math.isfinite(v)]


def test_on_the_contour_three_of_four_are_right_when_simulated_alone(contour: Contour, fit: PerceptFit) -> None:
    """By the sweep's own sampling to a thousandth; by the fit's route, another sampling of the force, to 0.005."""
    for friction_N, voltage_V in points(contour):
        gun = replace(SPACE.gun, friction_N=friction_N, voltage_V=voltage_V)
        assert rate_at(gun, fit.parameters) == pytest.approx(THRESHOLD_SHARE, abs=1e-3)
        assert predicted_rate(fit, percept_of(gun, 0.02)).value == pytest.approx(THRESHOLD_SHARE, abs=5e-3)
    assert len(points(contour)) >= 6


def test_where_no_voltage_brings_the_magnet_home_there_is_no_contour(contour: Contour) -> None:
    assert math.isnan(contour.voltage_V[-1])
    assert math.isnan(contour.band.low_V[-1])


def test_the_damper_lowers_the_critical_voltage(contour: Contour) -> None:
    by_friction = dict(points(contour))
    assert by_friction[1.12] < by_friction[0.21] - 3.0


def test_the_contour_lies_in_its_band(contour: Contour) -> None:
    some = np.isfinite(contour.voltage_V)
    band = contour.band
    assert (band.low_V[some] < contour.voltage_V[some]).all()
    assert (contour.voltage_V[some] < band.high_V[some]).all()
    assert (band.low_V[some] <= band.each_friction_low_V[some]).all()
    assert (band.each_friction_high_V[some] <= band.high_V[some]).all()


def test_a_surer_fit_has_a_narrower_band(contour: Contour, layer: Layer, fit: PerceptFit) -> None:
    surer = replace(fit, covariance=tuple(tuple(x / 25.0 for x in row) for row in fit.covariance))
    narrow = contour_of(SPACE, layer, surer, 1)
    some = np.isfinite(contour.voltage_V) & np.isfinite(contour.band.high_V)
    width, before = (one.band.high_V[some] - one.band.low_V[some] for one in (narrow, contour))
    assert (width < 0.5 * before).all()
    assert (width > 0).all()
    assert narrow.voltage_V[some].tolist() == contour.voltage_V[some].tolist()


def test_a_fit_without_covariance_has_no_band(layer: Layer, fit: PerceptFit) -> None:
    unknown = replace(fit, covariance=((math.nan,) * 3,) * 3)
    band = band_of(drawn_contours(layer.felt[0.02], np.array(SPACE.voltage_V), unknown, 1, draws=10))
    assert np.isnan([band.low_V, band.high_V]).all()


def test_the_draws_are_those_of_the_seed(layer: Layer, fit: PerceptFit) -> None:
    felt, volts = layer.felt[0.02], np.array(SPACE.voltage_V)
    one, again, other = (drawn_contours(felt, volts, fit, seed, draws=50) for seed in (7, 7, 8))
    assert np.array_equal(one, again, equal_nan=True)
    assert not np.array_equal(one, other, equal_nan=True)


def curves(count: int, length: int) -> FloatArray:
    """Random walks: what is extreme in one place need not be so in another."""
    return np.cumsum(np.random.default_rng(3).normal(size=(count, length)), axis=1)


def test_95_percent_of_the_contours_lie_wholly_in_the_band() -> None:
    drawn = curves(2000, 12)
    band = band_of(drawn)
    wholly = ((drawn >= band.low_V) & (drawn <= band.high_V)).all(axis=1).mean()
    alone = ((drawn >= band.each_friction_low_V) & (drawn <= band.each_friction_high_V)).all(axis=1).mean()
    assert 0.95 <= wholly < 0.965
    assert alone < 0.93  # the quantiles of each place alone would claim too much


def test_at_one_place_the_band_is_the_central_95_percent() -> None:
    band = band_of(curves(10_000, 1))
    assert [band.low_V[0], band.high_V[0]] == pytest.approx([-1.96, 1.96], abs=0.06)


def test_a_contour_beyond_the_range_opens_the_band() -> None:
    drawn = np.array([[5.0, 6.0 + n / 100] for n in range(100)])
    drawn[90:, 1] = math.inf
    assert band_of(drawn).high_V.tolist() == [5.0, math.inf]


def test_a_crossing_is_the_first_one_and_says_when_there_is_none() -> None:
    volts = np.array([0.0, 1.0, 2.0, 3.0])
    nan = math.nan
    grid = np.array(
        [
            [nan, 0.5, 1.0, 0.7],
            [nan, 0.8, 0.9, 1.0],
            [0.5, 0.6, 0.7, 0.74],
            [nan] * 4,
        ]
    )
    found = crossings(grid, volts)
    assert found[:3].tolist() == [1.5, 1.0, math.inf]
    assert math.isnan(found[3])


def test_what_is_not_felt_below_the_first_voltage_of_the_grid_is_no_contour_below_the_range() -> None:
    volts = np.array([0.0, 8.0, 16.0, 24.0])
    assert crossings(np.array([[math.nan, 0.8, 0.9, 0.95]]), volts).tolist() == [8.0]
    assert crossings(np.array([[0.76, 0.8, 0.9, 0.95]]), volts).tolist() == [-math.inf]


def test_a_coarse_grid_has_the_contour_of_a_fine_one_within_its_band(fit: PerceptFit) -> None:
    """Of the coarse one the band began at a voltage of the grid, above the solved voltage."""
    found = {}
    for grid in (4, 7):
        space = make_space(DesignRequest(grid=grid, voltage="0-24", pulse="0.01"))
        rows = rows_of(space, (0.01,), (0.02,))
        with on_processes(1) as run:
            layer = layers(space, rows, simulate_rows(rows, run, lambda _done: None))[0.01]
        contour, place = contour_of(space, layer, fit, 1), space.friction_N.index(1.12)
        found[grid] = contour.voltage_V[place]
        assert contour.band.low_V[place] <= found[grid] < contour.band.high_V[place]
    assert found[4] == pytest.approx(found[7], abs=0.01)
    assert found[4] == pytest.approx(7.9, abs=0.1)
