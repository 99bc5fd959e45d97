"""The exact binomial test of a proportion, with its Clopper-Pearson and Wilson intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from analysis.stats.arrays import FloatArray, Values, numbers, plain, share
from analysis.stats.binomial_tails import LongArray, log_between, log_pmf, log_tail
from analysis.stats.intervals import clopper_pearson, wilson

TIE = 1e-7
"""Outcomes within this relative distance of the observed one's probability count as equally likely (R's rule)."""

MOST_TRIALS = 1e10
"""The sums take time with the square root of the trials: beyond this, seconds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BinomialTest:
    """Two-sided exact test of a proportion; `log_p` is the natural logarithm, good where `p` underflows to 0.

    `ci_low, ci_high` are Clopper and Pearson's limits, `wilson_low, wilson_high` Wilson's.
    """

    p: Values
    log_p: Values
    estimate: Values
    ci_low: Values
    ci_high: Values
    wilson_low: Values
    wilson_high: Values


def binomial_test(
    successes: ArrayLike, trials: ArrayLike, p0: ArrayLike = 0.5, confidence: float = 0.95
) -> BinomialTest:
    """Is the chance of success `p0`? p = sum of P(i) over all outcomes i with P(i) <= P(successes) (1 + 1e-7).

    The tolerance makes ties of rounding count as ties, as R's `binom.test` and scipy do. It concerns the other side of
    the mode alone: on its own side the observed count is the border. It shows where neighbours differ by less than it:
    0 of 1e9 at p0 = 1e-9 has p = 1, with strict comparison 0.632.
    `successes, trials, p0` broadcast; equal cases are worked out once. `ValueError`: counts that are not whole,
    successes outside 0..trials, trials outside 1..1e10, p0 outside 0..1.
    Source: Sterne 1954, Biometrika 41, 275.

    >>> round(binomial_test(78, 140).p, 3)
    0.205
    """
    k, n, chance = _checked(successes, trials, p0)
    tail = (1.0 - share(confidence, "confidence")) / 2.0
    cases, where = np.unique(np.stack([k.ravel(), n.ravel(), chance.ravel()]), axis=1, return_inverse=True)
    log_p = _log_p(*cases.astype(np.longdouble))
    columns = [np.exp(log_p), log_p, cases[0] / cases[1]]
    columns += [*clopper_pearson(cases[0], cases[1], tail), *wilson(cases[0], cases[1], tail)]
    with np.errstate(under="ignore"):
        found = [plain(column.astype(np.float64)[where.ravel()].reshape(k.shape)) for column in columns]
    p, log, estimate, ci_low, ci_high, wilson_low, wilson_high = found
    return BinomialTest(
        p=p,
        log_p=log,
        estimate=estimate,
        ci_low=ci_low,
        ci_high=ci_high,
        wilson_low=wilson_low,
        wilson_high=wilson_high,
    )


def _checked(successes: ArrayLike, trials: ArrayLike, p0: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    k, n, chance = np.broadcast_arrays(numbers(successes, "successes"), numbers(trials, "trials"), numbers(p0, "p0"))
    if (k != np.floor(k)).any() or (n != np.floor(n)).any():
        raise ValueError("successes and trials must be whole numbers")
    if ((n < 1.0) | (n > MOST_TRIALS)).any():
        wrong = n[(n < 1.0) | (n > MOST_TRIALS)][0]
        raise ValueError(f"trials must be at least 1 and at most {MOST_TRIALS:g}, not {wrong:g}")
    if ((k < 0.0) | (k > n)).any():
        raise ValueError(f"successes must lie in 0..trials, not {k[(k < 0.0) | (k > n)][0]:g}")
    if ((chance < 0.0) | (chance > 1.0)).any():
        raise ValueError(f"p0 must lie in 0..1, not {chance[(chance < 0.0) | (chance > 1.0)][0]:g}")
    return k, n, chance


def _log_p(k: LongArray, n: LongArray, chance: LongArray) -> LongArray:
    """Log of p; where p0 is 0 or 1, only one outcome is possible."""
    possible = (chance > 0) & (chance < 1)
    log_p = np.where(k == n * chance, 0, -np.inf).astype(np.longdouble)
    log_p[possible] = _log_two_sided(k[possible], n[possible], chance[possible])
    return log_p


def _log_two_sided(k: LongArray, n: LongArray, chance: LongArray) -> LongArray:
    """Log of both tails; where they are more than a half, of 1 less what lies between, which keeps the digits there."""
    low, high = _least_likely(k, n, chance)
    tails = np.full((2, len(k)), -np.inf, dtype=np.longdouble)
    for tail, border, step, there in zip(tails, (low, high), (-1, 1), (low >= 0, high <= n), strict=True):
        tail[there] = log_tail(border[there], step, n[there], chance[there])
    log_p: LongArray = np.logaddexp(tails[0], tails[1])
    likely = log_p > -np.log(2)
    between = log_between(low[likely], high[likely], n[likely], chance[likely])
    log_p[likely] = 0 + np.log1p(-np.exp(between))
    return log_p


def _least_likely(k: LongArray, n: LongArray, chance: LongArray) -> tuple[LongArray, LongArray]:
    """The outcomes counted: all up to `low` (-1: none) and all from `high` (n + 1: none).

    The probabilities rise up to the mode and fall after it, so the other side's border is found by halving.
    """
    mode = np.minimum(np.floor((n + 1) * chance), n)
    limit = log_pmf(k, n, chance) + np.log1p(np.longdouble(TIE))
    other = _border(np.where(k <= mode, n + 1, -1), mode, limit, n, chance)
    return np.where(k <= mode, k, other), np.where(k >= mode, k, other)


def _border(outer: LongArray, mode: LongArray, limit: LongArray, n: LongArray, chance: LongArray) -> LongArray:
    """Between `outer` (counted) and the mode: the counted outcome nearest to the mode."""
    counted, other = outer, mode + np.sign(mode - outer)
    while (np.abs(other - counted) > 1).any():
        middle = np.trunc((counted + other) / 2)
        rare = log_pmf(np.clip(middle, 0, n), n, chance) <= limit
        apart = np.abs(other - counted) > 1
        counted, other = np.where(rare & apart, middle, counted), np.where(apart & ~rare, middle, other)
    return counted
