"""Every check against brute force: all data sets of a small design are enumerated, printed, and the verdicts compared.

The printing here is its own: decimal arithmetic of the standard library. `expected` is what the sets of printed texts
say; a check must say the same, so that no "not attainable" is wrong and none is missed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator
from decimal import ROUND_DOWN, ROUND_HALF_DOWN, ROUND_HALF_EVEN, ROUND_HALF_UP, Context, Decimal
from fractions import Fraction
from itertools import combinations_with_replacement, product
from math import comb
from typing import TypeVar

import mpmath
import numpy as np

from analysis.paper.audit.binomial import binomial_p
from analysis.paper.audit.freedom import degrees_of_freedom
from analysis.paper.audit.means import debit, grim, grimmer, percent_of_count
from analysis.paper.audit.p_values import p_against_statistic
from analysis.paper.audit.printed import CheckResult
from analysis.paper.audit.tukey_pattern import ClaimedComparison, tukey_pattern
from analysis.paper.audit.variance_ratios import between_f, repeated_f
from tests.exact import exact_one_way_F, exact_rm_F

MODES = (ROUND_HALF_UP, ROUND_HALF_EVEN, ROUND_HALF_DOWN, ROUND_DOWN)
EXACT = Context(prec=60)
Case = TypeVar("Case")
Texts = tuple[str, ...]
"""One number as each of the modes prints it."""


def printed(value: Fraction | Decimal, digits: int) -> Texts:
    """`value` to so many decimals under each mode; 60 digits keep every tie of these small fractions."""
    if isinstance(value, Fraction):
        value = EXACT.divide(Decimal(value.numerator), Decimal(value.denominator))
    return tuple(str(value.quantize(Decimal(1).scaleb(-digits), rounding=mode)) for mode in MODES)


def root(value: Fraction) -> Decimal:
    return EXACT.sqrt(EXACT.divide(Decimal(value.numerator), Decimal(value.denominator)))


class Printed:
    """The tuples of texts that data can print, by mode, and with the modes mixed."""

    def __init__(self, rows: Iterable[tuple[Texts, ...]]) -> None:
        self.by_mode: list[set[Hashable]] = [set() for _ in MODES]
        self.mixed: set[Hashable] = set()
        for row in set(rows):
            for place, texts in enumerate(zip(*row, strict=True)):
                self.by_mode[place].add(texts)
            self.mixed.update(product(*map(set, row)))


def expected(texts: Hashable, plain: Printed, readings: Iterable[Printed] = ()) -> str:
    if texts in plain.mixed:
        return "attainable" if texts in plain.by_mode[0] or texts in plain.by_mode[1] else "only under a reading"
    rescued = any(texts in reading.mixed for reading in readings)
    return "only under a reading" if rescued else "not attainable"


def grid(low: int, high: int, digits: int) -> list[str]:
    """All texts from low to high."""
    return [str(Decimal(i).scaleb(-digits)) for i in range(low * 10**digits, high * 10**digits + 1)]


def thinned(cases: Iterable[tuple[Case, str]], every: int) -> Iterator[tuple[Case, str]]:
    """Of each verdict the first and then every so many-th, but sixteen times as many of those that data can print."""
    seen: Counter[str] = Counter()
    for case, verdict in cases:
        if seen[verdict] % (every if verdict == "not attainable" else -(-every // 16)) == 0:
            yield case, verdict
        seen[verdict] += 1


def compared(cases: Iterable[tuple[object, str, CheckResult]]) -> int:
    """How many cases; the first whose verdict is another is told."""
    count = 0
    for what, verdict, result in cases:
        count += 1
        assert result.verdict == verdict, (what, verdict, result)
    return count


def grim_cases(sizes: Iterable[int], digits: int, top: int) -> Iterator[tuple[object, str, CheckResult]]:
    for n in sizes:
        sets = Printed((printed(Fraction(total, n), digits),) for total in range(top * n + 1))
        for mean in grid(0, top - 1, digits):
            yield (mean, n), expected((mean,), sets), grim(mean, n)


def percent_cases(sizes: Iterable[int], digits: int) -> Iterator[tuple[object, str, CheckResult]]:
    def of(count: int, n: int) -> Printed:
        return Printed([(printed(Fraction(100 * count, n), digits),)])

    for n in sizes:
        for count in range(n + 1):
            plain, others = of(count, n), [of(count, m) for m in range(max(count, 1), n)]
            for percent in grid(0, 100, digits):
                yield (percent, count, n), expected((percent,), plain, others), percent_of_count(percent, count, n)


def spread_sets(
    data: Iterable[tuple[int, ...]], n: int, digits: tuple[int, int], grain: Fraction, low: Fraction
) -> list[Printed]:
    """Mean and SD of all data, the SD by n - 1, by n, and as a standard error."""
    rows: list[list[tuple[Texts, ...]]] = [[], [], []]
    for total, squares in {(sum(values), sum(v * v for v in values)) for values in data}:
        spread = grain**2 * (squares - Fraction(total**2, n))
        mean = printed(low + grain * Fraction(total, n), digits[0])
        for place, divisor in enumerate((n - 1, n, n * (n - 1))):
            rows[place].append((mean, printed(root(spread / divisor), digits[1])))
    return [Printed(part) for part in rows]


def grimmer_cases(n: int, top: int, digits: tuple[int, int], every: int) -> Iterator[tuple[object, str, CheckResult]]:
    """Scale 0..top; pairs of texts, thinned."""
    data = combinations_with_replacement(range(top + 1), n)
    plain, *others = spread_sets(data, n, digits, Fraction(1), Fraction(0))
    pairs = product(grid(0, top, digits[0]), grid(0, top, digits[1]))
    for (mean, sd), verdict in thinned(((pair, expected(pair, plain, others)) for pair in pairs), every):
        yield (mean, sd, n), verdict, grimmer(mean, sd, n, low="0", high=str(top))


def unbounded_grimmer_cases(n: int, every: int) -> Iterator[tuple[object, str, CheckResult]]:
    """Means of 5 and some, SDs up to 3, no scale: values from -25 to 35 are all that can matter (Samuelson)."""
    data = combinations_with_replacement(range(-12, 13), n)
    plain, *others = spread_sets(data, n, (1, 2), Fraction(1), Fraction(0))
    pairs = product(grid(0, 1, 1), grid(0, 3, 2))
    for (mean, sd), verdict in thinned(((pair, expected(pair, plain, others)) for pair in pairs), every):
        yield (mean, sd, n), verdict, grimmer(mean, sd, n)


def debit_cases(sizes: Iterable[int], digits: int, every: int = 1) -> Iterator[tuple[object, str, CheckResult]]:
    for n in sizes:
        data = ((1,) * k + (0,) * (n - k) for k in range(n + 1))
        plain, *others = spread_sets(data, n, (digits, digits), Fraction(1), Fraction(0))
        pairs = [(pair, expected(pair, plain, others)) for pair in product(grid(0, 1, digits), repeat=2)]
        for (mean, sd), verdict in thinned(pairs, every):
            yield (mean, sd, n), verdict, debit(mean, sd, n)


def binomial_cases(sizes: Iterable[int], chance: Fraction, digits: int) -> Iterator[tuple[object, str, CheckResult]]:
    """Against plain sums over the outcomes; the normal approximations in 40 digits."""
    for n in sizes:
        chances = [comb(n, k) * chance**k * (1 - chance) ** (n - k) for k in range(n + 1)]
        small = [sum(p for p in chances if p <= chances[k]) for k in range(n + 1)]
        upper = [sum(chances[k:], Fraction(0)) for k in range(n + 1)]
        lower = [sum(chances[: k + 1], Fraction(0)) for k in range(n + 1)]
        doubled = [min(Fraction(1), 2 * min(pair)) for pair in zip(lower, upper, strict=True)]
        normal = [_normal(n, k, chance, shift) for shift in (0, 0.5) for k in range(n + 1)]
        sets = [Printed((printed(p, digits),) for p in rule) for rule in (small, doubled, lower, upper, normal)]
        for p in grid(0, 1, digits):
            yield (p, n), expected((p,), sets[0], sets[1:]), binomial_p(p, n, chance=str(chance))


def _normal(n: int, k: int, chance: Fraction, shift: float) -> Decimal:
    with mpmath.workdps(40):
        away = max(abs(mpmath.mpf(k) - n * mpmath.mpf(chance.numerator) / chance.denominator) - shift, 0)
        share = mpmath.mpf(chance.numerator) / chance.denominator
        return Decimal(mpmath.nstr(mpmath.erfc(away / mpmath.sqrt(n * share * (1 - share)) / mpmath.sqrt(2)), 35))


def _finite(F: Callable[[], Fraction]) -> Fraction | None:
    try:
        return F()
    except ZeroDivisionError:
        return None


def repeated_cases(n: int, k: int, top: int, digits: int, every: int) -> Iterator[tuple[object, str, CheckResult]]:
    """All tables of n rows of k scores 0..top, with every set of means that one of them prints and F from 0 to 30."""
    plain: list[tuple[Texts, ...]] = []
    other: list[tuple[Texts, ...]] = []
    means: dict[tuple[int, ...], tuple[Texts, ...]] = {}
    for rows in combinations_with_replacement(product(range(top + 1), repeat=k), n):
        sums = tuple(map(sum, zip(*rows, strict=True)))
        means.setdefault(sums, tuple(printed(Fraction(c, n), 2) for c in sums))
        table = np.array(rows, dtype=float)
        for found, out in (
            (_finite(lambda t=table: exact_rm_F(t)), plain),  # type: ignore[misc]
            (_finite(lambda t=table: exact_one_way_F(list(t.T))), other),  # type: ignore[misc]
        ):
            if found is not None and found < 100:
                out.append((*means[sums], printed(found, digits)))
    sets = Printed(plain), Printed(other)
    texts = {tuple(text[0] for text in mean) for mean in means.values()}
    pairs = product(sorted(texts), grid(0, 30, digits))
    cases = (((mean, F), expected((*mean, F), sets[0], sets[1:])) for mean, F in pairs)
    for (mean, F), verdict in thinned(cases, every):
        yield (F, mean), verdict, repeated_f(F, n, k, mean, low="0", high=str(top))


def between_cases(sizes: tuple[int, ...], top: int, every: int) -> Iterator[tuple[object, str, CheckResult]]:
    """All groups of these sizes of scores 0..top; unequal sizes have no other error term."""
    assert len(set(sizes)) > 1
    rows: set[tuple[Texts, ...]] = set()
    means: set[Texts] = set()
    groups = [list(combinations_with_replacement(range(top + 1), n)) for n in sizes]
    for data in product(*groups):
        mean = tuple(printed(Fraction(sum(group), len(group)), 2) for group in data)
        means.add(tuple(text[0] for text in mean))
        F = _finite(lambda d=data: exact_one_way_F([np.array(group, dtype=float) for group in d]))  # type: ignore[misc]
        if F is not None and F < 100:
            rows.add((*mean, printed(F, 1)))
    sets = Printed(rows)
    cases = (((mean, F), expected((*mean, F), sets)) for mean, F in product(sorted(means), grid(0, 30, 1)))
    for (mean, F), verdict in thinned(cases, every):
        yield (F, mean), verdict, between_f(F, sizes, mean, low="0", high=str(top))


def p_cases(count: int, seed: int) -> Iterator[tuple[object, str, CheckResult]]:
    """Random statistics, and p-values near the true ones; the reference is mpmath's, in 30 digits."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        statistic = str(random.choice(["t", "F", "chi2", "r", "z"]))
        value = f"{random.uniform(0.01, 0.99) if statistic == 'r' else random.uniform(0.1, 6):.2f}"
        df = [str(random.integers(2, 60)) for _ in range({"t": 1, "F": 2, "chi2": 1, "r": 1, "z": 0}[statistic])]
        true = float(mp_p(statistic, value, df))
        if true > 0.999:
            continue  # too near 1 for the reference's digits, and for the check's margin
        p = f"{min(1, max(0, true + random.normal() * 0.002)):.3f}"
        yield (
            (statistic, value, df, p),
            p_verdict(statistic, value, df, p),
            p_against_statistic(
                statistic,
                value,
                df,
                p,  # type: ignore[arg-type]
            ),
        )


