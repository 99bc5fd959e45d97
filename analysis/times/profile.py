"""Likelihood intervals of the fitted diffusion: every value that the data do not rule out, whatever the rest is."""

from __future__ import annotations

import math

import numpy as np
from scipy import optimize, special

from analysis.stats.arrays import FloatArray, share
from analysis.times.fit import best, starts
from analysis.times.likelihood import Model, Range, Trials, model_of, natural

_FARTHEST = 12.0
"""How far from the peak, in coordinates, a limit is looked for: a factor of 160,000 in odds or size."""


def profile(
    trials: Trials, name: str, *, bias: bool = True, lapses: bool | Range = False, confidence: float = 0.95
) -> tuple[float, float]:
    """The limits where twice the fall of the profile likelihood equals the chi-squared quantile on 1 df.

    An end that is never reached is the edge of the parameter's range (0 or 1, infinite, or the cap of t0), as for a
    share of lapses that may as well be none. `KeyError`: no such parameter. `ValueError`: confidence outside 0..1.
    Source: Venzon & Moolgavkar 1988, Appl. Stat. 37, 87.
    """
    fall = float(special.chdtri(1, 1.0 - share(confidence, "confidence"))) / 2.0
    model = model_of(trials, bias=bias, lapses=lapses)
    if name not in model.names:
        raise KeyError(name)
    index = model.names.index(name)
    peak = best(model, starts(model))
    limits = [_limit(model, index, peak.at, peak.value - fall, sign) for sign in (-1.0, 1.0)]
    return limits[0], limits[1]


def _limit(model: Model, index: int, peak: FloatArray, wanted: float, sign: float) -> float:
    """Where the profile falls to `wanted` on one side, in the parameter's unit; doubled steps, then Brent's method."""
    last = [np.array(peak)]

    def excess(distance: float) -> float:
        found = best(model, [last[0]], held=(index, float(peak[index]) + sign * distance))
        last[0] = found.at
        return found.value - wanted

    inner, outer = 0.0, 0.05
    while excess(outer) > 0.0:
        if outer >= _FARTHEST:
            return _edge(model, index, sign)
        inner, outer = outer, min(2.0 * outer, _FARTHEST)
    distance = float(optimize.brentq(excess, inner, outer, xtol=1e-5))
    at = np.array(peak)
    at[index] += sign * distance
    return float(natural(model, at)[index])


def _edge(model: Model, index: int, sign: float) -> float:
    if index < model.drifts:
        return sign * math.inf
    at = np.full(len(model.names), 0.0)
    at[index] = sign * 700.0
    return float(natural(model, at)[index])
