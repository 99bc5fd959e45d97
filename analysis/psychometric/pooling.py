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

_CELLS = 240
_COARSE, _FINE, _PASSES = (40, 20), (80, 40), 2
"""Places of the mean and of the SD. Twice on the coarse grid: a posterior much narrower than its steps is found."""
_KEPT = 1e-5
"""What is left out on each side of a coarse marginal when the next grid is laid."""
_BEYOND, _WIDEST = 8.0, 20.0
"""So many ranges of all draws the mean may lie beyond them; the largest SD in ranges. Of two people both are needed."""
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
    step, span = float(values[1] - values[0]), float(values[-1] - values[0])
    scale = max(float(np.std(medians, ddof=1)), step)
    of_mean, of_sd = (values[0] - _BEYOND * span, values[-1] + _BEYOND * span), (step, _WIDEST * span)
    for _ in range(_PASSES):
        coarse = _group_on(values, own, (of_mean, of_sd), _COARSE, scale)
        of_mean = _around(coarse.means, coarse.weights.sum(axis=1))
    of_sd = _around(coarse.sds, coarse.weights.sum(axis=0))  # near the mean: away from it SDs are too large
    found = _group_on(values, own, (of_mean, of_sd), _FINE, scale)
    means, sds, weights = found.means, found.sds, found.weights
    of_people = own * np.einsum("msv,msp->pv", found.density, weights[..., None] / found.likely)
    return Group(
        mean=_estimate(means, weights.sum(axis=1), level),
        sd=_estimate(sds, weights.sum(axis=0), level),
        people=tuple(_estimate(values, one, level) for one in of_people),
        mean_draws=_quantiles(means, weights.sum(axis=1), (np.arange(draws[0].size) + 0.5) / draws[0].size),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _GroupGrid:
    """How likely each mean and SD are (`weights`); the `density` of values under them, how `likely` each person is."""

    means: FloatArray
    sds: FloatArray
    density: FloatArray
    likely: FloatArray
    weights: FloatArray


_Ends = tuple[float, float]


def _group_on(
    values: FloatArray, own: FloatArray, around: tuple[_Ends, _Ends], sizes: tuple[int, int], scale: float
) -> _GroupGrid:
    """On even means and even logarithms of the SD. Normal densities are not cut at the ends of the draws."""
    means, sds = np.linspace(*around[0], sizes[0]), np.geomspace(*around[1], sizes[1])
    density = np.exp(-0.5 * ((values - means[:, None, None]) / sds[:, None]) ** 2) / (sds[:, None] / sds[-1])
    likely = np.maximum(np.einsum("msv,pv->msp", density, own), 1e-300)  # BLAS hangs on threads
    log_weights = np.log(likely).sum(axis=-1) + np.log(sds / (1 + (sds / scale) ** 2))
    weights = np.exp(log_weights - log_weights.max())
    return _GroupGrid(means=means, sds=sds, density=density, likely=likely, weights=weights / weights.sum())


def _around(values: FloatArray, weights: FloatArray) -> _Ends:
    """Where a marginal is, with a place to spare on both sides."""
    passed = np.cumsum(weights)
    first, last = int(np.searchsorted(passed, _KEPT)), int(np.searchsorted(passed, 1 - _KEPT))
    return float(values[max(first - 1, 0)]), float(values[min(last + 1, values.size - 1)])


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
