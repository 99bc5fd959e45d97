"""The posterior of a psychometric function on a grid that is laid where it is, from the number of right answers a level.

The number of right answers of n at a level is binomial, or beta-binomial where answers vary more than that: shares are
drawn from Beta(ν p, ν (1 - p)) with ν = 1/η² - 1, η from 0 (binomial) to 1 (Schütt and others 2016, equation 5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import betaln, xlog1py, xlogy

from analysis.psychometric.priors import Priors
from analysis.stats.arrays import FloatArray
from experiments.design.procedures.psychometric import Shape, unscaled

_NODES = 4096
"""Shares at which a level's likelihood is tabulated, evenly in arcsin √p, where it is smooth: an error below 1e-5."""
_KEPT = 1e-5
"""What is left out on each side of a coarse marginal when the fine grid is laid."""
_COARSE = (32, 32, 10, 10, 8)
_FINE = (48, 40, 16, 16, 14)
NAMES = ("threshold", "width", "lapse", "guess", "overdispersion")
"""The axes of a posterior, in order."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Counts:
    """Right answers (k,) of so many trials (k,) at levels (k,), as they are fitted: levels are logarithms already."""

    levels: FloatArray
    right: FloatArray
    trials: FloatArray
    shape: Shape = "normal"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Posterior:
    """Values of each of the five parameters, and how likely each combination is; it sums to 1."""

    axes: tuple[FloatArray, ...]
    weights: FloatArray

    def marginal(self, name: str) -> tuple[FloatArray, FloatArray]:
        """A parameter's values and their weights."""
        place = NAMES.index(name)
        others = tuple(axis for axis in range(len(NAMES)) if axis != place)
        return self.axes[place], self.weights.sum(axis=others)


def posterior(counts: Counts, priors: Priors, fixed: dict[str, float]) -> Posterior:
    """The posterior, found on a coarse grid over all that the priors allow and computed on a fine one around it.

    `fixed` has the values of parameters that are known: a guess rate of 0.5, an overdispersion of 0.
    """
    bounds = _bounds(priors)
    coarse = _on(counts, priors, tuple(_axis(name, bounds, fixed, size) for name, size in zip(NAMES, _COARSE, strict=True)))
    narrowed = {name: _around(*coarse.marginal(name), bounds[name]) for name in NAMES}
    return _on(counts, priors, tuple(_axis(name, narrowed, fixed, size) for name, size in zip(NAMES, _FINE, strict=True)))


def _bounds(priors: Priors) -> dict[str, tuple[float, float]]:
    return {
        "threshold": (priors.threshold.low, priors.threshold.high),
        "width": (priors.width.low, priors.width.high),
        "lapse": (0.0, priors.lapse.most),
        "guess": (0.0, priors.guess.most),
        "overdispersion": (0.0, priors.overdispersion.most),
    }


def _axis(name: str, bounds: dict[str, tuple[float, float]], fixed: dict[str, float], size: int) -> FloatArray:
    """The middles of so many cells between two bounds, or the one value that is fixed."""
    if name in fixed:
        return np.array([fixed[name]])
    low, high = bounds[name]
    return np.asarray(low + (high - low) * (np.arange(size) + 0.5) / size)


def _around(values: FloatArray, weights: FloatArray, bounds: tuple[float, float]) -> tuple[float, float]:
    """Where a marginal is, with a cell to spare on both sides."""
    if values.size == 1:
        return bounds
    cell, passed = float(values[1] - values[0]), np.cumsum(weights)
    first = int(np.searchsorted(passed, _KEPT))
    last = int(np.searchsorted(passed, 1 - _KEPT))
    low = float(values[max(first - 1, 0)]) - cell / 2
    high = float(values[min(last + 1, values.size - 1)]) + cell / 2
    return max(low, bounds[0]), min(high, bounds[1])


def _on(counts: Counts, priors: Priors, axes: tuple[FloatArray, ...]) -> Posterior:
    log_density = _log_likelihood(counts, axes)
    for place, (name, values) in enumerate(zip(NAMES, axes, strict=True)):
        if values.size > 1:
            with np.errstate(divide="ignore"):
                log_prior = np.log(getattr(priors, name).density(values))
            log_density += log_prior.reshape([-1 if axis == place else 1 for axis in range(len(NAMES))])
    weights = np.exp(log_density - log_density.max())
    return Posterior(axes=axes, weights=weights / weights.sum())


def _log_likelihood(counts: Counts, axes: tuple[FloatArray, ...]) -> FloatArray:
    """Of the shape of the axes; the number of orders of the answers, which is the same everywhere, is left out."""
    thresholds, widths, lapses, guesses, spreads = axes
    total = np.zeros([len(axis) for axis in axes])
    slack = 1 - lapses[:, None] - guesses
    for level, right, trials in zip(counts.levels, counts.right, counts.trials, strict=True):
        felt = unscaled(level, thresholds[:, None], widths, counts.shape)
        share = guesses + slack * felt[..., None, None]
        at = np.arcsin(np.sqrt(np.clip(share, 0.0, 1.0))) * ((_NODES - 1) / (np.pi / 2))
        below = np.minimum(at.astype(np.intp), _NODES - 2)
        above = at - below
        for place, spread in enumerate(spreads):
            table = _table(right, trials, float(spread))
            total[..., place] += table[below] * (1 - above) + table[below + 1] * above
    return total


def _table(right: float, trials: float, spread: float) -> FloatArray:
    """The log likelihood of a level's answers by the share of right ones, from 0 to 1 in even steps of arcsin √p."""
    share = np.sin(np.linspace(0.0, np.pi / 2, _NODES)) ** 2
    share = np.clip(share, 1e-12, 1 - 1e-12)
    if spread**2 < 1e-7:
        return np.asarray(xlogy(right, share) + xlog1py(trials - right, -share))
    drawn = 1 / spread**2 - 1
    a, b = drawn * share, drawn * (1 - share)
    return np.asarray(betaln(right + a, trials - right + b) - betaln(a, b))
