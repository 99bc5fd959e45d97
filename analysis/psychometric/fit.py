"""The psychometric function of one participant in one condition: threshold, width, rates, with credible intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
import scipy
from numpy.typing import ArrayLike

from analysis.psychometric.grid import NAMES, LevelCounts, Posterior, posterior
from analysis.psychometric.priors import Priors, default_priors
from analysis.report.serial import UNWRITTEN
from analysis.stats.arrays import FloatArray, in_brief, numbers, one_of, share, single, yes_or_no
from analysis.stats.frames import Result
from experiments.design.language import Shape
from experiments.design.procedures.psychometric import share_felt

_DRAWS = 4000
"""Draws from the posterior, for what follows from several parameters at once."""
_PLACES = np.arange(_DRAWS)
_MOST_TRIALS = 1e6
_EVEN = (0.5 + np.outer(1.1347241384015194 ** -np.arange(1.0, 6.0), np.arange(_DRAWS))) % 1
"""(5, _DRAWS): they fill a cube of five dimensions evenly; the base is the root of x^6 = x + 1."""

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
    A `falling` function has fewer right answers the higher the level.
    """

    shape: Shape
    log: bool
    falling: bool
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
    draws: FloatArray = field(repr=False, compare=False, metadata=UNWRITTEN)
    """(_DRAWS, 5): threshold, width, lapse, guess and overdispersion on the axis of the fit."""

    @property
    def threshold_draws(self) -> FloatArray:
        """Draws (_DRAWS,) of the threshold, as a level."""
        return self._axis.back(self.draws[:, 0])

    @property
    def jnd_draws(self) -> FloatArray:
        """Draws (_DRAWS,) of the JND."""
        return self._axis.distance(_quarter(self.draws, self.shape))

    @property
    def _axis(self) -> _LevelAxis:
        return _LevelAxis(log=self.log, falling=self.falling)

    def curve(self, levels: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The share at levels (m,): its posterior median, and the band that holds its middle `confidence`."""
        tail = (1 - self.confidence) / 2
        low, middle, high = np.quantile(self.shares(levels), [tail, 0.5, 1 - tail], axis=0)
        return middle, low, high

    def shares(self, levels: ArrayLike) -> FloatArray:
        """The share at levels (m,) by each draw: (_DRAWS, m)."""
        return _shares(self.draws, self._axis.of(numbers(levels, "levels")), self.shape)

    def level_at(self, share: float) -> Credible:
        """The level at which F is `share`, above 0 and below 1: 0.5 is the threshold.

        `ValueError`: a share that no function reaches.
        """
        share = single(share, "share")
        if not 0 < share < 1:
            raise ValueError(f"share must be above 0 and below 1, not {share:g}")
        return _estimate(_at(self.draws, share, self.shape), self.confidence, self._axis.back)


def psychometric_fit(
    levels: ArrayLike,
    right: ArrayLike,
    trials: ArrayLike,
    *,
    guess: float | None,
    lapse: float | None = None,
    catch: tuple[int, int] = (0, 0),
    overdispersed: bool = False,
    shape: Shape = "normal",
    log: bool = False,
    falling: bool = False,
    span: tuple[float, float] | None = None,
    priors: Priors | None = None,
    confidence: float = 0.95,
) -> PsychometricFit:
    """Fit share(x) = g + (1 - g - l) F((x - threshold) / width) to `right` (k,) of `trials` (k,) at `levels` (k,).

    `guess` is chance where the design knows it (1/2, 1/3), and `None` where it is fitted, as for yes or no; `lapse`
    likewise. `catch`: yes answers and trials without a stimulus, whose share is g. `overdispersed` fits how much more
    than binomially answers vary. With `log`, F is of ln x; `falling`: F falls with x. `span`: the lowest and
    highest level that could have been met, as by an adaptive rule; those with trials unless given.
    `ValueError`: fewer than two different levels, counts that are none, levels that have no logarithm.
    Sources: Wichmann and Hill 2001, Percept. Psychophys. 63, 1293; Schütt and others 2016, Vision Res. 122, 105.

    >>> found = psychometric_fit([6, 8, 10, 12, 14], [10, 12, 15, 19, 20], [20] * 5, guess=0.5)
    >>> found.where, round(found.threshold.median, 1)
    ('within', 9.5)
    """
    axis = _LevelAxis(log=yes_or_no(log, "log"), falling=yes_or_no(falling, "falling"))
    one_of(shape, "shape", get_args(Shape))
    counts, level = _counts(levels, right, trials, shape, axis), share(confidence, "confidence")
    fixed = {} if yes_or_no(overdispersed, "overdispersed") else {"overdispersion": 0.0}
    fixed |= {name: _rate(rate, name) for name, rate in (("guess", guess), ("lapse", lapse)) if rate is not None}
    if sum(fixed.get(name, 0.0) for name in ("guess", "lapse")) >= 1:
        raise ValueError(f"guess and lapse must be below 1 together, not {fixed['guess']:g} and {fixed['lapse']:g}")
    if not (priors is None or isinstance(priors, Priors)):
        raise ValueError(f"priors must be Priors or None, not {in_brief(priors)}")
    used = _with_catch(counts, catch)
    draws = _draws(posterior(used, priors or default_priors(counts.levels), fixed))
    met = axis.back(counts.levels) if span is None else _span(span)
    where, reason = _where(met, axis.back(draws[:, 0]))
    return _fit(used, draws, axis, where=where, reason=reason, confidence=level)


def _span(given: ArrayLike) -> FloatArray:
    found = numbers(given, "span")
    if found.shape != (2,) or not found[0] < found[1]:
        raise ValueError(f"span must be the lowest and the highest level, not {in_brief(given)}")
    return found


def _rate(value: ArrayLike, name: str) -> float:
    found = single(value, name)
    if not 0 <= found < 1:
        raise ValueError(f"{name} must be at least 0 and below 1, not {in_brief(value)}")
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class _LevelAxis:
    """The axis on which F rises: levels, or their logarithms, with the sign turned where F falls with the level."""

    log: bool
    falling: bool

    def of(self, levels: FloatArray) -> FloatArray:
        shown = np.log(levels) if self.log else levels
        return -shown if self.falling else shown

    def back(self, places: FloatArray) -> FloatArray:
        shown = -places if self.falling else places
        return np.exp(shown) if self.log else shown

    def distance(self, apart: FloatArray) -> FloatArray:
        return np.exp(apart) if self.log else apart


def _counts(levels: ArrayLike, right: ArrayLike, trials: ArrayLike, shape: Shape, axis: _LevelAxis) -> LevelCounts:
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
    if axis.log and (given["levels"] <= 0).any():
        raise ValueError(f"levels must be above 0 for a logarithmic axis, not {given['levels'].min():g}")
    kept = given["trials"] > 0
    if np.unique(given["levels"][kept]).size < 2:
        raise ValueError("levels must hold at least two different ones with trials")
    return LevelCounts(
        levels=axis.of(given["levels"][kept]), right=given["right"][kept], trials=given["trials"][kept], shape=shape
    )


def _with_catch(counts: LevelCounts, catch: tuple[int, int]) -> LevelCounts:
    """The counts, and those of trials without a stimulus: a level so low that F is 0."""
    given = numbers(catch, "catch")
    yes, trials = given.tolist() if given.shape == (2,) else (1.0, 0.0)
    if not 0 <= yes <= trials <= _MOST_TRIALS or yes % 1 or trials % 1:
        raise ValueError(f"catch must be two whole numbers, yes answers and of how many trials, not {in_brief(catch)}")
    if not trials:
        return counts
    return replace(
        counts,
        levels=np.append(counts.levels, -np.inf),
        right=np.append(counts.right, yes),
        trials=np.append(counts.trials, trials),
    )


def _draws(found: Posterior) -> FloatArray:
    """Draws of the five parameters, the same each time: evenly through the weights, and evenly within the cells."""
    passed = np.cumsum(found.weights.ravel())
    places = np.searchsorted(passed, (np.arange(_DRAWS) + 0.5) / _DRAWS * passed[-1])
    cells = np.unravel_index(np.minimum(places, passed.size - 1), found.weights.shape)
    columns = [
        axis.left[cell] + axis.cells[cell] * some for axis, cell, some in zip(found.axes, cells, _EVEN, strict=True)
    ]
    return np.stack(columns, axis=-1)


def _fit(
    counts: LevelCounts,
    draws: FloatArray,
    axis: _LevelAxis,
    *,
    where: ThresholdPlace,
    reason: str | None,
    confidence: float,
) -> PsychometricFit:
    by_name = dict(zip(NAMES, draws.T, strict=True))
    rates = {name: _estimate(by_name[name], confidence) for name in ("lapse", "guess", "overdispersion")}
    rise = _rise(draws, counts.shape)
    return PsychometricFit(
        shape=counts.shape,
        log=axis.log,
        falling=axis.falling,
        confidence=confidence,
        threshold=_estimate(by_name["threshold"], confidence, axis.back),
        width=_estimate(by_name["width"], confidence, axis.distance),
        jnd=_estimate(_quarter(draws, counts.shape), confidence, axis.distance),
        slope=_estimate(-rise if axis.falling else rise, confidence),
        **rates,
        goodness=_goodness(counts, draws),
        where=where,
        reason=reason,
        draws=draws,
    )


def _rise(draws: FloatArray, shape: Shape) -> FloatArray:
    """The slope of the share at the threshold, by unit of the fit's axis."""
    at, width = draws[:, 0], draws[:, 1]
    step = 1e-4 * width
    rise = share_felt(at + step, at, width, shape) - share_felt(at - step, at, width, shape)
    return np.asarray((1 - draws[:, 2] - draws[:, 3]) * rise / (2 * step))


def _quarter(draws: FloatArray, shape: Shape) -> FloatArray:
    """Half the distance between F = 1/4 and 3/4."""
    return np.asarray(np.abs(_at(draws, 0.75, shape) - _at(draws, 0.25, shape)) / 2)


def _estimate(values: FloatArray, confidence: float, back: Callable[[FloatArray], FloatArray] = np.asarray) -> Credible:
    tail = (1 - confidence) / 2
    places = np.array([tail, 0.5, 1 - tail]) * (values.size - 1)
    ordered = values[:1] if values.min() == values.max() else np.sort(values)
    low, middle, high = sorted(back(np.interp(places, _PLACES[: ordered.size], ordered)))
    return Credible(
        median=float(middle), mean=float(back(values.mean(keepdims=True))[0]), low=float(low), high=float(high)
    )


def _where(levels: FloatArray, thresholds: FloatArray) -> tuple[ThresholdPlace, str | None]:
    """Whether there is a threshold among the levels, and if not, what can be said."""
    low, high = float(levels.min()), float(levels.max())
    below, above = float((thresholds < low).mean()), float((thresholds > high).mean())
    none = "no threshold within the levels:"
    if below > 0.5:
        return "below", f"{none} it lies below {low:g} (probability {below:.2f})"
    if above > 0.5:
        return "above", f"{none} it lies above {high:g} (probability {above:.2f})"
    if below + above > 0.5:
        return "unknown", f"{none} the answers do not say on which side of {low:g} to {high:g} it lies"
    return "within", None


def _at(draws: FloatArray, share: float, shape: Shape) -> FloatArray:
    """The levels, on the fit's axis, at which F is a share."""
    return np.asarray(draws[:, 0] + draws[:, 1] * _widths_off(share, shape))


@lru_cache(maxsize=64)
def _widths_off(share: float, shape: Shape) -> float:
    """So many widths from the threshold F is a share: by bisection for every shape alike."""
    low, high = -20.0, 20.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if share_felt(middle, 0.0, 1.0, shape) < share else (low, middle)
    return (low + high) / 2


def _shares(draws: FloatArray, levels: FloatArray, shape: Shape) -> FloatArray:
    """(draws, levels)"""
    felt = share_felt(levels, draws[:, :1], draws[:, 1:2], shape)
    return np.asarray(draws[:, 3:4] + (1 - draws[:, 3:4] - draws[:, 2:3]) * felt)


def _goodness(counts: LevelCounts, draws: FloatArray) -> Goodness:
    """Posterior predictive: each draw's deviance from the data against that from data drawn from it (Gelman 1996)."""
    some, stream = draws[::8], np.random.default_rng(1996)
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
    wrong, xlogy = trials - right, scipy.special.xlogy
    own = xlogy(right, right / trials) + xlogy(wrong, wrong / trials)
    return np.asarray(2 * (own - xlogy(right, shares) - xlogy(wrong, 1 - shares)).sum(axis=-1))
