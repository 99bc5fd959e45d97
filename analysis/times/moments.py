"""Closed forms of the simple diffusion: how often each answer, after what time, with what spread.

With x coth x and x^2 / sinh^2 x of x = a v and x = z v (the logarithm of the transform of the upper exit's time is
log sinh(z g) - log sinh(a g) + const, g = sqrt(v^2 + 2 lambda), of which these are the first two derivatives):

    E(T | upper) = a^2 c(a v) - z^2 c(z v),          c(x) = (x coth x - 1) / x^2                        -> 1/3
    V(T | upper) = a^4 h(a v) - z^4 h(z v),          h(x) = (x coth x + x^2 / sinh^2 x - 2) / x^4       -> 2/45

and the same for "lower" from a - z. Both are even in v. For w = 1/2 the answers' times are alike, and these are the
EZ forms of Wagenmakers, van der Maas & Grasman 2007, Psychon. Bull. Rev. 14, 3. Without drift they need no limit.
Source of the transform: Cox & Miller 1965, The Theory of Stochastic Processes, section 5.7.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from analysis.stats.arrays import FloatArray, Values, plain
from analysis.times.density import check_bounds

_TERMS = 20
_EVEN = 2 * np.arange(1, _TERMS + 1)
_COTH = 2.0**_EVEN * special.bernoulli(2 * _TERMS)[2::2] / np.array([math.factorial(int(n)) for n in _EVEN])
"""x coth x = 1 + sum of these times x^2, x^4, ...; used for |x| < 1, where 20 terms leave 1e-19 of it."""
_H_SERIES = ((2.0 - _EVEN) * _COTH)[1:]
"""x coth x + x^2 / sinh^2 x = 2 C - x C', C = x coth x."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Moments:
    """Probability of "upper", and mean (s) and variance (s^2) of the decision time: of all, and given the answer."""

    upper: Values
    mean_s: Values
    variance_s2: Values
    upper_mean_s: Values
    upper_variance_s2: Values
    lower_mean_s: Values
    lower_variance_s2: Values


def moments(drift: ArrayLike, boundary: ArrayLike, start: ArrayLike = 0.5) -> Moments:
    """The moments of the decision time (without t0); the arguments broadcast. `ValueError`: as `log_density`.

    >>> found = moments(1.0, 2.0)
    >>> round(found.upper, 6), round(found.mean_s, 6), round(moments(0.0, 2.0).variance_s2, 6)
    (0.880797, 0.761594, 0.666667)
    """
    v, a, w = np.broadcast_arrays(*(np.asarray(x, dtype=np.float64) for x in (drift, boundary, start)))
    check_bounds(a, w)
    p = lower_probability(-v * a, 1.0 - w)
    up, down = _given(v, a, w * a), _given(v, a, (1.0 - w) * a)
    mean = p * up[0] + (1.0 - p) * down[0]
    within = p * up[1] + (1.0 - p) * down[1]
    return Moments(
        upper=plain(p),
        mean_s=plain(mean),
        variance_s2=plain(within + p * (1.0 - p) * (up[0] - down[0]) ** 2),
        upper_mean_s=plain(up[0]),
        upper_variance_s2=plain(up[1]),
        lower_mean_s=plain(down[0]),
        lower_variance_s2=plain(down[1]),
    )


def lower_probability(scaled_drift: FloatArray, start: FloatArray) -> FloatArray:
    """P(lower) = (e^(-2 c w) - e^(-2 c)) / (1 - e^(-2 c)), c = v a; 1 - w without drift. Nothing cancels."""
    c = np.abs(scaled_drift)
    some = c > 1e-300
    whole = np.where(some, -np.expm1(-2.0 * c), 1.0)
    away = np.exp(-2.0 * c * start) * np.where(some, -np.expm1(-2.0 * c * (1.0 - start)) / whole, 1.0 - start)
    towards = np.where(some, -np.expm1(-2.0 * c * (1.0 - start)) / whole, 1.0 - start)
    return np.where(scaled_drift < 0.0, towards, np.where(some, away, 1.0 - start))


def _given(v: FloatArray, a: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean and variance of the time given the exit at a, from z."""
    return a**2 * mean_form(a * v) - z**2 * mean_form(z * v), a**4 * variance_form(a * v) - z**4 * variance_form(z * v)


def mean_form(x: FloatArray) -> FloatArray:
    """c(x) = (x coth x - 1) / x^2."""
    small = np.abs(x) < 1.0
    far = np.where(small, 1.0, np.abs(x))
    return np.where(small, _series(_COTH, x, small), (far / np.tanh(far) - 1.0) / far**2)


def variance_form(x: FloatArray) -> FloatArray:
    """h(x) = (x coth x + x^2 / sinh^2 x - 2) / x^4."""
    small = np.abs(x) < 1.0
    far = np.where(small, 1.0, np.abs(x))
    fall = np.exp(-2.0 * far)
    squared = 4.0 * far**2 * fall / np.expm1(-2.0 * far) ** 2
    return np.where(small, _series(_H_SERIES, x, small), (far / np.tanh(far) + squared - 2.0) / far**4)


def _series(coefficients: FloatArray, x: FloatArray, small: NDArray[np.bool_]) -> FloatArray:
    return np.asarray(np.polynomial.polynomial.polyval(np.where(small, x, 0.0) ** 2, coefficients))
