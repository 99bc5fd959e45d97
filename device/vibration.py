"""The vibration that the paper compares with, as an acceleration over time.

The moving mass of the actuator is not published, so there is no force, only the acceleration that was measured:
its peak, its root mean square and its duration. One decaying sinusoid has just the two unknowns that these fix.
"""

from __future__ import annotations

import cmath
import math

import numpy as np
from numpy.typing import NDArray

from device.parameters import VibrationParameters

__all__ = ["VibrationParameters", "waveform"]

_SLOWEST, _FASTEST = 1e-6, 1e4  # decay over the duration, in nepers, between which the solution is looked for


def waveform(parameters: VibrationParameters, points: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Time in s and acceleration in m/s2 of the vibration, a(t) = A exp(-d t) sin(2 pi f t) over its duration.

    A and d are solved for the published peak and root mean square. `ValueError`: fewer than 2 points, or no decaying
    sinusoid has this peak, root mean square, frequency and duration together.
    """
    if points < 2:
        raise ValueError(f"points is {points}; it must be at least 2")
    amplitude, decay = _solved(parameters)
    time_s = np.linspace(0.0, parameters.duration_s, points)
    return time_s, amplitude * np.exp(-decay * time_s) * np.sin(2 * math.pi * parameters.frequency_Hz * time_s)


def _solved(parameters: VibrationParameters) -> tuple[float, float]:
    """The amplitude in m/s2 and the decay rate in 1/s."""
    from scipy.optimize import brentq  # noqa: PLC0415 - the heavy import waits until a waveform is asked for

    duration_s = parameters.duration_s
    omega = 2 * math.pi * parameters.frequency_Hz
    cycles = parameters.frequency_Hz * duration_s
    if cycles < 1:
        raise ValueError(f"frequency_Hz x duration_s is {cycles:g} cycles; the vibration needs at least one")
    wanted = parameters.rms_m_s2 / parameters.peak_m_s2
    low, high = (_ratio(omega, decay / duration_s, duration_s) for decay in (_FASTEST, _SLOWEST))
    if not low < wanted < high:
        raise ValueError(
            f"rms_m_s2 / peak_m_s2 is {wanted:g}; a decaying sinusoid of {parameters.frequency_Hz:g} Hz over "
            f"{duration_s:g} s can have {low:.4g} to {high:.4g}"
        )
    nepers = brentq(lambda d: _ratio(omega, d / duration_s, duration_s) - wanted, _SLOWEST, _FASTEST, xtol=1e-14)
    decay = float(nepers) / duration_s
    return parameters.peak_m_s2 / _unit_peak(omega, decay), decay


def _ratio(omega: float, decay: float, duration_s: float) -> float:
    return _unit_rms(omega, decay, duration_s) / _unit_peak(omega, decay)


def _unit_peak(omega: float, decay: float) -> float:
    """The first and largest maximum of exp(-d t) sin(w t), where tan(w t) = w/d."""
    t = math.atan2(omega, decay) / omega
    return math.exp(-decay * t) * math.sin(omega * t)


def _unit_rms(omega: float, decay: float, duration_s: float) -> float:
    """The root mean square of exp(-d t) sin(w t) over the duration: sin^2 = (1 - Re exp(2 i w t))/2, integrated."""
    steady = -math.expm1(-2 * decay * duration_s) / (2 * decay)
    rate = complex(-2 * decay, 2 * omega)
    swinging = ((cmath.exp(rate * duration_s) - 1) / rate).real
    return math.sqrt((steady - swinging) / 2 / duration_s)
