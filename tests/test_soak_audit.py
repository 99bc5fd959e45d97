"""The full figures behind "published numbers audited", kept as a table: `make soak`."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import chain, product
from math import ceil, floor
from pathlib import Path

import pytest

from analysis.paper.audit.means import debit, grim, grimmer
from analysis.paper.audit.p_values import p_against_statistic
from analysis.paper.audit.participants import forward_counts, rating_grains
from analysis.paper.audit.printed import CheckResult
from analysis.paper.audit.reconstruct import meets, reconstruct
from analysis.paper.audit.run import audit, load_paper_file
from analysis.paper.paper import load_paper
from tests import brute_force as brute
from tests import golden_audit as golden
from tests import summarised_data as rebuilt
from tests.conftest import Soak

pytestmark = pytest.mark.soak

Cases = Iterator[tuple[object, str, CheckResult]]
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
    start = time.perf_counter()
    findings = audit(load_paper_file(Path(__file__).parent.parent / "configs" / "paper.toml"))
    seconds = time.perf_counter() - start
    soak("the whole audit of the paper", f"{seconds:.1f} s", "10 s", f"{len(findings)} numbers, one process")
    assert seconds < 10


@pytest.mark.parametrize(("k", "with_sds"), rebuilt.DESIGNS)
def test_samples_that_existed_are_found_again(soak: Soak, k: int, with_sds: bool) -> None:
    """A thousand samples a design, each summarised to two decimals and searched for."""
    found = starts = succeeded = 0
    slowest = 0.0
    for seed, wanted in enumerate(rebuilt.cases(k, with_sds, 1_000, seed=k)):
        start = time.perf_counter()
        one = reconstruct(wanted, seed)
        seconds = time.perf_counter() - start
        slowest = max(slowest, seconds)
        found += bool(one.data) and meets(one.data[0], wanted) and seconds < 1
        starts += one.starts
        succeeded += one.succeeded
    printed = "means" + (", SDs" if with_sds else "") + (" and F" if k > 1 else "")
    soak(
        f"samples that existed, found again within 1 s: {k} conditions, {printed}",
        f"{found / 10:.1f} %",
        "99 %",
        f"n = 5..30, scales to 100; slowest {slowest:.2f} s; {succeeded} of {starts} starts succeeded",
    )
    assert found >= 990


def test_participants_of_this_paper(soak: Soak) -> None:
    """Every published number that can be met, by 500 seeds."""
    paper = load_paper(Path(__file__).parent.parent / "configs" / "paper.toml")
    searches = {
        "forward answers of experiment 1": lambda seed: forward_counts(paper.direction, seed).search,
        "ratings of experiment 2": lambda seed: rating_grains(paper.preference, rebuilt.MEANS, "0.1", 0.6, seed).search,
    }
    for name, search in searches.items():
        start = time.perf_counter()
        found = [search(seed) for seed in range(500)]
        seconds = (time.perf_counter() - start) / 500
        different = len({tuple(sorted(one.data[0])) for one in found})
        share = 500 / sum(one.starts for one in found)
        detail = f"{100 * share:.1f} % of the starts succeed, {seconds:.3f} s each"
        soak(f"{name} rebuilt by 500 seeds: different data sets", different, "500", detail)
        assert different == 500
