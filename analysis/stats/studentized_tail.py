"""Both tails of the studentized range in log space, without a difference of nearly equal numbers anywhere.

With R(w) and C(w) the tail and the distribution function of the range of k standard normals, and S² = chi2_df / df,

    P(Q > q) = E R(qS),    P(Q <= q) = E C(qS).

R falls like exp(-w²/4), and that factor only rescales the density of S. With c(w) = exp(w²/4) R(w), which is smooth and
lies between 0 and k(k-1)/2, the far tail is therefore exact before any integration:

    P(Q > q) = (1 + q²/2df)^(-df/2) E c(uS),    u = q / sqrt(1 + q²/2df).

All integrals are trapezoidal sums of analytic functions that vanish at both ends, so their error falls geometrically
with the number of nodes (Trefethen & Weideman 2014, SIAM Review 56, 385). c and C are summed once per k and kept as
piecewise polynomials; the expectations too, once so many values are asked of one (k, df) that this pays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy

from analysis.stats.arrays import FloatArray

DEPTH = 40.0
"""Sums end where a term is exp(-DEPTH) = 4e-18 of the largest: below a double's rounding."""
GRID_STEP = 0.6
"""Step times sqrt(k) of the sums over z: φ^k has the standard deviation 1/√k, the error exp(-2π² / STEP²)."""
LOWEST_Z = -7.0
"""The largest of two normals lies below with probability 1e-24, that of more even more rarely."""
FINEST_K = 1e4
"""Grids get finer with k up to here. With more means they are too coarse only where 1 - p is no double any more."""
GAUSS_LEGENDRE = np.polynomial.legendre.leggauss(10)
"""Points and weights for the mass of a normal in an interval up to one standard deviation wide: to 1e-16, 6 to 1e-12.

scipy's would load all of scipy.linalg, 90 ms.
"""

S_NODES, S_NODES_K = 56, 20.0
"""Nodes over the scale S, for k up to S_NODES_K, as sqrt(k) above: 48 lose five digits of log p next to 1 at k = 20,
df = 0.5, 56 none (measured for df >= 0.5; with smaller df 1 - p loses digits, p does not).
"""
NEAR_ONE = float(np.log1p(-1.0 / 32.0))
"""Above this log p, 1 - p is taken from the lower side; below it 1 - p has lost at most five bits."""
ROWS = 512
"""Values taken at once, so that ROWS x S_NODES numbers stay in the processor's cache."""

SMALLEST_Q = 1e-300
"""Below it erf(q) is no normal double; P(Q <= q) is smaller still."""
TINY = 1e-100
"""Below, q²/2df counts as 0 against 1, and must not be divided by: its square root is still a double, it is not."""
MIDDLE_W = 8.0
"""Half of the panels lie below this range, where c and C change; beyond they are all but straight."""
PANELS, DEGREE = 32, 13
"""Of the piecewise polynomials: 20 panels or degree 11 cost half a digit, 16 or 10 two (measured)."""
LARGEST_W = 40.0
"""C(w) is 1 in doubles from w = 12 on; z - w would lose the digits of z where w is huge."""
TABLE_PAYS = 1000
"""From so many values at one (k, df) a table is quicker than sums: it takes 2 x 448 sums to make one."""
TABLE_MIN_DF = 1.0
"""Below, the expectations change within less than a panel."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Panels:
    """A function of w >= 0 as polynomials on equal panels of y = w / (w + MIDDLE_W), from 0 to `end`.

    `coefficients`: (DEGREE + 1, PANELS), of the powers of a panel's own -1..1.
    """

    coefficients: FloatArray
    end: float

    def __call__(self, w: FloatArray) -> FloatArray:
        """The function at `w`, of any shape."""
        place = w / (w + MIDDLE_W) * (PANELS / self.end)
        panel = np.minimum(place.astype(np.intp), PANELS - 1)
        t = 2.0 * (place - panel) - 1.0
        value: FloatArray = self.coefficients[DEGREE].take(panel)
        for row in self.coefficients[DEGREE - 1 :: -1]:
            value *= t
            value += row.take(panel)
        return value


def fitted(function: Callable[[FloatArray], FloatArray], end_w: float) -> Panels:
    """`function` of w (n,) between 0 and `end_w`, met at the Chebyshev points of each panel."""
    end = 1.0 / (1.0 + MIDDLE_W / end_w)
    t = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    y = (np.arange(PANELS)[:, None] + (t + 1.0) / 2.0) * (end / PANELS)
    values = function((MIDDLE_W * y / (1.0 - y)).ravel()).reshape(y.shape)
    return Panels(coefficients=np.linalg.solve(np.vander(t, increasing=True), values.T), end=end)


def log_tails(q: FloatArray, k: FloatArray, df: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The logarithms of P(Q > q) and P(Q <= q), to full accuracy; finite q > 0, k >= 2, df > 0; all (n,)."""
    upper = _by_k(_upper, q, k, df)
    lower = np.log1p(-np.exp(np.minimum(upper, NEAR_ONE)))
    sure = upper > NEAR_ONE
    if sure.any():
        lower[sure] = _by_k(_lower, q[sure], k[sure], df[sure])
        upper[sure] = np.log1p(-np.exp(lower[sure]))
    return upper, lower


