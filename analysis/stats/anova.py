"""Analysis of variance of one factor, between or within participants, for one data set or many at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from analysis.stats.arrays import FloatArray, Values, float_or_array, numbers
from analysis.stats.sums_of_squares import Sums, between_sums, repeated_sums, unscaled

NO_ERROR = "no error variance: the effect is the same in everyone, F is infinite"
F_UNDEFINED = "neither effect nor error beyond the rounding of the data: F is 0/0, undefined"


@dataclass(frozen=True, slots=True, kw_only=True)
class Anova:
    """One-way ANOVA between participants.

    An error no larger than what rounding decimals to doubles makes is none. No error but an effect: F = inf, p = 0.
    Neither (all values equal): 0/0, F and p are NaN. `reason` says which.
    `ss_effect, ss_error, ms_error` are in the squared unit of the data: of data beyond 1e154 they can be inf, of data
    below 1e-162 they can be 0, while F and p stand.
    """

    F: Values
    df_effect: int
    df_error: int
    p: Values
    ss_effect: Values
    ss_error: Values
    ms_error: Values

    @property
    def reason(self) -> str | NDArray[np.str_]:
        """Why F is infinite or undefined, empty if it is neither; an array of texts over the leading axes for many."""
        texts = np.select([np.isnan(self.F), np.isinf(self.F)], [F_UNDEFINED, NO_ERROR], default="")
        return str(texts) if texts.ndim == 0 else texts


@dataclass(frozen=True, slots=True, kw_only=True)
class RepeatedMeasuresAnova(Anova):
    """One-way ANOVA within participants; `ss_participants` is the spread of the participants' own means."""

    ss_participants: Values


def one_way_anova(groups: Sequence[ArrayLike]) -> Anova:
    """One-way ANOVA between participants.

    F = [sum n_i (m_i - m)^2 / (k - 1)] / [sum (x - m_i)^2 / (N - k)], p from the upper tail of F(k - 1, N - k).

    `groups`: k >= 2 arrays (..., n_i) whose leading axes broadcast; each result has shape (...).
    `ValueError`: fewer than two groups, an empty one, no group with two values, or values that are not finite numbers.
    Source: Fisher 1925, Statistical Methods for Research Workers.

    >>> result = one_way_anova([[1.0, 2.0, 3.0], [2.0, 3.0, 4.0], [6.0, 7.0, 8.0]])
    >>> result.F, result.df_effect, result.df_error
    (21.0, 2, 6)
    """
    return _anova(between_sums(check_groups(groups)))


def rm_anova(scores: ArrayLike) -> RepeatedMeasuresAnova:
    """One-way repeated-measures ANOVA, sphericity assumed (no correction of the degrees of freedom).

    F = [n sum (m_j - m)^2 / (k - 1)] / [sum (x_ij - m_i - m_j + m)^2 / ((n - 1)(k - 1))].

    `scores`: (..., n participants, k conditions); each result has shape (...).
    `ValueError`: fewer than two participants or conditions, or values that are not finite numbers (a missing score is
    not guessed: leave the participant out).
    Source: Winer 1971, Statistical Principles in Experimental Design, chapter 4.

    >>> result = rm_anova([[1.0, 2.0, 4.0], [2.0, 2.0, 6.0], [3.0, 5.0, 5.0]])
    >>> round(result.F, 9), result.df_effect, result.df_error
    (7.0, 2, 4)
    """
    sums = repeated_sums(check_scores(scores))
    found = _anova(sums)
    people = float_or_array(unscaled(sums.participants, 2 * sums.exponent))
    return RepeatedMeasuresAnova(**{name: getattr(found, name) for name in Anova.__slots__}, ss_participants=people)


def check_scores(scores: ArrayLike) -> FloatArray:
    """`scores` as float64 (..., participants, conditions), at least two of each; else `ValueError` with the reason."""
    array = numbers(scores, "scores")
    if array.ndim < 2:
        raise ValueError(f"scores must have two axes (participants, conditions), not {array.ndim}")
    n, k = array.shape[-2:]
    if n < 2 or k < 2:
        raise ValueError(f"at least 2 participants and 2 conditions are needed, not {n} and {k}")
    return array


def check_groups(groups: Sequence[ArrayLike]) -> list[FloatArray]:
    """`groups` as float64 arrays, at least two and none empty; else `ValueError` with the reason."""
    arrays = [numbers(group, f"group {i}") for i, group in enumerate(groups)]
    if len(arrays) < 2:
        raise ValueError(f"at least 2 groups are needed, not {len(arrays)}")
    for i, array in enumerate(arrays):
        if array.ndim < 1 or array.shape[-1] < 1:
            raise ValueError(f"group {i} must hold at least one value along its last axis")
    if all(array.shape[-1] == 1 for array in arrays):
        raise ValueError("no group has two values: there is no variance within groups to test against")
    return arrays


def _anova(sums: Sums) -> Anova:
    """The F test of decomposed data, its sums of squares in the data's own units."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        F = (sums.effect / sums.df_effect) / sums.ms_error
    squares = (unscaled(value, 2 * sums.exponent) for value in (sums.effect, sums.error, sums.ms_error))
    effect, error, ms_error = map(float_or_array, squares)
    return Anova(
        F=float_or_array(F),
        df_effect=sums.df_effect,
        df_error=sums.df_error,
        p=float_or_array(special.fdtrc(sums.df_effect, sums.df_error, F)),
        ss_effect=effect,
        ss_error=error,
        ms_error=ms_error,
    )
