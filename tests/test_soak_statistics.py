"""The full figures behind the numbers of the statistics, kept as a table: `make soak`."""

from __future__ import annotations

import json
import math
import statistics as st
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from mpmath import mpf
from scipy import stats as scipy_stats

from analysis import (
    binomial_test,
    binomial_test_log_p,
    binomial_test_p,
    one_way_anova,
    rm_anova,
    rm_tukey_hsd,
    rm_tukey_hsd_paired,
)
from analysis.stats.binomial import Tail
from tests import nist
from tests.conftest import Soak
from tests.exact import digits, exact_one_way_F, exact_rm_F, exact_squared_q, p_digits
from tests.golden_binomial import GOLDEN, digits_of
from tests.made_scores import ADDITIVE, KINDS, made_scores

pytestmark = pytest.mark.soak

ROOT = Path(__file__).parent.parent

OFFSETS = (1.0, 1e3, 1e6, 1e9, 1e12)
SCALES = (1e-300, 1e-160, 1e-10, 1.0, 3.7, 1e10, 1e154, 1e290)

SETS = 10_000
PINGOUIN_CALLS = 40


@pytest.mark.parametrize("name", nist.NAMES)
def test_nist_one_way_sets(soak: Soak, name: str) -> None:
    groups, certified = nist.read(name)
    F, exact = one_way_anova(groups).F, exact_one_way_F(groups)
    found, ceiling = digits(F, exact), digits(float(exact), Fraction(certified))
    detail = (
        f"LRE against the certified value {digits(F, Fraction(certified)):.1f}; exact F of the doubles {ceiling:.1f}"
    )
    soak(f"NIST {name}: digits of F", f"{found:.1f}", "14", f"exact rationals of the doubles; {detail}")
    assert found >= 14


@pytest.mark.parametrize("kind", KINDS)
def test_repeated_measures_against_exact_rationals(soak: Soak, kind: str) -> None:
    rng, F_digits, ps, q_digits, Fs = np.random.default_rng(2026), [], [], [], []
    for seed in range(600):
        n, k, offset, scale = rng.integers(2, 41), rng.integers(2, 11), rng.choice(OFFSETS), rng.choice(SCALES)
        scores = made_scores(seed, int(n), int(k), kind, float(offset)) * scale
        found, exact = rm_anova(scores), exact_rm_F(scores)
        assert found.ss_error >= 0.0
        F_digits.append(digits(found.F, exact))
        ps.append(p_digits(found))
        Fs.append(found.F)
        if seed % 10 == 0:
            last = rm_tukey_hsd(scores)[-1]
            q_digits.append(digits(last.q**2, exact_squared_q(scores, int(k) - 1, int(k) - 2)))
    reach = "no offset" if kind == "huge" else "offsets to 1e12"
    how = f"600 tables, n 2-40, k 2-10, {reach}, scales 1e-300 to 1e290, F {min(Fs):.1g} to {max(Fs):.1g}"
    soak(f"repeated measures, {kind}: fewest digits of F", f"{min(F_digits):.1f}", "15", how)
    soak(f"repeated measures, {kind}: fewest digits of p at that F", f"{min(ps):.1f}", "13", "mpmath's beta integral")
    soak(f"repeated measures, {kind}: fewest digits of Tukey's q^2", f"{min(q_digits):.1f}", "13.5", "exact rationals")
    assert min(F_digits) >= 15
    assert min(ps) >= 13
    assert min(q_digits) >= 13.5


@pytest.mark.parametrize(("most", "p_bound", "log_bound"), [(10**6, 13, 14), (10**9, 11, 11)], ids=["to 1e6", "1e9"])
def test_binomial_against_sums_of_mpmath(soak: Soak, most: int, p_bound: float, log_bound: float) -> None:
    cases = [case for case in GOLDEN["tests"] if (case["n"] > 10**6) == (most > 10**6)]
    tests = [(case, binomial_test(case["k"], case["n"], case["p0"])) for case in cases]
    normal = [pair for pair in tests if not 0 < mpf(pair[0]["p"]) < 1e-300]
    p = min(digits_of(found.p, case["p"]) for case, found in normal)
    log_p = min(digits_of(found.log_p, case["log_p"]) for case, found in tests)
    soak(f"binomial, n up to {most:.0e}: fewest digits of p", f"{p:.1f}", p_bound, f"mpmath, {len(normal)} cases")
    soak(f"binomial, n up to {most:.0e}: fewest digits of log p", f"{log_p:.1f}", log_bound, f"{len(tests)} cases")
    assert p >= p_bound
    assert log_p >= log_bound


