"""The shares of "forward" of many evidences at once: `percept.forward_rate` over arrays."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.polynomial.hermite_e import hermegauss
from numpy.typing import ArrayLike, NDArray

from experiments.synthetic.diffusion import People
from experiments.synthetic.diffusion_batch import upper_probabilities

Floats = NDArray[np.float64]

_POINTS = 15
"""As many as in `percept.forward_rate`."""


def own_start(start: ArrayLike, logit_start: ArrayLike) -> Floats:
    """The starting point of people whose logit differs by so much, as `diffusion.Person.own` has it; they broadcast.

    >>> own_start(0.5, [0.0, 1.0]).round(6).tolist()
    [0.5, 0.731059]
    """
    w = np.asarray(start, dtype=np.float64)
    return np.asarray(w / (w + (1.0 - w) * np.exp(-np.asarray(logit_start, dtype=np.float64))))


def forward_rates(log_odds: ArrayLike, start: float, people: People, lapse_rate: float = 0.0) -> Floats:
    """The share of "forward" in the mean over people, of each evidence (any shape); Gauss-Hermite quadrature.

    >>> forward_rates([0.0, 1.0, -1.0], 0.5, People()).round(6).tolist()
    [0.5, 0.731059, 0.268941]
    """
    drift, boundary, logit = map(_nodes, (people.drift_factor_sd, people.log_boundary_sd, people.logit_start_sd))
    strength = (1.0 + drift[0])[:, None] * np.exp(boundary[0])
    product = np.asarray(log_odds, dtype=np.float64)[..., None, None, None] * strength[..., None]
    upper = upper_probabilities(product, 1.0, own_start(start, logit[0]))
    mean = np.einsum("...ijk,i,j,k->...", upper, drift[1], boundary[1], logit[1])
    return np.asarray((1.0 - lapse_rate) * mean + lapse_rate / 2.0)


@lru_cache(maxsize=64)
def _nodes(sd: float) -> tuple[Floats, Floats]:
    """Places and weights of the quadrature."""
    if sd == 0.0:
        return np.zeros(1), np.ones(1)
    places, weights = hermegauss(_POINTS)
    return sd * places, weights / math.sqrt(2.0 * math.pi)
