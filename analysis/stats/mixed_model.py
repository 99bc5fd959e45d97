"""Linear mixed model of single trials with a random intercept a person, by restricted maximum likelihood.

The fit is that of statsmodels; here it gets columns of like size, names, and words for what it warns of.
"""

from __future__ import annotations

import warnings
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.stats.arrays import FloatArray, numbers, share
from analysis.stats.fixed_effects import Coefficient, coefficients, columns_of, people_codes
from analysis.stats.frames import Result

TOO_FEW_PEOPLE = "There are fewer than two participants: nothing tells the spread between people from that of trials."
NO_SPREAD_LEFT = "The predictors and the people explain every value exactly: there is no error to test against."
NOT_CONVERGED = "The restricted likelihood has no peak that statsmodels could find."
EXACT = 1e-20
"""Of the spread of the values: what is left below it is rounding."""
_METHODS = ["bfgs", "powell"]
"""One after the other until one ends at a peak. The others of statsmodels stop early, L-BFGS far from any."""
_SINGULAR = 1e-4
"""A spread between people below this share of that of trials is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearMixedModel(Result):
    """The fitted model: coefficients in the unit of the values, SD between people and SD of a single trial.

    `person_sd` is 0 where people differ no more than chance has them. Empty where there is no fit, for `reason`.
    """

    coefficients: tuple[Coefficient, ...] = ()
    person_sd: float | None = None
    residual_sd: float | None = None
    people: int
    trials: int
    reason: str | None = None

    def rows(self) -> list[dict[str, object]]:
        """The coefficients, a row each."""
        return [row for coefficient in self.coefficients for row in coefficient.rows()]


def linear_mixed_model(
    values: ArrayLike, people: Sequence[Hashable], predictors: Mapping[str, ArrayLike], confidence: float = 0.95
) -> LinearMixedModel:
    """Fits y = x'b + s u + e, with u ~ N(0, 1) of each person and e ~ N(0, residual_sd^2), by REML.

    z and p are Wald's of the normal distribution: with few people p is too small; of a full table `rm_anova` has the
    exact test. `values`: (trials,); `people`: whose each is; `predictors`: by name (trials,), beside an intercept;
    `indicators` makes them of a factor. No fit (`reason`): one person, nothing left to explain.
    `ValueError`: lengths that differ, predictors that are constant or overlap, no finite numbers.
    Equals lme4's `lmer(y ~ x + (1 | person))`. Source: Laird & Ware 1982, Biometrics 38, 963.

    >>> values = [5.0, 6.1, 7.2, 8.0, 6.4, 7.7, 4.1, 5.0]
    >>> found = linear_mixed_model(values, list("aabbccdd"), {"damper": [0, 1] * 4})
    >>> [round(one.estimate, 3) for one in found.coefficients], round(found.person_sd, 2)
    ([5.675, 1.025], 1.39)
    """
    array = numbers(values, "values")
    if array.ndim != 1:
        raise ValueError(f"values must be one number a trial, not of shape {array.shape}")
    columns = columns_of(predictors, array.size)
    codes = people_codes(people, array.size)
    confidence = share(confidence, "confidence")
    empty = LinearMixedModel(people=len(np.unique(codes)), trials=array.size)
    middle, spread = float(array.mean()), float(np.abs(array - array.mean()).max())
    if empty.people < 2:
        return replace(empty, reason=TOO_FEW_PEOPLE)
    if _explained(columns.matrix, codes, array - middle, spread):
        return replace(empty, reason=NO_SPREAD_LEFT)
    fit = _fit((array - middle) / spread, columns.matrix, codes)
    if fit is None:
        return replace(empty, reason=NOT_CONVERGED)
    estimates = spread * (columns.back @ fit.fe_params)
    estimates[0] += middle
    covariance = columns.back @ fit.cov_params()[: estimates.size, : estimates.size] @ columns.back.T
    ratio = float(np.sqrt(max(fit.cov_re[0, 0] / fit.scale, 0.0)))
    residual_sd = spread * float(np.sqrt(fit.scale))
    return replace(
        empty,
        coefficients=coefficients(columns.names, estimates, spread * np.sqrt(np.diag(covariance)), confidence),
        person_sd=ratio * residual_sd if ratio > _SINGULAR else 0.0,
        residual_sd=residual_sd,
    )


def _explained(matrix: FloatArray, codes: NDArray[np.intp], values: FloatArray, spread: float) -> bool:
    """Whether people and predictors leave nothing: what is left of both when each person's own means are taken off."""
    if spread == 0.0:
        return True
    counts = np.bincount(codes)
    own = [column - (np.bincount(codes, weights=column) / counts)[codes] for column in (values / spread, *matrix.T)]
    x, y = np.column_stack(own[1:]), own[0]
    rest = y - x @ np.linalg.lstsq(x, y)[0]
    return bool(rest @ rest <= EXACT * (values / spread @ values / spread))


def _fit(values: FloatArray, matrix: FloatArray, codes: NDArray[np.intp]) -> Any | None:
    """The fit of statsmodels; None if it has none. It warns where people do not differ, which `person_sd` says."""
    with warnings.catch_warnings():
        model = import_module("statsmodels.regression.mixed_linear_model").MixedLM  # takes seconds
        warnings.simplefilter("ignore")  # after the import, which sets filters of its own
        try:
            found = model(values, matrix, groups=codes).fit(reml=True, method=_METHODS, gtol=1e-10)
        except np.linalg.LinAlgError:
            return None
    variances = np.diag(found.cov_params())
    return found if found.converged and np.isfinite(variances).all() and (variances[:-1] > 0.0).all() else None
