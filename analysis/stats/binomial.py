"""The exact binomial test of a proportion and its intervals, of many counts at once."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist
from typing import Literal, cast, get_args

import numpy as np
from numpy.typing import ArrayLike

from analysis.stats.arrays import FloatArray, Values, by_case, float_or_array, numbers, one_of, share, together
from analysis.stats.binomial_tail import LongArray, log_between, log_pmf, tail_over_pmf
from analysis.stats.frames import Result

Tail = Literal["two-sided", "greater", "less"]

TIE = 1e-7
"""Outcomes within this relative distance of the observed one's probability count as equally likely (R's rule)."""

_MOST_TRIALS = 1e10
"""What the sums near p = 1 bear: they take time with the square root of the trials."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BinomialTest(Result):
    """Exact test of a proportion; `log_p` is the natural logarithm, good where `p` underflows to 0.

    `ci_low, ci_high` are Clopper and Pearson's limits, `wilson_low, wilson_high` Wilson's. Of a one-sided test the
    interval is one-sided too: for "greater" it ends at 1, for "less" it begins at 0.

    >>> binomial_test(9, 10).estimate
    0.9
    """

    p: Values
    log_p: Values
    estimate: Values
    ci_low: Values
    ci_high: Values
    wilson_low: Values
    wilson_high: Values


def binomial_test(
    successes: ArrayLike,
    trials: ArrayLike,
    p0: ArrayLike = 0.5,
    alternative: Tail = "two-sided",
    *,
    confidence: float = 0.95,
) -> BinomialTest:
    """Is the chance of success `p0`, or is it greater, or less? With the intervals; `binomial_test_p` gives p alone.

    Two-sided p = sum of P(i) over all outcomes i with P(i) <= P(successes) (1 + 1e-7); "greater": P(X >= successes);
    "less": P(X <= successes). The tolerance makes ties of rounding count as ties, as R's `binom.test` and scipy do. It
    concerns the other side of the mode alone: on its own side the observed count is the border. It shows where
    neighbours differ by less than it: 0 of 1e9 at p0 = 1e-9 has p = 1, with strict comparison 0.632.

    `successes, trials, p0` broadcast; equal cases are worked out once. `ValueError`: counts that are not whole,
    successes outside 0..trials, trials outside 1..1e10, p0 outside 0..1, an alternative that is none.
    Sources: Sterne 1954, Biometrika 41, 275; the intervals: see `clopper_pearson` and `wilson`.

    >>> found = binomial_test(78, 140)
    >>> round(found.p, 3), round(found.ci_low, 3), round(found.ci_high, 3)
    (0.205, 0.471, 0.641)
    >>> round(binomial_test(78, 140, alternative="greater").p, 3)
    0.102
    """
    k, n, chance = _checked(successes, trials, p0)
    side = _known(alternative)
    tail = (1.0 - share(confidence, "confidence")) / (2.0 if side == "two-sided" else 1.0)
    log_p = _log_p_of((k, n, chance), side)

    def intervals(k: FloatArray, n: FloatArray) -> FloatArray:
        limits = np.stack([*clopper_pearson(k, n, tail), *wilson(k, n, tail)])
        limits[1::2] = 1.0 if side == "greater" else limits[1::2]
        limits[::2] = 0.0 if side == "less" else limits[::2]
        return limits

    with np.errstate(under="ignore"):
        columns = [np.exp(log_p), log_p, k / n, *by_case(intervals, k, n)]
        found = [float_or_array(column) for column in columns]
    return BinomialTest(**dict(zip(BinomialTest.__slots__, found, strict=True)))


def binomial_test_p(
    successes: ArrayLike, trials: ArrayLike, p0: ArrayLike = 0.5, alternative: Tail = "two-sided"
) -> Values:
    """The p of `binomial_test` alone: many at once without their intervals. `ValueError`: as there.

    >>> binomial_test_p([9, 10], 10).round(4).tolist()
    [0.0215, 0.002]
    """
    with np.errstate(under="ignore"):
        return float_or_array(np.exp(_log_p_of(_checked(successes, trials, p0), _known(alternative))))


def binomial_test_log_p(
    successes: ArrayLike, trials: ArrayLike, p0: ArrayLike = 0.5, alternative: Tail = "two-sided"
) -> Values:
    """Natural logarithm of the p of `binomial_test`, also where that is no double any more. `ValueError`: as there.

    >>> round(binomial_test_log_p(0, 10_000), 3)
    -6930.779
    """
    return float_or_array(_log_p_of(_checked(successes, trials, p0), _known(alternative)))


