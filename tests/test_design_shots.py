"""What the sweep makes of a shot: the same percept as the full trace, the scalar formulas, the device's own rules."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.predict.design_search.choice import both_ways, evidences, logits, predict, rates
from analysis.predict.design_search.felt import COIL_POINTS, FREE_POINTS, Feeling, feel_on, percepts_of_shots
from analysis.predict.design_search.run import waiting_note
from analysis.predict.design_search.space import FrictionRow, shots, simulate_rows
from analysis.predict.fit.percept_model import PAPER_RATES, fit_percept, predicted_rate
from analysis.predict.jobs import one_by_one
from device.limits import (
    BEYOND_DUTY,
    BEYOND_HEAT,
    BEYOND_PULSE,
    BEYOND_VOLTAGE,
    DriveHistory,
    Load,
    broken_limit,
    load_of,
    steady_coil_C,
)
from device.methods import paper_methods
from device.parameters import GunParameters
from device.physics import batch, simulate, trace
from device.physics.equations import HOME
from device.words import LimitError, Pulse
from experiments.synthetic.decision import forward_rates
from experiments.synthetic.diffusion import People
from experiments.synthetic.percept import Percept, PerceptParameters, evidence, percept_of_summary, percept_of_trace

DEFAULT = PerceptParameters()
GUN = GunParameters()
GUNS = [
    replace(GUN, friction_N=friction, voltage_V=voltage, pulse_s=pulse)
    for friction, voltage, pulse in ((0.21, 16.0, 0.01), (1.12, 16.0, 0.01), (0.21, 24.0, 0.005), (1.0, 5.0, 0.02))
]
VOLTAGES = (0.0, 0.7, 3.0, 8.0, 16.0, 24.0)
nonnegative = st.floats(0.0, 12.0)


def fired(load: Load, rate_Hz: float, shots: int) -> DriveHistory:
    """A steady train by the device's own rules."""
    history = DriveHistory()
    for shot in range(shots):
        history = history.record(load, shot / rate_Hz, shot / rate_Hz + load.on_s)
    return history


def rate_of(percept: Percept) -> float:
    return float(forward_rates(evidence(percept, DEFAULT), DEFAULT.start, People()))


@pytest.mark.parametrize("gun", GUNS)
def test_four_times_the_points_change_the_rate_by_less_than_half_a_thousandth(gun: GunParameters) -> None:
    summary, fine = simulate(gun), (4 * COIL_POINTS, 4 * FREE_POINTS)
    ((coarse,),), ((exact,),) = (
        percepts_of_shots([gun], [summary], (0.02,), points) for points in ((COIL_POINTS, FREE_POINTS), fine)
    )
    assert rate_of(coarse) == pytest.approx(rate_of(exact), abs=5e-4)


@pytest.mark.slow
@pytest.mark.parametrize("gun", GUNS)
def test_a_fine_trace_gives_the_same_percept(gun: GunParameters) -> None:
    ((felt,),) = percepts_of_shots([gun], [simulate(gun)], (0.02,))
    traced = percept_of_trace(trace(gun, 20_000), gun.magnet_mass_kg, 0.02)
    assert rate_of(felt) == pytest.approx(rate_of(traced), abs=1e-3)


def test_a_shot_that_sticks_or_stays_has_no_percept() -> None:
    found = shots(FrictionRow(gun=replace(GUN, friction_N=1.54), voltage_V=(0.0, 12.0), leaks_s=(0.02,)))
    assert [shot.felt for shot in found] == [(), ()]
    assert HOME not in [shot.status for shot in found]
    assert all(math.isnan(shot.period_s) and shot.by_summary is None for shot in found)


@pytest.mark.slow
@pytest.mark.parametrize("changed", [{}, {"drive_off": "open"}, {"emf": "reciprocal"}, {"inductance_H": 1e-9}])
def test_the_compiler_gives_the_same_shots(monkeypatch: pytest.MonkeyPatch, changed: dict[str, Any]) -> None:
    """Also those that stick, stay, creep, or are not home in time; under more leaks than one."""
    pytest.importorskip("numba")
    rows = [
        FrictionRow(gun=replace(GUN, friction_N=f, pulse_s=p, **changed), voltage_V=VOLTAGES, leaks_s=(0.02, 0.01))
        for f, p in ((0.0, 0.01), (0.21, 0.002), (1.12, 0.02), (1.54, 0.01))
    ]
    compiled = [shots(row) for row in rows]
    monkeypatch.setattr(batch, "find_spec", lambda _name: None)
    for row, found in zip(rows, compiled, strict=True):
        for one, other in zip(shots(row), found, strict=True):
            assert one.status == other.status
            assert one.period_s == pytest.approx(other.period_s, rel=1e-9, nan_ok=True)
            for a, b in zip(one.felt, other.felt, strict=True):
                assert [a.first, a.reaction, a.second] == pytest.approx([b.first, b.reaction, b.second], rel=1e-9)


def test_a_shot_is_felt_as_its_course_of_times_and_forces_is() -> None:
    """Against the other way there: the times and forces of a trace, through `percept_of_course`."""
    drawn = trace(GUN, 3000)
    one = Feeling(0.02, drawn.summary.firing_end_s or 0.0, drawn.summary.reset_end_s or 0.0)
    for time_s, force_N in zip(drawn.time_s.tolist(), drawn.force_N.tolist(), strict=True):
        feel_on(one, time_s, force_N)
    expected = percept_of_trace(drawn, GUN.magnet_mass_kg, 0.02)
    blow_N = GUN.magnet_mass_kg * (drawn.summary.impact_speed_m_s or 0.0) / 0.02
    found = (one.first_N, -one.least_N, max(one.late_N, one.landing_N + blow_N))
    assert found == (expected.first, expected.reaction, expected.second)


