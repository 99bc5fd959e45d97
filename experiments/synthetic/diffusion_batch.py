"""A million diffusions at once: the sampling of `diffusion`, over arrays.

All draws are uniform numbers made of the bit generator's raw output, which numpy promises never to change, in the
order in which the draws still wanting stand in the array; so a seed gives the same answers and times everywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from experiments.synthetic.diffusion import CUT, LARGEST, LEVY_TAIL, SURE

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Decisions:
    """Answers and times, arrays of one shape."""

    upper: Bools
    time_s: Floats


def upper_probabilities(drift: ArrayLike, boundary: ArrayLike, start: ArrayLike) -> Floats:
    """P(upper) of each diffusion, as `diffusion.upper_probability`; the arguments broadcast."""
    v, a, w = (np.asarray(values, dtype=np.float64) for values in (drift, boundary, start))
    w = np.where(v < 0.0, 1.0 - w, w)
    whole = -np.expm1(-2.0 * np.abs(v) * a)
    some = whole > 1e-300
    share = np.where(some, -np.expm1(-2.0 * np.abs(v) * a * w) / np.where(some, whole, 1.0), w)
    return np.where(v < 0.0, 1.0 - share, share)


def decide_all(
    drift: ArrayLike,
    boundary: ArrayLike,
    start: ArrayLike,
    non_decision_s: ArrayLike,
    *,
    generator: np.random.Generator,
    shape: tuple[int, ...] | None = None,
) -> Decisions:
    """One decision each of the broadcast parameters (or of `shape`), without lapses; about 1 us each.

    `ValueError`: a drift or boundary beyond `LARGEST`, a boundary not above 0, a start outside 0..1, a time below 0.
    """
    values = (np.asarray(value, dtype=np.float64) for value in (drift, boundary, start, non_decision_s))
    v, a, w, t0 = (np.array(x) for x in np.broadcast_arrays(*values))
    _check(v, a, w, t0)
    shape = v.shape if shape is None else shape
    v, a, w, t0 = (np.broadcast_to(x, shape).ravel() for x in (v, a, w, t0))
    upper = uniforms(generator, v.size) < upper_probabilities(v, a, w)
    gap, back = np.where(upper, 1.0 - w, w) * a, np.where(upper, w, 1.0 - w) * a
    time_s = t0 + _ways(np.abs(v), gap, back, generator)
    return Decisions(upper=upper.reshape(shape), time_s=time_s.reshape(shape))


def uniforms(generator: np.random.Generator, count: int) -> Floats:
    """Numbers strictly between 0 and 1, as `Stream.uniform` makes them."""
    raw = np.asarray(generator.bit_generator.random_raw(count), dtype=np.uint64)
    return ((raw >> np.uint64(12)).astype(np.float64) + 0.5) * 2.0**-52


def _check(v: Floats, a: Floats, w: Floats, t0: Floats) -> None:
    rules = (
        (np.abs(v) <= LARGEST, f"drift must be within {LARGEST:g}"),
        ((a > 0.0) & (a <= LARGEST), f"boundary must be above 0 and at most {LARGEST:g}"),
        ((w >= 0.0) & (w <= 1.0), "start must be 0 to 1"),
        ((t0 >= 0.0) & (t0 <= 3_600.0), "non_decision_s must be 0 to 3600"),
    )
    for holds, rule in rules:
        if not holds.all():
            raise ValueError(f"{rule}, but element {int(np.argmin(holds.ravel()))} is not")


def _ways(v: Floats, gap: Floats, back: Floats, generator: np.random.Generator) -> Floats:
    """The times of `diffusion._way`; each round takes those still under way one exit further."""
    time_s = np.zeros_like(v)
    open_ = np.flatnonzero((gap > 0.0) & (back > 0.0))
    while open_.size:
        c, g, b = v[open_], gap[open_], back[open_]
        behind = b <= g
        time_s[open_] += exit_times(c, np.where(behind, b, g), generator)
        there = uniforms(generator, open_.size) < _ending(c, g, b)
        gap[open_], back[open_] = np.where(behind, g - b, 2.0 * g), np.where(behind, 2.0 * b, b - g)
        open_ = open_[np.where(behind, g > b, ~there)]
    return time_s


def _ending(v: Floats, gap: Floats, back: Floats) -> Floats:
    behind = np.expm1(-2.0 * v * back)
    some = behind < -1e-300
    ratio = np.expm1(-2.0 * v * (gap + back)) / np.where(some, behind, 1.0) / (1.0 + np.exp(-2.0 * v * gap))
    return np.where(some, ratio, (gap + back) / (2.0 * back))


def exit_times(drift: Floats, half_width: Floats, generator: np.random.Generator) -> Floats:
    """The times at which diffusions from 0 leave (-half_width, half_width)."""
    c = np.abs(drift) * half_width
    x, wanting = np.empty_like(c), np.arange(c.size)
    late_share = _late_shares(c)
    while wanting.size:
        proposed = _proposed(c[wanting], late_share[wanting], generator)
        taken = _accepted(proposed, uniforms(generator, wanting.size))
        x[wanting[taken]] = proposed[taken]
        wanting = wanting[~taken]
    return np.asarray(half_width * half_width * x)


def _late_shares(c: Floats) -> Floats:
    near = np.minimum(c, SURE)
    rate, root = math.pi**2 / 8.0 + near * near / 2.0, math.sqrt(2.0 * CUT)
    p = math.pi / (2.0 * rate) * np.exp(near - rate * CUT)
    above = np.exp(2.0 * near) * special.erfc((1.0 + CUT * near) / root)
    share = p / (p + special.erfc((1.0 - CUT * near) / root) + above)
    return np.where(c > SURE, 0.0, share)


def _proposed(c: Floats, late_share: Floats, generator: np.random.Generator) -> Floats:
    late = uniforms(generator, c.size) < late_share
    slow, fast = ~late & (c * CUT < 1.0), ~late & (c * CUT >= 1.0)
    x = np.empty_like(c)
    rate = math.pi**2 / 8.0 + c[late] ** 2 / 2.0
    x[late] = CUT - np.log(uniforms(generator, rate.size)) / rate
    x[slow] = _early_slow(c[slow], generator)
    x[fast] = _early_fast(c[fast], generator)
    return x


def _early_slow(c: Floats, generator: np.random.Generator) -> Floats:
    x, wanting = np.empty_like(c), np.arange(c.size)
    while wanting.size:
        proposed = special.ndtri(LEVY_TAIL * uniforms(generator, wanting.size)) ** -2.0
        taken = uniforms(generator, wanting.size) < np.exp(-(c[wanting] ** 2) * proposed / 2.0)
        x[wanting[taken]] = proposed[taken]
        wanting = wanting[~taken]
    return x


def _early_fast(c: Floats, generator: np.random.Generator) -> Floats:
    x, wanting = np.empty_like(c), np.arange(c.size)
    while wanting.size:
        mean = 1.0 / c[wanting]
        h = mean * special.ndtri(uniforms(generator, wanting.size)) ** 2 / 2.0
        root = mean / (1.0 + h + np.sqrt(h * (2.0 + h)))
        smaller = uniforms(generator, wanting.size) * (mean + root) <= mean
        proposed = np.where(smaller, root, mean * mean / root)
        taken = proposed <= CUT
        x[wanting[taken]] = proposed[taken]
        wanting = wanting[~taken]
    return x


def _accepted(x: Floats, u: Floats) -> Bools:
    """As `diffusion._accepted`: nearly all are told by the first term."""
    total = np.ones_like(x)
    result, wanting = np.zeros(x.size, dtype=np.bool_), np.arange(x.size)
    n = 0
    while wanting.size:
        n += 1
        here = x[wanting]
        size = n * (n + 1)
        term = (2 * n + 1) * np.exp(np.where(here <= CUT, -2.0 * size / here, -size * math.pi**2 * here / 2.0))
        total[wanting] += -term if n % 2 else term
        below = u[wanting] < total[wanting]
        told = (term == 0.0) | (below if n % 2 else ~below)
        result[wanting[told]] = below[told]
        wanting = wanting[~told]
    return result
