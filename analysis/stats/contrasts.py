"""Planned contrasts of conditions within people, each tested on its own error."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from analysis.stats.anova import check_scores, one_table, own_pairs
from analysis.stats.arrays import FloatArray, in_brief, numbers, share
from analysis.stats.corrections import Correction, corrected
from analysis.stats.frames import Result, Results, ScoreTable
from analysis.stats.paired import CONSTANT, EQUAL

_UNBALANCED = 1e-9
"""Weights that add up to more than this, of the largest, are no contrast: thirds are no doubles."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedContrast(Result):
    """One contrast: `estimate` is the sum of weights times means, `se` its own standard error, t on n - 1 df.

    `p_adjusted` is corrected for all contrasts asked for together; the interval is for this one alone. `d_z` is
    t / sqrt(n). Where the contrast is the same in every participant all but `estimate` is None, for `reason`.
    """

    name: str
    weights: tuple[float, ...]
    estimate: float
    se: float | None = None
    t: float | None = None
    df: int
    p: float | None = None
    p_adjusted: float | None = None
    ci_low: float | None = None
    ci_high: float | None = None
    d_z: float | None = None
    reason: str | None = None


def planned_contrasts(
    scores: ScoreTable,
    weights: Mapping[str, Sequence[float]],
    correction: Correction = "none",
    confidence: float = 0.95,
) -> Results[PlannedContrast]:
    """Contrasts of conditions within people, each on its own error, so that none needs sphericity.

    With c_i = sum_j w_j x_ij of participant i: t = mean(c) / (sd(c) / sqrt(n)) on n - 1 degrees of freedom.

    `scores`: (n participants, k conditions); `weights`: by the name of each contrast, k numbers that add up to 0.
    Weights whose positive ones add up to 1, such as (-1, 1/2, 1/2), leave `estimate` in the unit of the scores.
    `ValueError`: as in `rm_anova`; weights of another number, all 0, or with another sum, named.
    Sources: Rosenthal & Rosnow 1985, Contrast Analysis; Maxwell & Delaney 2004, Designing Experiments, chapter 13.

    >>> rates = [[0.5, 0.8, 0.9], [0.6, 0.7, 1.0], [0.5, 0.9, 0.8], [0.6, 0.8, 0.8]]
    >>> found, = planned_contrasts(rates, {"force against vibration": (-1.0, 0.5, 0.5)})
    >>> round(found.estimate, 4), round(found.t, 3), found.df
    (0.2875, 7.667, 3)
    """
    array = one_table(check_scores(scores))
    if not isinstance(weights, Mapping):
        raise ValueError(
            f"weights must be those of each contrast by its name, {{name: weights}}, not {in_brief(weights)}"
        )
    tests = [_contrast(array, name, _checked(name, some, array.shape[1]), confidence) for name, some in weights.items()]
    adjusted = iter(corrected([test.p for test in tests if test.p is not None], correction).tolist())
    return Results(test if test.p is None else replace(test, p_adjusted=next(adjusted)) for test in tests)


def _checked(name: str, weights: Sequence[float], k: int) -> FloatArray:
    if isinstance(weights, Mapping):
        order = "in the order of the conditions in `scores`"
        raise ValueError(f"weights of {name!r} must be {k} numbers {order}, not a mapping: {in_brief(weights)}")
    array = numbers(weights, f"weights of {name!r}")
    if array.shape != (k,):
        raise ValueError(f"weights of {name!r}: {k} numbers are needed, one a condition, not {in_brief(weights)}")
    largest, total = float(np.abs(array).max()), math.fsum(array)
    if largest == 0.0 or abs(total) > _UNBALANCED * largest:
        raise ValueError(
            f"weights of {name!r} must add up to 0 and not all be 0, but {list(weights)} add up to {total:g}"
        )
    return array


def _contrast(scores: FloatArray, name: str, weights: FloatArray, confidence: float) -> PlannedContrast:
    """The paired test of what is weighted positively against what is weighted negatively.

    As a pair it has the rules of pairs for scale, offset and rounding. Both sums are rounded once.
    """
    n, tail = len(scores), (1.0 - share(confidence, "confidence")) / 2.0
    wide, halves = scores.astype(np.longdouble), (np.maximum(-weights, 0.0), np.maximum(weights, 0.0))
    pair = own_pairs(np.stack([wide @ half for half in halves], axis=-1).astype(np.float64))
    estimate, se, q = float(pair.difference[0]), float(pair.error[0]) * math.sqrt(2.0), float(pair.q[0])
    found = PlannedContrast(name=name, weights=tuple(weights.tolist()), estimate=estimate, df=n - 1)
    if not math.isfinite(q):
        return replace(found, reason=CONSTANT if estimate else EQUAL)
    t = math.copysign(q / math.sqrt(2.0), estimate)
    half = -float(scipy.special.stdtrit(n - 1, tail)) * se
    return replace(
        found,
        se=se,
        t=t,
        p=2.0 * float(scipy.special.stdtr(n - 1, -abs(t))),
        ci_low=estimate - half,
        ci_high=estimate + half,
        d_z=t / math.sqrt(n),
    )