Side = Callable[[FloatArray, float, FloatArray, bool], FloatArray]
"""A logarithm at q (n,), k, df (n,) or (1,), the latter for one df that all share; by that df's table or without."""


def _by_k(side: Side, q: FloatArray, k: FloatArray, df: FloatArray) -> FloatArray:
    result = np.empty(q.shape)
    for means in np.unique(k):
        at = np.flatnonzero(k == means)
        result[at] = _by_df(side, q[at], float(means), df[at])
    return result


def _by_df(side: Side, q: FloatArray, k: float, df: FloatArray) -> FloatArray:
    """A df that many values share goes alone, with its table; the others go together, a few rows at a time."""
    result = np.empty(q.shape)
    values, which, counts = np.unique(df, return_inverse=True, return_counts=True)
    alone = (counts >= TABLE_PAYS) & (values >= TABLE_MIN_DF) | np.isinf(values)
    for i in np.flatnonzero(alone):
        at = np.flatnonzero(which == i)
        result[at] = side(q[at], k, values[i : i + 1], True)
    rest = np.flatnonzero(~alone[which])
    for start in range(0, rest.size, ROWS):
        at = rest[start : start + ROWS]
        result[at] = side(q[at], k, values if values.size == 1 else df[at], False)
    return result


def _upper(q: FloatArray, k: float, df: FloatArray, tabled: bool) -> FloatArray:
    """The logarithm of P(Q > q)."""
    u, exponent = _tilted(q, df)
    mean = upper_table(k, float(df[0]))(u) if tabled else _upper_mean(u, k, df)
    result: FloatArray = np.log(mean / (1.0 + u / MIDDLE_W)) - exponent
    return result