def test_without_the_compiler_the_workers_simulate(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batch, "find_spec", lambda _name: None)
    row, asked = FrictionRow(gun=GUN, voltage_V=(16.0,), leaks_s=(0.02,)), list[object]()

    def run(function: Callable[[object], object], pieces: Sequence[object], done: Callable[[int, Any], None]) -> None:
        asked.extend(pieces)
        one_by_one(function, pieces, done)

    ((shot,),) = simulate_rows([row], run, lambda _words: None)
    assert shot.status == HOME
    assert asked == [row]
    assert "recoil[fast]" in waiting_note()


def test_a_shot_without_bullet_firing_says_nothing_by_its_summary() -> None:
    """Voltage so low that the magnet turns while the coil still pushes."""
    gun = replace(GUN, voltage_V=0.7, friction_N=0.21)
    summary = simulate(gun)
    assert summary.firing_end_s == summary.recoil_end_s
    assert percept_of_summary(summary, gun.magnet_mass_kg, 0.02).first == 0.0


@given(nonnegative, nonnegative, nonnegative)
def test_arrays_have_the_evidence_and_the_rate_of_single_percepts(first: float, reaction: float, second: float) -> None:
    percept, felt = Percept(first=first, reaction=reaction, second=second), np.array([first, reaction, second])
    found = evidences(felt, DEFAULT.exponent, DEFAULT.sensitivity, DEFAULT.confusion)
    assert float(found) == pytest.approx(evidence(percept, DEFAULT), rel=1e-12, abs=1e-12)
    assert float(rates(felt, DEFAULT)) == pytest.approx(rate_of(percept), abs=1e-12)


@given(st.floats(0.05, 0.95))
def test_no_evidence_leaves_the_start_and_much_of_it_no_doubt(start: float) -> None:
    odds = logits(np.array([0.0, 1e-9, 800.0, -800.0]), start)
    assert odds[:2] == pytest.approx([math.log(start / (1 - start))] * 2, abs=1e-6)
    assert odds[2] > 50
    assert odds[3] < -50
    assert np.isfinite(odds).all()


def test_both_ways_alike_no_bias_helps() -> None:
    """With a start of one half the mean of both directions is the forward rate; a bias makes it less."""
    felt = np.array([5.4, 1.9, 4.6])
    fair = replace(DEFAULT, start=0.5)
    assert float(both_ways(felt, fair)) == pytest.approx(float(rates(felt, fair)))
    assert float(both_ways(felt, replace(DEFAULT, start=0.7))) < float(rates(felt, fair))


@pytest.mark.slow
def test_a_grids_intervals_are_those_of_a_single_prediction() -> None:
    fit = fit_percept(PAPER_RATES, paper_methods())
    percept = Percept(first=6.0, reaction=2.0, second=1.0)
    one, many = predicted_rate(fit, percept), predict(np.array([[6.0, 2.0, 1.0], [math.nan] * 3]), fit)
    assert [many.rate[0], many.ci_low[0], many.ci_high[0]] == pytest.approx([one.value, one.ci_low, one.ci_high])
    assert np.isnan([many.rate[1], many.ci_low[1], many.evidence[1]]).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("voltage", "pulse", "rate", "limit"),
    [
        (16.0, 0.010, 5.0, None),
        (24.5, 0.001, 1.0, BEYOND_VOLTAGE),
        (1.0, 0.021, 1.0, BEYOND_PULSE),
        (1.0, 0.020, 5.0, None),  # a tenth of a second exactly
        (24.0, 0.010, 5.0, BEYOND_HEAT),
        (24.0, 0.010, 2.0, None),
        (17.8, 0.010, 5.0, None),
        (17.9, 0.010, 5.0, BEYOND_HEAT),
    ],
)
def test_a_steady_train_is_judged_as_the_device_judges_it(
    voltage: float, pulse: float, rate: float, limit: str | None
) -> None:
    assert broken_limit(voltage, pulse, GUN.resistance_ohm, rate) == limit
    if limit in (BEYOND_VOLTAGE, BEYOND_PULSE):
        with pytest.raises(LimitError):
            Pulse(voltage_V=voltage, pulse_s=pulse)
        return
    load = load_of(Pulse(voltage_V=voltage, pulse_s=pulse), GUN.resistance_ohm)
    refusal = nullcontext() if limit is None else pytest.raises(LimitError)
    with refusal:
        fired(load, rate, round(1200 * rate))


def test_the_limit_on_duty_is_the_devices_too() -> None:
    """No pulse that is allowed breaks it at 5 Hz; at 5.2 Hz 6 pulses of 20 ms would fall in the fullest second."""
    assert broken_limit(1.0, 0.02, GUN.resistance_ohm, 5.2) == BEYOND_DUTY
    load = load_of(Pulse(voltage_V=1.0, pulse_s=0.02), GUN.resistance_ohm)
    with pytest.raises(LimitError, match="10% of a second"):
        fired(load, 5.2, 12)
    assert steady_coil_C(load, 5.0) < 26
