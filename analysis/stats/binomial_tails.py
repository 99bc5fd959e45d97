"""Probabilities and tails of the binomial distribution, in numpy's long double and in logarithms.

A probability of 1e-300 is the exponential of -690: 13 digits of it take 16 digits of the exponent, which doubles do not
have and the 64 bits of an x86 long double do. Where long doubles are doubles, three digits fewer hold.
"""

from __future__ import annotations

from math import factorial

import numpy as np
from numpy.typing import NDArray

LongArray = NDArray[np.longdouble]

_PI = np.longdouble("3.14159265358979323846264338327950288")
_SMALL = 16
_STIRLING = [(1, 12), (-1, 360), (1, 1260), (-1, 1680), (1, 1188), (-691, 360360), (1, 156), (-3617, 122400)]
"""Coefficients of 1/x, 1/x^3, ... in log x! - [log(2 pi x) / 2 + x log x - x]; enough from x = 16 on."""

_NEGLIGIBLE = 1e-21
_FIRST_TERMS, _MOST_TERMS = 32, 4096


def _small_stirling_errors() -> LongArray:
    x = np.arange(1, _SMALL, dtype=np.longdouble)
    factorials = np.array([np.longdouble(factorial(i)) for i in range(1, _SMALL)])
    errors = np.log(factorials) - (np.log(2 * _PI * x) / 2 + x * np.log(x) - x)
    return np.concatenate([[np.longdouble(0)], errors])


_SMALL_ERRORS = _small_stirling_errors()


def log_pmf(k: LongArray, n: LongArray, chance: LongArray) -> LongArray:
    """Log of P(X = k) for X from n trials with 0 < chance < 1 and 0 <= k <= n, by the saddle point.

    log P = log[n / (2 pi k (n - k))] / 2 + e(n) - e(k) - e(n - k) - D(k, n chance) - D(n - k, n (1 - chance)), with
    Stirling's error e and the deviance D(x, m) = x log(x / m) + m - x. No large terms cancel, unlike in log gammas.
    Source: Loader 2000, Fast and accurate computation of binomial probabilities.
    """
    size = np.maximum(n, 2)
    x = np.clip(k, 1, size - 1)
    y = size - x
    deviance = _deviance(x, size * chance) + _deviance(y, size * (1 - chance))
    stirling = _stirling_error(size) - _stirling_error(x) - _stirling_error(y)
    inside = np.log(size / (2 * _PI * x * y)) / 2 + stirling - deviance
    return np.select([k == 0, k == n], [n * np.log1p(-chance), n * np.log(chance)], default=inside)


def log_tail(border: LongArray, step: int, n: LongArray, chance: LongArray) -> LongArray:
    """Log of P(X >= border) for step 1, of P(X <= border) for step -1; `border` must lie on that side of the mode."""
    return log_pmf(border, n, chance) + np.log(_relative_sum(border, step, np.full_like(n, np.inf), n, chance))


def log_between(low: LongArray, high: LongArray, n: LongArray, chance: LongArray) -> LongArray:
    """Log of P(low < X < high), -inf if nothing lies between; for up to some 1e5 values in between."""
    count = high - low - 1
    start = np.clip(low + 1, 0, n)
    total = log_pmf(start, n, chance) + np.log(_relative_sum(start, 1, np.maximum(count, 1), n, chance))
    return np.where(count < 1, -np.inf, total)


def _stirling_error(x: LongArray) -> LongArray:
    large = np.maximum(x, _SMALL)
    series = np.zeros_like(large)
    for numerator, denominator in reversed(_STIRLING):
        series = series / (large * large) + np.longdouble(numerator) / denominator
    table: LongArray = _SMALL_ERRORS[np.minimum(x, _SMALL - 1).astype(np.intp)]
    return np.where(x < _SMALL, table, series / large)


def _deviance(x: LongArray, m: LongArray) -> LongArray:
    """D(x, m) for x >= 1; near m as (x - m) v + 2 x (v^3 / 3 + v^5 / 5 + ...) with v = (x - m) / (x + m)."""
    v = (x - m) / (x + m)
    near = np.abs(v) < 0.1
    square = np.where(near, v * v, 0)
    series = np.zeros_like(v)
    for power in range(25, 1, -2):
        series = square * series + np.longdouble(1) / power
    close = (x - m) * v + 2 * x * v * square * series
    return np.where(near, close, x * np.log(x / m) + m - x)


def _relative_sum(start: LongArray, step: int, count: LongArray, n: LongArray, chance: LongArray) -> LongArray:
    """Sum of P(start + j step) / P(start) over j from 0 to count - 1, until no term adds a digit; one axis."""
    total, term, place, left = np.ones_like(start), np.ones_like(start), start.copy(), count - 1
    odds = chance / (1 - chance)
    active, terms = np.flatnonzero(left > 0), _FIRST_TERMS
    while active.size:
        ratios = _ratios(place[active], step, terms, n[active], odds[active])
        ratios[np.arange(terms) >= left[active, None]] = 0
        new = np.cumprod(ratios, axis=1) * term[active, None]
        total[active] += new.sum(axis=1)
        term[active] = new[:, -1]
        place[active] += step * terms
        left[active] -= terms
        active = active[term[active] > _NEGLIGIBLE * total[active]]
        terms = min(2 * terms, _MOST_TERMS)
    return total


def _ratios(place: LongArray, step: int, terms: int, n: LongArray, odds: LongArray) -> LongArray:
    """P(i + step) / P(i) for the next `terms` values i from `place` on; 0 beyond the ends."""
    i = np.clip(place[:, None] + step * np.arange(terms), 0, n[:, None])
    rest = n[:, None] - i
    ratios: LongArray = rest / (i + 1) * odds[:, None] if step > 0 else i / ((rest + 1) * odds[:, None])
    return ratios