def p_verdict(statistic: str, value: str, df: list[str], p: str) -> str:
    """By the p-values of the ends of the statistic's interval and of p's, each mode for itself."""

    def fits(ends: tuple[str, str], claim: tuple[str, str], tails: int) -> bool:
        low, high = (mp_p(statistic, str(Decimal(value) + Decimal(end)), df) * tails / 2 for end in reversed(ends))
        return bool(low < mpmath.mpf(str(Decimal(p) + Decimal(claim[1])))) and bool(
            mpmath.mpf(str(Decimal(p) + Decimal(claim[0]))) < high
        )

    half, cut = (("-0.005", "0.005"), ("-0.0005", "0.0005")), (("0", "0.01"), ("0", "0.001"))
    if fits(*half, 2):
        return "attainable"
    tails = [1, 2] if statistic in {"t", "r", "z"} else [2]
    mixed = (("-0.005", "0.01"), ("-0.0005", "0.001"))
    return (
        "only under a reading"
        if any(fits(*ends, t) for ends in (half, cut, mixed) for t in tails)
        else "not attainable"
    )


def mp_p(statistic: str, value: str, df: list[str]) -> mpmath.mpf:
    with mpmath.workdps(30):
        x, nu = mpmath.mpf(value), [mpmath.mpf(text) for text in df]
        match statistic:
            case "z":
                return mpmath.erfc(x / mpmath.sqrt(2))
            case "chi2":
                return mpmath.gammainc(nu[0] / 2, x / 2, regularized=True)
            case "F":
                return mpmath.betainc(nu[1] / 2, nu[0] / 2, 0, nu[1] / (nu[1] + nu[0] * x), regularized=True)
            case "t":
                return mpmath.betainc(nu[0] / 2, 0.5, 0, nu[0] / (nu[0] + x * x), regularized=True)
            case _:
                return mpmath.betainc(nu[0] / 2, 0.5, 0, max(1 - x * x, 0), regularized=True)


