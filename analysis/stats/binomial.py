"""The exact binomial test of a proportion, its tails in long doubles, its intervals; sensitivity d′ and criterion c.

A probability of 1e-300 is the exponential of -690: 13 digits of it take 16 digits of the exponent, which doubles do not
have and the 64 bits of an x86 long double do. Where long doubles are doubles, three digits fewer hold.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from analysis.stats.arrays import FloatArray, Values, float_or_array, numbers, share

LongArray = NDArray[np.longdouble]

_PI = np.longdouble("3.14159265358979323846264338327950288")
_SMALL = 16
_STIRLING = [(1, 12), (-1, 360), (1, 1260), (-1, 1680), (1, 1188), (-691, 360360), (1, 156), (-3617, 122400)]
"""Coefficients of 1/x, 1/x^3, ... in log x! - [log(2 pi x) / 2 + x log x - x]; enough from x = 16 on."""

_NEGLIGIBLE = 1e-21
_FIRST_TERMS, _MOST_TERMS = 32, 4096


def _small_stirling_errors() -> LongArray:
    x = np.arange(1, _SMALL, dtype=np.longdouble)
    factorials = np.array([np.longdouble(factorial(i)) for i in range(1, _SMALL)])
    errors = np.log(factorials) - (np.log(2 * _PI * x) / 2 + x * np.log(x) - x)
    return np.concatenate([[np.longdouble(0)], errors])


_SMALL_ERRORS = _small_stirling_errors()


def log_pmf(k: LongArray, n: LongArray, chance: LongArray) -> LongArray:
    """Log of P(X = k) for X from n trials with 0 < chance < 1 and 0 <= k <= n, by the saddle point.

    log P = log[n / (2 pi k (n - k))] / 2 + e(n) - e(k) - e(n - k) - D(k, n chance) - D(n - k, n (1 - chance)), with
    Stirling's error e and the deviance D(x, m) = x log(x / m) + m - x. No large terms cancel, unlike in log gammas.
    Source: Loader 2000, Fast and accurate computation of binomial probabilities.
    """
    size = np.maximum(n, 2)
    x = np.clip(k, 1, size - 1)
    y = size - x
    deviance = _deviance(x, size * chance) + _deviance(y, size * (1 - chance))
    stirling = _stirling_error(size) - _stirling_error(x) - _stirling_error(y)
    inside = np.log(size / (2 * _PI * x * y)) / 2 + stirling - deviance
    return np.select([k == 0, k == n], [n * np.log1p(-chance), n * np.log(chance)], default=inside)


def log_tail(border: LongArray, step: int, n: LongArray, chance: LongArray) -> LongArray:
    """Log of P(X >= border) for step 1, of P(X <= border) for step -1; `border` must lie on that side of the mode."""
    return log_pmf(border, n, chance) + np.log(_relative_sum(border, step, np.full_like(n, np.inf), n, chance))


def log_between(low: LongArray, high: LongArray, n: LongArray, chance: LongArray) -> LongArray:
    """Log of P(low < X < high), -inf if nothing lies between; for up to some 1e5 values in between."""
    count = high - low - 1
    start = np.clip(low + 1, 0, n)
    total = log_pmf(start, n, chance) + np.log(_relative_sum(start, 1, np.maximum(count, 1), n, chance))
    return np.where(count < 1, -np.inf, total)


def _stirling_error(x: LongArray) -> LongArray:
    large = np.maximum(x, _SMALL)
    series = np.zeros_like(large)
    for numerator, denominator in reversed(_STIRLING):
        series = series / (large * large) + np.longdouble(numerator) / denominator
    table: LongArray = _SMALL_ERRORS[np.minimum(x, _SMALL - 1).astype(np.intp)]
    return np.where(x < _SMALL, table, series / large)


def _deviance(x: LongArray, m: LongArray) -> LongArray:
    """D(x, m) for x >= 1; near m as (x - m) v + 2 x (v^3 / 3 + v^5 / 5 + ...) with v = (x - m) / (x + m)."""
    v = (x - m) / (x + m)
    near = np.abs(v) < 0.1
    square = np.where(near, v * v, 0)
    series = np.zeros_like(v)
    for power in range(25, 1, -2):
        series = square * series + np.longdouble(1) / power
    close = (x - m) * v + 2 * x * v * square * series
    return np.where(near, close, x * np.log(x / m) + m - x)


def _relative_sum(start: LongArray, step: int, count: LongArray, n: LongArray, chance: LongArray) -> LongArray:
    """Sum of P(start + j step) / P(start) over j from 0 to count - 1, until no term adds a digit; one axis."""
    total, term, place, left = np.ones_like(start), np.ones_like(start), start.copy(), count - 1
    odds = chance / (1 - chance)
    active, terms = np.flatnonzero(left > 0), _FIRST_TERMS
    while active.size:
        ratios = _ratios(place[active], step, terms, n[active], odds[active])
        ratios[np.arange(terms) >= left[active, None]] = 0
        new = np.cumprod(ratios, axis=1) * term[active, None]
        total[active] += new.sum(axis=1)
        term[active] = new[:, -1]
        place[active] += step * terms
        left[active] -= terms
        active = active[term[active] > _NEGLIGIBLE * total[active]]
        terms = min(2 * terms, _MOST_TERMS)
    return total


def _ratios(place: LongArray, step: int, terms: int, n: LongArray, odds: LongArray) -> LongArray:
    """P(i + step) / P(i) for the next `terms` values i from `place` on; 0 beyond the ends."""
    i = np.clip(place[:, None] + step * np.arange(terms), 0, n[:, None])
    rest = n[:, None] - i
    ratios: LongArray = rest / (i + 1) * odds[:, None] if step > 0 else i / ((rest + 1) * odds[:, None])
    return ratios


_CLOSE = 1e-9
"""A step of Newton's so small leaves an error of its square."""


