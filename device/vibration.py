"""The vibration that the paper compares with, as an acceleration over time.

The moving mass of the actuator is not published, so there is no force, only the acceleration that was measured:
"several decaying sinusoidal waves" by their peak, root mean square and duration. One decaying sinusoid meets peak and
root mean square only if it is over long before the duration's end (2 % of the peak after 12 of the 24 ms), so there
are two of one frequency, a fast one (the start) and a slow one (the ringing):

    a(t) = sum over j of A_j exp(-d_j t) sin(2 pi f t + phi_j)
    transform: K s^2/(D_1 D_2) with D_j = (s + d_j)^2 + (2 pi f)^2

The s^2 makes the integrals of a over all time, and of its integral, 0: what vibrated is at rest at its place again,
which no single one can do. The degree of the denominator lets a start from 0. What is left are K, d_1 and d_2, solved
for the peak, the root mean square over the duration, and an envelope of `RESIDUAL` of the peak at its end. Of the
solutions that there may be, it is the one of the fastest start.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from device.parameters import VibrationParameters

__all__ = ["RESIDUAL", "Vibration", "VibrationParameters", "solved", "waveform"]

RESIDUAL = 0.02
"""Of the peak: what the envelope has come down to when the vibration counts as over, assumed."""
_FACTORS = np.geomspace(1.02, 1e3, 24)
"""d_2/d_1, between which the solution is looked for."""
_MOST_NEPERS = 200.0  # of the slow one's decay over the duration

_ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Vibration:
    """A sum of decaying exponentials in conjugate pairs, in m/s2: residues at poles in 1/s."""

    residues: _ComplexArray
    poles: _ComplexArray

    def acceleration_m_s2(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """The acceleration at times from 0 on."""
        return np.real(np.exp(np.multiply.outer(time_s, self.poles)) @ self.residues)

    def envelope_m_s2(self, time_s: float) -> float:
        """What the acceleration does not pass from this time on."""
        return float(np.abs(self.residues) @ np.exp(self.poles.real * time_s))

    def rms_m_s2(self, duration_s: float) -> float:
        """The root mean square over a duration: the integral of the products of the exponentials."""
        rates = np.add.outer(self.poles, self.poles)
        parts = np.outer(self.residues, self.residues) * np.expm1(rates * duration_s) / rates
        return math.sqrt(float(np.real(parts.sum())) / duration_s)


def waveform(parameters: VibrationParameters, points: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Time in s and acceleration in m/s2 of the vibration over its duration.

    `ValueError`: fewer than 2 points, or no such sum has this peak, root mean square, frequency and duration together.
    """
    if points < 2:
        raise ValueError(f"points is {points}; it must be at least 2")
    time_s = np.linspace(0.0, parameters.duration_s, points)
    acceleration = solved(parameters).acceleration_m_s2(time_s)
    acceleration[0] = 0.0  # but for rounding
    return time_s, acceleration


@lru_cache(maxsize=64)
def solved(parameters: VibrationParameters) -> Vibration:
    """The vibration that these numbers describe. `ValueError` as `waveform`, with the range that there is."""
    from scipy.optimize import brentq  # noqa: PLC0415 - the heavy import waits until a waveform is asked for

    cycles = parameters.frequency_Hz * parameters.duration_s
    if cycles < 1:
        raise ValueError(f"frequency_Hz x duration_s is {cycles:g} cycles; the vibration needs at least one")
    wanted = parameters.rms_m_s2 / parameters.peak_m_s2
    ratios = [_ratio(cycles, factor) for factor in _FACTORS.tolist()]
    for (low, first), (high, second) in reversed(list(pairwise(zip(_FACTORS.tolist(), ratios, strict=True)))):
        if min(first, second) <= wanted <= max(first, second):
            factor = float(brentq(lambda factor: _ratio(cycles, factor) - wanted, low, high, xtol=1e-14))
            return _scaled(_unit(cycles, _slow_nepers(cycles, factor), factor), parameters)
    raise ValueError(
        f"rms_m_s2 / peak_m_s2 is {wanted:g}; decaying sinusoids of {parameters.frequency_Hz:g} Hz that fade to "
        f"{RESIDUAL:.0%} of the peak in {parameters.duration_s:g} s can have {min(ratios):.4g} to {max(ratios):.4g}"
    )


def _scaled(unit: Vibration, parameters: VibrationParameters) -> Vibration:
    """From a duration of 1 to that of the parameters, and to their peak."""
    size = parameters.peak_m_s2 / _peak(unit)
    return Vibration(residues=unit.residues * size, poles=unit.poles / parameters.duration_s)


def _ratio(cycles: float, factor: float) -> float:
    """Root mean square to peak, of the vibration that fades as it should."""
    unit = _unit(cycles, _slow_nepers(cycles, factor), factor)
    return unit.rms_m_s2(1.0) / _peak(unit)


def _slow_nepers(cycles: float, factor: float) -> float:
    """The slow one's decay over the duration that leaves `RESIDUAL` of the peak at its end."""
    from scipy.optimize import brentq  # noqa: PLC0415 - as above

    def excess(nepers: float) -> float:
        unit = _unit(cycles, nepers, factor)
        return math.log(unit.envelope_m_s2(1.0) / _peak(unit) / RESIDUAL)

    return float(brentq(excess, 1e-3, _MOST_NEPERS, xtol=1e-14))


def _unit(cycles: float, nepers: float, factor: float) -> Vibration:
    """The vibration over a duration of 1 with K = 1."""
    turning = 2j * math.pi * cycles
    poles = np.array([-nepers + turning, -nepers * factor + turning])
    poles = np.concatenate([poles, poles.conj()])
    gaps = np.subtract.outer(poles, poles) + np.eye(4)
    return Vibration(residues=poles**2 / gaps.prod(axis=1), poles=poles)


def _peak(unit: Vibration) -> float:
    """The largest acceleration of all: where it is on a grid, then between the roots of its change around there."""
    from scipy.optimize import brentq  # noqa: PLC0415 - as above

    change = Vibration(residues=unit.residues * unit.poles, poles=unit.poles)
    fastest = np.abs(unit.poles).max()
    grid = np.concatenate([np.geomspace(1e-3 / fastest, 1.0, 200), np.linspace(0.0, 1.0, 800)])
    grid.sort()
    size = np.abs(unit.acceleration_m_s2(grid))
    top = int(size.argmax())
    around = grid[max(top - 1, 0)], grid[min(top + 1, len(grid) - 1)]

    def slope(time: float) -> float:
        return float(change.acceleration_m_s2(np.array(time)))

    if slope(around[0]) * slope(around[1]) >= 0:
        return float(size[top])
    at = brentq(slope, *around, xtol=1e-15)
    return float(abs(unit.acceleration_m_s2(np.array(at))))
