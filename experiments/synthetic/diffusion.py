"""The simple drift-diffusion of a two-alternative choice, drawn exactly: which answer, and after what time.

    dX = v dt + dW,  X(0) = z = w a,  answered when X meets a ("upper") or 0 ("lower"),  time = t0 + first passage

with s = 1, so that X and the boundary a are in sqrt(s) and the drift v in 1/sqrt(s). No step size, no truncated
series: the answer has probability (1 - exp(-2 v z)) / (1 - exp(-2 v a)), and given the answer the way there is cut
into exits from symmetric intervals, whose time does not depend on the side and is drawn by rejection. An exit from
(-d, d) with drift v takes d^2 J(|v| d), J(c) having density cosh(c) exp(-c^2 x/2) sum (-1)^n a_n(x), drawn with the
alternating series of Devroye 2009; at least 0.9991 of the proposals are accepted, whatever c.
Sources: Ratcliff 1978, Psychol. Rev. 85, 59; Devroye 2009, Stat. Probab. Lett. 79, 2251; Polson, Scott & Windle 2013,
J. Am. Stat. Assoc. 108, 1339 (J is four times their Polya-Gamma variable); cf. Drugowitsch 2016, Sci. Rep. 6, 20490.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import Protocol

__all__ = ["Decision", "Diffusion", "Draws", "Lapses", "People", "Person", "decide", "person", "upper_probability"]

CUT = 0.64
"""Where the two forms of the series meet (Devroye 2009)."""
SURE = 30.0
"""Above this |v| d an exit later than `CUT` has a probability below 1e-100."""
LARGEST = 1e6
"""Drift and boundary above this are refused: nobody is that cautious, and squares stay far from overflow."""

_NORMAL = NormalDist()


class Draws(Protocol):
    """What is asked of a random stream (`experiments.design.streams.Stream`)."""

    def uniform(self) -> float:
        """A number strictly between 0 and 1."""

    def normal(self) -> float:
        """A standard normal number."""


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
        if not abs(self.drift) <= LARGEST:
            raise ValueError(f"drift is {self.drift}; it must be within {LARGEST:g} 1/sqrt(s)")
        if not 0.0 < self.boundary <= LARGEST:
            raise ValueError(f"boundary is {self.boundary}; it must be above 0 and at most {LARGEST:g} sqrt(s)")
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


def person(people: People, draws: Draws) -> Person:
    """Somebody, drawn once. The four draws are always made, so one spread's change moves no other value."""
    drift, boundary, non_decision, start = (draws.normal() for _ in range(4))
    return Person(
        drift_factor=1.0 + people.drift_factor_sd * drift,
        boundary_factor=math.exp(people.log_boundary_sd * boundary),
        non_decision_factor=math.exp(people.log_non_decision_sd * non_decision),
        logit_start=people.logit_start_sd * start,
    )


def upper_probability(drift: float, boundary: float, start: float) -> float:
    """P(upper) = (1 - exp(-2 v w a)) / (1 - exp(-2 v a)), w for no drift; to 1e-16 and without overflow.

    >>> upper_probability(0.0, 1.0, 0.25), round(upper_probability(1.0, 2.0, 0.5), 6)
    (0.25, 0.880797)
    """
    if drift < 0:
        return 1.0 - upper_probability(-drift, boundary, 1.0 - start)
    whole = -math.expm1(-2.0 * drift * boundary)
    return -math.expm1(-2.0 * drift * boundary * start) / whole if whole > 1e-300 else start


def decide(diffusion: Diffusion, draws: Draws) -> Decision:
    """One decision. The first draw says whether it lapses, the second which answer, the rest how long it takes.

    So for one stream the answer changes with the drift only one way: common random numbers for comparing designs.
    """
    lapses = diffusion.lapses
    lapse, side = draws.uniform() < lapses.rate, draws.uniform()
    if lapse:
        time_s = lapses.earliest_s + (lapses.latest_s - lapses.earliest_s) * draws.uniform()
        return Decision(upper=side < 0.5, time_s=time_s, lapse=True)
    a, w = diffusion.boundary, diffusion.start
    upper = side < upper_probability(diffusion.drift, a, w)
    gap, back = ((1.0 - w) * a, w * a) if upper else (w * a, (1.0 - w) * a)
    return Decision(upper=upper, time_s=diffusion.non_decision_s + _way(abs(diffusion.drift), gap, back, draws))


