"""d′ from the share of right answers in tasks of several intervals: two-interval, ABX, oddity.

All take Gaussian evidence of equal variance, an observer without bias, and the strategy that is named.

======================  ==============================================================================================
`two-interval`          p = F(d / sqrt 2): the larger of two
`abx`                   p = F(d / sqrt 2) F(d / sqrt 6) + F(-d / sqrt 2) F(-d / sqrt 6): X is nearer to A or to B
`oddity`                p = 2 int_0^inf [F(-z sqrt 3 + d sqrt(2/3)) + F(-z sqrt 3 - d sqrt(2/3))] f(z) dz: farthest out
======================  ==============================================================================================

with F and f the standard normal distribution and its density. Sources: Macmillan & Creelman 2005, Detection Theory,
chapters 7 and 9 (ABX and oddity by differencing); Ennis 1990, Journal of Sensory Studies 4, 225 (oddity).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
import scipy

from analysis.stats.arrays import FloatArray, Values, one_of, whole
from analysis.stats.frames import Result

Task = Literal["two-interval", "abx", "oddity"]
CHANCE: Mapping[Task, float] = {"two-interval": 1 / 2, "abx": 1 / 2, "oddity": 1 / 3}
"""How often who feels nothing is right."""
MOST_D = 20.0
"""Beyond it, every task's share of right answers is 1 in floats."""


def _two_interval(d: FloatArray) -> FloatArray:
    return np.asarray(scipy.special.ndtr(d / np.sqrt(2.0)))


def _abx(d: FloatArray) -> FloatArray:
    one, other = scipy.special.ndtr(d / np.sqrt(2.0)), scipy.special.ndtr(d / np.sqrt(6.0))
    return np.asarray(one * other + (1.0 - one) * (1.0 - other))


def _oddity(d: FloatArray) -> FloatArray:
    z, area = _half_normal()
    shift, out = d[..., None] * np.sqrt(2.0 / 3.0), -z * np.sqrt(3.0)
    return np.asarray(2.0 * ((scipy.special.ndtr(out + shift) + scipy.special.ndtr(out - shift)) @ area))


@cache
def _half_normal() -> tuple[FloatArray, FloatArray]:
    """Places z above 0 and the normal density's share at each: 200 nodes of Gauss and Legendre, made when needed."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    z = 4.5 * (nodes + 1.0)  # the density is below 1e-18 beyond 9
    return z, 4.5 * weights * np.exp(-(z**2) / 2.0) / np.sqrt(2.0 * np.pi)


SHARE_RIGHT: Mapping[Task, Callable[[FloatArray], FloatArray]] = {
    "two-interval": _two_interval,
    "abx": _abx,
    "oddity": _oddity,
}
"""The share of right answers at a d′ of at least 0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Discrimination(Result):
    """d′ with its standard error (delta method, binomial); 0 at or below chance, with a standard error of NaN.

    `corrected`: all or none were right, so half an answer was added on either side (log-linear) before d′ was taken.
    """

    d_prime: Values
    se: Values
    corrected: bool


def discrimination(right: int, trials: int, task: Task) -> Discrimination:
    """d′ from so many right answers. `ValueError`: no trials, or more right ones than trials.

    >>> round(float(discrimination(76, 100, "two-interval").d_prime), 3)
    0.999
    """
    from scipy.optimize import elementwise  # noqa: PLC0415 - the heavy import waits until there are answers

    trials = whole(trials, "trials", 1)
    right = whole(right, "right", 0, trials)
    one_of(task, "task", tuple(SHARE_RIGHT))
    share_of, corrected = SHARE_RIGHT[task], right in (0, trials)
    share = (right + 0.5) / (trials + 1) if corrected else right / trials
    if share <= CHANCE[task]:
        return Discrimination(d_prime=0.0, se=float("nan"), corrected=corrected)
    found = elementwise.find_root(lambda d: share_of(np.asarray(d)) - share, (0.0, MOST_D))
    d = float(found.x)
    low, high = max(d - 1e-4, 0.0), d + 1e-4
    slope = float(np.diff(share_of(np.array([low, high])))[0]) / (high - low)
    se = float(np.sqrt(share * (1.0 - share) / trials) / slope) if slope > 0 else float("nan")
    return Discrimination(d_prime=d, se=se, corrected=corrected)
