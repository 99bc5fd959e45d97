"""First-passage density of the simple diffusion, its logarithm and its derivatives.

    dX = v dt + dW,  X(0) = w a,  absorbed at 0 ("lower") and a ("upper");  s = 1, v in 1/sqrt(s), a in sqrt(s)
    p(t, lower) = a^-2 exp(-v a w - v^2 t / 2) f(t / a^2, w),   p(t, upper | v, w) = p(t, lower | -v, 1 - w)

f is the density without drift from w in (0, 1), by one of two series (Navarro & Fuss 2009, J. Math. Psychol. 53, 222;
Feller 1968): images for short times, waves for long ones. Where they take the number of terms that keeps the absolute
error below a bound, here it is fixed: their meeting point `CUT` is such that `IMAGES` and `WAVES` terms leave a
*relative* error below 1e-18 for w from 1e-6 to 1 - 1e-6, so rounding rules, in the tails as well. Each series is
divided by its leading exponential, so the logarithm never meets an underflow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.stats.arrays import FloatArray, Values, plain

CUT = 0.3
"""Scaled time t / a^2 where the series meet: at most 7 exp(-60) and 36 exp(-51) of the sums are left out there."""
IMAGES = 3
"""Pairs of images, (m - 1 + w) and -(m + 1 - w) for m = 1, 3, 5."""
WAVES = 5

_LOG_2PI = math.log(2.0 * math.pi)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogDensity:
    """Logarithm of f(tau, w) and its partial derivatives."""

    value: FloatArray
    by_time: FloatArray
    by_start: FloatArray


def log_density(time_s: ArrayLike, upper: ArrayLike, drift: ArrayLike, boundary: ArrayLike, start: ArrayLike) -> Values:
    """Log p(t, answer) of the decision time (without t0) and the answer; -inf at t <= 0. All arguments broadcast.

    `ValueError`: a boundary not above 0 or a start not strictly between 0 and 1.

    >>> round(float(log_density(0.5, True, 1.0, 1.0, 0.5)), 6)
    -1.072671
    """
    t, v, a, w = np.broadcast_arrays(
        *(np.asarray(values, dtype=np.float64) for values in (time_s, drift, boundary, start))
    )
    t, up, v, a, w = np.broadcast_arrays(t, np.asarray(upper, dtype=np.bool_), v, a, w)
    check_bounds(a, w)
    v, near, far = np.where(up, -v, v), np.where(up, 1.0 - w, w), np.where(up, w, 1.0 - w)
    some = t > 0.0
    tau = np.where(some, t, 1.0) / a**2
    value = unit_log_density(tau, near, far) - 2.0 * np.log(a) - v * a * near - v * v * t / 2.0
    return plain(np.where(some, value, -math.inf))


def check_bounds(boundary: FloatArray, start: FloatArray) -> None:
    """`ValueError` unless every boundary is above 0 and every start strictly between 0 and 1."""
    if not (boundary > 0.0).all():
        raise ValueError(f"boundary must be above 0, not {boundary[~(boundary > 0.0)].ravel()[0]}")
    if not ((start > 0.0) & (start < 1.0)).all():
        raise ValueError(
            f"start must lie strictly between 0 and 1, not {start[~((start > 0) & (start < 1))].ravel()[0]}"
        )


def unit_log_density(tau: FloatArray, near: FloatArray, far: FloatArray) -> FloatArray:
    """Log f(tau, near), with far = 1 - near given apart so that neither end loses digits."""
    value = np.empty(np.shape(tau))
    short = tau <= CUT
    value[short] = _log_images(tau[short], near[short], far[short])
    value[~short] = _log_waves(tau[~short], near[~short], far[~short])
    return value


def _log_images(tau: FloatArray, near: FloatArray, far: FloatArray) -> FloatArray:
    """The images paired round each odd m at distance `far`: (m - far) e^.. - (m + far) e^.., without cancellation."""
    total = np.zeros_like(tau)
    for m in range(1, 2 * IMAGES, 2):
        ahead = m - 1.0 + near
        fall = -2.0 * m * far / tau
        pair = -ahead * np.expm1(fall) - 2.0 * far * np.exp(fall)
        total += np.exp(-(m - 1.0) * (m - 1.0 + 2.0 * near) / (2.0 * tau)) * pair
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.log(total) - near**2 / (2.0 * tau) - (_LOG_2PI + 3.0 * np.log(tau)) / 2.0)


def _log_waves(tau: FloatArray, near: FloatArray, far: FloatArray) -> FloatArray:
    """Pi sum k sin(k pi w) exp(-k^2 pi^2 tau / 2), the sines from the nearer end."""
    angle = math.pi * np.minimum(near, far)
    mirrored = far < near
    total = np.zeros_like(tau)
    for k in range(1, WAVES + 1):
        sine = np.where(mirrored & (k % 2 == 0), -1.0, 1.0) * np.sin(k * angle)
        total += k * sine * np.exp(-(k * k - 1) * math.pi**2 * tau / 2.0)
    return np.asarray(math.log(math.pi) + np.log(total) - math.pi**2 * tau / 2.0)


def with_slopes(tau: NDArray[np.float64], near: FloatArray) -> LogDensity:
    """Log f with its derivatives by tau and w, of arrays of one axis; for likelihoods."""
    value, by_time, by_start = (np.empty(tau.shape) for _ in range(3))
    short = tau <= CUT
    for where, series in ((short, _image_slopes), (~short, _wave_slopes)):
        value[where], by_time[where], by_start[where] = series(tau[where], near[where])
    return LogDensity(value=value, by_time=by_time, by_start=by_start)


def _image_slopes(tau: FloatArray, near: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of sum b exp(-b^2 / (2 tau)) / sqrt(2 pi tau^3), b = w + 2 k."""
    weights, total, squares, cubes = (np.zeros_like(tau) for _ in range(4))
    for k in (0, -1, 1, -2, 2, -3):
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
