"""Distribution of the first-passage time of the simple diffusion: P(T <= t and the answer). Symbols as in `density`.

Short times: the images' inverse Gaussian distributions (Blurton, Kesselmeier & Gondan 2012, J. Math. Psychol. 56, 470);
long times: the answer's probability less the waves' tail (Ratcliff 1978, Psychol. Rev. 85, 59). They meet at `CUT`,
where what is left out is below 1e-20; the absolute error is that of rounding, about 1e-15.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from analysis.stats.arrays import FloatArray, Values, plain
from analysis.times.density import CUT, WAVES, check_bounds
from analysis.times.moments import lower_probability


def distribution(
    time_s: ArrayLike, upper: ArrayLike, drift: ArrayLike, boundary: ArrayLike, start: ArrayLike
) -> Values:
    """P(T <= t, answer), rising from 0 to the answer's probability; divide by that for the time given the answer.

    The decision time is without t0; all arguments broadcast. `ValueError`: as `density.log_density`.

    >>> round(distribution(100.0, True, 1.0, 2.0, 0.5), 6)
    0.880797
    """
    t, v, a, w = np.broadcast_arrays(
        *(np.asarray(values, dtype=np.float64) for values in (time_s, drift, boundary, start))
    )
    t, up, v, a, w = np.broadcast_arrays(t, np.asarray(upper, dtype=np.bool_), v, a, w)
    check_bounds(a, w)
    c, near = np.where(up, -v, v) * a, np.where(up, 1.0 - w, w)
    some = t > 0.0
    tau = np.where(some, t, 1.0) / a**2
    value = np.empty(tau.shape)
    short = tau <= CUT
    value[short] = _images(tau[short], c[short], near[short])
    value[~short] = _waves(tau[~short], c[~short], near[~short])
    return plain(np.where(some, value, 0.0))


def _images(tau: FloatArray, c: FloatArray, near: FloatArray) -> FloatArray:
    """Sum sign(b) exp(-c w) [e^(-|c| b) Phi((|c| tau - b)/sqrt(tau)) + e^(|c| b) Phi(-(|c| tau + b)/sqrt(tau))]."""
    total, root, drift = np.zeros_like(tau), np.sqrt(tau), np.abs(c)
    for k in (0, -1, 1, -2, 2, -3):
        b = np.abs(near + 2.0 * k)
        first = special.log_ndtr((drift * tau - b) / root) - drift * b
        second = special.log_ndtr(-(drift * tau + b) / root) + drift * b
        both = np.exp(first - c * near) + np.exp(second - c * near)
        total += both if k >= 0 else -both
    return np.maximum(total, 0.0)


def _waves(tau: FloatArray, c: FloatArray, near: FloatArray) -> FloatArray:
    """P(lower) - 2 pi exp(-c w - c^2 tau / 2) sum k sin(k pi w) exp(-k^2 pi^2 tau / 2) / (c^2 + k^2 pi^2)."""
    tail = np.zeros_like(tau)
    for k in range(1, WAVES + 1):
        rate = c * c + (k * math.pi) ** 2
        tail += k * np.sin(k * math.pi * near) / rate * np.exp(-c * near - rate * tau / 2.0)
    return np.asarray(lower_probability(c, near) - 2.0 * math.pi * tail)
