"""The simple drift-diffusion of a two-alternative choice, drawn exactly: which answer, and after what time.

    dX = v dt + dW,  X(0) = z = w a,  answered when X meets a ("upper") or 0 ("lower"),  time = t0 + first passage

with s = 1, so that X and the boundary a are in sqrt(s) and the drift v in 1/sqrt(s). No step size, no truncated
series: the answer has probability (1 - exp(-2 v z)) / (1 - exp(-2 v a)), and given the answer the way there is cut
into exits from symmetric intervals, whose time does not depend on the side and is drawn by rejection. An exit from
(-d, d) with drift v takes d^2 J(|v| d), J(c) having density cosh(c) exp(-c^2 x/2) sum (-1)^n a_n(x), drawn with the
alternating series of Devroye 2009; at least 0.9991 of the proposals are accepted, whatever c.
Sources: Ratcliff 1978, Psychol. Rev. 85, 59; Devroye 2009, Stat. Probab. Lett. 79, 2251; Polson, Scott & Windle 2013,
J. Am. Stat. Assoc. 108, 1339 (J is four times their Polya-Gamma variable); cf. Drugowitsch 2016, Sci. Rep. 6, 20490.

Of many at once the draws are made in the order in which those still wanting stand in the array.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.design.streams import Stream

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Draw = Callable[[int], Floats]
"""So many numbers strictly between 0 and 1."""

_CUT = 0.64
"""Where the two forms of the series meet (Devroye 2009)."""
SURE = 30.0
"""Above this |v| d an exit later than `_CUT` has a probability below 1e-100."""
_LARGEST = 1e6
"""Drift and boundary above this are refused: nobody is that cautious, and squares stay far from overflow."""

LEVY_TAIL = 0.10564977366685535
"""P(N < -1/sqrt(CUT)): 1/N^2 is then below `_CUT`. As a number, so that scipy waits until something is drawn."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lapses:
    """Answers that are not decided: a fair coin after a time uniform from `earliest_s` to `latest_s`.

    Source: Ratcliff & Tuerlinckx 2002, Psychon. Bull. Rev. 9, 438 (uniform contaminants); the range is assumed.
    """

    rate: float = 0.0
    earliest_s: float = 0.2
    latest_s: float = 3.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.rate <= 1.0:
            raise ValueError(f"lapse rate is {self.rate}; it must be 0 to 1")
        if not 0.0 <= self.earliest_s < self.latest_s <= 3_600.0:
            raise ValueError(f"lapses last {self.earliest_s} to {self.latest_s} s; 0 <= earliest < latest <= 3600")


@dataclass(frozen=True, slots=True, kw_only=True)
class Diffusion:
    """One decision's parameters. `start` is z / a, 0 to 1; at 0 or 1 the answer is given at once."""

    drift: float  # v, 1/sqrt(s), towards the upper boundary
    boundary: float  # a, sqrt(s): the caution
    start: float = 0.5  # w = z / a: above 0.5 leans towards the upper answer
    non_decision_s: float = 0.3  # t0
    lapses: Lapses = Lapses()

    def __post_init__(self) -> None:
        if not abs(self.drift) <= _LARGEST:
            raise ValueError(f"drift is {self.drift}; it must be within {_LARGEST:g} 1/sqrt(s)")
        if not 0.0 < self.boundary <= _LARGEST:
            raise ValueError(f"boundary is {self.boundary}; it must be above 0 and at most {_LARGEST:g} sqrt(s)")
        if not 0.0 <= self.start <= 1.0:
            raise ValueError(f"start is {self.start}; it must be 0 to 1")
        if not 0.0 <= self.non_decision_s <= 3_600.0:
            raise ValueError(f"non_decision_s is {self.non_decision_s}; it must be 0 to 3600")


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """One answer and the time from the stimulus to it."""

    upper: bool
    time_s: float
    lapse: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class People:
    """How people differ from the mean person; 0 for not at all. All assumed: the paper gives no spread."""

    drift_factor_sd: float = 0.0  # of the factor on every drift, normal around 1
    log_boundary_sd: float = 0.0
    log_non_decision_sd: float = 0.0
    logit_start_sd: float = 0.0

    def __post_init__(self) -> None:
        for name in ("drift_factor_sd", "log_boundary_sd", "log_non_decision_sd", "logit_start_sd"):
            if not 0.0 <= getattr(self, name) <= 5.0:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be 0 to 5")


@dataclass(frozen=True, slots=True, kw_only=True)
class Person:
    """What one person makes of the mean person's parameters."""

    drift_factor: float
    boundary_factor: float
    non_decision_factor: float
    logit_start: float

    def own(self, mean: Diffusion) -> Diffusion:
        """The person's own diffusion; the median person is the mean one."""
        start = mean.start
        if 0.0 < start < 1.0:
            start = 1.0 / (1.0 + (1.0 - start) / start * math.exp(-self.logit_start))
        return Diffusion(
            drift=mean.drift * self.drift_factor,
            boundary=mean.boundary * self.boundary_factor,
            start=start,
            non_decision_s=mean.non_decision_s * self.non_decision_factor,
            lapses=mean.lapses,
        )


def person(people: People, draws: Stream) -> Person:
    """Somebody, drawn once. The four draws are always made, so one spread's change moves no other value."""
    drift, boundary, non_decision, start = (draws.normal() for _ in range(4))
    return Person(
        drift_factor=1.0 + people.drift_factor_sd * drift,
        boundary_factor=math.exp(people.log_boundary_sd * boundary),
        non_decision_factor=math.exp(people.log_non_decision_sd * non_decision),
        logit_start=people.logit_start_sd * start,
    )


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
    from scipy.special import erfc  # noqa: PLC0415 - slow, and whoever only reads a design needs none of it

    near = np.minimum(c, SURE)
    rate, root = math.pi**2 / 8.0 + near * near / 2.0, math.sqrt(2.0 * _CUT)
    p = math.pi / (2.0 * rate) * np.exp(near - rate * _CUT)
    above = np.exp(2.0 * near) * erfc((1.0 + _CUT * near) / root)
    share = p / (p + erfc((1.0 - _CUT * near) / root) + above)
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
    from scipy.special import ndtri  # noqa: PLC0415 - as above

    x, wanting = np.empty_like(c), np.arange(c.size)
    while wanting.size:
        proposed = ndtri(LEVY_TAIL * draw(wanting.size)) ** -2.0
        taken = draw(wanting.size) < np.exp(-(c[wanting] ** 2) * proposed / 2.0)
        x[wanting[taken]] = proposed[taken]
        wanting = wanting[~taken]
    return x


def _early_fast(c: Floats, draw: Draw) -> Floats:
    """The same for means below `_CUT`, where at least 0.6 of the proposals are.

    Michael, Schucany & Haas 1976, Am. Stat. 30, 88; the smaller root without cancellation.
    """
    from scipy.special import ndtri  # noqa: PLC0415 - as above

    x, wanting = np.empty_like(c), np.arange(c.size)
    while wanting.size:
        mean = 1.0 / c[wanting]
        h = mean * ndtri(draw(wanting.size)) ** 2 / 2.0
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
