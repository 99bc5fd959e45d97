"""Makes studentized_range.json: tails of the studentized range to 17 digits, by mpmath, in about a quarter of an hour.

Run from the project's root: `.venv/bin/python -m tests.golden.make_studentized_range`; `... --check` only holds
it against closed forms for k = 2 and 3.

P(Q > q) is the plain double integral over the scale s and the largest value z, in 25 digits, with none of the float
code's transformations, tables or ranges. Both sums start near the peak and walk outwards until three terms in a row are
below 1e-22 of the sum. Each value is taken on two lattices of different steps, and kept only if they agree to 1e-17.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from mpmath import betainc, erf, erfc, exp, expm1, gammainc, inf, log, log1p, loggamma, mp, mpf, pi, sqrt

DIGITS = 25
TARGET = Path(__file__).with_name("studentized_range.json")
AGREEMENT = mpf(10) ** -17
NEGLIGIBLE = mpf(10) ** -22
NEGLIGIBLE_TERMS = 3
STEPS = (mpf(1), mpf("0.83"))  # two lattices with no point in common but the first

TYPICAL_RANGE = {2: 1.13, 3: 1.69, 4: 2.06, 5: 2.33, 10: 3.08, 20: 3.73}  # mean range of k normals: where p is near 1/2
DEGREES = (2, 3, 5, 10, 26, 100, 1e3, 1e4, 1e5, float("inf"))
SHARES = (0.3, 0.6, 1.0, 1.8)
TAILS = (1e-4, 1e-8, 1e-20, 1e-60, 1e-150, 1e-298)
BEYOND = (  # outside the promise, and where only the logarithm is a double
    (3, 0.5, 4.0),
    (3, 0.5, 1e9),
    (4, 1, 3.0),
    (4, 1, 1e30),
    (100, 10, 5.0),
    (100, 10, 60.0),
    (3, 1e7, 6.0),
    (3, 1e7, 40.0),
    (3, 26, 1e30),
    (5, float("inf"), 1e3),
    (5, 1e5, 1e3),
)


def outward(term: Callable[[mpf], mpf], start: mpf, step: mpf) -> mpf:
    """The trapezoidal sum of `term` from `start` both ways, until it has become negligible."""
    total = term(start)
    for sign in (1, -1):
        small, i = 0, 0
        while small < NEGLIGIBLE_TERMS:
            i += 1
            value = term(start + sign * i * step)
            total += value
            small = small + 1 if value <= NEGLIGIBLE * total else 0
    return total * step


class Range:
    """P(range of k normals > w) = k ∫ φ(z) [Φ(z)^(k-1) - (Φ(z) - Φ(z-w))^(k-1)] dz, z the largest value."""

    def __init__(self, k: int, fineness: mpf) -> None:
        self.k, self.step = k, fineness * mpf("0.55") / sqrt(k)
        self.root_2, self.root_2pi = sqrt(2), sqrt(2 * pi)
        self.normal: dict[int, tuple[mpf, mpf]] = {}

    def below(self, z: mpf) -> mpf:
        """Φ."""
        return erfc(-z / self.root_2) / 2

    def at(self, z: mpf) -> tuple[mpf, mpf]:
        """φ and Φ at a point of the lattice."""
        i = int(mp.nint(z / self.step))
        if i not in self.normal:
            self.normal[i] = (exp(-(z**2) / 2) / self.root_2pi, self.below(z))
        return self.normal[i]

    def sf(self, w: mpf) -> mpf:
        def term(z: mpf) -> mpf:
            density, below = self.at(z)
            far = self.below(z - w)
            total, power = mpf(1), mpf(1)  # (a^m - (a-b)^m) / b, a sum of positive terms
            for _ in range(self.k - 2):
                power *= below
                total = total * (below - far) + power
            return density * far * total

        start = self.step * mp.nint(w / 2 / self.step)
        return self.k * outward(term, start, self.step)


def studentized_sf(k: int, df: float, q: mpf, fineness: mpf) -> mpf:
    """P(Q > q) = ∫ f(s) P(range > q s) ds over x = log s, f the density of sqrt(chi2_df / df)."""
    inner = Range(k, fineness)
    if df == inf:
        return inner.sf(q)
    df = mpf(df)
    constant = log(2) + df / 2 * log(df / 2) - loggamma(df / 2)

    def term(x: mpf) -> mpf:
        return exp(constant + df * x - df / 2 * exp(2 * x)) * inner.sf(q * exp(x))

    step = fineness * min(mpf("0.5") / sqrt(2 * df), mpf("0.055"))
    return outward(term, -log1p(q**2 / (2 * df)) / 2, step)


def value(k: int, df: float, q: float) -> mpf:
    """P(Q > q), `ArithmeticError` if the two lattices disagree."""
    with mp.workdps(DIGITS):
        first, second = (studentized_sf(k, df, mpf(q), fineness) for fineness in STEPS)
    if abs(first / second - 1) > AGREEMENT:
        raise ArithmeticError(f"k={k}, df={df}, q={q}: {first} and {second} differ")
    return second


def two_means(df: float, q: mpf) -> mpf:
    """k = 2 in closed form: the two-sided t at q / sqrt(2), for df = inf the two-sided normal."""
    if df == inf:
        return erfc(q / 2)
    df = mpf(df)
    return betainc(df / 2, mpf(1) / 2, 0, df / (df + q**2 / 2), regularized=True)


def three_means(df: float, q: mpf) -> mpf:
    """k = 3 the other way round: ∫ f(w) P(S < w/q) dw, f the closed density 3/√π e^(-w²/4) erf(w/√12) of the range."""
    df, step = mpf(df), min(mpf("0.4") / sqrt(2 * mpf(df)), mpf("0.05"))

    def term(x: mpf) -> mpf:
        w = exp(x)
        density = 3 / sqrt(pi) * exp(-(w**2) / 4) * erf(w / sqrt(12))
        return w * density * gammainc(df / 2, 0, df * w**2 / (2 * q**2), regularized=True)

    return outward(term, log(q / sqrt(1 + q**2 / (2 * df))), step)


def check() -> None:
    for df, q in ((2, 3.0), (2, 1e60), (26, 3.5), (26, 4e3), (1e3, 50.0), (1e5, 40.0), (inf, 5.0), (inf, 50.0)):
        report("k=2", df, q, value(2, df, q) / two_means(df, mpf(q)) - 1)
    for df, q in ((2, 3.0), (5, 1e9), (26, 3.5), (26, 40.0), (100, 15.0)):
        report("k=3", df, q, value(3, df, q) / three_means(df, mpf(q)) - 1)


def report(*cells: object) -> None:
    print(*(mp.nstr(c, 3) if isinstance(c, mpf) else c for c in cells), flush=True)  # noqa: T201


def tail_q(k: int, df: float, p: float) -> float:
    """A q whose tail is about p: the bound k(k-1)/2 (1 + q²/2df)^(-df/2) solved for q, and rounded."""
    exponent = log(k * (k - 1) / 2 / mpf(p))
    squared = 4 * exponent if df == inf else 2 * mpf(df) * expm1(2 * exponent / df)
    return float(mp.nstr(sqrt(squared), 6))


def points() -> Iterator[tuple[int, float, float]]:
    """Every third of ten places on each (k, df), others for the neighbours."""
    for i, (k, typical) in enumerate(TYPICAL_RANGE.items()):
        for j, df in enumerate(DEGREES):
            places = [round(share * typical, 4) for share in SHARES] + [tail_q(k, df, p) for p in TAILS]
            yield from ((k, df, q) for q in places[(i + j) % 3 :: 3])
    yield from BEYOND


def main() -> None:
    mp.dps = DIGITS
    check()
    if "--check" in sys.argv:
        return
    rows = []
    for k, df, q in points():
        p = value(k, df, q)
        logp = log(p)
        rows.append([k, str(df), q, mp.nstr(p, 18), mp.nstr(logp, 18)])
        report(*rows[-1])
    lines = ",\n".join(json.dumps(row) for row in rows)
    about = "made by make_studentized_range.py with mpmath; rows: k, df, q, P(Q > q), log P(Q > q)"
    TARGET.write_text(f'{{"about": "{about}", "rows": [\n{lines}\n]}}\n', encoding="utf-8")


if __name__ == "__main__":
    main()