def _log_p_of(cases: tuple[FloatArray, FloatArray, FloatArray], side: Tail) -> LongArray:
    found: LongArray = by_case(lambda k, n, chance: _log_p(k, n, chance, side), *cases)
    return found


def _checked(successes: ArrayLike, trials: ArrayLike, p0: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    k, n, chance = together(
        successes=numbers(successes, "successes"), trials=numbers(trials, "trials"), p0=numbers(p0, "p0")
    )
    for name, counts in (("successes", k), ("trials", n)):
        if (counts != np.floor(counts)).any():
            raise ValueError(f"{name} must be whole numbers, not {counts[counts != np.floor(counts)][0]:g}")
    if ((n < 1.0) | (n > _MOST_TRIALS)).any():
        wrong = n[(n < 1.0) | (n > _MOST_TRIALS)][0]
        raise ValueError(f"trials must be at least 1 and at most {_MOST_TRIALS:g}, not {wrong:g}")
    if ((k < 0.0) | (k > n)).any():
        raise ValueError(f"successes must lie in 0..trials, not {k[(k < 0.0) | (k > n)][0]:g}")
    if ((chance < 0.0) | (chance > 1.0)).any():
        raise ValueError(f"p0 must lie in 0..1, not {chance[(chance < 0.0) | (chance > 1.0)][0]:g}")
    return k, n, chance


def _known(alternative: str) -> Tail:
    return cast("Tail", one_of(alternative, "alternative", get_args(Tail)))


def _log_p(k: FloatArray, n: FloatArray, chance: FloatArray, side: Tail) -> LongArray:
    """Log of p; where p0 is 0 or 1, only one outcome is possible."""
    counted = {"two-sided": np.equal, "greater": np.less_equal, "less": np.greater_equal}[side]
    log_p = np.where(counted(k, n * chance), 0, -np.inf).astype(np.longdouble)
    possible = (chance > 0.0) & (chance < 1.0)
    successes, trials, p = (case[possible].astype(np.longdouble) for case in (k, n, chance))
    match side:
        case "two-sided":
            log_p[possible] = _log_two_sided(successes, trials, p, 1 - p)
        case "greater":
            log_p[possible] = _log_upper(successes, trials, p, 1 - p)
        case "less":
            log_p[possible] = _log_upper(trials - successes, trials, 1 - p, p)
    return log_p


def _log_upper(k: LongArray, n: LongArray, p: LongArray, q: LongArray) -> LongArray:
    """Log of P(X >= k): the tail, or 1 less the other one if k is not beyond the mode."""
    beyond = k > np.floor((n + 1) * p)
    border = np.clip(np.where(beyond, k, n - k + 1), 1, n)
    chances = np.where(beyond, p, q), np.where(beyond, q, p)
    tail = log_pmf(border, n, *chances) + np.log(tail_over_pmf(border, n, *chances))
    with np.errstate(divide="ignore"):
        return np.select([k == 0, beyond], [0, tail], default=np.log1p(-np.exp(tail)))


_LIKELY = np.log(0.9)
"""Above this log p, 1 less what lies between the tails keeps the digits."""


def _log_two_sided(k: LongArray, n: LongArray, p: LongArray, q: LongArray) -> LongArray:
    """Log of both tails; next to p = 1, of 1 less what lies between. Counts above the mode are turned to failures."""
    mode = np.minimum(np.floor((n + 1) * p), n)
    above = k > mode
    k, mode = np.where(above, n - k, k), np.where(above, n - mode, mode)
    p, q = np.where(above, q, p), np.where(above, p, q)
    log_low = log_pmf(k, n, p, q)
    high, log_high = _other_border(
        log_low + np.log1p(np.longdouble(TIE)), np.clip(2 * mode - k, mode, n), (mode, n, p, q)
    )
    borders = np.clip(np.concatenate([n - k, high]), 1, np.tile(n, 2))
    over_pmf = tail_over_pmf(borders, np.tile(n, 2), np.concatenate([q, p]), np.concatenate([p, q]))
    lower, upper = np.concatenate([log_low, log_high]).reshape(2, -1) + np.log(over_pmf).reshape(2, -1)
    log_p: LongArray = np.where(high > n, lower, np.logaddexp(lower, upper))
    likely = log_p > _LIKELY
    if likely.any():
        between = log_between(*(case[likely] for case in (k, high, n, p, q)))
        log_p[likely] = 0 + np.log1p(-np.exp(between))
    return log_p


_LEAST_FALL = np.finfo(np.float64).tiny


def _other_border(
    limit: LongArray, start: LongArray, case: tuple[LongArray, LongArray, LongArray, LongArray]
) -> tuple[LongArray, LongArray]:
    """The outcome nearest to the mode, from there upwards, with log P <= `limit`, and its log P; n + 1 if none has.

    `case`: mode, n, p, q. Log P is concave and its slope from one outcome to the next has a closed form, so Newton's
    steps, cut to whole ones, never leave the counted outcomes once they are there, and end at the border.
    """
    mode, n, p, q = case
    at, before = start, None
    while before is None or (at != before).any():
        log_now = log_pmf(at, n, p, q)
        over, counted = log_now - limit, log_now <= limit
        outer = np.where(counted, at, at + 1)
        with np.errstate(divide="ignore", over="ignore"):
            fall = np.maximum(np.log(outer * q) - np.log((n - outer + 1) * p), _LEAST_FALL)
            steps = np.where(counted, -np.floor(-over / fall), np.maximum(np.ceil(over / fall), 1))
        at, before = np.clip(at + steps, mode, n), at
    return np.where(counted, at, n + 1), log_now


_CLOSE = 1e-5
"""With log P so near to its aim, the third power of which is left after a step."""


def clopper_pearson(k: FloatArray, n: FloatArray, tail: float) -> tuple[FloatArray, FloatArray]:
    """Limits with P(X >= k | low) = P(X <= k | high) = tail, for k of n, one axis; 0 for k = 0, 1 for k = n.

    Found by Halley's method, because scipy's beta quantiles can be wrong in the first digit (1000 of 1e9, scipy 1.17).
    Source: Clopper & Pearson 1934, Biometrika 26, 404.
    """
    low, high = np.zeros_like(k), np.ones_like(k)
    some, not_all = k > 0.0, k < n
    odds = _odds_of_tail(np.concatenate([k[some], (n - k)[not_all]]), np.concatenate([n[some], n[not_all]]), tail)
    of_successes, of_failures = np.split(odds, [int(some.sum())])
    low[some], high[not_all] = of_successes / (1.0 + of_successes), 1.0 / (1.0 + of_failures)
    return low, high


def _odds_of_tail(k: FloatArray, n: FloatArray, tail: float) -> FloatArray:
    """The odds p / q at which P(X >= k) is `tail`, k >= 1.

    In t = log odds, F = log P(X >= k) is concave, F' = k q P(k) / P(X >= k) and F'' = F' (k - n p - p - F'). Steps
    begin at Wilson's limit of half a success less.
    """
    start = wilson(k - 0.5, n, tail)[0]
    odds = (start / (1.0 - start)).astype(np.longdouble)
    successes, trials = k.astype(np.longdouble), n.astype(np.longdouble)
    missing = np.ones_like(odds)
    while (np.abs(missing) > _CLOSE).any():
        q = 1 / (1 + odds)
        p = odds * q
        sum_over_first = tail_over_pmf(successes, trials, p, q)
        missing = np.log(np.longdouble(tail)) - log_pmf(successes, trials, p, q) - np.log(sum_over_first)
        slope = successes * q / sum_over_first
        newton = missing / slope
        odds = odds * np.exp(newton / np.clip(1 + newton * (successes - trials * p - p - slope) / 2, 0.5, 2))
    return odds.astype(np.float64)


def wilson(k: FloatArray, n: FloatArray, tail: float) -> tuple[FloatArray, FloatArray]:
    """The p with |k / n - p| = z sqrt(p (1 - p) / n), z the normal quantile of `tail`.

    These are the roots of (n + z^2) p^2 - (2 k + z^2) p + k^2 / n = 0; the lower is taken from the product of the two,
    where nothing cancels. Source: Wilson 1927, J. Am. Stat. Assoc. 22, 209.
    """
    z = -NormalDist().inv_cdf(tail)
    upper = k + z * z / 2.0 + z * np.sqrt(k * (n - k) / n + z * z / 4.0)
    return k * (k / n) / upper, np.where(k == n, 1.0, upper / (n + z * z))
