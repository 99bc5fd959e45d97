"""Analyses of variance of crossed factors: any number within people, and one between them if there are groups."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, combinations

import numpy as np
import scipy
from numpy.typing import NDArray

from analysis.stats.anova import F_UNDEFINED, NO_ERROR
from analysis.stats.arrays import FloatArray, in_brief, row_labels
from analysis.stats.frames import Result, Results, ScoreTable, named_scores
from analysis.stats.sums_of_squares import NOISE, exponent_of, scale, without_noise


@dataclass(frozen=True, slots=True, kw_only=True)
class FactorialEffect(Result):
    """One effect. `source` names its factors; `p_gg` is corrected by `epsilon` (Greenhouse and Geisser) within people.

    `size` is generalised eta squared, of factors that are all manipulated. As in `Anova`, an error no larger than
    rounding makes is none: F is infinite, or NaN if the effect is none either; `reason` says which.
    """

    source: tuple[str, ...]
    F: float
    df: tuple[int, int]
    p: float
    epsilon: float | None
    p_gg: float | None
    size: float

    @property
    def reason(self) -> str:
        """Why F is infinite or undefined, empty if it is neither."""
        return F_UNDEFINED if math.isnan(self.F) else NO_ERROR if math.isinf(self.F) else ""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stratum:
    """What some factors within people come to: each person's contrasts (n, df), and the squares left within groups."""

    factors: tuple[int, ...]
    parts: list[FloatArray]
    left: float
    noise: float

    @property
    def df(self) -> int:
        return int(self.parts[0].shape[1])

    @property
    def df_error(self) -> int:
        return self.df * sum(len(part) - 1 for part in self.parts)

    @property
    def epsilon(self) -> float:
        """Greenhouse and Geisser's: tr(S)^2 / (df tr(S^2)), S the covariance of the contrasts within groups."""
        rest = np.concatenate([part - part.mean(axis=0) for part in self.parts])
        covariance = rest.T @ rest
        squares = self.df * float((covariance**2).sum())
        return float(np.trace(covariance)) ** 2 / squares if squares > 0 else math.nan

    def within(self) -> float:
        """The squares that the levels explain when each group counts alike, whatever its size (type III)."""
        mean = np.mean([part.mean(axis=0) for part in self.parts], axis=0)
        return float((mean**2).sum() / (sum(1.0 / len(part) for part in self.parts) / len(self.parts) ** 2))

    def between(self) -> float:
        """The squares by which the groups differ."""
        grand = np.concatenate(self.parts).mean(axis=0)
        return float(sum(len(part) * ((part.mean(axis=0) - grand) ** 2).sum() for part in self.parts))


def factorial_anova(
    scores: ScoreTable, names: Sequence[str], group: Sequence[str] | None = None
) -> Results[FactorialEffect]:
    """The ANOVA of crossed factors, each effect against its own interaction with people.

    `scores`: (n people, levels of the first factor within people, of the second, ...). `group`: each one's group, if a
    factor varies between people. `names`: of the factors, the one between people first. `ValueError`: fewer than two
    people, levels or groups, a group of one, or no finite numbers. Groups of unequal size are compared as sums of
    squares of type III do, the levels by the means of the groups' means, as afex and SPSS have them. Of one
    factor within people `scores` may be a table with a column a level.
    Sources: Winer 1971, chapter 7; Olejnik & Algina 2003, Psychological Methods 8, 434.

    >>> [effect.source for effect in factorial_anova([[[1, 2], [2, 4]], [[1, 3], [2, 2]]], ["damper", "voltage"])]
    [('damper',), ('voltage',), ('damper', 'voltage')]
    """
    array = _unit_scaled(named_scores(scores, "scores")[0])
    factors = list(map(str, row_labels(names, "names")))
    within = factors if group is None else factors[1:]
    if array.ndim != 1 + len(within) or min(array.shape) < 2:
        raise ValueError(
            f"scores must be (people, levels, ...) of {len(within)} factors, each at least 2, not {array.shape}"
        )
    groups = np.array([""] * len(array) if group is None else list(map(str, row_labels(group, "group"))))
    sizes = {str(one): int((groups == one).sum()) for one in np.unique(groups)}
    if group is not None and (len(groups) != len(array) or len(sizes) < 2 or min(sizes.values()) < 2):
        raise ValueError(
            f"group must be one for each of the {len(array)} people, at least two groups of two, not {in_brief(sizes)}"
        )
    strata = [_stratum(array, groups, some) for some in _subsets(len(within))]
    all_left = sum(stratum.left for stratum in strata)
    found = []
    for stratum in strata:
        named = tuple(within[place] for place in stratum.factors)
        if named:
            found.append(_effect(named, stratum, stratum.within(), stratum.df, all_left))
        if group is not None:
            df = stratum.df * (len(sizes) - 1)
            found.append(_effect((factors[0], *named), stratum, stratum.between(), df, all_left))
    return Results(found)


def _unit_scaled(scores: FloatArray) -> FloatArray:
    """The scores within -1..1, by a power of two: no F hangs on it, and no square leaves the range of floats."""
    scaled = scores.copy()
    if scaled.size:
        scale(scaled, exponent_of(np.max(np.abs(scaled))))
    return scaled


def _subsets(count: int) -> Iterator[tuple[int, ...]]:
    """The factors of each effect, none first: main effects, then interactions of two, and so on."""
    return chain.from_iterable(combinations(range(count), size) for size in range(count + 1))


def _stratum(scores: FloatArray, groups: NDArray[np.str_], factors: tuple[int, ...]) -> _Stratum:
    """Orthonormal contrasts of these factors, of the mean over all others."""
    parts = [
        scipy.linalg.helmert(levels) if place in factors else np.full((1, levels), levels**-0.5)
        for place, levels in enumerate(scores.shape[1:])
    ]
    contrasts: FloatArray = np.ones((1, 1))
    for part in parts:
        contrasts = np.asarray(np.kron(contrasts, part), dtype=np.float64)
    values = scores.reshape(len(scores), -1) @ contrasts.T
    own = [values[groups == one] for one in np.unique(groups)]
    left = float(sum(((one - one.mean(axis=0)) ** 2).sum() for one in own))
    cells = math.prod(scores.shape[1:])  # a contrast rounds once for each
    return _Stratum(factors=factors, parts=own, left=left, noise=NOISE**2 * cells * float((scores**2).sum()))


def _effect(source: tuple[str, ...], stratum: _Stratum, explained: float, df: int, all_left: float) -> FactorialEffect:
    df_error = stratum.df_error
    squares = (np.array(value) for value in (explained, stratum.left, stratum.noise))
    explained, left = map(float, without_noise(*squares))
    without_error = math.inf if explained > 0 else math.nan
    F = explained / df / (left / df_error) if left > 0 else without_error
    epsilon = (stratum.epsilon if left > 0 else math.nan) if stratum.factors else None
    return FactorialEffect(
        source=source,
        F=F,
        df=(df, df_error),
        p=float(scipy.stats.f.sf(F, df, df_error)),
        epsilon=epsilon,
        p_gg=None if epsilon is None else float(scipy.stats.f.sf(F, epsilon * df, epsilon * df_error)),
        size=explained / (explained + all_left) if explained + all_left > stratum.noise else math.nan,
    )
