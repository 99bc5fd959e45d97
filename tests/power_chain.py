"""Simulated studies through the real chain of logs and statistics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from analysis.logs.reading import read_logs
from analysis.predict.power.grid import PowerRequest, make_grid
from analysis.predict.power.planned import ANOVA, ANY_PAIR, Findings, analysed_directions, analysed_ratings
from analysis.summary.summary import summarize
from experiments.clock import VirtualClock
from experiments.config.door import participant_codes
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.load import load_setup
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.synthetic.laws import RatesLaw, RatingsLaw, SyntheticAnswers

EQUAL = [0.0, 0.0, 0.0]


def null_setup(experiment: str) -> Setup[DesignConfig]:
    """The shipped design with null participants, as steps and logs know them: guessing, or without preference."""
    setup = load_setup(experiment)
    null = make_grid(PowerRequest(config=experiment, participants="14", null=True)).cells[0].config
    if isinstance(null.law, RatesLaw):
        alike: dict[str, object] = {"share": dict.fromkeys(null.law.share, 0.5)}
    elif isinstance(null.law, RatingsLaw):
        means = null.law.mean.values()
        alike = {"mean": dict.fromkeys(null.law.mean, sum(means) / len(means))}
    laws = setup.laws.model_dump()
    laws["questions"][null.question] = null.law.model_dump() | alike
    return replace(setup, laws=SyntheticAnswers.model_validate(laws))


def through_the_chain(setup: Setup[DesignConfig], participants: int, seed: int, folder: Path) -> dict[str, Any]:
    """The statistics of a study whose every answer went through a session, a journal and a table."""
    for code in participant_codes(participants):
        asked = RunRequest(setup=setup, participant_id=code, results=folder, seed=seed, again="resume")
        run(asked, synthetic_screen, VirtualClock())
    logs = read_logs([folder])
    assert not logs.problems
    found: dict[str, Any] = summarize(logs).to_dict()[setup.config.experiment]
    return found


def counted(found: dict[str, Any]) -> Findings:
    """What the power analysis says of the scores behind a study's statistics."""
    methods = found["methods"]
    scores = table(found["participants"], methods)
    if "backward" not in found:
        return analysed_ratings(scores[None], methods, EQUAL)
    both = np.stack([scores, table(found["backward"]["participants"], methods)], axis=-1)
    return analysed_directions(np.rint(10 * both).astype(np.int64)[None], (10, 10), methods, EQUAL, EQUAL)


def table(participants: dict[str, dict[str, float]], methods: list[str]) -> np.ndarray:
    return np.array([[person[method] for method in methods] for person in participants.values()])


def said(found: dict[str, Any]) -> dict[str, bool]:
    """Which of the planned tests are significant by `statistics.json`, in the words of the power analysis."""
    tukey = {f"Tukey, {pair['a']} other than {pair['b']}": pair["p"] < 0.05 for pair in found["tukey"]}
    binomial = {
        f"binomial, {method} {direction}": test["p"] < 0.05
        for method, tests in found.get("binomial", {}).items()
        for direction, test in tests.items()
    }
    d_prime = {}
    for method, row in found.get("sensitivity", {}).items():
        spread = row["d_prime"]["sd"] / np.sqrt(found["n"])
        interval = counted(found).half_widths[f"d′, {method}"][0]
        d_prime[f"d′, {method}"] = abs(row["d_prime"]["mean"]) > interval
        assert interval > spread
    return {ANOVA: found["anova"]["p"] < 0.05, **tukey, ANY_PAIR: any(tukey.values()), **binomial, **d_prime}


def homogeneity_p(one: np.ndarray, other: np.ndarray) -> float:
    """The chi-square test that two samples of whole numbers have one distribution; rare values pooled."""
    edges = np.unique(np.quantile(other, [0.0, 0.1, 0.25, 0.5, 0.75, 0.9]))
    table = [
        np.bincount(np.clip(np.searchsorted(edges, x, "right") - 1, 0, None), minlength=len(edges))
        for x in (one, other)
    ]
    return float(stats.chi2_contingency(np.array(table)).pvalue)
