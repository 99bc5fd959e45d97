"""The Bayes factor of an analysis of variance: the effect of the conditions against none, by numerical integration.

Model (Rouder et al. 2012): y = mu + sigma X b + noise of SD sigma; a flat prior on mu, 1/sigma^2 on sigma^2, on the b
of each factor a normal one of variance g, on g the inverse gamma (1/2, r^2/2): effects are Cauchy of scale r. b of a
fixed factor has one entry fewer than levels (they sum to 0), that of random participants one a participant. With mu,
sigma and b integrated out, N values, and for each direction of each factor the eigenvalue l of X'X and the sum of
squares S,

    p(y | g) = const * prod (1 + g l)^(-1/2) * [SS_error + sum S / (1 + g l)]^(-(N - 1) / 2).

What is left is an integral over each g, here over log g in panels that grow from the peak outwards.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from analysis.stats.anova import F_UNDEFINED, NO_ERROR, check_groups, check_scores, one_table
from analysis.stats.arrays import FloatArray, scale_number
from analysis.stats.diagnostics import unit_scaled
from analysis.stats.frames import GroupTable, Result, ScoreTable
from analysis.stats.sums_of_squares import between_sums, repeated_sums

FIXED_SCALE = 0.5
"""Scale r of the prior on the conditions: "medium" in R's BayesFactor and in JASP."""
RANDOM_SCALE = 1.0
"""Scale r of the prior on the participants: "nuisance" there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AnovaBayesFactor(Result):
    """`bf10`: how much likelier the data are under an effect of the conditions than under none; `log_bf10` its log.

    `bf10` is inf beyond 1.8e308, `log_bf10` stands. None where F is infinite or undefined, for `reason`.
    """

    bf10: float | None = None
    log_bf10: float | None = None
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Factor:
    """Eigenvalues, how often each stands there, the sums of squares in their directions, and the prior's scale."""

    eigenvalues: FloatArray
    counts: FloatArray
    squares: FloatArray
    scale: float


def rm_anova_bayes_factor(
    scores: ScoreTable, fixed_scale: float = FIXED_SCALE, random_scale: float = RANDOM_SCALE
) -> AnovaBayesFactor:
    """BF10 of a one-way repeated-measures ANOVA: conditions and participants against participants alone.

    Conditions are a fixed factor, participants a random one; see the module for model and integral. In a full table
    both are orthogonal: l = n for the conditions, k for the participants.

    `scores`: (n participants, k conditions), one value a cell, such as each one's mean. `ValueError` as in `rm_anova`,
    or a scale outside 1e-6 to 1e6. Equals R's `anovaBF(y ~ condition + person, whichRandom = "person")`.
    Source: Rouder, Morey, Speckman & Province 2012, J. Math. Psychol. 56, 356.

    >>> rates = [[0.5, 0.8, 0.9], [0.6, 0.7, 1.0], [0.5, 0.9, 0.8], [0.6, 0.8, 0.8]]
    >>> round(rm_anova_bayes_factor(rates).bf10, 2)
    44.01
    """
    array = one_table(check_scores(scores))
    of_conditions, of_people = scale_number(fixed_scale, "fixed_scale"), scale_number(random_scale, "random_scale")
    n, k = array.shape
    sums = repeated_sums(array)
    effect, people, error = (float(part) for part in (sums.effect, sums.participants, sums.error))
    if error == 0.0:
        return AnovaBayesFactor(reason=NO_ERROR if effect else F_UNDEFINED)
    conditions = _even(n, k - 1, effect, of_conditions)
    participants = _even(k, n - 1, people, of_people)
    return _bayes_factor(
        _log_likelihood((conditions, participants), error, n * k),
        _log_likelihood((participants,), error + effect, n * k),
    )


def one_way_bayes_factor(groups: GroupTable, fixed_scale: float = FIXED_SCALE) -> AnovaBayesFactor:
    """BF10 of a one-way ANOVA between people: groups against none; they may differ in size.

    `groups`: k >= 2 arrays (n_i,). `ValueError` as in `one_way_anova`, or a scale outside 1e-6 to 1e6. Equals R's
    `anovaBF(y ~ group)`. Source: Rouder, Morey, Speckman & Province 2012, J. Math. Psychol. 56, 356.

    >>> round(one_way_bayes_factor([[1.0, 2.0, 3.0], [2.0, 3.0, 4.0], [6.0, 7.0, 8.0]]).bf10, 2)
    17.48
    """
    arrays, scale = check_groups(groups), scale_number(fixed_scale, "fixed_scale")
    if any(array.ndim != 1 for array in arrays):
        raise ValueError("groups must have one axis each, the values of its people")
    sums = between_sums(arrays)
    effect, error = float(sums.effect), float(sums.error)
    if error == 0.0:
        return AnovaBayesFactor(reason=NO_ERROR if effect else F_UNDEFINED)
    values = sum(array.size for array in arrays)
    log_none = -(values - 1) / 2.0 * math.log(effect + error)
    return _bayes_factor(_log_likelihood((_uneven(arrays, effect, scale),), error, values), log_none)


