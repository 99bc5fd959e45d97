"""Predicted rates over whole grids: the percept's formulas for arrays, and the fit's uncertainty of each."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from analysis.predict.fit.percept_model import FITTED, PerceptFit
from analysis.stats.arrays import FloatArray
from experiments.synthetic.percept import PerceptParameters

REACH = float(special.ndtri(0.975))
_STEP = 1e-4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Predicted:
    """Shares of right answers to a forward shot with their 95 % limits, and the evidence; NaN where nothing is felt."""

    evidence: FloatArray
    rate: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray


def evidences(felt: FloatArray, exponent: float, sensitivity: ArrayLike, confusion: ArrayLike) -> FloatArray:
    """`experiments.synthetic.percept.evidence` for arrays (..., 3) of first, reaction, second."""
    first, reaction, second = np.moveaxis(np.power(felt, exponent), -1, 0)
    strongest = np.maximum(first, reaction)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = strongest / (strongest + np.asarray(confusion) * second)
    return np.asarray(np.asarray(sensitivity) * (first - reaction) * np.where(strongest == 0.0, 0.0, share))


def logits(evidence: FloatArray, start: ArrayLike) -> FloatArray:
    """The log odds of "forward" from the evidence A and the start w.

    logit P = 2 A w + log((1 - exp(-2 A w)) / (1 - exp(-2 A (1 - w)))) for A > 0, its mirror for A < 0; it neither
    overflows nor loses what is close to 1.
    """
    w = np.asarray(start, dtype=np.float64)
    size = np.abs(evidence)
    near = np.where(np.asarray(evidence) < 0.0, 1.0 - w, w)
    with np.errstate(divide="ignore", invalid="ignore"):
        up = 2.0 * size * near + np.log(-np.expm1(-2.0 * size * near)) - np.log(-np.expm1(-2.0 * size * (1.0 - near)))
    found = np.where(np.asarray(evidence) < 0.0, -up, up)
    return np.where(size < 1e-12, special.logit(w), found)


def rates(felt: FloatArray, parameters: PerceptParameters) -> FloatArray:
    """The predicted share of right answers to a forward shot."""
    return np.asarray(special.expit(_logit_of(felt, parameters)))


def predict(felt: FloatArray, fit: PerceptFit) -> Predicted:
    """The rates with the fit's uncertainty: the delta method on the logit, as `percept_fit.predicted_rate`."""
    best = fit.parameters
    centre = _logit_of(felt, best)
    slopes = np.stack([_slope(felt, best, name) for name in FITTED], axis=-1)
    variance = np.einsum("...i,ij,...j->...", slopes, np.array(fit.covariance), slopes)
    half = REACH * np.sqrt(variance)
    low, rate, high = (np.asarray(special.expit(x)) for x in (centre - half, centre, centre + half))
    evidence = evidences(felt, best.exponent, best.sensitivity, best.confusion)
    return Predicted(evidence=evidence, rate=rate, ci_low=low, ci_high=high)


def _logit_of(felt: FloatArray, parameters: PerceptParameters, name: str = "", factor: float = 1.0) -> FloatArray:
    values = {one: getattr(parameters, one) * (factor if one == name else 1.0) for one in FITTED}
    found = evidences(felt, parameters.exponent, values["sensitivity"], values["confusion"])
    return logits(found, values["start"])


def _slope(felt: FloatArray, parameters: PerceptParameters, name: str) -> FloatArray:
    """The derivative of the logit by the logarithm of a fitted number."""
    up, down = (_logit_of(felt, parameters, name, math.exp(step)) for step in (_STEP, -_STEP))
    return (up - down) / (2.0 * _STEP)
