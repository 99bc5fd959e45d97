"""The posterior of a psychometric function, from the right answers a level, on a grid that is laid where it is.

The number of right answers of n at a level is binomial, or beta-binomial where answers vary more than that: shares are
drawn from Beta(ν p, ν (1 - p)) with ν = 1/η² - 1, η from 0 (binomial) to 1 (Schütt and others 2016, equation 5).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import prod

import numpy as np
import scipy

from analysis.psychometric.priors import Priors
from analysis.stats.arrays import FloatArray
from experiments.design.language import Shape
from experiments.design.procedures.psychometric import share_felt

_NODES = 512
"""Shares at which a level's likelihood is tabulated, evenly in arcsin √p, where it is smooth: an error below 1e-3."""
_KEPT = 1e-5
"""What is left out on each side of a coarse marginal when the fine grid is laid."""
_COARSE = (18, 14, 5, 5, 5)
_FINE = (26, 22, 8, 20, 8)
"""Places of each axis. Twice on the coarse grid, so that a posterior much narrower than its cells is found as well.

Catch trials say much of the guess rate: between 7 places its median was off by half an SD.
"""
_LAPSE_POWER = 1.5
"""Cells of a lapse rate are even in its root of this degree: its density falls from near 0, and its tail is long."""
_AT_ONCE = 30_000
"""So many shares are worked out together."""
_NO_SPREAD = 1e-7
NAMES = ("threshold", "width", "lapse", "guess", "overdispersion")
"""The axes of a posterior, in order."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LevelCounts:
    """Right answers (k,) of so many trials (k,) at levels (k,), as they are fitted: levels are logarithms already."""

    levels: FloatArray
    right: FloatArray
    trials: FloatArray
    shape: Shape = "normal"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Posterior:
    """Values of each of the five parameters with the cells around them, and how likely each combination is.

    The weights sum to 1.
    """

    axes: tuple[Axis, ...]
    weights: FloatArray

    def marginal(self, name: str) -> tuple[FloatArray, FloatArray]:
        """A parameter's values and their weights."""
        place = NAMES.index(name)
        before, after = prod(self.weights.shape[:place]), prod(self.weights.shape[place + 1 :])
        return self.axes[place].values, self.weights.reshape(before, -1, after).sum(axis=2).sum(axis=0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Axis:
    """Values (n,) of a parameter, from `low` to `high`, each with the width of its cell; of one value, width 0."""

    low: float
    high: float
    values: FloatArray
    cells: FloatArray

    @property
    def left(self) -> FloatArray:
        """Where each cell begins."""
        return np.asarray(self.low + np.cumsum(self.cells) - self.cells)


def posterior(counts: LevelCounts, priors: Priors, fixed: dict[str, float]) -> Posterior:
    """The posterior, found on a coarse grid over all that the priors allow and computed on a fine one around it.

    `fixed` has the values of parameters that are known: a guess rate of 0.5, an overdispersion of 0.
    """
    bounds = {
        "threshold": (priors.threshold.low, priors.threshold.high),
        "width": (priors.width.low, priors.width.high),
        "lapse": (priors.lapse.low, priors.lapse.most),
        "guess": (0.0, priors.guess.most),
        "overdispersion": (0.0, priors.overdispersion.most),
    }
    bounds |= {name: (value, value) for name, value in fixed.items()}
    around = [bounds[name] for name in NAMES]
    for sizes in (_COARSE, _COARSE):
        coarse = _on(counts, priors, tuple(map(_axis, NAMES, around, sizes)))
        around = [_around(axis, coarse.marginal(name)[1]) for name, axis in zip(NAMES, coarse.axes, strict=True)]
    return _on(counts, priors, tuple(map(_axis, NAMES, around, _FINE)))


def _axis(name: str, bounds: tuple[float, float], size: int) -> Axis:
    """Middles of even cells; of guesses and overdispersion, which end at their bounds, nodes of Gauss and Legendre.

    Cells of a width are as its logarithm has them: near its lowest a share hangs on it most.
    """
    low, high = bounds
    if low == high:
        return Axis(low=low, high=high, values=np.array([low]), cells=np.zeros(1))
    if name == "width" and low > 0:
        ends = np.geomspace(low, high, size + 1)
        return Axis(low=low, high=high, values=np.sqrt(ends[1:] * ends[:-1]), cells=np.diff(ends))
    if name == "lapse":
        roots = np.linspace(low ** (1 / _LAPSE_POWER), high ** (1 / _LAPSE_POWER), size + 1)
        middles = (roots[1:] + roots[:-1]) / 2
        return Axis(low=low, high=high, values=middles**_LAPSE_POWER, cells=np.diff(roots**_LAPSE_POWER))
    if name in ("threshold", "width"):
        cells = np.full(size, (high - low) / size)
        return Axis(low=low, high=high, values=low + cells * (np.arange(size) + 0.5), cells=cells)
    nodes, weights = _nodes(size)
    return Axis(low=low, high=high, values=low + (high - low) * (nodes + 1) / 2, cells=(high - low) * weights / 2)


@cache
def _nodes(size: int) -> tuple[FloatArray, FloatArray]:
    nodes, weights = np.polynomial.legendre.leggauss(size)
    return nodes, weights


def _around(axis: Axis, weights: FloatArray) -> tuple[float, float]:
    """Where a marginal is, with a cell to spare on both sides."""
    if axis.values.size == 1:
        return axis.low, axis.high
    passed = np.cumsum(weights)
    first, last = int(np.searchsorted(passed, _KEPT)), int(np.searchsorted(passed, 1 - _KEPT))
    edges = np.append(axis.left, axis.high)
    return float(edges[max(first - 1, 0)]), float(edges[min(last + 2, edges.size - 1)])


def _on(counts: LevelCounts, priors: Priors, axes: tuple[Axis, ...]) -> Posterior:
    log_density = _log_likelihood(counts, axes)
    for place, (name, axis) in enumerate(zip(NAMES, axes, strict=True)):
        if axis.values.size > 1:
            with np.errstate(divide="ignore"):
                log_prior = np.log(getattr(priors, name).density(axis.values) * axis.cells)
            log_density += log_prior.reshape([-1 if other == place else 1 for other in range(len(NAMES))])
    weights = np.exp(log_density - log_density.max())
    return Posterior(axes=axes, weights=weights / weights.sum())


def _log_likelihood(counts: LevelCounts, axes: tuple[Axis, ...]) -> FloatArray:
    """Of the shape of the axes; the number of orders of the answers, which is the same everywhere, is left out."""
    thresholds, widths, lapses, guesses, spreads = (axis.values for axis in axes)
    total = np.zeros([axis.size for axis in (thresholds, widths, lapses, guesses, spreads)])
    slack = 1 - lapses[:, None] - guesses
    felt = share_felt(counts.levels[:, None, None], thresholds[:, None], widths, counts.shape)[..., None, None]
    if spreads.size == 1 and spreads[0] ** 2 < _NO_SPREAD:
        few = max(1, _AT_ONCE // total.size)
        for some in (slice(first, first + few) for first in range(0, len(felt), few)):
            total[..., 0] += _binomial(guesses + slack * felt[some], counts.right[some], counts.trials[some])
        return total
    for level, right, trials in zip(felt, counts.right, counts.trials, strict=True):
        share = guesses + slack * level
        at = np.arcsin(np.sqrt(np.clip(share, 0.0, 1.0))) * ((_NODES - 1) / (np.pi / 2))
        below = np.minimum(at.astype(np.intp), _NODES - 2)
        above = at - below
        for place, spread in enumerate(spreads):
            table = _table(right, trials, float(spread))
            total[..., place] += table[below] * (1 - above) + table[below + 1] * above
    return total


def _binomial(share: FloatArray, right: FloatArray, trials: FloatArray) -> FloatArray:
    """The log likelihood of all levels' answers: `share` of the shape (levels, ...), which is overwritten."""
    np.clip(share, 1e-12, 1 - 1e-12, out=share)
    flat = share.reshape(len(share), -1)
    wrong = (trials - right) @ np.log(1 - flat)
    return np.asarray(right @ np.log(flat, out=flat) + wrong).reshape(share.shape[1:])


def _table(right: float, trials: float, spread: float) -> FloatArray:
    """The log likelihood of a level's answers by the share of right ones, from 0 to 1 in even steps of arcsin √p."""
    share = np.sin(np.linspace(0.0, np.pi / 2, _NODES)) ** 2
    share = np.clip(share, 1e-12, 1 - 1e-12)
    if spread**2 < _NO_SPREAD:
        return np.asarray(scipy.special.xlogy(right, share) + scipy.special.xlog1py(trials - right, -share))
    drawn = 1 / spread**2 - 1
    a, b = drawn * share, drawn * (1 - share)
    return np.asarray(scipy.special.betaln(right + a, trials - right + b) - scipy.special.betaln(a, b))