def _even(eigenvalue: int, count: int, squares: float, scale: float) -> _Factor:
    """A factor of a full table: all directions alike."""
    ones = np.ones(1)
    return _Factor(eigenvalues=ones * eigenvalue, counts=ones * count, squares=ones * squares, scale=scale)


def _uneven(groups: Sequence[FloatArray], effect: float, scale: float) -> _Factor:
    """The factor of groups of any sizes: the columns of contrasts, centred, and their directions.

    The sums of squares come from means of scaled values and are put on `effect`, which has all its digits.
    """
    sizes = np.array([group.size for group in groups], dtype=np.float64)
    means = np.array([part.mean() for part in _scaled(groups)])
    columns = np.linalg.svd(np.eye(sizes.size) - 1.0 / sizes.size)[0][:, :-1]
    centred = columns - sizes @ columns / sizes.sum()
    eigenvalues, directions = np.linalg.eigh(centred.T @ (sizes[:, None] * centred))
    squares = np.square(directions.T @ centred.T @ (sizes * means)) / eigenvalues
    if squares.sum():
        squares *= effect / squares.sum()
    return _Factor(
        eigenvalues=eigenvalues,
        counts=np.ones(eigenvalues.size),
        squares=squares,
        scale=scale,
    )


def _scaled(groups: Sequence[FloatArray]) -> list[FloatArray]:
    """The groups less the first value of all, over a power of two."""
    together = unit_scaled(np.concatenate(groups))
    return np.split(together - together[0], np.cumsum([group.size for group in groups])[:-1])


def _bayes_factor(log_effect: float, log_none: float) -> AnovaBayesFactor:
    log_bf10 = log_effect - log_none
    return AnovaBayesFactor(bf10=math.exp(log_bf10) if log_bf10 < 709.0 else math.inf, log_bf10=log_bf10)


def _log_likelihood(factors: Sequence[_Factor], error: float, values: int) -> float:
    """Log of the likelihood of the data, less a constant: the integral over the g of each factor."""

    def log_density(*log_g: FloatArray) -> FloatArray:
        log_prior, left = np.zeros(()), np.float64(error)
        for factor, place in zip(factors, log_g, strict=True):
            g_l = np.exp(place)[..., None] * factor.eigenvalues
            log_prior = (
                log_prior + _log_inverse_gamma(place, factor.scale) - (factor.counts * np.log1p(g_l)).sum(-1) / 2
            )
            left = left + (factor.squares / (1.0 + g_l)).sum(-1)
        found: FloatArray = log_prior - (values - 1) / 2.0 * np.log(left)
        return found

    return _log_integral(log_density, len(factors))


def _log_inverse_gamma(log_g: FloatArray, scale: float) -> FloatArray:
    """Log density of log g, where g has the inverse gamma distribution (1/2, scale^2/2)."""
    half = scale**2 / 2.0
    found: FloatArray = 0.5 * math.log(half) - scipy.special.gammaln(0.5) - 0.5 * log_g - half * np.exp(-log_g)
    return found


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_REACH = 80.0
"""So far from the peak, in log g, everything is below e^-40 of it."""
_GRID = np.linspace(-80.0, 80.0, 161)


def _log_integral(log_density: Callable[..., FloatArray], axes: int) -> float:
    """Log of the integral of exp(log_density) over all its arguments, one peak along each."""
    grids = np.meshgrid(*[_GRID] * axes, indexing="ij", sparse=True)
    heights = log_density(*grids)
    place = np.unravel_index(int(np.argmax(heights)), heights.shape)
    start = _GRID[np.array(place)]
    search: Any = scipy.optimize.minimize  # its stubs do not know the method's options
    found = search(lambda x: -float(log_density(*x)), start, method="Nelder-Mead", options={"xatol": 1e-4})
    peak = np.asarray(found.x, dtype=np.float64)
    rules = [_panels(log_density, peak, axis) for axis in range(axes)]
    points = np.meshgrid(*(points for points, _ in rules), indexing="ij", sparse=True)
    weights = np.meshgrid(*(np.log(weights) for _, weights in rules), indexing="ij", sparse=True)
    return float(scipy.special.logsumexp(log_density(*points) + sum(weights)))


def _panels(
    log_density: Callable[..., FloatArray], peak: FloatArray, axis: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points and weights along one argument: Gauss-Legendre panels, as wide as the peak there, doubling outwards."""
    step = 0.01
    around = [log_density(*(peak + shift * np.eye(len(peak))[axis])) for shift in (-step, 0.0, step)]
    curvature = -float(around[0] - 2.0 * around[1] + around[2]) / step**2
    width = 1.0 / math.sqrt(max(curvature, 0.25))
    count = math.ceil(math.log2(_REACH / width)) + 1
    edges = np.concatenate([[0.0], width * 2.0 ** np.arange(count)])
    edges = peak[axis] + np.concatenate([-edges[:0:-1], edges])
    middle, half = (edges[1:] + edges[:-1]) / 2.0, np.diff(edges) / 2.0
    return (middle[:, None] + half[:, None] * _NODES).ravel(), (half[:, None] * _WEIGHTS).ravel()