def _way(drift: float, gap: float, back: float, draws: Draws) -> float:
    """The time in s until a point `gap` away is met, given that the one `back` behind is not.

    Nearer to the point behind, the way is doubled for sure; nearer to the one ahead, it ends with at least 1/2. Given
    the answer the sign of the drift no longer matters.
    """
    time_s = 0.0
    while gap > 0.0:
        if back <= gap:
            time_s += exit_time(drift, back, draws)
            gap, back = gap - back, 2.0 * back
            if back <= 0.0:
                break
        else:
            time_s += exit_time(drift, gap, draws)
            if draws.uniform() < ending_probability(drift, gap, back):
                break
            gap, back = 2.0 * gap, back - gap
    return time_s


def ending_probability(drift: float, gap: float, back: float) -> float:
    """The chance that an exit from (-gap, gap) is through the point ahead, given that it is met in the end.

    (1 - exp(-2 v (gap + back))) / (1 - exp(-2 v back)) / (1 + exp(-2 v gap)); without drift (gap + back) / (2 back).
    """
    whole, behind = math.expm1(-2.0 * drift * (gap + back)), math.expm1(-2.0 * drift * back)
    if behind > -1e-300:
        return (gap + back) / (2.0 * back)
    return whole / behind / (1.0 + math.exp(-2.0 * drift * gap))


def exit_time(drift: float, half_width: float, draws: Draws) -> float:
    """The time in s at which a diffusion from 0 leaves (-half_width, half_width); exact, whatever the drift."""
    c = abs(drift) * half_width
    rate = math.pi**2 / 8.0 + c * c / 2.0
    late = late_share(c)
    while True:
        if draws.uniform() < late:
            x = CUT - math.log(draws.uniform()) / rate
        else:
            x = _early_slow(c, draws) if c * CUT < 1.0 else _early_fast(c, draws)
        if _accepted(x, draws.uniform()):
            return half_width * half_width * x


def late_share(c: float) -> float:
    """The share of proposals that lie beyond `CUT`: p / (p + q) of Polson, Scott & Windle, both times exp(c)."""
    if c > SURE:
        return 0.0
    rate, root = math.pi**2 / 8.0 + c * c / 2.0, math.sqrt(CUT)
    p = math.pi / (2.0 * rate) * math.exp(c - rate * CUT)
    below = math.erfc((1.0 - CUT * c) / root / math.sqrt(2.0)) / 2.0
    above = math.exp(2.0 * c) * math.erfc((1.0 + CUT * c) / root / math.sqrt(2.0)) / 2.0
    return p / (p + 2.0 * (below + above))


LEVY_TAIL = _NORMAL.cdf(-1.0 / math.sqrt(CUT))
"""P(N < -1/sqrt(CUT)): 1/N^2 is then below `CUT`."""


def _early_slow(c: float, draws: Draws) -> float:
    """An inverse Gaussian number of mean 1/c and shape 1 given that it is below `CUT`, for a mean above `CUT`.

    1/N^2 below `CUT`, tilted by exp(-c^2 x / 2): at least 0.45 of the proposals are taken.
    """
    while True:
        x = _NORMAL.inv_cdf(LEVY_TAIL * draws.uniform()) ** -2
        if draws.uniform() < math.exp(-c * c * x / 2.0):
            return x


def _early_fast(c: float, draws: Draws) -> float:
    """The same for a mean below `CUT`: at least 0.6 of the proposals are."""
    while True:
        x = _inverse_gaussian(1.0 / c, draws)
        if x <= CUT:
            return x


def _inverse_gaussian(mean: float, draws: Draws) -> float:
    """Michael, Schucany & Haas 1976, Am. Stat. 30, 88; the smaller root without cancellation."""
    h = mean * draws.normal() ** 2 / 2.0
    x = mean / (1.0 + h + math.sqrt(h * (2.0 + h)))
    return x if draws.uniform() * (mean + x) <= mean else mean * mean / x


def _accepted(x: float, u: float) -> bool:
    """Whether u a_0 lies below the alternating sum, told by as many terms as it takes: odd sums are below, even above.

    The terms fall faster than exp(-n^2), so they have vanished after a few tens at the latest.
    """
    total, n = 1.0, 0
    while True:
        n += 1
        term = (2 * n + 1) * math.exp(-2.0 * n * (n + 1) / x if x <= CUT else -n * (n + 1) * math.pi**2 * x / 2.0)
        total += -term if n % 2 else term
        if n % 2 and u < total:
            return True
        if (not n % 2 and u > total) or term == 0.0:
            return u < total
