"""Decisions of the simple drift-diffusion, drawn exactly: which answer, and after what time; and how often which.

No step size, no truncated series: the answer has probability (1 - exp(-2 v z)) / (1 - exp(-2 v a)), and given the
answer the way there is cut into exits from symmetric intervals, whose time does not depend on the side and is drawn by
rejection. An exit from (-d, d) with drift v takes d^2 J(|v| d), J(c) having density cosh(c) exp(-c^2 x/2) sum (-1)^n
a_n(x), drawn with the alternating series of Devroye 2009; at least 0.9991 of the proposals are accepted, whatever c.
Sources: Devroye 2009, Stat. Probab. Lett. 79, 2251; Polson, Scott & Windle 2013,
J. Am. Stat. Assoc. 108, 1339 (J is four times their Polya-Gamma variable); cf. Drugowitsch 2016, Sci. Rep. 6, 20490.

Of many at once the draws are made in the order in which those still wanting stand in the array.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from experiments.design.streams import Stream
from experiments.synthetic.diffusion import Decision, Diffusion, People

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Draw = Callable[[int], Floats]
"""So many numbers strictly between 0 and 1."""

_CUT = 0.64
"""Where the two forms of the series meet (Devroye 2009)."""
SURE = 30.0
"""Above this |v| d an exit later than `_CUT` has a probability below 1e-100."""
LEVY_TAIL = 0.10564977366685535
"""P(N < -1/sqrt(CUT)): 1/N^2 is then below `_CUT`. As a number, so that scipy waits until something is drawn."""

_POINTS = 15


def decide(diffusion: Diffusion, draws: Stream) -> Decision:
    """One decision. The first draw says whether it lapses, the second which answer, the rest how long it takes.

    So for one stream the answer changes with the drift only one way: common random numbers for comparing designs.
    """
    lapses = diffusion.lapses
    lapse, side = draws.uniform() < lapses.rate, draws.uniform()
    if lapse:
        time_s = lapses.earliest_s + (lapses.latest_s - lapses.earliest_s) * draws.uniform()
        return Decision(upper=side < 0.5, time_s=time_s, lapse=True)
    a, w = diffusion.boundary, diffusion.start
    upper = side < float(upper_probabilities(diffusion.drift, a, w))
    gap, back = ((1.0 - w) * a, w * a) if upper else (w * a, (1.0 - w) * a)
    ahead, behind, speed = np.array([gap]), np.array([back]), np.array([abs(diffusion.drift)])
    (way,) = crossing_times(speed, ahead, behind, lambda count: np.array([draws.uniform() for _ in range(count)]))
    return Decision(upper=upper, time_s=diffusion.non_decision_s + float(way))


def upper_probabilities(drift: ArrayLike, boundary: ArrayLike, start: ArrayLike) -> Floats:
    """P(upper) = (1 - exp(-2 v w a)) / (1 - exp(-2 v a)), w for no drift; to 1e-16. The arguments broadcast.

    >>> upper_probabilities([0.0, 1.0], [1.0, 2.0], [0.25, 0.5]).round(6).tolist()
    [0.25, 0.880797]
    """
    v, a, w = (np.asarray(values, dtype=np.float64) for values in (drift, boundary, start))
    w = np.where(v < 0.0, 1.0 - w, w)
    whole = -np.expm1(-2.0 * np.abs(v) * a)
    some = whole > 1e-300
    share = np.where(some, -np.expm1(-2.0 * np.abs(v) * a * w) / np.where(some, whole, 1.0), w)
    return np.where(v < 0.0, 1.0 - share, share)


def crossing_times(v: Floats, gap: Floats, back: Floats, draw: Draw) -> Floats:
    """The times in s until points `gap` away are met, given that those `back` behind are not; a round is an exit each.

    Nearer to the point behind, the way is doubled for sure; nearer to the one ahead, it ends with at least 1/2. Given
    the answer the sign of the drift no longer matters.
    """
    time_s = np.zeros_like(v)
    open_ = np.flatnonzero((gap > 0.0) & (back > 0.0))
    while open_.size:
        c, g, b = v[open_], gap[open_], back[open_]
        behind = b <= g
        time_s[open_] += exit_times(c, np.where(behind, b, g), draw)
        there = draw(open_.size) < ending_probabilities(c, g, b)
        gap[open_], back[open_] = np.where(behind, g - b, 2.0 * g), np.where(behind, 2.0 * b, b - g)
        open_ = open_[np.where(behind, g > b, ~there)]
    return time_s


def ending_probabilities(v: Floats, gap: Floats, back: Floats) -> Floats:
    """The chances that exits from (-gap, gap) are through the point ahead, given that it is met in the end.

    (1 - exp(-2 v (gap + back))) / (1 - exp(-2 v back)) / (1 + exp(-2 v gap)); without drift (gap + back) / (2 back).
    """
    behind = np.expm1(-2.0 * v * back)
    some = behind < -1e-300
    ratio = np.expm1(-2.0 * v * (gap + back)) / np.where(some, behind, 1.0) / (1.0 + np.exp(-2.0 * v * gap))
    return np.where(some, ratio, (gap + back) / (2.0 * back))


def exit_times(drift: Floats, half_width: Floats, draw: Draw) -> Floats:
    """The times at which diffusions from 0 leave (-half_width, half_width)."""
    c = np.abs(drift) * half_width
    x, wanting = np.empty_like(c), np.arange(c.size)
    late_share = late_shares(c)
    while wanting.size:
        proposed = _proposed(c[wanting], late_share[wanting], draw)
        taken = _accepted(proposed, draw(wanting.size))
        x[wanting[taken]] = proposed[taken]
        wanting = wanting[~taken]
    return np.asarray(half_width * half_width * x)


def late_shares(c: Floats) -> Floats:
    """The share of proposals that lie beyond `_CUT`: p / (p + q) of Polson, Scott & Windle, both times exp(c)."""
    near = np.minimum(c, SURE)
    rate, root = math.pi**2 / 8.0 + near * near / 2.0, math.sqrt(2.0 * _CUT)
    p = math.pi / (2.0 * rate) * np.exp(near - rate * _CUT)
    above = np.exp(2.0 * near) * scipy.special.erfc((1.0 + _CUT * near) / root)
    share = p / (p + scipy.special.erfc((1.0 - _CUT * near) / root) + above)
    return np.where(c > SURE, 0.0, share)


def _proposed(c: Floats, late_share: Floats, draw: Draw) -> Floats:
    late = draw(c.size) < late_share
    slow, fast = ~late & (c * _CUT < 1.0), ~late & (c * _CUT >= 1.0)
    x = np.empty_like(c)
    rate = math.pi**2 / 8.0 + c[late] ** 2 / 2.0
    x[late] = _CUT - np.log(draw(rate.size)) / rate
    x[slow] = _early_slow(c[slow], draw)
    x[fast] = _early_fast(c[fast], draw)
    return x


def _early_slow(c: Floats, draw: Draw) -> Floats:
    """Inverse Gaussian numbers of mean 1/c and shape 1 given that they are below `_CUT`, for means above `_CUT`.

    1/N^2 below `_CUT`, tilted by exp(-c^2 x / 2): at least 0.45 of the proposals are taken.
    """
    x, wanting = np.empty_like(c), np.arange(c.size)
    while wanting.size:
        proposed = scipy.special.ndtri(LEVY_TAIL * draw(wanting.size)) ** -2.0
        taken = draw(wanting.size) < np.exp(-(c[wanting] ** 2) * proposed / 2.0)
        x[wanting[taken]] = proposed[taken]
        wanting = wanting[~taken]
    return x


def _early_fast(c: Floats, draw: Draw) -> Floats:
    """The same for means below `_CUT`, where at least 0.6 of the proposals are.

    Michael, Schucany & Haas 1976, Am. Stat. 30, 88; the smaller root without cancellation.
    """
    x, wanting = np.empty_like(c), np.arange(c.size)
    while wanting.size:
        mean = 1.0 / c[wanting]
        h = mean * scipy.special.ndtri(draw(wanting.size)) ** 2 / 2.0
        root = mean / (1.0 + h + np.sqrt(h * (2.0 + h)))
        smaller = draw(wanting.size) * (mean + root) <= mean
        proposed = np.where(smaller, root, mean * mean / root)
        taken = proposed <= _CUT
        x[wanting[taken]] = proposed[taken]
        wanting = wanting[~taken]
    return x


def _accepted(x: Floats, u: Floats) -> Bools:
    """Whether u a_0 lies below the alternating sum, told by as many terms as it takes: odd sums are below, even above.

    Nearly all are told by the first term; the terms fall faster than exp(-n^2), so they have vanished soon.
    """
    total = np.ones_like(x)
    result, wanting = np.zeros(x.size, dtype=np.bool_), np.arange(x.size)
    n = 0
    while wanting.size:
        n += 1
        here = x[wanting]
        size = n * (n + 1)
        term = (2 * n + 1) * np.exp(np.where(here <= _CUT, -2.0 * size / here, -size * math.pi**2 * here / 2.0))
        total[wanting] += -term if n % 2 else term
        below = u[wanting] < total[wanting]
        told = (term == 0.0) | (below if n % 2 else ~below)
        result[wanting[told]] = below[told]
        wanting = wanting[~told]
    return result


def own_start(start: ArrayLike, logit_start: ArrayLike) -> Floats:
    """The starting point of people whose logit differs by so much, as `diffusion.Person.own` has it; they broadcast.

    >>> own_start(0.5, [0.0, 1.0]).round(6).tolist()
    [0.5, 0.731059]
    """
    w = np.asarray(start, dtype=np.float64)
    return np.asarray(w / (w + (1.0 - w) * np.exp(-np.asarray(logit_start, dtype=np.float64))))


def forward_rates(log_odds: ArrayLike, start: float, people: People, lapse_rate: float = 0.0) -> Floats:
    """The share of "forward" in the mean over people, of each evidence (any shape).

    Over their factors of drift and boundary and their bias: Gauss-Hermite quadrature of 15 points for each spread above
    0; 1e-8 of the mean for spreads up to 0.5. With no spread and no lapses `upper_probabilities`.

    >>> forward_rates([0.0, 1.0, -1.0], 0.5, People()).round(6).tolist()
    [0.5, 0.731059, 0.268941]
    """
    drift, boundary, logit = map(_nodes, (people.drift_factor_sd, people.log_boundary_sd, people.logit_start_sd))
    strength = (1.0 + drift[0])[:, None] * np.exp(boundary[0])
    product = np.asarray(log_odds, dtype=np.float64)[..., None, None, None] * strength[..., None]
    upper = upper_probabilities(product, 1.0, own_start(start, logit[0]))
    mean = np.einsum("...ijk,i,j,k->...", upper, drift[1], boundary[1], logit[1])
    return np.asarray((1.0 - lapse_rate) * mean + lapse_rate / 2.0)


@lru_cache(maxsize=64)
def _nodes(sd: float) -> tuple[Floats, Floats]:
    """Places and weights of the quadrature."""
    if sd == 0.0:
        return np.zeros(1), np.ones(1)
    places, weights = np.polynomial.hermite_e.hermegauss(_POINTS)
    return sd * places, weights / math.sqrt(2.0 * math.pi)
