import re

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson
from scipy.optimize import brentq

from device.vibration import RESIDUAL, VibrationParameters, solved, waveform


def shape(parameters, points=40_001):
    time_s, acceleration = waveform(parameters, points)
    rms = np.sqrt(np.trapezoid(acceleration**2, time_s) / time_s[-1])
    return np.abs(acceleration).max(), rms, time_s[-1]


def test_peak_rms_and_duration_come_out_as_the_paper_prints_them():
    peak, rms, duration_s = shape(VibrationParameters())
    assert peak == pytest.approx(1000.0, rel=1e-6)
    assert rms == pytest.approx(257.54, rel=1e-6)
    assert duration_s == 0.024


def test_it_is_over_at_the_end_of_its_duration_and_not_before():
    found = solved(VibrationParameters())
    assert found.envelope_m_s2(0.024) == pytest.approx(RESIDUAL * 1000.0, rel=1e-9)
    later = np.linspace(0.024, 0.3, 100_001)
    assert np.abs(found.acceleration_m_s2(later)).max() <= RESIDUAL * 1000.0
    last = np.linspace(0.018, 0.024, 10_001)  # one cycle
    assert np.abs(found.acceleration_m_s2(last)).max() > 2 * RESIDUAL * 1000.0


def test_one_decaying_sinusoid_would_be_over_at_half_of_the_duration():
    time_s = np.linspace(0.0, 0.024, 20_001)

    def of(decay):
        a = np.exp(-decay * time_s) * np.sin(2 * np.pi * 175.0 * time_s)
        return a, np.sqrt(np.mean(a**2)) / np.abs(a).max()

    decay = brentq(lambda decay: of(decay)[1] - 0.25754, 1.0, 1e4)
    over_s = np.log(1 / (RESIDUAL * np.abs(of(decay)[0]).max())) / decay
    assert 0.012 < over_s < 0.013


def test_two_terms_of_the_frequency_decay_at_rates_of_their_own():
    found = solved(VibrationParameters())
    assert np.abs(found.poles.imag) == pytest.approx(2 * np.pi * 175.0)
    slow, fast = sorted({-rate for rate in found.poles.real})
    assert fast > 2 * slow
    assert found.residues.sum() == pytest.approx(0.0, abs=1e-9)  # a(0) = 0


def test_what_vibrated_is_at_rest_at_its_place_again():
    time_s = np.linspace(0.0, 0.3, 100_001)
    speed = cumulative_simpson(solved(VibrationParameters()).acceleration_m_s2(time_s), x=time_s, initial=0.0)
    place = cumulative_simpson(speed, x=time_s, initial=0.0)
    assert abs(speed[-1]) < 1e-7 * np.abs(speed).max()
    assert abs(place[-1]) < 1e-5 * np.abs(place).max()


@pytest.mark.slow
@given(
    peak=st.floats(1.0, 1e4), ratio=st.floats(0.12, 0.35), duration=st.floats(0.005, 0.5), cycles=st.floats(2.0, 50.0)
)
@example(peak=1.0, ratio=0.12, duration=0.005, cycles=50.0)
@example(peak=1e4, ratio=0.35, duration=0.5, cycles=2.0)
@settings(max_examples=5, deadline=None)
def test_any_solvable_request_is_met(peak, ratio, duration, cycles):
    asked = VibrationParameters(
        peak_m_s2=peak, rms_m_s2=ratio * peak, duration_s=duration, frequency_Hz=cycles / duration
    )
    got_peak, got_rms, _ = shape(asked)
    assert got_peak == pytest.approx(peak, rel=1e-4)  # sampled
    assert got_rms == pytest.approx(ratio * peak, rel=1e-5)
    assert solved(asked).envelope_m_s2(duration) == pytest.approx(RESIDUAL * peak, rel=1e-9)


def test_the_vibration_starts_from_zero_and_fades():
    _, acceleration = waveform(VibrationParameters(), 2401)
    assert acceleration[0] == 0.0
    assert np.abs(acceleration[1200:]).max() < np.abs(acceleration[:1200]).max() / 2


@pytest.mark.slow
@pytest.mark.parametrize("rms", [900.0, 1.0, 1500.0])
def test_an_rms_that_no_decaying_sinusoids_have_is_refused_with_the_range(rms):
    with pytest.raises(ValueError, match=r"rms_m_s2 / peak_m_s2 .* can have"):
        waveform(VibrationParameters(rms_m_s2=rms), 10)


def test_less_than_one_cycle_or_two_points_is_refused():
    with pytest.raises(ValueError, match="one"):
        waveform(VibrationParameters(frequency_Hz=30.0), 10)
    with pytest.raises(ValueError, match="points is 1"):
        waveform(VibrationParameters(), 1)


@pytest.mark.parametrize("field", ["peak_m_s2", "rms_m_s2", "duration_s", "frequency_Hz"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_every_number_is_finite_and_above_zero(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        VibrationParameters(**{field: value})


def test_an_effect_outside_the_library_is_refused():
    with pytest.raises(ValueError, match="effect is 124"):
        VibrationParameters(effect=124)


@pytest.mark.parametrize("wrong", [None, "1", True, 1.5, 0, 124])
def test_an_effect_that_the_driver_does_not_have_is_refused_by_value_and_rule(wrong):
    with pytest.raises(ValueError, match=re.escape(f"effect is {wrong!r}; it must be a waveform of the DRV2605")):
        VibrationParameters(effect=wrong)


@pytest.mark.parametrize("field", ["peak_m_s2", "rms_m_s2", "duration_s", "frequency_Hz"])
@pytest.mark.parametrize("wrong", [None, "1", True])
def test_a_number_of_the_wrong_kind_is_refused_by_name_value_and_rule(field, wrong):
    with pytest.raises(ValueError, match=re.escape(f"{field} is {wrong!r}; it must be a finite number above 0")):
        VibrationParameters(**{field: wrong})
