"""The full figures behind `recoil fit percept`: recovery, the judgement by what was not fitted, null participants."""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.paper.recurrence import wilson_interval
from analysis.predict.fit.percept_model import FITTED, Fitted, fit_percept
from analysis.predict.jobs import on_processes
from analysis.predict.power.planned import ANOVA, ANY_PAIR
from analysis.report.copies import cores
from device.methods import paper_methods
from experiments.design.streams import generator
from experiments.load import load_setup
from experiments.synthetic.decision import forward_rates
from experiments.synthetic.diffusion import People
from experiments.synthetic.percept import PerceptParameters, evidence, percepts_of
from tests.conftest import RECOIL, Soak
from tests.felt_configs import felt_config
from tests.power_chain import counted, said, through_the_chain

pytestmark = pytest.mark.soak

SETS = 200
STUDIES = 100_000
LOGGED = 40
SPREADS = {"drift_factor_sd": 0.2, "log_boundary_sd": 0.1, "log_non_decision_sd": 0.1, "logit_start_sd": 0.2}
TRUTH = PerceptParameters()


def recoil(*words: object) -> Any:
    done = subprocess.run([RECOIL, *map(str, words), "--json"], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def percent(one: dict[str, Any], key: str) -> str:
    return f"{100 * one[key]:.1f} % [{100 * one['ci_low']:.1f}, {100 * one['ci_high']:.1f}]"


def test_the_published_numbers_among_10_000_studies_of_the_fit(tmp_path: Path, soak: Soak) -> None:
    begun = time.perf_counter()
    found = recoil("fit", "percept", "--studies", 10_000, "--out", tmp_path / "fit")
    seconds = time.perf_counter() - begun
    soak("fit, 4 x 10,000 studies and report", f"{seconds:.1f} s", "60 s", f"{cores()} cores")
    for name, one in found["fitted"].items():
        interval = f"{one['value']:.3f} [{one['ci_low']:.3f}, {one['ci_high']:.3f}]"
        soak(f"fitted to the paper's forward rates: {name}", interval, "stated", "95 % profile likelihood")
    for case in found["judged"]["cases"]:
        how = f"10,000 studies of 14, {case['name']}, 95 % Monte Carlo interval"
        for place in case["places"]:
            label = f"{case['name']}: percentile of {place['quantity']} = {place['published']}"
            soak(label, percent(place, "percentile"), "fitted" if place["fitted"] else "2.5 to 97.5", how)
        for claim in case["claims"]:
            soak(f"{case['name']}: {claim['claim']}", percent(claim, "share"), "stated", how)
    main = found["judged"]["cases"][found["judged"]["main"]]
    F = main["places"][0]
    assert 0.025 < F["percentile"] < 0.975
    assert seconds < 60


def refitted(times: int, number: int) -> dict[str, Fitted]:
    """The percept fitted to a simulated study of the default percept and people alike."""
    trials, felt = 140 * times, percepts_of(paper_methods(), TRUTH.leak_s)
    draws = generator(number, "percept recovery", str(times))
    rates = {
        name: float(draws.binomial(trials, forward_rates(evidence(one, TRUTH), TRUTH.start, People()))) / trials
        for name, one in felt.items()
    }
    return fit_percept(rates, paper_methods(), trials=trials).fitted


@pytest.mark.parametrize("times", [1, 10])
def test_recovery_of_the_percept(times: int, soak: Soak) -> None:
    begun, fits = time.perf_counter(), dict[int, dict[str, Fitted]]()
    with on_processes(cores()) as run:
        run(partial(refitted, times), range(SETS), fits.__setitem__)
    seconds = time.perf_counter() - begun
    for name in FITTED:
        true, found = getattr(TRUTH, name), [one[name] for one in fits.values()]
        covered = float(np.mean([one.ci_low <= true <= one.ci_high for one in found]))
        values = np.array([one.value for one in found])
        bounded = np.mean([one.ci_low > 0.0 and np.isfinite(one.ci_high) for one in found])
        low, middle, high = np.percentile(values, (2.5, 50.0, 97.5))
        soak(
            f"percept from {140 * times} forward trials a method: {name} = {true:g}",
            f"median {middle:.3f}, 95 % of the estimates {low:.3f} to {high:.3f}, coverage {100 * covered:.1f} %",
            "95 % +- 3.1 %",
            f"{SETS} sets, interval bounded on both sides in {100 * bounded:.0f} %; {seconds:.0f} s",
        )
        assert 0.90 < covered <= 1.0


def test_null_participants_who_feel_nothing_at_large_n(tmp_path: Path, soak: Soak) -> None:
    config = felt_config(tmp_path, spreads=SPREADS)
    found = recoil("power", config, "--null", "--participants", 14, "--studies", STUDIES, "--out", tmp_path / "null")
    for design in found["designs"]:
        shares = {share["claim"]: share for share in design["claims"]}
        for claim in (name for name in shares if "other than" not in name):
            share = shares[claim]
            inside = "inside" if share["ci_low"] <= 0.05 <= share["ci_high"] else "outside"
            how = f"{STUDIES:,} studies of 14 {design['people']}; 5 % {inside} the interval"
            soak(f"felt, evidence 0: false positives, {claim}", percent(share, "share"), "5 %", how)
        for claim in (ANOVA, ANY_PAIR):
            assert abs(shares[claim]["share"] - 0.05) < 0.003


def one_study(folder: str, config: str, seed: int) -> dict[str, tuple[bool, bool]]:
    """Of each claim: what the logs' statistics say, and what the power analysis says of the same answers."""
    where = Path(tempfile.mkdtemp(dir=folder))
    try:
        found = through_the_chain(load_setup(config), 14, seed, where)
        counts = counted(found).claims
        return {claim: (bool(held), bool(counts[claim][0])) for claim, held in said(found).items()}
    finally:
        shutil.rmtree(where)


def test_null_participants_who_feel_nothing_through_real_logs(tmp_path: Path, soak: Soak) -> None:
    """40 studies of 14 people: 560 runs with journal and table, read and summarised as `recoil analyze` does."""
    config = felt_config(tmp_path, spreads=SPREADS, sensitivity=0.0)
    studies: dict[int, dict[str, tuple[bool, bool]]] = {}
    with on_processes(cores()) as run:
        run(partial(one_study, str(tmp_path), str(config)), range(1, LOGGED + 1), studies.__setitem__)
    differing = sum(said_so != counted_so for one in studies.values() for said_so, counted_so in one.values())
    soak("felt: claims that logs and power analysis judge differently", differing, "0", f"{LOGGED} studies of 14")
    assert (differing, len(studies)) == (0, LOGGED)
    for claim in (ANOVA, ANY_PAIR):
        held = sum(one[claim][0] for one in studies.values())
        low, high = wilson_interval(held, LOGGED)
        figure = f"{100 * held / LOGGED:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
        soak(f"felt, evidence 0: false positives through real logs, {claim}", figure, "5 % inside", f"{LOGGED} studies")
        assert low <= 0.05 <= high