def clopper_pearson(k: FloatArray, n: FloatArray, tail: float) -> tuple[FloatArray, FloatArray]:
    """Limits with P(X >= k | low) = P(X <= k | high) = tail, for k of n, one axis; 0 for k = 0, 1 for k = n.

    Found by Newton's method, because scipy's beta quantiles can be wrong in the first digit (1000 of 1e9, scipy 1.17).
    Source: Clopper & Pearson 1934, Biometrika 26, 404.
    """
    successes, trials = k.astype(np.longdouble), n.astype(np.longdouble)
    low, high = np.zeros_like(k), np.ones_like(k)
    some, not_all = k > 0.0, k < n
    low[some] = _limit(successes[some], trials[some], tail, 1)
    high[not_all] = _limit(successes[not_all], trials[not_all], tail, -1)
    return low, high


def _limit(k: LongArray, n: LongArray, tail: float, step: int) -> FloatArray:
    """The p at which P(X >= k) (step 1) or P(X <= k) (step -1) is `tail`.

    The logarithm of either is concave in t = log(p / (1 - p)), so Newton's steps converge from where it is a half. Its
    slope in t is k (1 - p) P(k) / P(X >= k), or -(n - k) p P(k) / P(X <= k).
    """
    odds = (k + 0.5) / (n - k + 0.5)
    change = np.ones_like(odds)
    while (np.abs(change) > _CLOSE).any():
        p = odds / (1 + odds)
        log_now = log_tail(k, step, n, p)
        falling = np.exp(log_pmf(k, n, p) - log_now)
        slope = k * (1 - p) * falling if step > 0 else -(n - k) * p * falling
        change = (np.log(np.longdouble(tail)) - log_now) / slope
        odds = odds * np.exp(change)
    limit: LongArray = odds / (1 + odds)
    return limit.astype(np.float64)


def wilson(k: FloatArray, n: FloatArray, tail: float) -> tuple[FloatArray, FloatArray]:
    """The p with |k / n - p| = z sqrt(p (1 - p) / n), z the normal quantile of `tail`.

    These are the roots of (n + z^2) p^2 - (2 k + z^2) p + k^2 / n = 0; the lower is taken from the product of the two,
    where nothing cancels. Source: Wilson 1927, J. Am. Stat. Assoc. 22, 209.
    """
    z = -float(special.ndtri(tail))
    upper = k + z * z / 2.0 + z * np.sqrt(k * (n - k) / n + z * z / 4.0)
    return k * (k / n) / upper, np.where(k == n, 1.0, upper / (n + z * z))


TIE = 1e-7
"""Outcomes within this relative distance of the observed one's probability count as equally likely (R's rule)."""

_MOST_TRIALS = 1e10
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
        found = [float_or_array(column.astype(np.float64)[where.ravel()].reshape(k.shape)) for column in columns]
    return BinomialTest(**dict(zip(BinomialTest.__slots__, found, strict=True)))


def _checked(successes: ArrayLike, trials: ArrayLike, p0: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    k, n, chance = np.broadcast_arrays(numbers(successes, "successes"), numbers(trials, "trials"), numbers(p0, "p0"))
    if (k != np.floor(k)).any() or (n != np.floor(n)).any():
        raise ValueError("successes and trials must be whole numbers")
    if ((n < 1.0) | (n > _MOST_TRIALS)).any():
        wrong = n[(n < 1.0) | (n > _MOST_TRIALS)][0]
        raise ValueError(f"trials must be at least 1 and at most {_MOST_TRIALS:g}, not {wrong:g}")
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection:
    """d' and criterion with the corrected rates they come from. A criterion below 0 leans towards "yes"."""

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
    hit_rate, z_hit = _rate_and_z(hits, signal_trials, "hits")
    false_alarm_rate, z_false_alarm = _rate_and_z(false_alarms, noise_trials, "false_alarms")
    return Detection(
        d_prime=float_or_array(z_hit - z_false_alarm),
        criterion=float_or_array(-(z_hit + z_false_alarm) / 2.0),
        hit_rate=float_or_array(hit_rate),
        false_alarm_rate=float_or_array(false_alarm_rate),
    )


def _rate_and_z(count: ArrayLike, trials: ArrayLike, name: str) -> tuple[FloatArray, FloatArray]:
    """The corrected rate and its normal quantile, taken from the nearer end so that 0 and all mirror exactly."""
    counts, totals = np.broadcast_arrays(numbers(count, name), numbers(trials, f"trials of {name}"))
    if (totals < 1.0).any():
        raise ValueError(f"{name}: there must be at least 1 trial")
    if ((counts < 0.0) | (counts > totals)).any():
        raise ValueError(f"{name} must lie in 0..trials, not {counts[(counts < 0.0) | (counts > totals)][0]:g}")
    if (counts != np.floor(counts)).any() or (totals != np.floor(totals)).any():
        raise ValueError(f"{name} and their trials must be whole numbers, counts and not rates")
    rest = totals - counts
    z = special.ndtri((np.minimum(counts, rest) + 0.5) / (totals + 1.0))
    return (counts + 0.5) / (totals + 1.0), np.where(counts > rest, -z, z)
