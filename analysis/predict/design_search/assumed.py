"""Predictions under other assumed numbers, each refitted to the same rates, and with the bias left out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from analysis.predict.design_search.critical import crossings
from analysis.predict.design_search.rates import Floats, evidences, logits, rates
from analysis.predict.design_search.shots import Layer, shot_of
from analysis.predict.fit.percept_model import PAPER_RATES, PerceptFit, fit_percept
from device.methods import Method
from device.parameters import GunParameters
from device.physics import simulate
from experiments.synthetic.diffusion import People
from experiments.synthetic.percept import Percept, PerceptParameters, evidence, forward_rate

DEFAULT = PerceptParameters()
EXPONENTS = (1.1, 2.3)
"""Stevens 1975, p. 15: static force on the palm's skin; and as far from 1.7 on the other side, assumed."""
LEAKS_S = (0.01, 0.04)
"""Half of the assumed leak and twice of it, assumed."""
LEAKS = (DEFAULT.leak_s, *LEAKS_S)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Alternative:
    """The contour under another assumption. `deviance` above 0: the refit does not meet the paper's rates."""

    name: str
    parameters: PerceptParameters
    deviance: float
    voltage_V: Floats


def base_parameters() -> list[tuple[str, PerceptParameters]]:
    """The other values of each assumed number, one changed at a time, by name."""
    exponents = [(f"exponent {value:g}", replace(DEFAULT, exponent=value)) for value in EXPONENTS]
    leaks = [(f"leak {1e3 * value:g} ms", replace(DEFAULT, leak_s=value)) for value in LEAKS_S]
    return exponents + leaks


def alternatives(methods: dict[str, Method], layer: Layer, voltage_V: tuple[float, ...]) -> Iterator[Alternative]:
    """The contour under each other assumption."""
    volts = np.array(voltage_V)
    for name, base in base_parameters():
        other = fit_percept(PAPER_RATES, methods, base=base)
        found = crossings(rates(layer.felt[base.leak_s], other.parameters), volts)
        yield Alternative(name=name, parameters=other.parameters, deviance=other.deviance, voltage_V=found)


def unbiased(layer: Layer, voltage_V: tuple[float, ...], fit: PerceptFit) -> Floats:
    """The contour of the mean over both directions, so that no bias helps."""
    best = fit.parameters
    return crossings(both_ways(layer.felt[best.leak_s], best), np.array(voltage_V))


def under(gun: GunParameters, others: Sequence[Alternative]) -> dict[str, float]:
    """The predicted share for one gun under each other assumption, by name; NaN if its magnet does not come home."""
    leaks_s = tuple(dict.fromkeys(other.parameters.leak_s for other in others))
    felt = dict(zip(leaks_s, shot_of(gun, simulate(gun), leaks_s).felt, strict=False))
    return {other.name: _rate(felt.get(other.parameters.leak_s), other.parameters) for other in others}


def _rate(percept: Percept | None, parameters: PerceptParameters) -> float:
    if percept is None:
        return math.nan
    return forward_rate(evidence(percept, parameters), parameters.start, People())


def both_ways(felt: Floats, parameters: PerceptParameters) -> Floats:
    """The mean share of right answers to a forward and to a backward shot."""
    evidence = evidences(felt, parameters.exponent, parameters.sensitivity, parameters.confusion)
    forward = special.expit(logits(evidence, parameters.start))
    backward = special.expit(logits(evidence, 1.0 - parameters.start))
    return np.asarray((forward + backward) / 2.0)
