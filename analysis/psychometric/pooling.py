"""A quantity of several people: its mean and spread in the group, and each person's own, drawn towards the others.

Each person's true value is drawn from a normal distribution of unknown mean and standard deviation; what their own data
say is given as draws from their own fit. Both unknowns are on a grid, the mean as likely everywhere, the standard
deviation with a half-Cauchy prior whose scale is the spread of the people's own medians (Gelman 2006, Bayesian Anal. 1,
515). The less one person's data say, the nearer their value is to the group's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from analysis.psychometric.fit import Credible
from analysis.report.serial import UNWRITTEN
from analysis.stats.arrays import FloatArray, in_brief, numbers, share
from analysis.stats.frames import Result

_CELLS, _MEANS, _SPREADS = 240, 80, 40
_LARGEST = 1e100
"""Of a draw: squares of larger ones are no numbers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Group(Result):
    """The group's mean and standard deviation, and the people's own values in their order."""

    mean: Credible
    sd: Credible
    people: tuple[Credible, ...]
    mean_draws: FloatArray = field(repr=False, compare=False, metadata=UNWRITTEN)
    """Draws of the mean, as many as of each person."""


def pooled_group(draws: Sequence[FloatArray], confidence: float = 0.95) -> Group:
    """The group behind draws (n,) of each person's value, from fits whose priors were flat where the draws are.

    `ValueError`: fewer than two people, or somebody without draws.

    >>> own = [np.random.default_rng(i).normal(10 + i, 1, 500) for i in range(4)]
    >>> found = pooled_group(own)
    >>> round(found.mean.median, 1), bool(found.people[0].median > np.median(own[0]))
    (11.4, True)
    """
    draws, level = _people(draws), share(confidence, "confidence")
    values, own = _histograms(draws)
    medians = np.array([np.median(one) for one in draws])
    scale = max(float(np.std(medians, ddof=1)), float(values[1] - values[0]))
    means = np.linspace(values[0], values[-1], _MEANS)
    sds = np.geomspace(float(values[1] - values[0]), 4 * float(values[-1] - values[0]), _SPREADS)
    density = np.exp(-0.5 * ((values - means[:, None, None]) / sds[:, None]) ** 2) / sds[:, None]
    density /= density.sum(axis=-1, keepdims=True)
    likely = np.einsum("msv,pv->msp", density, own)  # not by BLAS, whose last digit hangs on its threads
    log_weights = np.log(np.maximum(likely, 1e-300)).sum(axis=-1) + np.log(sds / (1 + (sds / scale) ** 2))
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.sum()
    of_people = own * np.einsum("msv,msp->pv", density, weights[..., None] / np.maximum(likely, 1e-300))
    return Group(
        mean=_estimate(means, weights.sum(axis=1), level),
        sd=_estimate(sds, weights.sum(axis=0), level),
        people=tuple(_estimate(values, one, level) for one in of_people),
        mean_draws=_quantiles(means, weights.sum(axis=1), (np.arange(draws[0].size) + 0.5) / draws[0].size),
    )


def _people(draws: object) -> list[FloatArray]:
    if not isinstance(draws, Sequence | np.ndarray) or isinstance(draws, str | bytes):
        raise ValueError(f"draws must be a list of each person's, not {in_brief(draws)}")
    people = [numbers(one, f"draws[{place}]") for place, one in enumerate(draws)]
    if len(people) < 2:
        raise ValueError(f"draws must hold those of at least two people, not of {len(people)}")
    for place, one in enumerate(people):
        if one.ndim != 1 or not one.size or np.abs(one).max() > _LARGEST:
            raise ValueError(
                f"draws[{place}] must be a row of numbers up to {_LARGEST:g}, not of the shape {one.shape}"
            )
    return people


def difference(one: FloatArray, other: FloatArray) -> FloatArray:
    """Draws of a difference of two values that are known apart: the draws of the other are put in another order."""
    mixed = np.random.default_rng(2006).permutation(len(other))
    return np.asarray(one - other[mixed])


def _histograms(draws: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Values that cover everybody's draws, and how each person's lie among them."""
    low, high = min(float(one.min()) for one in draws), max(float(one.max()) for one in draws)
    edges = np.linspace(low, high if high > low else low + 1.0, _CELLS + 1)
    own = np.stack([np.histogram(one, edges)[0] / one.size for one in draws])
    return (edges[1:] + edges[:-1]) / 2, own


def _estimate(values: FloatArray, weights: FloatArray, confidence: float) -> Credible:
    tail = (1 - confidence) / 2
    low, median, high = _quantiles(values, weights, np.array([tail, 0.5, 1 - tail]))
    mean = float(weights @ values / weights.sum())
    return Credible(median=float(median), mean=mean, low=float(low), high=float(high))


def _quantiles(values: FloatArray, weights: FloatArray, shares: FloatArray) -> FloatArray:
    passed = np.cumsum(weights) - weights / 2
    return np.asarray(np.interp(shares * weights.sum(), passed, values))
