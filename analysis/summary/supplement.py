"""Beside the core tests of an experiment: what a reader asks for besides F and Tukey.

Nothing here can fail on data that the core takes: what is undefined is None, and a `reason` beside it says why.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd

from analysis.stats.anova import rm_anova
from analysis.stats.arrays import FloatArray
from analysis.stats.cells import TrialCells
from analysis.stats.diagnostics import NORMALITY_NOTE, OUTLIER_RULE, ends, normality, outliers, unit_scaled
from analysis.stats.effect_sizes import EFFECT_SIZE_NOTE, effect_size
from analysis.stats.logit_model import MODEL_NAME, MODEL_NOTE, Clustering, LogitModel, clustering, logit_model
from analysis.stats.paired import CONSTANT, EQUAL, SCALE, PairedT, jzs_paired, paired_t_tests
from analysis.stats.rank_tests import friedman, signed_rank_tests
from analysis.stats.sphericity import sphericity
from analysis.stats.tukey import Comparison, rm_tukey_hsd_paired
from analysis.summary.results import (
    BayesFactor,
    BayesFactors,
    Diagnostics,
    FarScore,
    FriedmanTest,
    NamedModel,
    NotedEffectSize,
    NotedNormality,
    Outliers,
    OwnErrorPair,
    PostHoc,
    Supplement,
)
from device.words import DIRECTIONS

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


def within_supplement(scores: pd.DataFrame, scale: tuple[float, float]) -> Supplement | None:
    """Further statistics of scores, participants by methods, on a `scale` from lowest to highest.

    None for fewer than two participants or methods, as the ANOVA is.
    """
    if min(scores.shape) < 2:
        return None
    array, methods = scores.to_numpy(dtype="float64"), [str(method) for method in scores.columns]
    pairs = paired_t_tests(array, methods)
    return Supplement(
        sphericity=sphericity(array),
        effect_size=NotedEffectSize(size=effect_size(rm_anova(unit_scaled(array))), note=EFFECT_SIZE_NOTE),
        friedman=_friedman(array, methods),
        paired_t=pairs,
        tukey_paired=tuple(_finite(pair) for pair in rm_tukey_hsd_paired(array, methods)),
        tukey_paired_note=TUKEY_PAIRED_NOTE,
        bayes_factors=BayesFactors(
            r=SCALE, note=BAYES_NOTE, pairs=tuple(_bayes_factor(pair, len(array)) for pair in pairs)
        ),
        diagnostics=_diagnostics(scores, scale),
    )


def model(cells: TrialCells) -> NamedModel:
    """The logistic model of the forward answers."""
    place, methods = DIRECTIONS.index("forward"), cells.methods
    if min(len(cells.participants), len(methods)) < 2:
        found = LogitModel(reason="A model needs two participants and two methods.")
    else:
        found = logit_model(cells.correct[..., place], cells.trials[..., place], methods)
    return NamedModel(name=MODEL_NAME, note=MODEL_NOTE, fit=found)


def pooled_clustering(cells: TrialCells, method: str, direction: str) -> Clustering:
    """How the answers of a method and direction cluster in people, and what that leaves of their binomial test."""
    place = cells.methods.index(method), DIRECTIONS.index(direction)
    return clustering(cells.correct[:, *place], cells.trials[:, *place])


def _friedman(scores: FloatArray, methods: Sequence[str]) -> FriedmanTest:
    found = friedman(scores)
    return FriedmanTest(
        chi2=found.chi2,
        df=found.df,
        p=found.p,
        kendall_w=found.kendall_w,
        reason=found.reason,
        mean_ranks=dict(zip(methods, found.mean_ranks, strict=True)),
        post_hoc=PostHoc(name=SIGNED_RANKS, pairs=signed_rank_tests(scores, methods)),
    )


def _finite(pair: Comparison) -> OwnErrorPair:
    """A Tukey comparison with None for q, p and interval where the differences have no variance."""
    a, b, difference, q = str(pair.a), str(pair.b), float(pair.difference), float(pair.q)
    if not math.isfinite(q):
        return OwnErrorPair(a=a, b=b, difference=difference, reason=CONSTANT if difference else EQUAL)
    p, low, high = float(pair.p), float(pair.ci_low), float(pair.ci_high)
    return OwnErrorPair(a=a, b=b, difference=difference, q=q, p=p, ci_low=low, ci_high=high)


def _bayes_factor(pair: PairedT, n: int) -> BayesFactor:
    factor = None if pair.t is None else jzs_paired(pair.t, n)
    reason = pair.reason if factor is not None or pair.t is None else BEYOND
    return BayesFactor(a=str(pair.a), b=str(pair.b), bf10=factor, reason=reason)


def _diagnostics(scores: pd.DataFrame, scale: tuple[float, float]) -> Diagnostics:
    array, people, methods = scores.to_numpy(dtype="float64"), scores.index, [str(m) for m in scores.columns]
    at_ends = ends(array, scale)
    far = tuple(
        FarScore(participant=str(people[o.row]), method=methods[o.column], score=o.score, fence=o.fence)
        for o in outliers(array)
    )
    return Diagnostics(
        normality=NotedNormality(test=normality(array), note=NORMALITY_NOTE),
        outliers=Outliers(rule=OUTLIER_RULE, found=far),
        scale=scale,
        floor=dict(zip(methods, at_ends.floor, strict=True)),
        ceiling=dict(zip(methods, at_ends.ceiling, strict=True)),
    )
