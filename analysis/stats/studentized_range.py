"""The studentized range, of which Tukey's tests are made: its tail, the tail's logarithm, and its critical values.

The tail has full accuracy however small it is: 1e-12 relative for k = 2..20, df >= 2, p down to 1e-300, and its
logarithm beyond (scipy's is 1 - cdf, with no digit left below 1e-12). k need not be a whole number.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from analysis.stats.arrays import FloatArray, Values, doubles, float_or_array, together
from analysis.stats.studentized_tail import log_tails

LOWEST_X = -45.0
"""exp(-45) is a range that is smaller with a probability below 1e-19, for every k and df."""
MOST_MEANS, NORMAL_FROM = 1e100, 1e100
"""Larger k and df would be squared beyond all doubles; from there the error is a normal one in all digits."""
STEPS = 120
"""Halving alone would end in so many steps; six to fifteen are usual."""


def studentized_range_sf(q: ArrayLike, k: ArrayLike, df: ArrayLike) -> Values:
    """P(Q > q) for k means (k >= 2) and df > 0 error degrees of freedom, df = inf included; the arguments broadcast.

    E R(q sqrt(chi2_df / df)), R(w) = k ∫ φ(z) [Φ(z)^(k-1) - (Φ(z) - Φ(z-w))^(k-1)] dz.
    1 for q <= 0, 0 for q = inf, NaN for q = NaN. `ValueError` for k or df out of range.
    Source: Lund & Lund 1983, AS 190, for the distribution; `analysis.stats.studentized_tail` for the way.

    >>> round(studentized_range_sf(3.514, 3, 26), 3)
    0.05
    """
    return float_or_array(np.exp(_logsf(*_checked(q=q, k=k, df=df))))


def studentized_range_logsf(q: ArrayLike, k: ArrayLike, df: ArrayLike) -> Values:
    """Natural logarithm of P(Q > q), also where that is no double any more; -inf for q = inf.

    >>> round(studentized_range_logsf(1e9, 3, 26), 3)
    -488.21
    """
    return float_or_array(_logsf(*_checked(q=q, k=k, df=df)))


def studentized_range_isf(p: ArrayLike, k: ArrayLike, df: ArrayLike) -> Values:
    """The q with P(Q > q) = p, the critical value of Tukey's test at level p; the arguments broadcast.

    inf for p = 0, 0 for p = 1. `ValueError` for p outside 0..1, or k or df out of range.

    >>> round(studentized_range_isf(0.05, 3, 26), 3)
    3.514
    """
    p, k, df = _checked(p=p, k=k, df=df)
    if ((p < 0.0) | (p > 1.0)).any():
        raise ValueError(f"p must lie in 0..1, not {p[(p < 0.0) | (p > 1.0)][0]}")
    q = np.select([p == 0.0, p == 1.0], [np.inf, 0.0], default=np.nan)
    inside = (p > 0.0) & (p < 1.0)
    q[inside] = _quantile(p[inside], k[inside], df[inside])
    return float_or_array(q)


def _checked(**named: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The three arguments broadcast; the first, q or p, may be NaN or infinite, and so may df."""
    arrays = {name: doubles(value, name) for name, value in named.items()}
    means, freedom = arrays["k"], arrays["df"]
    if not ((means >= 2.0) & (means <= MOST_MEANS)).all():
        wrong = means[~((means >= 2.0) & (means <= MOST_MEANS))][0]
        raise ValueError(f"k, the number of means, must be at least 2 and at most {MOST_MEANS:g}, not {wrong}")
    if not (freedom > 0.0).all():
        raise ValueError(f"df must be above 0, not {freedom[~(freedom > 0.0)][0]}")
    first, means, freedom = together(**arrays)
    return first, means, np.where(freedom > NORMAL_FROM, np.inf, freedom)


def _logsf(q: FloatArray, k: FloatArray, df: FloatArray) -> FloatArray:
    result = np.select([q <= 0.0, q == np.inf], [0.0, -np.inf], default=np.nan)
    inside = (q > 0.0) & (q < np.inf)
    result[inside] = log_tails(q[inside], k[inside], df[inside])[0]
    return result


