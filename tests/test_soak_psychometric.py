"""The full figures of psychometric fits and paired scores: against other programs, and the coverage of intervals."""

from __future__ import annotations

import json
import os
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis import paired_scores, psychometric_fit
from analysis.psychometric.priors import PlateauPrior, default_priors
from analysis.stats.binomial import binomial_test
from experiments.design.procedures.psychometric import share_felt
from tests.conftest import Soak
from tests.threshold_bound import width_of

pytestmark = pytest.mark.soak

ROOT = Path(__file__).parent.parent
PEERS = Path(os.environ.get("RECOIL_PEERS", ROOT / ".venv-peers/bin/python"))
"""A Python with psignifit: uv venv .venv-peers; uv pip install --python .venv-peers psignifit==4.3"""
LEVELS, TRIALS, SD = np.linspace(-4.0, 4.0, 9), np.full(9, 20), 2.0
SETS, MOST_S = 20, 480.0
KINDS: Mapping[str, float | None] = {"2AFC": 0.5, "yes/no": None}


def data_sets(*, free: bool) -> list[dict[str, Any]]:
    """Nine levels of 20 trials, a cumulative normal of sd 2, a lapse rate of 0.02, a guess rate of 0.5 or 0.05."""
    stream, found = np.random.default_rng(0), []
    for number in range(SETS):
        kind = tuple(KINDS)[number % 2]
        guess = 0.5 if kind == "2AFC" else 0.05
        shares = guess + (1 - guess - 0.02) * share_felt(LEVELS, stream.uniform(-1, 1), width_of(SD))
        right = stream.binomial(TRIALS, shares)
        found.append(
            {"levels": LEVELS.tolist(), "right": right.tolist(), "trials": TRIALS.tolist(), "kind": kind, "free": free}
        )
    return found