def tukey_accusations(count: int, seed: int) -> tuple[int, int]:
    """Real data, printed; their own true pattern must never be called not attainable. Cases, and verdicts left open."""
    from analysis import rm_tukey_hsd

    random, done, undecided = np.random.default_rng(seed), 0, 0
    while done < count:
        n, k = int(random.integers(3, 15)), int(random.integers(2, 5))
        data = random.integers(0, 6, (n, k)) + np.arange(k)
        F = _finite(lambda d=data: exact_rm_F(d.astype(float)))  # type: ignore[misc]
        if F is None or Fraction(1, 10) > F:
            continue
        texts = tuple(printed(Fraction(int(c), n), 2)[0] for c in data.sum(axis=0))
        claims = [
            ClaimedComparison(higher=int(pair.a), lower=int(pair.b), p=f"{pair.p:.3f}")
            if pair.difference > 0
            else ClaimedComparison(higher=int(pair.b), lower=int(pair.a), p=f"{pair.p:.3f}")
            for pair in rm_tukey_hsd(data)
            if pair.difference != 0
        ]
        for grain in (None, "1"):
            result = tukey_pattern(printed(F, 2)[0], [n] * k, claims, texts, grain=grain)
            assert result.verdict != "not attainable", (data, result)
            assert not result.reason.endswith("not attainable"), (data, result)
            undecided += result.verdict == "undecided"
        done += 1
    return done, undecided


