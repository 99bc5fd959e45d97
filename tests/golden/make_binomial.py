"""Remakes binomial.json: references of 25 digits for the binomial test, from mpmath alone.

.venv/bin/python -m tests.golden.make_binomial [FILE]

Probabilities are summed term by term at 60 digits; which outcomes count is decided on them, P(i) <= P(k) (1 + 1e-7);
the limits are roots of the summed tails. About a minute.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

from mpmath import mp, mpf

mp.dps = 60

FILE = Path(__file__).with_name("binomial.json")
THIRD, NEAR_HALF = 1 / 3, 0.48
CASES = [
    *[(k, 20, p0) for k in (0, 1, 7, 13, 20) for p0 in (0.5, THIRD, 0.9)],
    *[(k, 140, p0) for k in (0, 1, 67, 70, 78, 139, 140) for p0 in (0.5, THIRD, NEAR_HALF)],
    *[(k, 10, p0) for k in (0, 1, 9, 10) for p0 in (0.0, 1.0, 1e-300, 1 - 2**-53)],
    *[(2, 10, 1e-300), (10, 10, 5e-324), (1, 1, 0.5), (0, 1, 0.25), (1, 2, 0.5), (2, 3, 0.7)],
    *[(k, 1000, p0) for k in (0, 3, 300, 500, 507, 999, 1000) for p0 in (0.5, 0.3, 0.001)],
    *[(7000, 10_000, 0.5), (9990, 10_000, 0.9), (6_850, 10_000, 0.5), (1, 10_000, 0.5)],
    *[(k, 10**6, 0.5) for k in (0, 1, 480_000, 481_500, 499_000, 499_999, 500_100, 502_000, 518_000, 10**6)],
    *[(k, 10**6, 0.3) for k in (280_000, 283_500, 299_500, 300_001, 301_000, 315_000, 500_000)],
    *[(k, 10**6, 1e-6) for k in (0, 1, 2, 5, 50, 160)],
    *[(k, 10**9, 0.5) for k in (1, 499_500_000, 499_999_990, 500_030_000, 500_500_000, 501_000_000)],
    *[(k, 10**9, 0.3) for k in (299_600_000, 300_010_000)],
    *[(k, 10**9, 1e-9) for k in (0, 1, 3, 20, 150)],
]
INTERVALS = [(0, 20), (1, 20), (20, 20), (78, 140), (999, 1000), (500, 1000), (0, 10**6), (1, 10**6), (5, 10**6)]
INTERVALS += [(1000, 10**6), (10**6 - 1, 10**6), (0, 10**9), (1, 10**9), (2, 10**9), (1000, 10**9), (10**9, 10**9)]


def log_pmf(k: int, n: int, p: mpf) -> mpf:
    ways = mp.loggamma(n + 1) - mp.loggamma(k + 1) - mp.loggamma(n - k + 1)
    return ways + (k * mp.log(p) if k else 0) + ((n - k) * mp.log1p(-p) if n - k else 0)


def log_tail(border: int, step: int, n: int, p: mpf) -> mpf:
    """Log of the sum of P(i) from `border` outwards."""
    term = total = mpf(1)
    odds, i = p / (1 - p), border
    while 0 <= i <= n and term > total * mpf(10) ** -40:
        term *= (n - i) * odds / (i + 1) if step > 0 else i / ((n - i + 1) * odds)
        total += term
        i += step
    return log_pmf(border, n, p) + mp.log(total)


def other_border(k: int, mode: int, n: int, p: mpf) -> int:
    """The outcome nearest to the mode, on the side where k is not, that counts; -1 or n + 1 if none does."""
    limit = log_pmf(k, n, p) + mp.log1p(mpf(1) / 10**7)
    step = 1 if k < mode else -1
    counted, other = (n + 1, mode - 1) if step > 0 else (-1, mode + 1)
    while abs(counted - other) > 1:
        middle = (counted + other) // 2
        if log_pmf(middle, n, p) <= limit:
            counted = middle
        else:
            other = middle
    return counted


def log_p(k: int, n: int, p0: float) -> mpf:
    p = mpf(p0)
    if p0 in {0.0, 1.0}:
        return mpf(0) if k == n * p0 else -mp.inf
    mode = min(int(mp.floor((n + 1) * p)), n)
    if k == mode:
        return mpf(0)
    other = other_border(k, mode, n, p)
    low, high = (k, other) if k < mode else (other, k)
    if high - low <= 1:
        return mpf(0)
    tails = [log_tail(low, -1, n, p)] if low >= 0 else []
    tails += [log_tail(high, 1, n, p)] if high <= n else []
    largest = max(tails)
    return largest + mp.log(sum(mp.exp(tail - largest) for tail in tails))


def log_greater(k: int, n: int, p0: float) -> mpf:
    """Log of P(X >= k)."""
    p = mpf(p0)
    if p0 in {0.0, 1.0}:
        return mpf(0) if k <= n * p0 else -mp.inf
    if k > (n + 1) * p:
        return log_tail(k, 1, n, p)
    return mp.log1p(-mp.exp(log_tail(k - 1, -1, n, p))) if k else mpf(0)


def log_less(k: int, n: int, p0: float) -> mpf:
    """Log of P(X <= k)."""
    p = mpf(p0)
    if p0 in {0.0, 1.0}:
        return mpf(0) if k >= n * p0 else -mp.inf
    if k < (n + 1) * p - 1:
        return log_tail(k, -1, n, p)
    return mp.log1p(-mp.exp(log_tail(k + 1, 1, n, p))) if k < n else mpf(0)


def clopper_pearson(k: int, n: int) -> tuple[mpf, mpf]:
    """The limits at 95 %: where the tail, which grows away from k / n towards it, is 0.025; by halving the logit."""
    low = mpf(0) if k == 0 else _root(lambda p: log_tail(k, 1, n, p), mpf(-60), _logit(k, n))
    high = mpf(1) if k == n else _root(lambda p: log_tail(k, -1, n, p), mpf(60), _logit(k, n))
    return low, high


def _logit(k: int, n: int) -> mpf:
    return mp.log(mpf(2 * k + 1) / (2 * (n - k) + 1))


def _root(log_of_tail: Callable[[mpf], mpf], below: mpf, above: mpf) -> mpf:
    target = mp.log(mpf("0.025"))
    for _ in range(130):
        middle = (below + above) / 2
        if log_of_tail(1 / (1 + mp.exp(-middle))) < target:
            below = middle
        else:
            above = middle
    return 1 / (1 + mp.exp(-below))


def wilson(k: int, n: int) -> tuple[mpf, mpf]:
    z = mp.sqrt(2) * mp.erfinv(mpf("0.95"))
    half = z * mp.sqrt(mpf(k) * (n - k) / n + z * z / 4)
    return (k + z * z / 2 - half) / (n + z * z), (k + z * z / 2 + half) / (n + z * z)


def _text(value: mpf) -> str:
    return mp.nstr(value, 25, min_fixed=0, max_fixed=0)


def main(path: Path) -> None:
    tests = []
    for k, n, p0 in CASES:
        log = log_p(k, n, p0)
        sides = {"log_greater": _text(log_greater(k, n, p0)), "log_less": _text(log_less(k, n, p0))}
        tests.append({"k": k, "n": n, "p0": p0, "p": _text(mp.exp(log)), "log_p": _text(log), **sides})
    limits = []
    for k, n in INTERVALS:
        names = ("ci_low", "ci_high", "wilson_low", "wilson_high")
        values = map(_text, (*clopper_pearson(k, n), *wilson(k, n)))
        limits.append({"k": k, "n": n, **dict(zip(names, values, strict=True))})
    content = {
        "source": "mpmath, 60 digits, by tests/golden/make_binomial.py",
        "rule": "P(i) <= P(k) (1 + 1e-7)",
        "tests": tests,
        "intervals": limits,
    }
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FILE)
