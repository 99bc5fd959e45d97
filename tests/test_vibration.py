import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from device.vibration import VibrationParameters, waveform


def shape(parameters, points=400_001):
    time_s, acceleration = waveform(parameters, points)
    rms = np.sqrt(np.trapezoid(acceleration**2, time_s) / time_s[-1])
    return np.abs(acceleration).max(), rms, time_s[-1]


def test_peak_rms_and_duration_come_out_as_the_paper_prints_them():
    peak, rms, duration_s = shape(VibrationParameters())
    assert peak == pytest.approx(1000.0, rel=1e-6)
    assert rms == pytest.approx(257.54, rel=1e-6)
    assert duration_s == 0.024


@given(peak=st.floats(1.0, 1e4), ratio=st.floats(0.1, 0.6), duration=st.floats(0.005, 0.5), cycles=st.floats(2.0, 50.0))
@settings(max_examples=25, deadline=None)
def test_any_solvable_request_is_met(peak, ratio, duration, cycles):
    asked = VibrationParameters(
        peak_m_s2=peak, rms_m_s2=ratio * peak, duration_s=duration, frequency_Hz=cycles / duration
    )
    got_peak, got_rms, _ = shape(asked)
    assert got_peak == pytest.approx(peak, rel=1e-4)  # sampled
    assert got_rms == pytest.approx(ratio * peak, rel=1e-5)


def test_the_vibration_starts_from_zero_and_fades():
    _, acceleration = waveform(VibrationParameters(), 2401)
    assert acceleration[0] == 0.0
    assert np.abs(acceleration[1200:]).max() < np.abs(acceleration[:1200]).max() / 2


@pytest.mark.parametrize("rms", [900.0, 1.0, 1500.0])
def test_an_rms_that_no_decaying_sinusoid_has_is_refused_with_the_range(rms):
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
