"""The psychometric function of one participant in one condition: threshold, width, rates, with credible intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import xlogy

from analysis.psychometric.grid import NAMES, LevelCounts, Posterior, posterior
from analysis.psychometric.priors import Priors, default_priors
from analysis.stats.arrays import FloatArray, numbers
from analysis.stats.frames import Result
from experiments.design.procedures.psychometric import Shape, share_felt

_DRAWS = 4000
"""Draws from the posterior, for what follows from several parameters at once."""
_MOST_TRIALS = 1e6
_ALPHAS = 1.1347241384015194 ** -np.arange(1.0, 6.0)
"""Their multiples fill a cube of five dimensions evenly: the base is the root of x^6 = x + 1."""

ThresholdPlace = Literal["within", "below", "above", "unknown"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Credible(Result):
    """The posterior's median and mean, and the interval that holds its middle `confidence`."""

    median: float
    mean: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Goodness(Result):
    """The deviance at the posterior's draws, and how often data drawn from them deviate as much: `p`.

    A small p says that the answers vary more, or otherwise, than such a function lets them.
    """

    deviance: float
    p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PsychometricFit(Result):
    """A fitted function. `threshold` is the level at which F is 1/2, on the levels' own axis.

    `width`: from F = 0.05 to 0.95, of a fit on a logarithmic axis as a ratio. `jnd`: half the distance, or the root of
    the ratio, between the levels at F = 1/4 and 3/4. `slope`: of the share, by unit of the axis, at the threshold.
    `where`: whether the threshold lies among the levels, as likely as not; what is not `within` is no measurement.
    """

    shape: Shape
    log: bool
    confidence: float
    threshold: Credible
    width: Credible
    jnd: Credible
    slope: Credible
    lapse: Credible
    guess: Credible
    overdispersion: Credible
    goodness: Goodness
    where: ThresholdPlace
    reason: str | None = None
    draws: FloatArray = field(repr=False, compare=False, metadata={"written": False})
    """(_DRAWS, 5): threshold, width, lapse, guess and overdispersion on the axis of the fit."""

    def curve(self, levels: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The share at levels (m,): its posterior median, and the band that holds its middle `confidence`."""
        shares = _shares(self.draws, _axis(numbers(levels, "levels"), log=self.log), self.shape)
        tail = (1 - self.confidence) / 2
        low, middle, high = np.quantile(shares, [tail, 0.5, 1 - tail], axis=0)
        return middle, low, high

    def level_at(self, share: float) -> Credible:
        """The level at which F is `share`, above 0 and below 1: 0.5 is the threshold.

        `ValueError`: a share that no function reaches.
        """
        if not 0 < share < 1:
            raise ValueError(f"share must be above 0 and below 1, not {share:g}")
        return _estimate(_at(self.draws, share, self.shape), self.confidence, _back(log=self.log))


def psychometric_fit(
    levels: ArrayLike,
    right: ArrayLike,
    trials: ArrayLike,
    *,
    guess: float | None,
    lapse: float | None = None,
    overdispersed: bool = False,
    shape: Shape = "normal",
    log: bool = False,
    priors: Priors | None = None,
    confidence: float = 0.95,
) -> PsychometricFit:
    """Fit share(x) = g + (1 - g - l) F((x - threshold) / width) to `right` (k,) of `trials` (k,) at `levels` (k,).

    `guess` is chance where the design knows it (1/2, 1/3), and `None` where it is fitted, as for yes or no; `lapse`
    likewise. `overdispersed` fits how much more than binomially answers vary. With `log`, F is of ln x.
    `ValueError`: fewer than two different levels, counts that are none, levels that have no logarithm.
    Sources: Wichmann and Hill 2001, Percept. Psychophys. 63, 1293; Schütt and others 2016, Vision Res. 122, 105.

    >>> found = psychometric_fit([6, 8, 10, 12, 14], [10, 12, 15, 19, 20], [20] * 5, guess=0.5)
    >>> found.where, round(found.threshold.median, 1)
    ('within', 9.5)
    """
    counts = _counts(levels, right, trials, shape, log=log)
    if not 0 < confidence < 1:
        raise ValueError(f"confidence must be above 0 and below 1, not {confidence:g}")
    fixed = {} if overdispersed else {"overdispersion": 0.0}
    for name, rate in (("guess", guess), ("lapse", lapse)):
        if rate is not None:
            if not 0 <= rate < 1:
                raise ValueError(f"{name} must be at least 0 and below 1, not {rate:g}")
            fixed[name] = float(rate)
    draws = _draws(posterior(counts, priors or default_priors(counts.levels), fixed))
    return _fit(counts, draws, log=log, confidence=confidence)


def _counts(levels: ArrayLike, right: ArrayLike, trials: ArrayLike, shape: Shape, *, log: bool) -> LevelCounts:
    given = {"levels": numbers(levels, "levels"), "right": numbers(right, "right"), "trials": numbers(trials, "trials")}
    sizes = {name: array.shape for name, array in given.items()}
    if given["levels"].ndim != 1 or len(set(sizes.values())) > 1:
        raise ValueError(
            f"levels, right and trials must be rows of one length, not {', '.join(map(str, sizes.values()))}"
        )
    bad = (given["right"] < 0) | (given["right"] > given["trials"]) | (given["trials"] > _MOST_TRIALS)
    bad |= (given["right"] % 1 != 0) | (given["trials"] % 1 != 0)
    if bad.any():
        place = int(np.argmax(bad))
        counted = f"{given['right'][place]:g} of {given['trials'][place]:g}"
        raise ValueError(
            f"right must be whole numbers from 0 to trials (at most 1,000,000), not {counted} at index {place}"
        )
    if log and (given["levels"] <= 0).any():
        raise ValueError(f"levels must be above 0 for a logarithmic axis, not {given['levels'].min():g}")
    kept = given["trials"] > 0
    if np.unique(given["levels"][kept]).size < 2:
        raise ValueError("levels must hold at least two different ones with trials")
    return LevelCounts(
        levels=_axis(given["levels"][kept], log=log),
        right=given["right"][kept],
        trials=given["trials"][kept],
        shape=shape,
    )


def _axis(levels: FloatArray, *, log: bool) -> FloatArray:
    return np.log(levels) if log else levels


def _back(*, log: bool) -> Callable[[FloatArray], FloatArray]:
    return np.exp if log else np.asarray


def _draws(found: Posterior) -> FloatArray:
    """Draws of the five parameters, the same each time: evenly through the weights, and evenly within the cells."""
    passed = np.cumsum(found.weights.ravel())
    places = np.searchsorted(passed, (np.arange(_DRAWS) + 0.5) / _DRAWS * passed[-1])
    cells = np.unravel_index(np.minimum(places, passed.size - 1), found.weights.shape)
    even = (0.5 + np.outer(_ALPHAS, np.arange(_DRAWS))) % 1
    columns = [
        axis.left[cell] + axis.cells[cell] * some for axis, cell, some in zip(found.axes, cells, even, strict=True)
    ]
    return np.stack(columns, axis=-1)


def _fit(counts: LevelCounts, draws: FloatArray, *, log: bool, confidence: float) -> PsychometricFit:
    by_name = dict(zip(NAMES, draws.T, strict=True))
    back, width = _back(log=log), by_name["width"]
    quarter = np.abs(_at(draws, 0.75, counts.shape) - _at(draws, 0.25, counts.shape)) / 2
    slack = 1 - by_name["guess"] - by_name["lapse"]
    step = 1e-4 * width
    rise = share_felt(by_name["threshold"] + step, by_name["threshold"], width, counts.shape) - share_felt(
        by_name["threshold"] - step, by_name["threshold"], width, counts.shape
    )
    where, reason = _where(counts, by_name["threshold"], back)
    rates = {name: _estimate(by_name[name], confidence) for name in ("lapse", "guess", "overdispersion")}
    return PsychometricFit(
        shape=counts.shape,
        log=log,
        confidence=confidence,
        threshold=_estimate(by_name["threshold"], confidence, back),
        width=_estimate(width, confidence, back),
        jnd=_estimate(quarter, confidence, back),
        slope=_estimate(slack * rise / (2 * step), confidence),
        **rates,
        goodness=_goodness(counts, draws),
        where=where,
        reason=reason,
        draws=draws,
    )


def _estimate(values: FloatArray, confidence: float, back: Callable[[FloatArray], FloatArray] = np.asarray) -> Credible:
    tail = (1 - confidence) / 2
    low, middle, high = back(np.quantile(values, [tail, 0.5, 1 - tail]))
    return Credible(
        median=float(middle), mean=float(back(values.mean(keepdims=True))[0]), low=float(low), high=float(high)
    )


def _where(
    counts: LevelCounts, thresholds: FloatArray, back: Callable[[FloatArray], FloatArray]
) -> tuple[ThresholdPlace, str | None]:
    """Whether there is a threshold among the levels, and if not, what can be said."""
    low, high = float(counts.levels.min()), float(counts.levels.max())
    below, above = float((thresholds < low).mean()), float((thresholds > high).mean())
    first, last = back(np.array([low, high]))
    if below <= 0.5 and above <= 0.5 and below + above <= 0.5:
        return "within", None
    if below > 0.5:
        return "below", f"no threshold within the levels: it lies below {first:g} (probability {below:.2f})"
    if above > 0.5:
        return "above", f"no threshold within the levels: it lies above {last:g} (probability {above:.2f})"
    return (
        "unknown",
        f"no threshold within the levels: the answers do not say on which side of {first:g} to {last:g} it lies",
    )


def _at(draws: FloatArray, share: float, shape: Shape) -> FloatArray:
    """The levels, on the fit's axis, at which F is a share, by bisection for every shape alike."""
    low, high = -20.0, 20.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if share_felt(middle, 0.0, 1.0, shape) < share else (low, middle)
    return np.asarray(draws[:, 0] + draws[:, 1] * (low + high) / 2)


def _shares(draws: FloatArray, levels: FloatArray, shape: Shape) -> FloatArray:
    """(draws, levels)"""
    felt = share_felt(levels, draws[:, :1], draws[:, 1:2], shape)
    return np.asarray(draws[:, 3:4] + (1 - draws[:, 3:4] - draws[:, 2:3]) * felt)


def _goodness(counts: LevelCounts, draws: FloatArray) -> Goodness:
    """Posterior predictive: each draw's deviance from the data against that from data drawn from it (Gelman 1996)."""
    some, stream = draws[::4], np.random.default_rng(1996)
    shares = np.clip(_shares(some, counts.levels, counts.shape), 1e-12, 1 - 1e-12)
    spread, drawn = some[:, 4:], shares
    if spread.max() > 0:
        many = 1 / np.maximum(spread, 1e-3) ** 2 - 1
        drawn = stream.beta(np.maximum(many * shares, 1e-9), np.maximum(many * (1 - shares), 1e-9))
    right = stream.binomial(counts.trials.astype(int), drawn).astype(float)
    own, simulated = _deviance(counts.right, counts.trials, shares), _deviance(right, counts.trials, shares)
    return Goodness(deviance=float(np.median(own)), p=float((simulated >= own - 1e-9).mean()))


def _deviance(right: FloatArray, trials: FloatArray, shares: FloatArray) -> FloatArray:
    """2 Σ ln(likelihood of the data's own shares / of these shares), of the shape (draws,)."""
    wrong = trials - right
    own = xlogy(right, right / trials) + xlogy(wrong, wrong / trials)
    return np.asarray(2 * (own - xlogy(right, shares) - xlogy(wrong, 1 - shares)).sum(axis=-1))
