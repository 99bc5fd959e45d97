"""The gun's own threshold: an adaptive run on the simulated gun brackets the voltage that the percept gives."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from analysis.paper.recurrence import wilson_interval
from analysis.psychometric.fit import PsychometricFit, psychometric_fit
from analysis.psychometric.priors import PlateauPrior, Priors
from experiments.design.procedures.posterior import best_stimulus, parameter_grid, posterior_after, variance_rule
from experiments.design.procedures.psychometric import share_felt
from tests.conftest import Soak
from tests.felt_thresholds import VOLTAGES, Somebody, shares_right, voltage_at, whole_session, whole_setup

pytestmark = pytest.mark.soak

RUNS, WANTED = 500, 0.93
LAPSES = np.array([0.0, 0.02, 0.04, 0.06, 0.08])
PRIORS = Priors(
    threshold=PlateauPrior(low=0.0, flat_from=2.0, flat_to=24.0, high=30.0),
    width=PlateauPrior(low=1.0, flat_from=3.0, flat_to=60.0, high=90.0),
)


def adaptive_runs(shares: np.ndarray, trials: int) -> tuple[np.ndarray, np.ndarray]:
    """Trials and right answers (runs, voltages) of the posterior rule."""
    known = parameter_grid(
        stimuli=VOLTAGES,
        thresholds=np.linspace(0, 30, 60),
        widths=np.geomspace(3, 80, 20),
        lapses=LAPSES,
        guesses=np.array([0.5]),
        prior=np.ones((60, 20, 5, 1)) * np.exp(-LAPSES / 0.03)[:, None],
    )
    rule, draws, runs = variance_rule(known), np.random.default_rng(16), np.arange(RUNS)
    posterior = np.broadcast_to(known.start(), (RUNS, *known.shape))
    given, right = np.zeros((2, RUNS, len(VOLTAGES)))
    for _ in range(trials):
        stimulus = best_stimulus(rule.gains(posterior))
        answer = draws.random(RUNS) < shares[stimulus]
        given[runs, stimulus] += 1
        right[runs, stimulus] += answer
        posterior = posterior_after(known, posterior, stimulus, answer)
    return given, right


def fitted(given: np.ndarray, right: np.ndarray) -> PsychometricFit:
    shown = given > 0
    return psychometric_fit(VOLTAGES[shown], right[shown], given[shown], guess=0.5, shape="logistic", priors=PRIORS)


@pytest.mark.parametrize(
    "someone",
    [
        Somebody("asymmetric-1", 0.213, 160),
        Somebody("asymmetric-2", 0.213, 160),
        Somebody("asymmetric-1", 0.639, 160),
        Somebody("asymmetric-2", 0.639, 160),
        Somebody("asymmetric-2", 0.639, 480),
    ],
    ids=str,
)
def test_a_run_brackets_the_voltage_of_three_in_four(someone: Somebody, soak: Soak) -> None:
    shares = shares_right(someone)
    true = float(np.interp(0.75, shares, VOLTAGES))
    fits = [fitted(*counts) for counts in zip(*adaptive_runs(shares, someone.trials), strict=True)]
    starts, estimates, ends = np.array([voltage_at(found, 0.75) for found in fits]).T
    held = int(((starts <= true) & (true <= ends)).sum())
    low, high = wilson_interval(held, RUNS)
    who = f"{someone.method}, {someone.sensitivity / 0.213:.0f} x the paper's sensitivity, {someone.trials} trials"
    soak(
        f"{who}: voltage of 75 % in the 95 % interval",
        f"{100 * held / RUNS:.1f} % [{100 * low:.1f}, {100 * high:.1f}]",
        f"{100 * WANTED:.0f} %",
        f"{RUNS} runs of the posterior rule; true {true:.2f} V, median estimate off by"
        f" {np.median(estimates) - true:+.2f} V, interval {np.median(ends - starts):.1f} V wide in the median;"
        f" the fit check has p < .05 in {100 * np.mean([found.goodness.p < 0.05 for found in fits]):.1f} % of runs",
    )
    assert held >= WANTED * RUNS


WHOLE = 500


def test_whole_sessions_bracket_the_voltage_of_three_in_four(memory: Path, soak: Soak) -> None:
    """Through the engine, the simulated gun and the journal to the table, and the report's own fit of that."""
    someone = Somebody("asymmetric-2", 0.213, 160)
    true = float(np.interp(0.75, shares_right(someone), VOLTAGES))
    setup, fits, rows = whole_setup(someone), list[PsychometricFit](), 0
    for seed in range(WHOLE):
        fit, answers = whole_session(setup, memory / str(seed), seed)
        fits.append(fit)
        rows += answers
        shutil.rmtree(memory / str(seed))
    assert (len(fits), rows) == (WHOLE, WHOLE * someone.trials)
    starts, estimates, ends = np.array([voltage_at(found, 0.75) for found in fits]).T
    held = int(((starts <= true) & (true <= ends)).sum())
    low, high = wilson_interval(held, WHOLE)
    soak(
        f"whole sessions, {someone.method}, the paper's sensitivity, {someone.trials} trials: voltage of 75 % in the"
        " 95 % interval",
        f"{100 * held / WHOLE:.1f} % [{100 * low:.1f}, {100 * high:.1f}]",
        f"{100 * WANTED:.0f} %",
        f"{WHOLE} runs of the engine on the simulated gun with a model-based participant, journal to table, then the"
        f" report's fit (cumulative normal); true {true:.2f} V, median estimate off by"
        f" {np.median(estimates) - true:+.2f} V, interval {np.median(ends - starts):.1f} V wide in the median",
    )
    assert held >= WANTED * WHOLE


@pytest.fixture
def memory() -> Iterator[Path]:
    """A folder in memory, where that can be: the runs are about levels and not about the disk."""
    shared = Path("/dev/shm")  # noqa: S108 - a folder of its own in it
    with TemporaryDirectory(dir=shared if shared.is_dir() else None) as folder:
        yield Path(folder)


@pytest.mark.parametrize("method", ["asymmetric-1", "asymmetric-2"])
def test_the_fit_check_says_that_the_curve_is_not_logistic(method: str, soak: Soak) -> None:
    shares = shares_right(Somebody(method, 0.213, 0))
    for trials in (100, 400, 2000):
        p = fit_checks(shares, trials)
        soak(
            f"{method}: its curve is noticed to be not logistic, {trials:,} trials a voltage",
            f"{(p < 0.05).sum()} of 20 data sets",
            "20 of 20" if trials == 2000 else "stated",
            f"{len(VOLTAGES)} voltages, p < .05; median p {np.median(p):.3f}",
        )
    assert (p < 0.05).all()


def test_a_curve_that_is_logistic_is_not_noticed(soak: Soak) -> None:
    p = fit_checks(0.5 + share_felt(VOLTAGES, 16.0, 37.0, "logistic") / 2, 2000)
    how = f"45 voltages, p < .05; median p {np.median(p):.3f}"
    soak("a logistic curve is noticed, 2,000 trials a voltage", f"{(p < 0.05).sum()} of 20 data sets", "at most 4", how)
    assert (p < 0.05).sum() <= 4


def fit_checks(shares: np.ndarray, trials: int) -> np.ndarray:
    """The p of the fit check for 20 data sets of so many trials a voltage."""
    right = np.random.default_rng(24).binomial(trials, shares, (20, len(VOLTAGES))).astype(float)
    return np.array([fitted(np.full(len(VOLTAGES), float(trials)), one).goodness.p for one in right])
