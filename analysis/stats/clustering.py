"""Trials come in people: how alike the answers of one person are, and what that leaves of a pooled binomial test."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from analysis.stats.arrays import FloatArray, numbers, share

METHOD = (
    "Clustering: the intraclass correlation is the analysis-of-variance estimate for binary answers (Ridout, Demétrio "
    "& Firth 1999); the design effect is 1 + (sum m² / sum m − 1) times it, over participants with m trials; the "
    "adjusted p is that of the rate with its variance times the design effect, or times 1 if that is larger (Rao & "
    "Scott 1992), on t(participants − 1)."
)
ONE_PERSON = "There are fewer than two participants: nothing tells the spread between people from chance."
ONE_TRIAL = "Nobody has two trials: nothing tells the spread between people from chance."
NO_SPREAD = "All answers are equal: the intraclass correlation is 0/0."


@dataclass(frozen=True, slots=True, kw_only=True)
class Clustering:
    """Intraclass correlation (it may be negative), design effect and the p-value it leaves; None for `reason`."""

    icc: float | None = None
    design_effect: float | None = None
    p_adjusted: float | None = None
    reason: str | None = None


def clustering(successes: ArrayLike, trials: ArrayLike, p0: float = 0.5) -> Clustering:
    """The clustering of binary answers in people, and the test of the pooled rate against `p0` that allows for it.

    With m_i trials and rate p_i of n participants, M = sum m_i, pooled rate p: MSB = sum m_i (p_i - p)^2 / (n - 1),
    MSW = sum m_i p_i (1 - p_i) / (M - n), m_0 = (M - sum m_i^2 / M) / (n - 1),
    icc = (MSB - MSW) / (MSB + (m_0 - 1) MSW), D = 1 + (sum m_i^2 / M - 1) icc,
    t(n - 1) = (p - p0) / sqrt(max(D, 1) p0 (1 - p0) / M). By simulation of 14 x 10 trials at p0 = .5 (rho 0 to .3) its
    size at .05 is .025 to .045, where the pooled test's grows to .28.

    `successes, trials`: (n,), participants without a trial do not count. `ValueError`: successes outside 0..trials.
    Sources: Ridout, Demetrio & Firth 1999, Biometrics 55, 137; Rao & Scott 1992, Biometrics 48, 577.
    """
    y, m = numbers(successes, "successes"), numbers(trials, "trials")
    if y.shape != m.shape or ((y < 0.0) | (y > m)).any():
        raise ValueError("successes must lie in 0..trials, one of each a participant")
    y, m = y[m > 0.0], m[m > 0.0]
    reason = _undefined(y, m)
    if reason is not None:
        return Clustering(reason=reason)
    icc = _icc(y, m)
    design_effect = 1.0 + (float((m**2).sum() / m.sum()) - 1.0) * icc
    variance = max(design_effect, 1.0) * share(p0, "p0") * (1.0 - p0) / float(m.sum())
    t = abs(float(y.sum() / m.sum()) - p0) / math.sqrt(variance)
    p = 2.0 * float(special.stdtr(m.size - 1, -t))
    return Clustering(icc=icc, design_effect=design_effect, p_adjusted=p)


def _undefined(y: FloatArray, m: FloatArray) -> str | None:
    if m.size < 2:
        return ONE_PERSON
    if m.max() < 2.0:
        return ONE_TRIAL
    return NO_SPREAD if y.sum() in (0.0, m.sum()) else None


def _icc(y: FloatArray, m: FloatArray) -> float:
    n, total, rates = m.size, float(m.sum()), y / m
    between = float((m * np.square(rates - y.sum() / total)).sum()) / (n - 1)
    within = float((m * rates * (1.0 - rates)).sum()) / (total - n)
    size = (total - float((m**2).sum()) / total) / (n - 1)
    return (between - within) / (between + (size - 1.0) * within)
