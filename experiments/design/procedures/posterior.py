"""What is known of a psychometric function after some answers, and which stimulus tells most of it next.

A grid over the parameters (threshold, width, lapse rate and guess rate; `surface` has one for two dimensions) holds the
posterior. It is multiplied by the likelihood of each answer, so that it depends on the stimuli and answers so far
alone. Arrays may have axes in front for many observers at once: one copy of the arithmetic serves the session and its
simulation.

The variance rule takes the stimulus with the least expected posterior variance of what is wanted (threshold, width, or
both in units of their prior), all else marginalised: Kontsevich and Tyler's Psi (1999) with another loss, as in
Prins' psi-marginal (2013). The entropy rule takes the one whose answer tells most of all parameters (QUEST+, Watson
2017).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from experiments.design.language import Shape
from experiments.design.procedures.psychometric import Shares, share_felt

WantedParameter = Literal["threshold", "width"]
_ALIKE = 1e-9
"""Stimuli whose gains differ relatively by less are alike: the first is taken on every machine."""
_LEAST = 1e-300
_TAILS = (0.025, 0.975)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AnswerGrid:
    """How stimuli are answered at each place of a grid of parameters, and how likely the places are to begin with.

    `prior` has an axis a parameter, in the order of `axes`, lapse and guess rates last, and sums to 1. `felt` is F, of
    the shape (stimuli, places of all but the rates); `chance` and `slack` are g and 1 - g - l, of lapses × guesses.
    """

    axes: Mapping[str, Shares]
    prior: Shares
    felt: Shares
    chance: Shares
    slack: Shares

    @property
    def shape(self) -> tuple[int, int]:
        """The posterior's axes: places of all but the rates, lapses × guesses."""
        return self.felt.shape[1], len(self.slack)

    def start(self) -> Shares:
        """The prior, with a posterior's axes."""
        return self.prior.reshape(self.shape)

    def marginal(self, posterior: Shares, name: str) -> Shares:
        """How likely each value of a parameter is, whatever the others are: (..., its values)."""
        front, place = posterior.ndim - 2, list(self.axes).index(name)
        others = tuple(front + axis for axis in range(self.prior.ndim) if axis != place)
        return np.asarray(posterior.reshape(*posterior.shape[:-2], *self.prior.shape).sum(axis=others))


def _quantiles(values: Shares, weights: Shares, shares: Sequence[float]) -> Shares:
    """The values of a parameter below which it lies with these probabilities: (..., shares).

    A value's weight is spread evenly over its cell, which goes halfway to its neighbours.
    """
    if len(values) == 1:
        return np.full((*weights.shape[:-1], len(shares)), values[0])
    middles = (values[1:] + values[:-1]) / 2
    edges = np.concatenate([[2 * values[0] - middles[0]], middles, [2 * values[-1] - middles[-1]]])
    passed = np.cumsum(weights, axis=-1)
    wanted = np.asarray(shares) * passed[..., -1:]
    cell = (passed[..., None] < wanted[..., None, :]).sum(axis=-2)
    own = np.take_along_axis(weights, cell, axis=-1)
    missing = np.take_along_axis(passed, cell, axis=-1) - wanted
    return np.asarray(edges[cell + 1] - (edges[cell + 1] - edges[cell]) * missing / np.where(own > 0, own, 1.0))