@pytest.mark.parametrize(("free", "bound"), [(False, 100), (True, 20)], ids=["overdispersion 0", "fitted"])
def test_against_psignifit(soak: Soak, free: bool, bound: int) -> None:
    asks = [str(PEERS), "-c", "import psignifit"]
    if not PEERS.exists() or subprocess.run(asks, capture_output=True, check=False).returncode:
        pytest.skip("psignifit is not there: uv venv .venv-peers; uv pip install --python .venv-peers psignifit==4.3")
    cases = data_sets(free=free)
    theirs = subprocess.run(
        [str(PEERS), str(ROOT / "tests/psignifit_fits.py"), str(MOST_S)],
        input=json.dumps(cases),
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    )
    peers = [json.loads(line) for line in theirs.stdout.splitlines()]
    psychometric_fit(LEVELS, TRIALS // 2, TRIALS, guess=0.5, overdispersed=free)
    ours_s, theirs_s, off = 0.0, 0.0, 0.0
    for case, peer in zip(cases, peers, strict=False):
        began_s = time.process_time()
        fit = psychometric_fit(
            case["levels"], case["right"], case["trials"], guess=KINDS[case["kind"]], overdispersed=free
        )
        ours_s, theirs_s = ours_s + time.process_time() - began_s, theirs_s + peer["took_s"]
        off = max(off, abs(fit.threshold.mean - peer["mean"]["threshold"]) / SD)
        off = max(off, abs(fit.width.mean - peer["mean"]["width"]) / width_of(SD))
    named = "overdispersion fitted" if free else "overdispersion 0"
    n = len(peers)
    how = f"{n} data sets, half 2AFC; {1e3 * ours_s / n:.1f} ms of CPU against {theirs_s / n:.2f} s"
    soak(f"a fit beside psignifit 4.3, {named}: times as fast", f"{theirs_s / ours_s:.0f}", f"≥ {bound}", how)
    soak(
        f"... means of threshold and width, {named}: farthest, in sd",
        f"{off:.4f}",
        "≤ 0.02",
        "same priors and estimator",
    )
    assert off <= 0.02


def drawn_priors(kind: str) -> dict[str, Any]:
    """The priors with which the intervals of such data are made: psignifit's for these levels."""
    return {"priors": default_priors(LEVELS), "guess": KINDS[kind]}


def from_plateau(prior: PlateauPrior, stream: np.random.Generator) -> float:
    """A draw from a prior by rejection."""
    while True:
        place = stream.uniform(prior.low, prior.high)
        if stream.random() < prior.density(np.array([place]))[0]:
            return float(place)


def from_rate(stream: np.random.Generator) -> float:
    """A draw from Beta(1, 10) up to 0.5."""
    while (rate := stream.beta(1, 10)) > 0.5:
        pass
    return float(rate)


def held(
    truths: Callable[[np.random.Generator], tuple[float, float, float, float]], kind: str, sets: int
) -> dict[str, int]:
    """How often the 95 % interval of each parameter holds the truth, of so many data sets."""
    stream, given = np.random.default_rng(17), drawn_priors(kind)
    counted = dict.fromkeys(("threshold", "width", "lapse", "guess"), 0)
    for _ in range(sets):
        truth = dict(zip(counted, truths(stream), strict=True))
        felt = share_felt(LEVELS, truth["threshold"], truth["width"])
        shares = truth["guess"] + (1 - truth["guess"] - truth["lapse"]) * felt
        fit = psychometric_fit(LEVELS, stream.binomial(TRIALS, np.clip(shares, 0, 1)), TRIALS, **given)
        for name in counted:
            counted[name] += getattr(fit, name).low <= truth[name] <= getattr(fit, name).high
    return counted


def of_prior(kind: str, stream: np.random.Generator) -> tuple[float, float, float, float]:
    """Threshold, width, lapse and guess rate, drawn from their priors."""
    priors = default_priors(LEVELS)
    guess = 0.5 if kind == "2AFC" else from_rate(stream)
    return from_plateau(priors.threshold, stream), from_plateau(priors.width, stream), from_rate(stream), guess


@pytest.mark.parametrize("kind", KINDS)
def test_coverage_of_intervals_with_truths_from_the_prior(soak: Soak, kind: str) -> None:
    sets = 2000
    found = held(partial(of_prior, kind), kind, sets)
    if kind == "2AFC":
        del found["guess"]
    for name, count in found.items():
        ends = binomial_test(count, sets)
        how = f"{sets} data sets of 9 × 20 trials, truths from the priors of the fit; exact interval "
        how += f"{ends.ci_low:.3f} to {ends.ci_high:.3f}"
        soak(f"95 % intervals of the {name}, {kind}: coverage", f"{count / sets:.3f}", ".94 to .96", how)
        assert ends.ci_low <= 0.96
        assert ends.ci_high >= 0.94


FIXED: Sequence[tuple[float, float, float]] = (
    (0.0, 2.0, 0.02), (0.0, 2.0, 0.0), (0.0, 2.0, 0.1), (0.0, 0.8, 0.02), (0.0, 4.0, 0.02),
    (2.0, 2.0, 0.02), (3.5, 2.0, 0.02), (-3.5, 2.0, 0.02), (5.0, 2.0, 0.02), (0.0, 8.0, 0.02), (0.0, 2.0, 0.3),
)  # fmt: skip
WHY = {
    "wide": "the width is beyond three spans, where the prior ends, and the threshold gives way with it",
    "lapses": "so many lapses have 3 % of the prior Beta(1, 10), and are taken in part for a higher threshold",
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("truth", FIXED, ids=str)
def test_coverage_at_fixed_truths(soak: Soak, kind: str, truth: tuple[float, float, float]) -> None:
    threshold, sd, lapse = truth
    sets, guess = 500, 0.5 if kind == "2AFC" else 0.05
    found = held(lambda _: (threshold, width_of(sd), lapse, guess), kind, sets)
    shown = f"threshold {found['threshold'] / sets:.3f}, width {found['width'] / sets:.3f}"
    low = min(found["threshold"], found["width"]) / sets < 0.90
    cause = "wide" if sd > 3 else "lapses"
    how = f"{sets} data sets of 9 × 20 trials, levels −4 to 4" + (f"; below .90: {WHY[cause]}" if low else "")
    named = f"coverage at threshold {threshold:g}, sd {sd:g}, lapse {lapse:g}, {kind}"
    soak(named, shown, "a table; what is below .90 explained", how)


@pytest.mark.parametrize("model", ["bradley-terry", "thurstone"])
def test_scores_of_fifty_designs(soak: Soak, model: Any) -> None:
    choix = json.loads((ROOT / "tests/golden/choix.json").read_text())
    by_r = json.loads((ROOT / "tests/golden/r/pairs_expected.json").read_text())
    off_choix = off_r = 0.0
    for ours, theirs in zip(choix, by_r["cases"], strict=True):
        found = np.array(
            [one.score for one in paired_scores(range(len(ours["wins"])), ours["wins"], model=model).scores]
        )
        off_r = max(off_r, float(np.abs(found - theirs[model]["scores"]).max()))
        off_choix = max(off_choix, float(np.abs(found - ours["scores"]).max()))
    version = by_r["r"].split(" (")[0]
    how = f"{len(choix)} designs of 3 to 8 items; {version}'s glm, by which BradleyTerry2 fits fixed effects"
    soak(f"paired scores, {model}: farthest from R", f"{off_r:.0e}", "≤ 1e-6", how)
    assert off_r <= 1e-6
    if model == "bradley-terry":
        soak("paired scores, bradley-terry: farthest from choix 0.4", f"{off_choix:.0e}", "≤ 1e-6", "the same designs")
        assert off_choix <= 1e-6
