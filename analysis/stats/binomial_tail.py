"""Probabilities and tails of the binomial distribution, in logarithms; arrays of one axis, in long doubles.

A probability of 1e-300 is the exponential of -690: 13 digits of it take 16 digits of the exponent, which doubles do not
have and the 64 bits of an x86 long double do. Where long doubles are doubles, three digits fewer hold. A chance p comes
with its q = 1 - p, so that neither end of 0..1 loses digits; the lower tail is the upper one of the failures.

    P(X >= k) / P(X = k) = k ∫ (1 - y)^(k-1) (1 + y p/q)^(n-k) dy  over y from 0 to 1,

the incomplete beta integral with t = p (1 - y). Its integrand is 1 at 0, falls, and its logarithm is concave; all parts
of that are of one sign as they are written here, so few nodes of Gauss give every digit, whatever n is.
"""

from __future__ import annotations

from math import factorial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.stats.arrays import FloatArray

LongArray = NDArray[np.longdouble]
RealArray = NDArray[np.floating[Any]]

_PI = np.longdouble("3.14159265358979323846264338327950288")
_SMALL = 16
_STIRLING = [(1, 12), (-1, 360), (1, 1260), (-1, 1680), (1, 1188), (-691, 360360), (1, 156), (-3617, 122400)]
"""Coefficients of 1/x, 1/x^3, ... in log x! - [log(2 pi x) / 2 + x log x - x]; enough from x = 16 on."""


def _small_stirling_errors() -> LongArray:
    x = np.arange(1, _SMALL, dtype=np.longdouble)
    factorials = np.array([np.longdouble(factorial(i)) for i in range(1, _SMALL)])
    errors = np.log(factorials) - (np.log(2 * _PI * x) / 2 + x * np.log(x) - x)
    return np.concatenate([[np.longdouble(0)], errors])


_SMALL_ERRORS = _small_stirling_errors()


def log_pmf(k: LongArray, n: LongArray, p: LongArray, q: LongArray) -> LongArray:
    """Log of P(X = k) for X from n trials with 0 < p < 1 and 0 <= k <= n, by the saddle point.

    log P = log[n / (2 pi k (n - k))] / 2 + e(n) - e(k) - e(n - k) - D(k, n p) - D(n - k, n q), with Stirling's error e
    and the deviance D(x, m) = x log(x / m) + m - x. No large terms cancel, unlike in log gammas.
    Source: Loader 2000, Fast and accurate computation of binomial probabilities.
    """
    size = np.maximum(n, 2)
    x = np.clip(k, 1, size - 1)
    y = size - x
    both, means = np.array([x, y]), np.array([size * p, size * q])
    stirling = _stirling_error(np.array([size, x, y]))
    deviance = _deviance(both, means)
    inside: LongArray = (
        np.log(size / (2 * _PI * x * y)) / 2 + stirling[0] - stirling[1] - stirling[2] - deviance[0] - deviance[1]
    )
    if ((k > 0) & (k < n)).all():
        return inside
    return np.select([k == 0, k == n], [n * _log_of(q, p), n * _log_of(p, q)], default=inside)


def _log_of(p: LongArray, q: LongArray) -> LongArray:
    """Log p, by way of q = 1 - p where that is the smaller one."""
    return np.where(q < p, np.log1p(-np.minimum(q, 0.5)), np.log(p))


def _stirling_error(x: LongArray) -> LongArray:
    large = np.maximum(x, _SMALL)
    square, series = large * large, np.zeros_like(large)
    for numerator, denominator in reversed(_STIRLING):
        series = series / square + np.longdouble(numerator) / denominator
    table: LongArray = _SMALL_ERRORS[np.minimum(x, _SMALL - 1).astype(np.intp)]
    return np.where(x < _SMALL, table, series / large)


_NEAR = 0.2
_SERIES = [1 / np.longdouble(power) for power in range(25, 1, -2)]
_SHORT_SERIES = [float(coefficient) for coefficient in _SERIES[4:]]
"""Coefficients of v^2, the last first; the short one is enough for doubles."""


def _deviance(x: LongArray, m: LongArray) -> LongArray:
    """D(x, m) for x >= 1 and m > 0."""
    rise = (m - x) / x
    near = np.abs(rise) < _NEAR
    close = -x * _log1p_less_near(np.where(near, rise, 0))
    return close if near.all() else np.where(near, close, x * np.log(x / m) + m - x)


