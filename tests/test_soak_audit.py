"""The full figures behind "published numbers audited", kept as a table: `make soak`."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import chain, product
from math import ceil, floor
from pathlib import Path

import pytest

from analysis.audit import Result, audit, debit, grim, grimmer, p_against_statistic, parse_paper
from tests import test_audit_brute as brute
from tests import test_audit_golden as golden
from tests.conftest import Soak

pytestmark = pytest.mark.soak

Cases = Iterator[tuple[object, str, Result]]
SUITES: dict[str, Callable[[], Cases]] = {
    "GRIM": lambda: brute.grim_cases(range(1, 101), 2, 2),
    "percentage of a count": lambda: brute.percent_cases(range(1, 21), 1),
    "GRIMMER on a scale": lambda: chain.from_iterable(
        brute.grimmer_cases(n, top, digits, every)
        for n, top, digits, every in (
            (2, 6, (1, 1), 1),
            (3, 4, (1, 2), 1),
            (4, 4, (2, 1), 1),
            (5, 4, (1, 2), 1),
            (6, 4, (1, 1), 1),
            (7, 3, (2, 2), 5),
        )
    ),
    "GRIMMER without a scale": lambda: chain.from_iterable(brute.unbounded_grimmer_cases(n, 1) for n in (2, 3, 4)),
    "DEBIT": lambda: brute.debit_cases((*range(2, 9), 15, 30), 2),
    "binomial p": lambda: chain(
        brute.binomial_cases(range(1, 21), Fraction(1, 2), 3), brute.binomial_cases(range(1, 11), Fraction(1, 3), 3)
    ),
    "F within participants": lambda: chain.from_iterable(
        brute.repeated_cases(*design, 1, every)
        for *design, every in ((3, 2, 3, 1), (2, 3, 2, 3), (3, 3, 1, 1), (4, 2, 2, 1), (3, 3, 2, 17), (4, 2, 3, 3))
    ),
    "F between groups": lambda: chain.from_iterable(
        brute.between_cases(sizes, top, every)
        for sizes, top, every in (((3, 2), 4, 1), ((2, 3, 2), 2, 7), ((4, 3), 3, 1))
    ),
    "p against statistic": lambda: brute.p_cases(3_000, 2),
    "df against design": lambda: brute.df_cases(12),
}


@pytest.mark.parametrize("name", SUITES)
def test_brute_force(name: str, soak: Soak) -> None:
    start = time.perf_counter()
    wrong = missed = undecided = count = 0
    for _, verdict, result in SUITES[name]():
        count += 1
        wrong += result.verdict == "not attainable" and verdict != "not attainable"
        missed += result.verdict not in {verdict, "undecided"} and result.verdict != "not attainable"
        undecided += result.verdict == "undecided"
    seconds = time.perf_counter() - start
    figure = f"{wrong} wrong, {missed} missed, {undecided} undecided of {count}"
    soak(f"{name}: verdicts against all data sets", figure, "0 wrong, 0 missed", f"enumerated in {seconds:.0f} s")
    assert (wrong, missed, undecided) == (0, 0, 0)


def test_grim_on_all_means(soak: Soak) -> None:
    """A mean is possible if some K / n is within half a unit of it, ends included: exact rationals, no rounding."""
    wrong = 0
    for n, hundredths in product(range(1, 101), range(1000)):
        low, high = (Fraction(2 * hundredths + end, 200) * n for end in (-1, 1))
        possible = floor(high) >= max(ceil(low), 0)
        result = grim(f"{hundredths // 100}.{hundredths % 100:02d}", n)
        wrong += golden.rounded_either_way(result) != possible
    soak("GRIM, means 0.00 to 9.99, n = 1 to 100: wrong", wrong, "0", "100000 pairs, exact rationals")
    assert wrong == 0


def test_tukey_never_accuses_data_that_exist(soak: Soak) -> None:
    count, undecided = brute.tukey_accusations(200, 2)
    soak("Tukey pattern: true patterns called not attainable", 0, "0", f"{count} data sets, {undecided} left undecided")


def test_agreement_with_other_programs(soak: Soak) -> None:
    grims = golden.rows("grim", "mean", "n", "consistent")
    same = [
        golden.rounded_either_way(grim(mean, n, items=block.get("items", 1))) == consistent
        for block, mean, n, consistent in (case.values for case in grims)
    ]
    for kind, check in (("grimmer", grimmer), ("debit", debit)):
        cases = golden.rows(kind, "mean", "sd", "n", "consistent")
        same += [golden.rounded_either_way(check(m, sd, n)) == said for _, m, sd, n, said in (c.values for c in cases)]
    soak("documented cases of scrutiny that agree", f"{sum(same)} of {len(same)}", "all", "GRIM, GRIMMER, DEBIT")
    p_values = [
        (p_against_statistic(statistic, value, df, p, sides=sides).verdict != "attainable") == error
        for sides, statistic, value, df, p, error in (case.values for case in golden.statcheck_cases())
    ]
    soak("documented cases of statcheck that agree", f"{sum(p_values)} of {len(p_values)}", "all", "errors of p")
    assert all(same)
    assert all(p_values)


def test_the_whole_audit_of_the_paper(soak: Soak) -> None:
    root = Path(__file__).parent
    text = (root.parent / "configs" / "paper.toml").read_text(encoding="utf-8")
    if "[[claims]]" not in text:
        text += (root / "golden" / "audit" / "paper_claims.toml").read_text(encoding="utf-8")
    start = time.perf_counter()
    findings = audit(parse_paper(text))
    seconds = time.perf_counter() - start
    soak("the whole audit of the paper", f"{seconds:.1f} s", "10 s", f"{len(findings)} numbers, one process")
    assert seconds < 10