def _quantile(p: FloatArray, k: FloatArray, df: FloatArray) -> FloatArray:
    """The q (n,) of p (n,): the root of log odds, over x with (1 + q²/2df)^(-df/2) = exp(-v²) and v(x) below.

    By v the tail is all but a normal one, whatever df. It is at most k(k-1)/2 exp(-v²) (a bound over all pairs), which
    ends the search on the right. Below df = 1 the q of a tiny p may be no double: inf.
    """
    wanted = np.log(p) - np.log1p(-p)

    def surplus(x: FloatArray) -> FloatArray:
        upper, lower = log_tails(np.minimum(_q_of(x, df), np.finfo(np.float64).max), k, df)
        difference: FloatArray = upper - lower - wanted
        return difference

    highest = np.sqrt(np.log(k * (k - 1.0) / 2.0) - np.log(p))
    return _q_of(_root(surplus, np.full(p.shape, LOWEST_X), highest), df)


def _q_of(x: FloatArray, df: FloatArray) -> FloatArray:
    """The q at x, with v = exp(x) for x < 0, 1 + x above: small q by their logarithm, large ones to the last digit.

    q = sqrt(2 df (exp(2v²/df) - 1)); beyond exp(2v²/df) = e^40 the 1 is no digit any more, and q² may be no double.
    """
    v: FloatArray = np.where(x < 0.0, np.exp(np.minimum(x, 0.0)), 1.0 + x)
    with np.errstate(over="ignore", invalid="ignore"):
        power = 2.0 * np.square(v) / df
        near, far = np.sqrt(2.0 * df * np.expm1(np.minimum(power, 40.0))), np.sqrt(2.0 * df) * np.exp(power / 2.0)
    return np.select([np.isinf(df), power < 40.0], [2.0 * v, near], default=far)


def _root(function: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray) -> FloatArray:
    """The zeros (n,) of a falling function between `low` and `high`, to the last digit; `high` where it stays above 0.

    Inverse quadratic interpolation where three points allow it, else halving. Source: Chandrupatla 1997, Advances in
    Engineering Software 28, 145.
    """
    a, b, share = high, low, np.full(low.shape, 0.5)
    f_a, f_b = function(a), function(b)
    outside = f_a > 0.0
    for _ in range(STEPS):
        new = a + share * (b - a)
        f_new = function(new)
        same = np.sign(f_new) == np.sign(f_a)
        c, f_c = np.where(same, a, b), np.where(same, f_a, f_b)
        b, f_b = np.where(same, b, a), np.where(same, f_b, f_a)
        a, f_a = new, f_new
        best = np.where(np.abs(f_a) < np.abs(f_b), a, b)
        least = 2.0 * np.spacing(np.abs(best)) / np.maximum(np.abs(b - a), np.finfo(np.float64).tiny)
        done = (least > 0.5) | (f_a == 0.0)
        if done.all():
            break
        share = np.where(done, 0.0, np.clip(_interpolated((a, b, c), (f_a, f_b, f_c)), least, 1.0 - least))
    return np.where(outside, high, best)


Three = tuple[FloatArray, FloatArray, FloatArray]


def _interpolated(places: Three, heights: Three) -> FloatArray:
    """Where from the first place (0) to the second (1) to look: by the inverse parabola if it is monotone, else 0.5."""
    (a, b, c), (f_a, f_b, f_c) = places, heights
    with np.errstate(divide="ignore", invalid="ignore"):
        place, height = (a - b) / (c - b), (f_a - f_b) / (f_c - f_b)
        trusted = (np.square(height) < place) & (np.square(1.0 - height) < 1.0 - place)
        first = f_a / (f_b - f_a) * f_c / (f_b - f_c)
        second = (c - a) / (b - a) * f_a / (f_c - f_a) * f_b / (f_c - f_b)
    return np.where(trusted, first + second, 0.5)