def _log1p_less(x: FloatArray) -> FloatArray:
    """Log(1 + x) - x, for x > -1."""
    near = np.abs(x) < _NEAR
    return np.where(near, _log1p_less_near(np.where(near, x, 0.0)), np.log1p(x) - x)


def _log1p_less_near(x: RealArray) -> RealArray:
    """Log(1 + x) - x as -x v + 2 v (v^2 / 3 + v^4 / 5 + ...), v = x / (2 + x), where no digit cancels."""
    v = x / (2 + x)
    square = v * v
    series = np.zeros_like(v)
    for coefficient in _SHORT_SERIES if v.dtype == np.float64 else _SERIES:
        series += coefficient
        series *= square
    return v * (2 * series - x)


_DEPTH = 42.0
"""The integrals end where the integrand is exp(-DEPTH) = 6e-19 of its largest value."""
_POINTS = 32
"""Enough for sixteen digits everywhere (measured, to n = 1e10)."""


def _gauss_legendre(points: int) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights over 0..1; numpy's, whose weights have errors of 1e-13, polished by Newton's method."""
    x: LongArray = np.polynomial.legendre.leggauss(points)[0].astype(np.longdouble)
    for _ in range(2):
        before: LongArray = np.ones(points, dtype=np.longdouble)
        now = x
        for i in range(2, points + 1):
            before, now = now, ((2 * i - 1) * x * now - (i - 1) * before) / np.longdouble(i)
        slope = points * (x * now - before) / (x * x - 1)
        x = x - now / slope
    return ((x + 1) / 2).astype(np.float64), (1 / ((1 - x * x) * slope**2)).astype(np.float64)


_NODES, _WEIGHTS = _gauss_legendre(_POINTS)


def tail_over_pmf(k: LongArray, n: LongArray, p: LongArray, q: LongArray) -> FloatArray:
    """P(X >= k) / P(X = k) for 1 <= k <= n not below the mode."""
    odds = p / q
    fall = (k - 1 - (n - k) * odds).astype(np.float64)[:, None]
    a, rest, odds = (part.astype(np.float64)[:, None] for part in (k - 1, n - k, np.minimum(odds, n)))

    end = _end(fall, a, rest, odds)
    y = end * _NODES
    below, above = _log1p_less(np.array([-y, odds * y]))
    exponent = a * below + rest * above - fall * y
    return np.asarray(k.astype(np.float64) * end[:, 0] * (np.exp(exponent) * _WEIGHTS).sum(axis=1))


def _end(fall: FloatArray, a: FloatArray, rest: FloatArray, odds: FloatArray) -> FloatArray:
    """The y, at most 1, at which the integrand is exp(-DEPTH), or a little more.

    From where its parabola at 0 is as deep, by Newton's steps, which end beyond the depth of a concave function.
    """
    bend = a + rest * odds**2
    end = np.minimum(2.0 * _DEPTH / np.maximum(fall + np.sqrt(fall**2 + 2.0 * _DEPTH * bend), 1.0), 0.5)
    for most in (0.999, 1.0):
        slope = fall + a * end / (1.0 - end) + rest * odds**2 * end / (1.0 + odds * end)
        depth = fall * end - a * (np.log1p(-end) + end) - rest * (np.log1p(odds * end) - odds * end)
        end = np.minimum(end + (_DEPTH - depth) / np.maximum(slope, 1.0), most)  # below 1: all of the range is taken
    return end


_NEGLIGIBLE = 1e-21
_FIRST_TERMS, _MOST_TERMS = 32, 4096


def log_between(low: LongArray, high: LongArray, n: LongArray, p: LongArray, q: LongArray) -> LongArray:
    """Log of P(low < X < high), -inf if nothing lies between; added up, so for up to some 1e5 values in between."""
    start = np.clip(low + 1, 0, n)
    total, term, place, left = np.ones_like(start), np.ones_like(start), start.copy(), high - start - 1
    active, terms = np.flatnonzero(left > 0), _FIRST_TERMS
    while active.size:
        i = place[active, None] + np.arange(terms)
        ratios = np.maximum(n[active, None] - i, 0) / (i + 1) * (p / q)[active, None]
        ratios[np.arange(terms) >= left[active, None]] = 0
        new = np.cumprod(ratios, axis=1) * term[active, None]
        total[active] += new.sum(axis=1)
        term[active] = new[:, -1]
        place[active] += terms
        left[active] -= terms
        active = active[term[active] > _NEGLIGIBLE * total[active]]
        terms = min(2 * terms, _MOST_TERMS)
    return np.where(high - low <= 1, -np.inf, log_pmf(start, n, p, q) + np.log(total))