@pytest.mark.parametrize("alternative", ["greater", "less"])
def test_one_sided_binomial_against_sums_of_mpmath(soak: Soak, alternative: Tail) -> None:
    """A log p below 1e-300, next to p = 1, is no normal double."""
    cases = [case for case in GOLDEN["tests"] if abs(mpf(case[f"log_{alternative}"])) > 1e-300]
    worst = min(
        digits_of(binomial_test_log_p(case["k"], case["n"], case["p0"], alternative), case[f"log_{alternative}"])
        for case in cases
    )
    soak(
        f"binomial, {alternative}: fewest digits of log p", f"{worst:.1f}", 14, f"mpmath, {len(cases)} cases to n = 1e9"
    )
    assert worst >= 14


@pytest.mark.parametrize("p0", [0.5, 0.3])
def test_two_thousand_binomials_of_a_million_beside_scipy(soak: Soak, p0: float) -> None:
    counts = np.random.default_rng(1).choice(np.arange(10**6 * p0 - 3000, 10**6 * p0 + 3000), 2000, replace=False)
    few = [int(count) for count in counts[::10]]
    pairs = [
        (_cpu_seconds(lambda: binomial_test_p(counts, 10**6, p0)) / 2000, _cpu_seconds(lambda: _scipys(few, p0)) / 200)
        for _ in range(5)
    ]
    found, theirs = np.asarray(binomial_test_p(few, 10**6, p0)), _scipys(few, p0)
    apart = float(np.max(np.abs(found / theirs - 1.0)))
    ours, scipys = (st.median(column) for column in zip(*pairs, strict=True))
    how = f"{1e6 * ours:.1f} us a count; scipy.stats.binomtest p alone {1e6 * scipys:.0f} us, at most {apart:.0e} apart"
    soak(f"2,000 binomial p of n = 1e6 at {p0}", f"{scipys / ours:,.0f} times scipy", "1", how)
    assert scipys >= ours


def test_one_binomial_and_a_hundred_thousand_beside_scipy(soak: Soak) -> None:
    counts = np.random.default_rng(1).binomial(140, 0.5, 100_000)
    works = (
        lambda: binomial_test_p(counts, 140),
        lambda: binomial_test_p(78, 140),
        lambda: binomial_test(78, 140),
        lambda: scipy_stats.binomtest(78, 140).pvalue,
        lambda: _with_both_intervals(scipy_stats.binomtest(78, 140)),
    )
    rounds = [[_cpu_seconds(work) for work in works] for _ in range(41)]
    many, one, whole, theirs, their_whole = (st.median(column) for column in zip(*rounds, strict=True))
    each = many / len(counts)
    how = f"{1e6 * each:.2f} us a count, n = 140; scipy.stats.binomtest p alone {1e6 * theirs:.0f} us"
    soak("100,000 binomial p", f"{theirs / each:,.0f} times scipy", "1,000", how)
    soak("one binomial p", f"{theirs / one:.1f} times scipy", "stated", f"{1e3 * one:.2f} ms")
    how = f"{1e3 * whole:.2f} ms; scipy: p, exact and Wilson's interval {1e3 * their_whole:.2f} ms"
    soak("one binomial test with both intervals", f"{their_whole / whole:.1f} times scipy", "1", how)
    assert theirs / each >= 1000
    assert their_whole >= whole


def _with_both_intervals(test: Any) -> None:
    test.pvalue, test.proportion_ci(method="exact"), test.proportion_ci(method="wilson")


def _scipys(counts: list[int], p0: float) -> np.ndarray:
    return np.array([scipy_stats.binomtest(count, 10**6, p0).pvalue for count in counts])


