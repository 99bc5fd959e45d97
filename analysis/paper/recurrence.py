"""How often published claims recur over many studies: one study is luck."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.paper.paper import PublishedDirection, PublishedExperiment, PublishedTukeyTest
from analysis.stats.anova import PairStatistics, check_scores, pairs_of, pooled_pairs, rm_anova
from analysis.stats.binomial import binomial_test_p
from analysis.stats.corrections import SIGNIFICANT
from analysis.stats.studentized_range import studentized_range_isf

WHOLE_PATTERN = "whole pattern"

Recurrence = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class ShareOfStudies:
    """The share of studies in which a claim held, with its 95 % Wilson interval: the Monte Carlo error."""

    claim: str
    held: int
    share: float
    ci_low: float
    ci_high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternOdds:
    """How often an experiment's published claims recur under `assumptions`, which say what was simulated."""

    experiment: str
    replications: int
    rows: tuple[ShareOfStudies, ...]
    assumptions: str


def recurs(scores: ArrayLike, published: PublishedExperiment) -> dict[str, Recurrence]:
    """Which published claims hold in which replication.

    `scores`: (..., n participants, k methods), methods in the order of `published.methods`. One array (...) a claim:
    the ANOVA's p below its bound; each Tukey comparison significant at its bound (by the critical q, pooled
    repeated-measures error) and in the published direction. Where nothing varies (0/0) a claim does not hold.
    `ValueError`: as in `rm_anova`, or if k is not the number of methods.
    """
    checked = check_scores(scores)
    if checked.shape[-1] != len(published.methods):
        raise ValueError(f"scores must have {len(published.methods)} methods, not {checked.shape[-1]}")
    bound = published.anova.p_below
    claims = {f"ANOVA p < {bound}": np.asarray(np.asarray(rm_anova(checked).p) < float(bound))}
    pairs = pooled_pairs(checked)
    for claim in published.tukey:
        name = f"{claim.higher} above {claim.lower}, p < {claim.p_below}"
        claims[name] = _holds(pairs, claim, published.methods)
    return claims


def chance_recurs(correct: ArrayLike, trials: tuple[int, int], published: PublishedDirection) -> dict[str, Recurrence]:
    """In which replication the exact binomial test comes out as published: rejecting one half, or not, at 5 %.

    `correct`: (..., k methods, 2 directions), counts of correct answers pooled over participants, of so many `trials`
    forward and backward; methods in the order of `published.methods`, forward before backward.
    """
    counts = np.asarray(correct)
    claims = {}
    for claim in published.binomial:
        method, direction = published.methods.index(claim.method), ("forward", "backward").index(claim.direction)
        rejected = np.asarray(binomial_test_p(counts[..., method, direction], trials[direction])) < SIGNIFICANT
        expected = float(claim.p) < SIGNIFICANT
        outcome = "p < .05" if expected else "p not below .05"
        claims[f"binomial, {claim.method} {claim.direction}, {outcome}"] = np.asarray(rejected == expected)
    return claims


def answers_recur(correct: ArrayLike, trials: tuple[int, int], published: PublishedDirection) -> dict[str, Recurrence]:
    """Which published claims of experiment 1 hold in which study: those of `recurs` and of `chance_recurs`.

    `correct`: (studies, n participants, k methods, 2 directions), counts of correct answers of so many `trials`
    forward and backward of each person and method; methods in the order of `published.methods`.
    """
    counts = np.asarray(correct)
    n = counts.shape[-3]
    pooled = n * trials[0], n * trials[1]
    return recurs(counts[..., 0] / trials[0], published) | chance_recurs(counts.sum(axis=-3), pooled, published)


def with_whole_pattern(claims: Mapping[str, Recurrence]) -> dict[str, Recurrence]:
    """The claims, and all of them together: the paper's whole pattern of significance."""
    return {**claims, WHOLE_PATTERN: np.logical_and.reduce(list(claims.values()))}


def share_of(claim: str, held: int, studies: int) -> ShareOfStudies:
    """The share of so many studies in which a claim held."""
    low, high = wilson_interval(held, studies)
    return ShareOfStudies(claim=claim, held=held, share=held / studies, ci_low=low, ci_high=high)


def odds_of(experiment: str, recurrences: Mapping[str, ArrayLike], assumptions: str) -> PatternOdds:
    """The share of replications in which each claim recurred, and all of them together under `whole pattern`.

    `ValueError` without any replication.
    """
    flags = {claim: np.asarray(held, dtype=np.bool_).ravel() for claim, held in recurrences.items()}
    sizes = {held.size for held in flags.values()}
    if len(sizes) != 1 or 0 in sizes:
        raise ValueError(f"{experiment}: every claim needs the same number of replications, not {sorted(sizes)}")
    rows = [share_of(claim, int(held.sum()), held.size) for claim, held in with_whole_pattern(flags).items()]
    return PatternOdds(experiment=experiment, replications=sizes.pop(), rows=tuple(rows), assumptions=assumptions)


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """Wilson's score interval of a proportion, at 95 %. Source: Wilson 1927, JASA 22, 209.

    >>> [round(x, 4) for x in wilson_interval(2, 10)]
    [0.0567, 0.5098]
    """
    z = NormalDist().inv_cdf(0.975)
    share = successes / trials
    centre = share + z * z / (2.0 * trials)
    half = z * math.sqrt(share * (1.0 - share) / trials + z * z / (4.0 * trials * trials))
    scale = 1.0 + z * z / trials
    low = 0.0 if successes == 0 else (centre - half) / scale
    return low, 1.0 if successes == trials else (centre + half) / scale


def _holds(pairs: PairStatistics, claim: PublishedTukeyTest, methods: list[str]) -> Recurrence:
    higher, lower = methods.index(claim.higher), methods.index(claim.lower)
    i = pairs_of(pairs.k).index((max(higher, lower), min(higher, lower)))
    difference = pairs.difference[..., i] if higher > lower else -pairs.difference[..., i]
    above: Recurrence = (difference > 0.0) & (pairs.q[..., i] > _critical(float(claim.p_below), pairs.k, pairs.df))
    return above


@lru_cache(maxsize=64)
def _critical(p: float, k: int, df: int) -> float:
    return float(studentized_range_isf(p, k, df))
