"""The exact binomial test and the Clopper-Pearson interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special, stats

from analysis.arrays import FloatArray, Values, numbers, plain, share

TIE = 1e-7
"""Outcomes within this relative distance of the observed one's probability count as equally likely (R's rule)."""

_UNDERFLOW = 1e-290


@dataclass(frozen=True, slots=True, kw_only=True)
class BinomialTest:
    """Two-sided exact test of a proportion; `log_p` is the natural logarithm, good where `p` underflows to 0."""

    p: Values
    log_p: Values
    estimate: Values
    ci_low: Values
    ci_high: Values


def binomial_test(
    successes: ArrayLike, trials: ArrayLike, p0: ArrayLike = 0.5, confidence: float = 0.95
) -> BinomialTest:
    """Is the chance of success `p0`? p = sum of P(i) over all outcomes i with P(i) <= P(successes) (1 + 1e-7).

    The tolerance makes ties of rounding count as ties, as R's `binom.test` does. The interval is Clopper-Pearson's.
    `successes, trials, p0` broadcast. `ValueError`: counts that are not whole, successes outside 0..trials,
    trials below 1, p0 outside 0..1.
    Sources: Sterne 1954, Biometrika 41, 275; Clopper & Pearson 1934, Biometrika 26, 404.

    >>> round(binomial_test(78, 140).p, 3)
    0.205
    """
    k, n, chance = _checked(successes, trials, p0)
    tail = (1.0 - share(confidence, "confidence")) / 2.0
    low, high = _least_likely(k, n, chance)
    p = np.minimum(_lower_tail(low, n, chance) + _upper_tail(high, n, chance), 1.0)
    return BinomialTest(
        p=plain(p),
        log_p=plain(_log_p(p, (low, high), n, chance)),
        estimate=plain(k / n),
        ci_low=plain(_clopper_pearson_low(k, n, tail)),
        ci_high=plain(_clopper_pearson_high(k, n, tail)),
    )


def _checked(successes: ArrayLike, trials: ArrayLike, p0: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    k, n, chance = np.broadcast_arrays(numbers(successes, "successes"), numbers(trials, "trials"), numbers(p0, "p0"))
    if (k != np.floor(k)).any() or (n != np.floor(n)).any():
        raise ValueError("successes and trials must be whole numbers")
    if (n < 1.0).any():
        raise ValueError(f"trials must be at least 1, not {n.min():g}")
    if ((k < 0.0) | (k > n)).any():
        raise ValueError(f"successes must lie in 0..trials, not {k[(k < 0.0) | (k > n)][0]:g}")
    if ((chance < 0.0) | (chance > 1.0)).any():
        raise ValueError(f"p0 must lie in 0..1, not {chance[(chance < 0.0) | (chance > 1.0)][0]:g}")
    return k, n, chance


def _log_pmf(k: FloatArray, n: FloatArray, chance: FloatArray) -> FloatArray:
    """Log of P(k); -inf outside 0..n. Log gammas, which cost digits at 1e9, only where P itself underflows."""
    inside = np.clip(k, 0.0, n)
    with np.errstate(all="ignore"):
        pmf = np.asarray(stats.binom.pmf(inside, n, chance))
        ways = special.gammaln(n + 1.0) - special.gammaln(inside + 1.0) - special.gammaln(n - inside + 1.0)
        far = ways + special.xlogy(inside, chance) + special.xlog1py(n - inside, -chance)
        value = np.where(pmf > _UNDERFLOW, np.log(pmf), far)
    return np.where(k == inside, value, -np.inf)


def _least_likely(k: FloatArray, n: FloatArray, chance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The outcomes counted: all up to `low` (-1: none) and all from `high` (n + 1: none).

    The probabilities rise up to the mode and fall after it, so the other side is found by halving; the border of
    the observed side is `k`, which the tolerance must not move.
    """
    mode = np.minimum(np.floor((n + 1.0) * chance), n)
    limit = _log_pmf(k, n, chance) + np.log1p(TIE)
    low = _border(np.full_like(mode, -1.0), mode, limit, n, chance)
    high = _border(n + 1.0, mode, limit, n, chance)
    return np.where(k <= mode, k, low), np.where(k >= mode, k, high)


def _border(outer: FloatArray, mode: FloatArray, limit: FloatArray, n: FloatArray, chance: FloatArray) -> FloatArray:
    """Between `outer` (counted) and the mode: the counted outcome nearest to the mode."""
    counted, other = outer, mode + np.sign(mode - outer)
    while (np.abs(other - counted) > 1.0).any():
        middle = np.trunc((counted + other) / 2.0)
        rare = _log_pmf(middle, n, chance) <= limit
        counted, other = np.where(rare, middle, counted), np.where(rare, other, middle)
    return counted


def _lower_tail(low: FloatArray, n: FloatArray, chance: FloatArray) -> FloatArray:
    """P(X <= low)."""
    inside = np.clip(low, 0.0, n - 1.0)
    value = special.betaincc(inside + 1.0, n - inside, chance)
    return np.select([low < 0.0, low >= n], [0.0, 1.0], default=value)


def _upper_tail(high: FloatArray, n: FloatArray, chance: FloatArray) -> FloatArray:
    """P(X >= high)."""
    inside = np.clip(high, 1.0, n)
    value = special.betainc(inside, n - inside + 1.0, chance)
    return np.select([high > n, high <= 0.0], [0.0, 1.0], default=value)


def _log_p(p: FloatArray, border: tuple[FloatArray, FloatArray], n: FloatArray, chance: FloatArray) -> FloatArray:
    low, high = border
    tiny: NDArray[np.bool_] = p < _UNDERFLOW
    with np.errstate(divide="ignore"):
        log_p = np.log(p)
    if not tiny.any():
        return log_p
    tails = np.logaddexp(_log_tail(low, -1.0, n, chance), _log_tail(high, 1.0, n, chance))
    return np.where(tiny, tails, log_p)


def _log_tail(border: FloatArray, step: float, n: FloatArray, chance: FloatArray) -> FloatArray:
    """Log of the sum of P outwards from `border`, term over term, until no term adds a digit."""
    inside = np.clip(border, 0.0, n)
    odds = np.divide(chance, 1.0 - chance, out=np.zeros_like(chance), where=(chance > 0.0) & (chance < 1.0))
    term, total, i = np.ones_like(inside), np.ones_like(inside), inside
    while (term > 1e-17 * total).any():
        ratio = (n - i) / (i + 1.0) * odds if step > 0.0 else i / ((n - i + 1.0) * np.maximum(odds, 1e-300))
        term = term * np.minimum(ratio, 1.0)
        total, i = total + term, np.clip(i + step, 0.0, n)
    return _log_pmf(border, n, chance) + np.log(total)


def _clopper_pearson_low(k: FloatArray, n: FloatArray, tail: float) -> FloatArray:
    inner = special.betaincinv(np.maximum(k, 1.0), n - np.maximum(k, 1.0) + 1.0, tail)
    return np.select([k == 0.0, k == n], [0.0, np.exp(np.log(tail) / n)], default=inner)


def _clopper_pearson_high(k: FloatArray, n: FloatArray, tail: float) -> FloatArray:
    inner = special.betainccinv(np.minimum(k, n - 1.0) + 1.0, n - np.minimum(k, n - 1.0), tail)
    return np.select([k == n, k == 0.0], [1.0, -np.expm1(np.log(tail) / n)], default=inner)
