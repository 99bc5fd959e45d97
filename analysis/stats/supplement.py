"""Around the core tests of an experiment: what a reader asks for beside F and Tukey, ready for `statistics.json`.

Nothing here can fail on data that the core takes: what is undefined is None, and a `reason` beside it says why.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import pandas as pd

from analysis.stats.anova import rm_anova
from analysis.stats.arrays import FloatArray
from analysis.stats.cells import DIRECTIONS, TrialCells
from analysis.stats.diagnostics import NORMALITY_NOTE, OUTLIER_RULE, ends, normality, outliers, unit_scaled
from analysis.stats.effect_sizes import NOTE as EFFECT_SIZE_NOTE
from analysis.stats.effect_sizes import effect_size
from analysis.stats.logit_model import NAME as MODEL_NAME
from analysis.stats.logit_model import NOTE as MODEL_NOTE
from analysis.stats.logit_model import LogitModel, clustering, logit_model
from analysis.stats.paired import CONSTANT, EQUAL, SCALE, PairedT, jzs_paired, paired_t_tests
from analysis.stats.rank_tests import friedman, signed_rank_tests
from analysis.stats.sphericity import sphericity
from analysis.stats.tukey import rm_tukey_hsd_paired

Json = dict[str, Any]

WITHIN = ("sphericity", "effect_size", "friedman", "paired_t", "tukey_paired", "bayes_factors", "diagnostics")
"""The keys of `within_supplement`."""

SIGNED_RANKS = (
    "Wilcoxon's signed-rank test of each pair, Holm's correction. Chosen over Conover's and Nemenyi's because these "
    "compare mean ranks, which makes a pair's result depend on the other methods (Benavoli, Corani & Mangili 2016)."
)
TUKEY_PAIRED_NOTE = (
    "studentized range with each pair's own standard error and n − 1 degrees of freedom: needs no sphericity."
)
BAYES_NOTE = (
    "BF10 of the paired t-test: a Cauchy prior of scale r on the standardised mean difference against none at all "
    "(Rouder et al. 2009), each pair by itself, not adjusted for their number."
)
BEYOND = "The Bayes factor cannot be computed: it is above 1.8e308, or |t| is above 100."


def within_supplement(scores: pd.DataFrame, scale: tuple[float, float]) -> Json:
    """The keys `WITHIN` for scores, participants by methods, on a `scale` from lowest to highest.

    All None for fewer than two participants or methods, as the ANOVA is.
    """
    if min(scores.shape) < 2:
        return dict.fromkeys(WITHIN)
    array, methods = scores.to_numpy(dtype="float64"), [str(method) for method in scores.columns]
    pairs = paired_t_tests(array, methods)
    return {
        "sphericity": asdict(sphericity(array)),
        "effect_size": {**asdict(effect_size(rm_anova(unit_scaled(array)))), "note": EFFECT_SIZE_NOTE},
        "friedman": _friedman(array, methods),
        "paired_t": [asdict(pair) for pair in pairs],
        "tukey_paired": [_finite(asdict(pair)) for pair in rm_tukey_hsd_paired(array, methods)],
        "tukey_paired_note": TUKEY_PAIRED_NOTE,
        "bayes_factors": {"r": SCALE, "note": BAYES_NOTE, "pairs": [_bayes_factor(p, len(array)) for p in pairs]},
        "diagnostics": _diagnostics(scores, scale),
    }


def model(cells: TrialCells) -> Json:
    """The logistic model of the forward answers."""
    place, methods = DIRECTIONS.index("forward"), cells.methods
    if min(len(cells.participants), len(methods)) < 2:
        found = LogitModel(reason="A model needs two participants and two methods.")
    else:
        found = logit_model(cells.correct[..., place], cells.trials[..., place], methods)
    return {"name": MODEL_NAME, "note": MODEL_NOTE, **asdict(found)}


def pooled_clustering(cells: TrialCells, method: str, direction: str) -> Json:
    """How the answers of a method and direction cluster in people, and what that leaves of their binomial test."""
    place = cells.methods.index(method), DIRECTIONS.index(direction)
    return asdict(clustering(cells.correct[:, *place], cells.trials[:, *place]))


def _friedman(scores: FloatArray, methods: Sequence[str]) -> Json:
    found = asdict(friedman(scores))
    ranks = dict(zip(methods, found.pop("mean_ranks"), strict=True))
    pairs = [asdict(pair) for pair in signed_rank_tests(scores, methods)]
    return {**found, "mean_ranks": ranks, "post_hoc": {"name": SIGNED_RANKS, "pairs": pairs}}


def _finite(comparison: Mapping[str, Any]) -> Json:
    """A Tukey comparison with None for q, p and interval where the differences have no variance."""
    if math.isfinite(comparison["q"]):
        return {**comparison, "reason": None}
    reason = CONSTANT if comparison["difference"] else EQUAL
    return {**comparison, **dict.fromkeys(("q", "p", "ci_low", "ci_high")), "reason": reason}


def _bayes_factor(pair: PairedT, n: int) -> Json:
    factor = None if pair.t is None else jzs_paired(pair.t, n)
    reason = pair.reason if factor is not None or pair.t is None else BEYOND
    return {"a": pair.a, "b": pair.b, "bf10": factor, "reason": reason}


def _diagnostics(scores: pd.DataFrame, scale: tuple[float, float]) -> Json:
    array, people, methods = scores.to_numpy(dtype="float64"), scores.index, [str(m) for m in scores.columns]
    counts = {end: dict(zip(methods, found, strict=True)) for end, found in asdict(ends(array, scale)).items()}
    far = [
        {"participant": str(people[o.row]), "method": methods[o.column], "score": o.score, "fence": o.fence}
        for o in outliers(array)
    ]
    return {
        "normality": {**asdict(normality(array)), "note": NORMALITY_NOTE},
        "outliers": {"rule": OUTLIER_RULE, "found": far},
        "scale": list(scale),
        **counts,
    }
