"""Analyses of variance of two factors: both within people, or one within and one between. Computed by pingouin."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import helmert
from scipy.stats import f as f_distribution

from analysis.stats.arrays import FloatArray, numbers, pingouin
from analysis.stats.frames import Result, Results, ScoreTable, named_scores


@dataclass(frozen=True, slots=True, kw_only=True)
class FactorialEffect(Result):
    """One effect. `source` names its factors; `p_gg` is corrected by `epsilon` (Greenhouse and Geisser), if it can be.

    `size` is generalised eta squared where both factors are within people, partial eta squared in a mixed design.
    """

    source: tuple[str, ...]
    F: float
    df: tuple[int, int]
    p: float
    epsilon: float | None
    p_gg: float | None
    size: float


def two_within(scores: ArrayLike, names: tuple[str, str]) -> Results[FactorialEffect]:
    """The ANOVA of two factors within people: each effect against its own interaction with people.

    `scores`: (n people, a levels, b levels). `ValueError`: fewer than two people or levels, or no finite numbers.
    Sources: Winer 1971, chapter 7; Olejnik & Algina 2003, Psychological Methods 8, 434.

    >>> scores = [[[1, 2], [3, 6]], [[2, 2], [4, 9]], [[1, 3], [5, 7]], [[3, 4], [4, 8]]]
    >>> [(effect.source, round(effect.F, 2)) for effect in two_within(scores, ("method", "load"))][:2]
    [(('method',), 58.8), (('load',), 243.0)]
    """
    array = numbers(scores, "scores")
    if array.ndim != 3 or min(array.shape) < 2:
        raise ValueError(f"scores must be (people, levels, levels), each at least 2, not {array.shape}")
    n, a, b = array.shape
    who, one, other = (part.ravel() for part in np.indices((n, a, b)))
    table = pd.DataFrame({"who": who, "one": one, "other": other, "score": array.ravel()})
    found = _silent("rm_anova", table, dv="score", within=["one", "other"], subject="who")
    return _effects(found, names, df=("ddof1", "ddof2"), size="ng2")


def mixed(scores: ScoreTable, group: Sequence[str], names: tuple[str, str]) -> Results[FactorialEffect]:
    """The ANOVA of one factor between people and one within: `names` are theirs, in this order.

    `scores`: (n people, k levels), `group`: each one's group. `ValueError`: fewer than two groups or levels, a group of
    one, or no finite numbers. Source: Winer 1971, chapter 7; of groups of unequal size the levels are compared by the
    means of the groups' means, whatever their sizes (sums of squares of type III, as afex and SPSS have them).

    >>> scores = [[1, 2], [2, 4], [3, 4], [2, 7], [4, 8], [3, 9]]
    >>> [round(effect.F, 2) for effect in mixed(scores, ["old"] * 3 + ["young"] * 3, ("age", "load"))]
    [13.14, 90.25, 30.25]
    """
    array = named_scores(scores, "scores")[0]
    if array.ndim != 2 or array.shape[1] < 2 or array.shape[0] != len(group):
        raise ValueError(f"scores must be (people, levels) with a group for each person, not {array.shape}")
    sizes = {one: list(group).count(one) for one in group}
    if len(sizes) < 2 or min(sizes.values()) < 2:
        raise ValueError(f"at least two groups of two are needed, not {sizes}")
    n, k = array.shape
    who, level = (part.ravel() for part in np.indices((n, k)))
    table = pd.DataFrame({"who": who, "level": level, "group": np.repeat(list(group), k), "score": array.ravel()})
    found = _silent("mixed_anova", table, dv="score", within="level", between="group", subject="who")
    between, within, both = _effects(found, names, df=("DF1", "DF2"), size="np2")
    return Results((between, _of_unweighted_means(within, array, np.array(group)), both))


def _of_unweighted_means(effect: FactorialEffect, scores: FloatArray, group: NDArray[np.str_]) -> FactorialEffect:
    """The effect of the levels when each group counts alike; with groups of one size it is the same."""
    contrasts = helmert(scores.shape[1]) @ scores.T
    parts = [contrasts[:, group == one] for one in np.unique(group)]
    mean = np.mean([part.mean(axis=1) for part in parts], axis=0)
    explained = (mean**2).sum() / (sum(1.0 / part.shape[1] for part in parts) / len(parts) ** 2)
    left = sum(((part - part.mean(axis=1, keepdims=True)) ** 2).sum() for part in parts)
    df, df_error = effect.df
    F = float(explained / df / (left / df_error)) if left > 0 else math.nan
    eps = effect.epsilon
    return replace(
        effect,
        F=F,
        p=float(f_distribution.sf(F, df, df_error)),
        p_gg=None if eps is None or effect.p_gg is None else float(f_distribution.sf(F, eps * df, eps * df_error)),
        size=float(explained / (explained + left)),
    )


def _silent(function: str, table: pd.DataFrame, **asked: object) -> pd.DataFrame:
    """What a function of pingouin finds; what it warns of is for its authors."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found: pd.DataFrame = pingouin(function)(table, **asked)
    return found


def _effects(
    found: pd.DataFrame, names: tuple[str, str], *, df: tuple[str, str], size: str
) -> Results[FactorialEffect]:
    """The three effects of a table of pingouin, whose columns of freedom and size have these names."""
    sources = ((names[0],), (names[1],), names)
    return Results(
        FactorialEffect(
            source=source,
            F=float(row["F"]),
            df=(int(row[df[0]]), int(row[df[1]])),
            p=float(row["p_unc"]),
            epsilon=_known(row["eps"]),
            p_gg=_known(row.get("p_GG_corr", math.nan)),
            size=float(row[size]),
        )
        for source, (_, row) in zip(sources, found.iterrows(), strict=True)
    )


def _known(value: float) -> float | None:
    return None if math.isnan(value) else float(value)