def _tilted(q: FloatArray, df: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The u = q / sqrt(1 + q²/2df) and df/2 log(1 + q²/2df), also where q² overflows; q and q²/4 for df = inf."""
    limit = np.sqrt(2.0 * df)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        r = q / limit
        root = np.hypot(1.0, r)
        near = np.square(q) / 4.0 * np.where(r > TINY, np.log1p(np.square(r)) / np.square(r), 1.0)
        far = df * np.where(np.isinf(r), np.log(q) - np.log(limit), np.log(root))
    return np.where(np.isinf(r), limit, q / root), np.where(r < 1.0, near, far)


def _lower(q: FloatArray, k: float, df: FloatArray, tabled: bool) -> FloatArray:
    """The logarithm of P(Q <= q)."""
    q = np.maximum(q, SMALLEST_Q)
    mean = lower_table(k, float(df[0]))(q) if tabled else _lower_mean(q, k, df)
    result: FloatArray = (k - 1.0) * np.log(scipy.special.erf(q / np.sqrt(8.0))) + mean
    return result


@lru_cache(maxsize=256)
def upper_table(k: float, df: float) -> Panels:
    """The upper mean over u: E c(uS) (1 + u / MIDDLE_W); of c itself for df = inf.

    The factor gives it a limit other than 0 at infinity.
    """
    if np.isinf(df):
        return fitted(lambda w: range_upper(w, k) * (1.0 + w / MIDDLE_W), np.inf)
    return fitted(lambda u: _upper_mean(u, k, np.array([df])), float(np.sqrt(2.0 * df)))


@lru_cache(maxsize=256)
def lower_table(k: float, df: float) -> Panels:
    """The lower mean over q: log E C(qS) - (k-1) log erf(q/√8); of C itself for df = inf."""
    if np.isinf(df):
        return fitted(lambda w: range_lower(w, k), np.inf)
    return fitted(lambda q: _lower_mean(q, k, np.array([df])), np.inf)


def _upper_mean(u: FloatArray, k: float, df: FloatArray) -> FloatArray:
    """The upper mean, E c(uS) (1 + u / MIDDLE_W)."""
    s, log_weight = scale_nodes(df, k, 0.0)
    weight = np.exp(log_weight)
    w = u[:, None] * s
    mean = np.sum(weight * upper_table(k, np.inf)(w) / (1.0 + w / MIDDLE_W), axis=1)
    result: FloatArray = mean / np.sum(weight, axis=1) * (1.0 + u / MIDDLE_W)
    return result


def _lower_mean(q: FloatArray, k: float, df: FloatArray) -> FloatArray:
    """The lower mean, log E C(qS) - (k-1) log erf(q/√8), summed in logarithms: S^(k-1) overflows at large k."""
    s, log_weight = scale_nodes(df, k, k - 1.0)
    w = q[:, None] * s
    share = scipy.special.erf(w / np.sqrt(8.0)) / scipy.special.erf(q / np.sqrt(8.0))[:, None]
    with np.errstate(divide="ignore"):  # at df far below 1, some s are 0
        terms = log_weight + lower_table(k, np.inf)(w) + (k - 1.0) * np.log(share)
    largest = terms.max(axis=1, keepdims=True)
    result: FloatArray = largest[:, 0] + np.log(
        np.sum(np.exp(terms - largest), axis=1) / np.sum(np.exp(log_weight), axis=1)
    )
    return result


def scale_nodes(df: FloatArray, k: float, power: float) -> tuple[FloatArray, FloatArray]:
    """Nodes of S (n, nodes) for df (n,), and the logarithms of their weights, up to a constant.

    Trapezoidal in t, with log s = (t + 1 - exp(-t)) / 2: it shortens the long left tail s^df of small df, and is all
    but linear over the narrow density of large df. `power`: the right end serves s^power times the density as well.
    """
    depth = DEPTH + 2.0 * np.log(k)  # c varies by as much as k²
    low, _ = _ends(depth / df)
    high = _ends(depth / (df + power))[1] + np.log1p(power / df) / 2.0
    first = -np.log1p(-2.0 * low - np.log1p(-low))  # before the t of `low`, by at most a few percent
    last = 2.0 * high - 1.0 + np.exp(-high)  # behind the t of `high`, likewise
    nodes = int(S_NODES * np.sqrt(max(1.0, min(k, FINEST_K) / S_NODES_K)))
    t = first[:, None] + (last - first)[:, None] * np.linspace(0.0, 1.0, nodes)
    x = (t - np.expm1(-t)) / 2.0
    return np.exp(x), np.log1p(np.exp(-t)) - df[:, None] * (np.expm1(2.0 * x) - 2.0 * x) / 2.0


def _ends(drop: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Just beyond the roots x < 0 and x > 0 of (exp(2x) - 1) / 2 - x = drop; log S has lost df drop of log density."""
    root = np.sqrt(drop)
    low = np.expm1(2.0 * (-root - drop)) / 2.0 - drop
    high = root
    for _ in range(3):
        high = np.log1p(2.0 * (drop + high)) / 2.0
    return low, high


def range_upper(w: FloatArray, k: float) -> FloatArray:
    """c(w) = exp(w²/4) P(range of k normals > w), for w (n,).

    k ∫ φ(z) [Φ(z)^m - (Φ(z) - Φ(z-w))^m] dz, m = k - 1, about the middle z = y + w/2 and with exp(w²/4) taken inside.
    """
    m = k - 1.0
    y, step = _normal_nodes(k)
    half = w[:, None] / 2.0
    below = scipy.special.ndtr(y + half)
    far = scipy.special.ndtr(y - half) / below
    with np.errstate(divide="ignore", invalid="ignore", under="ignore"):
        share = np.where(far > 0.0, -np.expm1(m * np.log1p(-far)) / far, m)
    scaled_far = np.exp(-np.square(y)) * scipy.special.erfcx((half - y) / np.sqrt(2.0))
    result: FloatArray = k * step / np.sqrt(8.0 * np.pi) * np.sum(scaled_far * below ** (m - 1.0) * share, axis=1)
    return result


def range_lower(w: FloatArray, k: float) -> FloatArray:
    """The logarithm of P(range of k normals <= w) / erf(w/√8)^(k-1), for w (n,).

    k ∫ φ(z) [Φ(z) - Φ(z-w)]^(k-1) dz; erf(w/√8) is the largest value of the bracket, so nothing under- or overflows.
    """
    z, step = _normal_nodes(k)
    w = np.minimum(w, LARGEST_W)[:, None]
    share = _normal_mass(z - w / 2.0, w) / scipy.special.erf(w / np.sqrt(8.0))
    density = np.exp(-np.square(z) / 2.0) / np.sqrt(2.0 * np.pi)
    result: FloatArray = np.log(k * step * np.sum(density * share ** (k - 1.0), axis=1))
    return result


def _normal_nodes(k: float) -> tuple[FloatArray, float]:
    """Equidistant z over all of k φ(z) that counts, and their step."""
    step = GRID_STEP / np.sqrt(min(k, FINEST_K))
    return np.arange(LOWEST_Z, np.sqrt(2.0 * (DEPTH + np.log(k))) + step, step), float(step)


def _normal_mass(middle: FloatArray, width: FloatArray) -> FloatArray:
    """Φ(middle + width/2) - Φ(middle - width/2) for middle (n, z), width (n, 1), to full relative accuracy."""
    half, distance = width / 2.0, np.abs(middle)  # on the left, where Φ keeps its digits
    mass = scipy.special.ndtr(half - distance) - scipy.special.ndtr(-half - distance)
    narrow = half[:, 0] < 0.5  # there the difference cancels
    points, weights = GAUSS_LEGENDRE
    at = distance[narrow][..., None] + half[narrow][..., None] * points
    mass[narrow] = half[narrow] * np.sum(np.exp(-np.square(at) / 2.0) * weights, axis=-1) / np.sqrt(2.0 * np.pi)
    return mass
