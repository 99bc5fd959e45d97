"""The full figures behind "every tail of Tukey's test is exact", kept as a table: `make soak`."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

from analysis import studentized_range_isf, studentized_range_logsf, studentized_range_sf
from analysis.stats.studentized_tail import TABLE_PAYS, lower_table, upper_table
from tests.conftest import Soak
from tests.golden.make_studentized_range import value
from tests.golden_range import AS_DOUBLE, DF, DFS, KS, LOG_P, K, P, Q

pytestmark = pytest.mark.soak

PROMISED = (K <= 20) & (DF >= 2)


def test_the_tail_against_mpmath(soak: Soak) -> None:
    rows = AS_DOUBLE & PROMISED
    direct = np.abs(studentized_range_sf(Q, K, DF)[rows] / P[rows] - 1.0).max()
    tables = np.array(
        [studentized_range_sf(np.full(TABLE_PAYS, q), k, df)[0] for q, k, df in zip(Q, K, DF, strict=True)]
    )
    tabled = np.abs(tables[rows] / P[rows] - 1.0).max()
    points = f"{rows.sum()} points, k 2..20, df 2..1e5 and inf, p {P[rows].max():.4f}..{P[rows].min():.0e}, mpmath"
    soak("relative error of p, by sums", f"{direct:.1e}", "1e-12", points)
    soak("relative error of p, by tables", f"{tabled:.1e}", "1e-12", "the same points")
    logarithm = np.abs(studentized_range_logsf(Q, K, DF) / LOG_P - 1.0)[PROMISED].max()
    soak("relative error of log p", f"{logarithm:.1e}", "1e-12", f"down to log p = {LOG_P.min():.0f}")
    outside = np.abs(studentized_range_logsf(Q, K, DF) / LOG_P - 1.0)[~PROMISED].max()
    soak("relative error of log p outside the promise", f"{outside:.1e}", "1e-12", "k = 100; df = 0.5 and 1")
    assert max(direct, tabled, logarithm, outside) < 1e-12


def test_fresh_points_against_mpmath(soak: Soak) -> None:
    random, worst = np.random.default_rng(20), 0.0
    for _ in range(20):
        k, df = int(random.integers(2, 21)), float(np.round(2.0 * 10.0 ** random.uniform(0.0, 4.7), 2))
        q = float(studentized_range_isf(10.0 ** (-300.0 * random.uniform() ** 3), k, df))
        worst = max(worst, abs(float(studentized_range_sf(q, k, df) / value(k, df, q)) - 1.0))
    soak("relative error of p, 20 random points", f"{worst:.1e}", "1e-12", "k, df, p at random, mpmath on the spot")
    assert worst < 1e-12


def test_there_and_back(soak: Soak) -> None:
    p = np.concatenate([1.0 - np.geomspace(1e-6, 0.5, 200), np.geomspace(0.5, 1e-300, 1500)])
    worst = max(
        np.abs(studentized_range_sf(studentized_range_isf(p, k, df), k, df) / p - 1.0).max() for k in KS for df in DFS
    )
    soak("relative error of sf(isf(p))", f"{worst:.1e}", "1e-12", f"{p.size} p from 1 - 1e-6 to 1e-300 at each (k, df)")
    assert worst < 1e-12


def test_a_larger_q_is_never_likelier(soak: Soak) -> None:
    rises, points = 0, 0
    for k in KS:
        for df in DFS:
            end = float(studentized_range_isf(1e-300, k, df))
            middle = float(studentized_range_isf(31 / 32, k, df))  # where the lower side takes over
            for q in (np.geomspace(1e-3, end, 300_000), middle * np.linspace(0.99, 1.01, 100_000)):
                rises += int((np.diff(studentized_range_logsf(q, k, df)) > 0.0).sum())
                points += q.size
    soak("a larger q with a larger p", rises, "0", f"{points} neighbours on fine grids, seams included")
    assert rises == 0


def seconds(call: Callable[[], object], repeats: int = 7) -> float:
    """Median duration."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def forget() -> None:
    upper_table.cache_clear()
    lower_table.cache_clear()


def test_speed_at_one_k_and_df(soak: Soak) -> None:
    q = np.random.default_rng(0).uniform(0.1, 12.0, 10_000)

    def with_tables() -> None:
        forget()
        studentized_range_sf(q, 3, 26)

    scipys = seconds(lambda: stats.studentized_range.sf(q[0], 3, 26), 21)
    cold, warm = seconds(with_tables) / q.size, seconds(lambda: studentized_range_sf(q, 3, 26)) / q.size
    soak(
        "time of a p, (3, 26), tables made inside",
        f"{scipys / cold:.0f} x scipy",
        "200 x",
        f"{cold * 1e6:.2f} us, 10,000 q",
    )
    soak(
        "the same, tables there",
        f"{scipys / warm:.0f} x scipy",
        "1000 x",
        f"{warm * 1e6:.2f} us; scipy {scipys * 1e3:.1f} ms",
    )
    back = seconds(lambda: studentized_range_isf(q / 12.1, 3, 26), 3) / q.size
    scipys_back = seconds(lambda: stats.studentized_range.isf(0.05, 3, 26), 3)
    soak(
        "time of an isf, tables there", f"{scipys_back / back:.0f} x scipy", "1000 x", f"{back * 1e6:.1f} us, 10,000 p"
    )
    assert scipys > 200 * cold
    assert scipys > 1000 * warm
    assert scipys_back > 1000 * back


@pytest.mark.parametrize("dfs", ["29 df", "10,000 df"])
def test_speed_over_many_pairs(soak: Soak, dfs: str) -> None:
    random = np.random.default_rng(0)
    q, k = random.uniform(0.1, 12.0, 10_000), random.integers(2, 21, 10_000)
    df = random.integers(2, 31, 10_000) if dfs == "29 df" else random.uniform(2.0, 1000.0, 10_000)

    def with_tables() -> None:
        forget()
        studentized_range_sf(q, k, df)

    ours = seconds(with_tables, 5) / q.size
    scipys = seconds(lambda: stats.studentized_range.sf(q[:40], k[:40], df[:40]), 3) / 40
    detail = f"{ours * 1e6:.1f} us, k = 2..20, {np.unique(np.stack([k, df]), axis=1).shape[1]} pairs"
    soak(f"time of a p over {dfs}, tables made inside", f"{scipys / ours:.0f} x scipy", "30 x", detail)
    assert scipys > 30 * ours


def test_the_first_call_is_quick(soak: Soak) -> None:
    code = (
        "import time, scipy.special; from analysis import studentized_range_sf as p;"  # imports are no part of the call
        "t = time.perf_counter(); p([2.0, 3.5, 5.0], 3, 26); print(time.perf_counter() - t)"
    )
    runs = [subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True) for _ in range(9)]
    first = statistics.median(float(run.stdout) for run in runs) * 1e3
    soak("the first three p of a process", f"{first:.1f} ms", "20 ms", "median of 9, (3, 26)")
    assert first < 20
