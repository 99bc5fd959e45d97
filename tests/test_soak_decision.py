"""The full figures behind "a participant who feels the gun": the sampler against theory, and parameter recovery."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest
from scipy.stats import kstwo

from analysis.times.first_passage import distribution, moments
from analysis.times.fit import DiffusionFit, Estimate, fit
from analysis.times.people import MeanEstimate, PeopleFit, fit_people
from experiments.design.streams import generator
from experiments.synthetic.decision import upper_probabilities
from experiments.synthetic.diffusion import Diffusion
from tests.conftest import Soak
from tests.decisions import EXTREMES, RANGE_S, TRUTH, decide_all, law, log_density, made, reference, scalar

pytestmark = pytest.mark.soak

SETS = 200
GRID = [(v, a, w) for v in (-3.0, -0.5, 0.0, 1.0, 6.0) for a in (0.6, 1.5, 4.0) for w in (0.1, 0.5, 0.8)]


def test_the_sampler_against_closed_forms(soak: Soak) -> None:
    n, worst, begun = 400_000, 0.0, time.perf_counter()
    for place in GRID:
        v, a, w = place
        drawn = decide_all(v, a, w, 0.0, generator=generator(1, "soak", str(place)), shape=(n,))
        expected, t = moments(v, a, w), drawn.time_s
        p = float(expected.upper)
        if min(p, 1 - p) * n > 100:
            worst = max(worst, abs(drawn.upper.mean() - p) / math.sqrt(p * (1 - p) / n))
        worst = max(worst, abs(t.mean() - float(expected.mean_s)) / (t.std() / math.sqrt(n)))
        squares = (t - float(expected.mean_s)) ** 2
        worst = max(worst, abs(squares.mean() - float(expected.variance_s2)) / (squares.std() / math.sqrt(n)))
    each_us = (time.perf_counter() - begun) / (n * len(GRID)) * 1e6
    checks = 3 * len(GRID)
    soak(
        "accuracy, mean and variance of time against closed forms, largest deviation",
        f"{worst:.2f} standard errors",
        "4.5",
        f"{checks} checks, {len(GRID)} places, {n:,} draws each, {each_us:.2f} us a draw",
    )
    assert worst < 4.5


def test_extremes_beside_an_ordinary_draw(soak: Soak) -> None:
    ordinary = scalar_s(law(1.0, 2.0, 0.5))
    slowest = max(scalar_s(extreme) for extreme in EXTREMES) / ordinary
    how = f"{len(EXTREMES)} extremes of drift, boundary and start, medians of 5 x 300; {ordinary * 1e6:.0f} us"
    soak("the slowest extreme, times an ordinary draw", f"{slowest:.1f}", "20", how)
    assert slowest < 20


def scalar_s(diffusion: Diffusion) -> float:
    """The median time of a draw, one at a time."""
    times = []
    for _ in range(5):
        begun = time.perf_counter()
        scalar(diffusion, 300)
        times.append((time.perf_counter() - begun) / 300)
    return statistics.median(times)


def test_the_distribution_of_times(soak: Soak) -> None:
    n, values = 200_000, []
    for place in GRID:
        v, a, w = place
        drawn = decide_all(v, a, w, 0.0, generator=generator(2, "ks", str(place)), shape=(n,))
        whole = float(upper_probabilities(v, a, w))
        for answer in (True, False):
            t = np.sort(drawn.time_s[drawn.upper == answer])
            if t.size < 100:
                continue
            share = np.asarray(distribution(t, answer, v, a, w)) / (whole if answer else 1.0 - whole)
            steps = np.arange(t.size + 1) / t.size
            values.append(float(kstwo.sf(max((steps[1:] - share).max(), (share - steps[:-1]).max()), t.size)))
    least = min(values)
    soak(
        "times given the answer, Kolmogorov-Smirnov, smallest p",
        f"{least:.4f}",
        f"{0.001 / len(values):.1e}",
        f"{len(values)} tests of up to {n:,} times, Bonferroni at 0.001",
    )
    assert least > 0.001 / len(values)


def test_the_density_against_200_digits(soak: Soak) -> None:
    worst = 0.0
    for v, a, w in [(v, a, w) for v in (-4.0, 0.0, 0.7, 20.0) for a in (0.5, 2.0) for w in (0.001, 0.3, 0.5, 0.99)]:
        for tau in (1e-4, 0.01, 0.1, 0.2999, 0.3001, 1.0, 10.0, 40.0):
            for answer in (True, False):
                expected = float(reference(tau * a * a, answer, v, a, w))
                error = abs(log_density(tau * a * a, answer, v, a, w) - expected) / max(1.0, abs(expected))
                worst = max(worst, float(error))
    soak(
        "log density against mpmath's series, largest relative error", f"{worst:.1e}", "1e-10", "512 places, 200 digits"
    )
    assert worst < 1e-10


DIFFERENCES = "SD 0.2 of drift factor and logit start, 0.1 of log boundary and log t0"
CASES = {
    "alike": ("people alike", "one fit of all trials"),
    "lapsing": ("people alike, 2 % lapses", "one fit of all trials; the lapses' range of times is known"),
    "together": ("people differ, fitted together", f"one fit of all trials, sandwich intervals; {DIFFERENCES}"),
    "each": ("people differ, fitted each", f"14 fits, mean over people, t intervals; {DIFFERENCES}"),
}


def fitted(case: str, seed: int, times: int) -> DiffusionFit | PeopleFit:
    if case == "lapsing":
        return fit(made(seed, times=times, lapse=0.02), lapses=RANGE_S)
    data = made(seed, times=times, spread=0.0 if case == "alike" else 0.2)
    return fit_people(data) if case == "each" else fit(data, by_person=case == "together")


def failed(found: DiffusionFit | PeopleFit) -> bool:
    return bool(found.left_out) if isinstance(found, PeopleFit) else found.reason is not None


def estimate(found: DiffusionFit | PeopleFit, name: str) -> Estimate | MeanEstimate:
    return found[name] if isinstance(found, DiffusionFit) else {mean.name: mean for mean in found.means}[name]


@cache
def recovered(case: str, times: int) -> tuple[list[DiffusionFit | PeopleFit], float]:
    begun = time.perf_counter()
    return [fitted(case, 1000 + number, times) for number in range(SETS)], time.perf_counter() - begun


def rows(case: str, times: int) -> Iterator[tuple[str, float, float, float, float, int]]:
    """Name, truth, bias, SD of the estimates, coverage of the 95 % intervals, sets with an interval."""
    fits, _ = recovered(case, times)
    truth = TRUTH | ({"lapse": 0.02} if case == "lapsing" else {})
    for name, true in truth.items():
        found = [estimate(one, name) for one in fits]
        told = [e for e in found if math.isfinite(e.se)]
        values = np.array([e.value for e in found])
        covered = np.mean([e.ci_low <= true <= e.ci_high for e in told]) if told else math.nan
        yield name, true, float(values.mean() - true), float(values.std(ddof=1)), float(covered), len(told)


def verdict(true: float, bias: float, sd: float, covered: float, told: int) -> str:
    """Recoverable: hardly ever untold, the interval holds, bias below half the noise, noise below half the value."""
    faults = []
    if told < 0.95 * SETS:
        faults.append(f"no interval in {SETS - told} of {SETS}")
    if covered < 0.90:
        faults.append("intervals too short")
    if abs(bias) > 0.5 * sd:
        faults.append("biased")
    if true and sd > 0.5 * true:
        faults.append("noise above half its size")
    return "NOT recoverable: " + ", ".join(faults) if faults else "recoverable"


@pytest.mark.parametrize("times", [1, 10])
@pytest.mark.parametrize("case", CASES)
def test_parameter_recovery(case: str, times: int, soak: Soak) -> None:
    fits, seconds = recovered(case, times)
    label, how = CASES[case]
    size = f"{label}; 14 x {60 * times} trials"
    bad = sum(map(failed, fits))
    soak(f"{size}: sets with a fit without a peak", f"{bad} of {SETS}", "5 %", f"{how}; {seconds:.0f} s")
    for name, true, bias, sd, covered, told in rows(case, times):
        soak(
            f"{size}: {name} = {true:g}",
            f"bias {bias:+.4f}, SD {sd:.4f}, coverage {100 * covered:.1f} %",
            "95 % +- 3.1 %" if case == "alike" else "stated",
            verdict(true, bias, sd, covered, told),
        )
        if case == "alike":
            assert abs(bias) < 0.5 * sd
            assert covered > 0.90
    assert bad <= 0.05 * SETS


def test_one_person_alone(soak: Soak) -> None:
    """A person's own 60 trials: which parameters can be had for each person."""
    begun = time.perf_counter()
    fits = [fit(made(5000 + number, people=1)) for number in range(SETS)]
    seconds = time.perf_counter() - begun
    for name, true in TRUTH.items():
        found = [estimate(one, name) for one in fits]
        told = [e for e in found if math.isfinite(e.se)]
        values = np.array([e.value for e in found])
        covered = float(np.mean([e.ci_low <= true <= e.ci_high for e in told]))
        bias, sd = float(values.mean() - true), float(values.std(ddof=1))
        soak(
            f"one person's own 60 trials: {name} = {true:g}",
            f"bias {bias:+.4f}, SD {sd:.4f}, coverage {100 * covered:.1f} %",
            "stated",
            f"{verdict(true, bias, sd, covered, len(told))}; {seconds:.0f} s for {SETS} sets",
        )
    assert all(one.reason is None for one in fits)
