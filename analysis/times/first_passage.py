"""The simple diffusion's first passage: density with its derivatives, closed forms, and distribution.

    dX = v dt + dW,  X(0) = w a,  absorbed at 0 ("lower") and a ("upper");  s = 1, v in 1/sqrt(s), a in sqrt(s)
    p(t, lower) = a^-2 exp(-v a w - v^2 t / 2) f(t / a^2, w),   p(t, upper | v, w) = p(t, lower | -v, 1 - w)

f is the density without drift from w in (0, 1), by one of two series (Navarro & Fuss 2009, J. Math. Psychol. 53, 222;
Feller 1968): images for short times, waves for long ones. They choose the number of terms from a bound on the
absolute error. Here the number is fixed, and where the series meet, `MEET_AT`, is chosen such that `IMAGES` and
`WAVES` terms leave a *relative* error below 1e-18 for w from 1e-6 to 1 - 1e-6, so rounding rules, in the tails as
well: 1e-14, and 1e-12 at these ends. Each series is divided by its leading exponential, so the logarithm never meets
an underflow.

With x coth x and x^2 / sinh^2 x of x = a v and x = z v (the logarithm of the transform of the upper exit's time is
log sinh(z g) - log sinh(a g) + const, g = sqrt(v^2 + 2 lambda), of which these are the first two derivatives):

    E(T | upper) = a^2 c(a v) - z^2 c(z v),          c(x) = (x coth x - 1) / x^2                        -> 1/3
    V(T | upper) = a^4 h(a v) - z^4 h(z v),          h(x) = (x coth x + x^2 / sinh^2 x - 2) / x^4       -> 2/45

and the same for "lower" from a - z. Both are even in v. For w = 1/2 the answers' times are alike, and these are the
EZ forms of Wagenmakers, van der Maas & Grasman 2007, Psychon. Bull. Rev. 14, 3. Without drift they need no limit.
Source of the transform: Cox & Miller 1965, The Theory of Stochastic Processes, section 5.7.

Short times: the images' inverse Gaussian distributions (Blurton, Kesselmeier & Gondan 2012, J. Math. Psychol. 56, 470);
long times: the answer's probability less the waves' tail (Ratcliff 1978, Psychol. Rev. 85, 59). They meet at `MEET_AT`,
where what is left out is below 1e-20; the absolute error is that of rounding, about 1e-15.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from analysis.stats.arrays import FloatArray, Values, float_or_array

MEET_AT = 0.3
"""Scaled time t / a^2 where the series meet: at most 7 exp(-60) and 36 exp(-51) of the sums are left out there."""
IMAGES = (0, -1, 1, -2, 2, -3)
"""The k of the images at w + 2 k, in pairs that cancel least."""
WAVES = 5

_LOG_2PI = math.log(2.0 * math.pi)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogDensity:
    """Logarithm of f(tau, w) and its partial derivatives."""

    value: FloatArray
    by_time: FloatArray
    by_start: FloatArray


def check_bounds(boundary: FloatArray, start: FloatArray) -> None:
    """`ValueError` unless every boundary is above 0 and every start strictly between 0 and 1."""
    if not (boundary > 0.0).all():
        raise ValueError(f"boundary must be above 0, not {boundary[~(boundary > 0.0)].ravel()[0]}")
    if not ((start > 0.0) & (start < 1.0)).all():
        raise ValueError(
            f"start must lie strictly between 0 and 1, not {start[~((start > 0) & (start < 1))].ravel()[0]}"
        )


def with_slopes(tau: NDArray[np.float64], near: FloatArray) -> LogDensity:
    """Log f with its derivatives by tau and w, of arrays of one axis; for likelihoods."""
    value, by_time, by_start = (np.empty(tau.shape) for _ in range(3))
    short = tau <= MEET_AT
    for where, series in ((short, _image_slopes), (~short, _wave_slopes)):
        value[where], by_time[where], by_start[where] = series(tau[where], near[where])
    return LogDensity(value=value, by_time=by_time, by_start=by_start)


def _image_slopes(tau: FloatArray, near: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of sum b exp(-b^2 / (2 tau)) / sqrt(2 pi tau^3), b = w + 2 k."""
    weights, total, squares, cubes = (np.zeros_like(tau) for _ in range(4))
    for k in IMAGES:
        b = near + 2.0 * k
        weight = np.exp(-2.0 * k * (k + near) / tau)
        weights += weight
        total += b * weight
        squares += b * b * weight
        cubes += b * b * b * weight
    value = np.log(total) - near**2 / (2.0 * tau) - (_LOG_2PI + 3.0 * np.log(tau)) / 2.0
    return value, cubes / total / (2.0 * tau**2) - 1.5 / tau, (weights - squares / tau) / total