def df_cases(most: int) -> Iterator[tuple[object, str, CheckResult]]:
    """Whole df of repeated designs: the plain ones, those of the readings listed here, and no others."""
    for n, k in product(range(3, most), range(2, 5)):
        others = {(k - 1, k * (n - 1))} | {(k - 1, (m - 1) * (k - 1)) for m in range(2, n)}
        others |= {(k - 1, n - k + 1)} if n > k else set()
        for first, second in product(range(1, 5), range(1, most * 4)):
            corrected = _correctable(first, second, n, k)
            plain = (first, second) == (k - 1, (n - 1) * (k - 1))
            rescued = (first, second) in others or corrected
            verdict = "attainable" if plain else "only under a reading" if rescued else "not attainable"
            found = degrees_of_freedom([str(first), str(second)], "repeated", [n, k])
            yield (first, second, n, k), verdict, found


def _correctable(first: int, second: int, n: int, k: int) -> bool:
    """Is there an effect df from 1 to k - 1 that with its n - 1 fold prints so when rounded or cut?"""
    low = max(Fraction(1), first - Fraction(1, 2), (second - Fraction(1, 2)) / (n - 1))
    ends = (Fraction(first + 1), Fraction(second + 1, n - 1))
    return low <= k - 1 and all(low < end for end in ends)