def credible_span(values: Shares, weights: Shares, *, log: bool = False) -> Shares:
    """How wide the 95 % credible interval of a parameter is, whose values have these weights (..., values).

    With `log` the values are logarithms, and the width is that of what they are the logarithms of.

    >>> round(float(credible_span(np.linspace(0, 10, 101), np.ones(101))), 1)
    9.6
    """
    ends = _quantiles(values, weights, _TAILS)
    return np.asarray(np.diff(np.exp(ends) if log else ends)[..., 0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ParameterGrid(AnswerGrid):
    """A grid of threshold, width, lapse and guess rate, and the stimuli (levels,)."""

    stimuli: Shares

    def values(self, wanted: WantedParameter) -> Shares:
        """A parameter's value at each place of thresholds × widths."""
        grid = np.meshgrid(self.axes["threshold"], self.axes["width"], indexing="ij")
        return np.asarray(grid[wanted == "width"]).ravel()


def parameter_grid(
    *,
    stimuli: Shares,
    thresholds: Shares,
    widths: Shares,
    lapses: Shares,
    guesses: Shares,
    prior: Shares | None = None,
    shape: Shape = "normal",
    either_way: bool = False,
) -> ParameterGrid:
    """A grid; without a prior every place has the same. `either_way`: lapses are guesses as well, g + l.

    `ValueError`: a prior of another shape, or of nothing.
    """
    axes = {"threshold": thresholds, "width": widths, "lapse": lapses, "guess": guesses}
    places = np.meshgrid(thresholds, widths, indexing="ij")
    levels = np.asarray(stimuli, float)
    chance, slack = chance_and_slack(lapses, guesses, either_way=either_way)
    return ParameterGrid(
        stimuli=levels,
        axes={name: np.asarray(values, float) for name, values in axes.items()},
        prior=checked_prior(prior, tuple(map(len, axes.values()))),
        felt=share_felt(levels[:, None], places[0].ravel(), places[1].ravel(), shape),
        chance=chance,
        slack=slack,
    )


def checked_prior(prior: Shares | None, sizes: tuple[int, ...]) -> Shares:
    """The prior with the sum 1, the same everywhere if there is none. `ValueError`: another shape, or of nothing."""
    weights = np.ones(sizes) if prior is None else np.asarray(prior, float)
    if weights.shape != sizes or not np.all(weights >= 0) or not weights.sum() > 0:
        raise ValueError(f"prior: it must have the shape {sizes}, no value below 0, and one above")
    return np.asarray(weights / weights.sum())


def chance_and_slack(lapses: Shares, guesses: Shares, *, either_way: bool = False) -> tuple[Shares, Shares]:
    """What is right by chance, g, and what F adds to it, 1 - g - l, of lapses × guesses.

    `either_way`: whoever lapses says either answer, so that l is in g as well.
    """
    lapse, guess = (axis.ravel() for axis in np.meshgrid(lapses, guesses, indexing="ij"))
    chance = guess + lapse if either_way else guess
    return chance, 1 - chance - lapse


def posterior_after(
    known: AnswerGrid, posterior: Shares, stimulus: NDArray[np.intp] | int, right: NDArray[np.bool_] | bool
) -> Shares:
    """The posterior after an answer to a stimulus, given by its place. Axes in front: one stimulus and answer each."""
    said = np.asarray(right)[..., None]
    chance, slack = np.where(said, known.chance, 1 - known.chance), np.where(said, known.slack, -known.slack)
    likely = posterior * (chance[..., None, :] + slack[..., None, :] * known.felt[stimulus][..., None])
    total = likely.sum(axis=(-2, -1), keepdims=True)
    return likely / np.where(total > 0, total, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class VarianceRule:
    """The stimulus with the least expected posterior variance of what is wanted.

    The variance expected after an answer is E[t²] - (E[t; right]²/p + E[t; wrong]²/(1 - p)): only what is taken away
    differs between stimuli. With P = g + (1 - g - l) F that needs one product of F with the posterior summed over g
    and l. `matrix`: F, and F times each wanted t in units of its prior's standard deviation.
    """

    known: ParameterGrid
    values: Shares
    matrix: Shares

    def gains(self, posterior: Shares) -> Shares:
        """What each stimulus is expected to take away, of the shape (..., stimuli)."""
        known = self.known
        felt, guessed = posterior @ known.slack, posterior @ known.chance
        products = felt @ self.matrix.T
        parts = products.reshape(*products.shape[:-1], len(self.values) + 1, len(known.felt))
        right = guessed.sum(-1)[..., None] + parts[..., 0, :]
        right_t = (guessed @ self.values.T)[..., None] + parts[..., 1:, :]
        all_t = (posterior.sum(-1) @ self.values.T)[..., None]
        share = np.clip(right, _LEAST, 1 - 1e-16)[..., None, :]
        taken = right_t**2 / share + (all_t - right_t) ** 2 / (1 - share)
        return np.asarray(taken.sum(axis=-2))


def variance_rule(known: ParameterGrid, wanted: tuple[WantedParameter, ...] = ("threshold",)) -> VarianceRule:
    """The rule for a grid."""
    weights = known.start().sum(-1)
    values = []
    for name in wanted:
        one = known.values(name)
        mean = weights @ one
        sd = np.sqrt(weights @ (one - mean) ** 2)
        values.append((one - mean) / (sd if sd > 0 else 1.0))
    parts = [known.felt, *(known.felt * one for one in values)]
    return VarianceRule(known, np.array(values), np.ascontiguousarray(np.concatenate(parts)))


@dataclass(frozen=True, slots=True, eq=False)
class EntropyRule:
    """The stimulus whose answer tells most: h(mean share) - mean h(share), h the entropy of a yes or no."""

    known: AnswerGrid
    doubt: Shares
    """h(P) at each place of the grid, of the shape (stimuli, all places of the grid)."""

    def gains(self, posterior: Shares) -> Shares:
        """What each answer is expected to tell, in nats, of the shape (..., stimuli)."""
        known = self.known
        felt = posterior @ known.slack
        right = (posterior @ known.chance).sum(-1)[..., None] + felt @ known.felt.T
        flat = posterior.reshape(*posterior.shape[:-2], -1)
        return np.asarray(_doubt(right) - flat @ self.doubt.T)


def entropy_rule(known: AnswerGrid) -> EntropyRule:
    """The rule for a grid."""
    share = known.chance + known.slack * known.felt[..., None]
    return EntropyRule(known, np.ascontiguousarray(_doubt(share).reshape(len(known.felt), -1)))


def _doubt(share: Shares) -> Shares:
    from scipy.special import entr  # noqa: PLC0415 - slow, and a run without such a rule needs none of it

    return np.asarray(entr(share) + entr(1 - share))


def best_stimulus(gains: Shares) -> NDArray[np.intp]:
    """The place of the stimulus that gains most, the first of those that are alike."""
    most = gains.max(axis=-1, keepdims=True)
    spread = most - gains.min(axis=-1, keepdims=True)
    return np.asarray(np.argmax(gains >= most - _ALIKE * np.maximum(spread, _ALIKE * np.abs(most)), axis=-1))
