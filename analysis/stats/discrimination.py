"""d′: of yes/no judgements, and from the share of right answers in two-interval, ABX and oddity tasks.

All take Gaussian evidence of equal variance; those of several intervals an observer without bias, and the strategy that
is named.

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
from statistics import NormalDist
from typing import Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike

from analysis.stats.arrays import FloatArray, Values, float_or_array, numbers, one_of, together, whole
from analysis.stats.frames import Result

Task = Literal["two-interval", "abx", "oddity"]
CHANCE: Mapping[Task, float] = {"two-interval": 1 / 2, "abx": 1 / 2, "oddity": 1 / 3}
"""How often who feels nothing is right."""
MOST_D = 20.0
"""Beyond it, every task's share of right answers is 1 in floats."""
_normal_quantiles = np.vectorize(NormalDist().inv_cdf, otypes=[np.float64])
"""Of arrays. Of the standard library: a report that needs no more of scipy is spared importing it."""


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection(Result):
    """d' and criterion with the corrected rates they come from. A criterion below 0 leans towards "yes".

    >>> yes_no([18, 12], 20, [6, 6], 20).to_frame().columns.tolist()
    ['d_prime', 'criterion', 'hit_rate', 'false_alarm_rate']
    """

    d_prime: Values
    criterion: Values
    hit_rate: Values
    false_alarm_rate: Values


def yes_no(hits: ArrayLike, signal_trials: ArrayLike, false_alarms: ArrayLike, noise_trials: ArrayLike) -> Detection:
    """Sensitivity d' = z(H) - z(F) and criterion c = -(z(H) + z(F)) / 2 of a yes/no judgement, log-linear corrected.

    H = (hits + 0.5) / (signal_trials + 1), F = (false_alarms + 0.5) / (noise_trials + 1), always, not only at 0 and 1.
    For judgements of direction "yes" is "forward": said on a forward shot a hit, on a backward shot a false alarm.
    All arguments broadcast. `ValueError`: a count that is not whole or outside 0..its trials, or no trials.
    Sources: Hautus 1995, Behavior Research Methods 27, 46; Macmillan & Creelman 2005, chapter 2.

    >>> round(yes_no(10, 10, 0, 10).d_prime, 3)
    3.381
    """
    hits, signal_trials, false_alarms, noise_trials = together(
        hits=numbers(hits, "hits"),
        signal_trials=numbers(signal_trials, "signal_trials"),
        false_alarms=numbers(false_alarms, "false_alarms"),
        noise_trials=numbers(noise_trials, "noise_trials"),
    )
    hit_rate, z_hit = _rate_and_z(hits, signal_trials, "hits", "signal_trials")
    false_alarm_rate, z_false_alarm = _rate_and_z(false_alarms, noise_trials, "false_alarms", "noise_trials")
    return Detection(
        d_prime=float_or_array(z_hit - z_false_alarm),
        criterion=float_or_array(-(z_hit + z_false_alarm) / 2.0),
        hit_rate=float_or_array(hit_rate),
        false_alarm_rate=float_or_array(false_alarm_rate),
    )


def _rate_and_z(counts: FloatArray, totals: FloatArray, name: str, of: str) -> tuple[FloatArray, FloatArray]:
    """The corrected rate and its normal quantile, taken from the nearer end so that 0 and all mirror exactly."""
    if (totals < 1.0).any():
        raise ValueError(f"{of} must be at least 1, not {totals[totals < 1.0][0]:g}")
    if ((counts < 0.0) | (counts > totals)).any():
        raise ValueError(f"{name} must lie in 0..{of}, not {counts[(counts < 0.0) | (counts > totals)][0]:g}")
    if (counts != np.floor(counts)).any() or (totals != np.floor(totals)).any():
        raise ValueError(f"{name} and {of} must be whole numbers, counts and not rates")
    rest = totals - counts
    z = _normal_quantiles((np.minimum(counts, rest) + 0.5) / (totals + 1.0))
    return (counts + 0.5) / (totals + 1.0), np.where(counts > rest, -z, z)