def _wave_slopes(tau: FloatArray, near: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of pi sum k sin(k pi w) exp(-k^2 pi^2 tau / 2)."""
    total, cubes, cosines = (np.zeros_like(tau) for _ in range(3))
    for k in range(1, WAVES + 1):
        weight = np.exp(-(k * k - 1) * math.pi**2 * tau / 2.0)
        sine = k * np.sin(k * math.pi * near) * weight
        total += sine
        cubes += k * k * sine
        cosines += k * k * np.cos(k * math.pi * near) * weight
    value = math.log(math.pi) + np.log(total) - math.pi**2 * tau / 2.0
    return value, -(math.pi**2) / 2.0 * cubes / total, math.pi * cosines / total


_TERMS = 20
_EVEN = 2 * np.arange(1, _TERMS + 1)


@cache
def _coth() -> FloatArray:
    """Of x coth x = cosh x / (sinh x / x) = 1 + sum of these times x^2, x^4, ...; for |x| < 1, where 20 leave 1e-19."""
    series = [Fraction(1)]
    for n in range(1, _TERMS + 1):
        earlier = sum(c / math.factorial(2 * (n - j) + 1) for j, c in enumerate(series))
        series.append(Fraction(1, math.factorial(2 * n)) - earlier)
    return np.array(series[1:], dtype=np.float64)


@cache
def _h_series() -> FloatArray:
    """Of x coth x + x^2 / sinh^2 x = 2 C - x C', C = x coth x."""
    return ((2.0 - _EVEN) * _coth())[1:]


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
    """The moments of the decision time (without t0); the arguments broadcast. `ValueError`: as `check_bounds`.

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
        upper=float_or_array(p),
        mean_s=float_or_array(mean),
        variance_s2=float_or_array(within + p * (1.0 - p) * (up[0] - down[0]) ** 2),
        upper_mean_s=float_or_array(up[0]),
        upper_variance_s2=float_or_array(up[1]),
        lower_mean_s=float_or_array(down[0]),
        lower_variance_s2=float_or_array(down[1]),
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
    return np.where(small, _series(_coth(), x, small), (far / np.tanh(far) - 1.0) / far**2)


def variance_form(x: FloatArray) -> FloatArray:
    """h(x) = (x coth x + x^2 / sinh^2 x - 2) / x^4."""
    small = np.abs(x) < 1.0
    far = np.where(small, 1.0, np.abs(x))
    fall = np.exp(-2.0 * far)
    squared = 4.0 * far**2 * fall / np.expm1(-2.0 * far) ** 2
    return np.where(small, _series(_h_series(), x, small), (far / np.tanh(far) + squared - 2.0) / far**4)


def _series(coefficients: FloatArray, x: FloatArray, small: NDArray[np.bool_]) -> FloatArray:
    return np.asarray(np.polynomial.polynomial.polyval(np.where(small, x, 0.0) ** 2, coefficients))


def distribution(
    time_s: ArrayLike, upper: ArrayLike, drift: ArrayLike, boundary: ArrayLike, start: ArrayLike
) -> Values:
    """P(T <= t, answer), rising from 0 to the answer's probability; divide by that for the time given the answer.

    NaN at t = NaN. The decision time is without t0; all arguments broadcast. `ValueError`: as `check_bounds`.

    >>> round(distribution(100.0, True, 1.0, 2.0, 0.5), 6)
    0.880797
    """
    t, v, a, w = (np.asarray(values, dtype=np.float64) for values in (time_s, drift, boundary, start))
    t, up, v, a, w = np.broadcast_arrays(t, np.asarray(upper, dtype=np.bool_), v, a, w)
    check_bounds(a, w)
    c, near = np.where(up, -v, v) * a, np.where(up, 1.0 - w, w)
    tau = np.where(t > 0.0, t, 1.0) / a**2
    value = np.empty(tau.shape)
    short = tau <= MEET_AT
    value[short] = _images(tau[short], c[short], near[short])
    value[~short] = _waves(tau[~short], c[~short], near[~short])
    return float_or_array(np.select([t > 0.0, np.isnan(t)], [value, math.nan], default=0.0))


def _images(tau: FloatArray, c: FloatArray, near: FloatArray) -> FloatArray:
    """Sum sign(b) exp(-c w) [e^(-|c| b) Phi((|c| tau - b)/sqrt(tau)) + e^(|c| b) Phi(-(|c| tau + b)/sqrt(tau))]."""
    total, root, drift = np.zeros_like(tau), np.sqrt(tau), np.abs(c)
    for k in IMAGES:
        b = np.abs(near + 2.0 * k)
        first = scipy.special.log_ndtr((drift * tau - b) / root) - drift * b
        second = scipy.special.log_ndtr(-(drift * tau + b) / root) + drift * b
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