def test_intervals_against_mpmath(soak: Soak) -> None:
    for prefix, name in (("ci", "Clopper-Pearson"), ("wilson", "Wilson")):
        worst = min(
            digits_of(getattr(binomial_test(case["k"], case["n"]), limit), case[limit])
            for case in GOLDEN["intervals"]
            for limit in (f"{prefix}_low", f"{prefix}_high")
        )
        soak(f"{name}'s limits: fewest digits", f"{worst:.1f}", "12", f"{len(GOLDEN['intervals'])} cases to n = 1e9")
        assert worst >= 12


def test_golden_binomials_are_what_the_script_makes(tmp_path: Path, soak: Soak) -> None:
    subprocess.run([sys.executable, "-m", "tests.golden.make_binomial", tmp_path / "again.json"], cwd=ROOT, check=True)
    same = json.loads((tmp_path / "again.json").read_text()) == GOLDEN
    soak("binomial references remade", "equal" if same else "differ", "equal", "tests/golden/make_binomial.py")
    assert same


def test_additive_data_beside_pingouin(soak: Soak) -> None:
    found, theirs = rm_anova(ADDITIVE), _pingouin(_long(ADDITIVE))
    how = f"pingouin here F = {float(theirs['F']):.3g}; exact F of the doubles {float(exact_rm_F(ADDITIVE)):.2g}"
    soak("additive tenths: F, p", f"{found.F}, {found.p}", "inf, 0", how)
    assert (found.F, found.p) == (math.inf, 0.0)


def test_speed_beside_pingouin(soak: Soak) -> None:
    """Ratios of one run: a cold call in a new process, then warm calls between pingouin's, medians of both."""
    tables = np.random.default_rng(1).normal(size=(SETS, 14, 3)) + np.array([0.0, 0.5, 1.0])
    cold = [
        float(subprocess.run([sys.executable, "-c", COLD], check=True, capture_output=True, cwd=ROOT).stdout)
        for _ in range(3)
    ]
    frames = [_long(table) for table in tables[:PINGOUIN_CALLS]]
    _pingouin(frames[0])
    ours, theirs = [], []
    for frame in frames:
        theirs.append(_seconds(lambda frame=frame: _pingouin(frame)))
        ours.append(_seconds(lambda: (rm_anova(tables), rm_tukey_hsd(tables))))
    each = st.median(theirs)
    first, warm = SETS * each / st.median(cold), SETS * each / st.median(ours)
    how = f"pingouin.rm_anova alone: {1e3 * each:.1f} ms a table, median of {PINGOUIN_CALLS}, times {SETS:,}"
    soak(
        "10,000 repeated-measures ANOVAs with three Tukey p each, set-up inside",
        f"{first:,.0f} times pingouin",
        "250",
        f"{1e3 * st.median(cold):.0f} ms, first call of a process, after imports, median of 3; {how}",
    )
    soak(
        "the same, once the table of the studentized range is there",
        f"{warm:,.0f} times pingouin",
        "3,000",
        f"{1e3 * st.median(ours):.1f} ms, median of {len(ours)}, between pingouin's calls",
    )
    paired = _seconds(lambda: rm_tukey_hsd_paired(tables))
    soak("10,000 times three Tukey p on each pair's own error", f"{1e3 * paired:.0f} ms", "stated", "one call, warm")
    assert first >= 250
    assert warm >= 3000


COLD = f"""
import time
import numpy as np
import scipy.special
from analysis import rm_anova, rm_tukey_hsd
tables = np.random.default_rng(1).normal(size=({SETS}, 14, 3)) + np.array([0.0, 0.5, 1.0])
start = time.perf_counter()
rm_anova(tables), rm_tukey_hsd(tables)
print(time.perf_counter() - start)
"""


def _cpu_seconds(work: Callable[[], object]) -> float:
    """Of this process alone, so that neighbours count less."""
    start = time.process_time()
    work()
    return time.process_time() - start


def _seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def _long(table: np.ndarray) -> pd.DataFrame:
    return pd.DataFrame(table).reset_index().melt(id_vars="index")


def _pingouin(frame: pd.DataFrame) -> pd.Series:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # pandas' deprecations, on every call
        import pingouin

        return pingouin.rm_anova(frame, dv="value", within="variable", subject="index").iloc[0]
