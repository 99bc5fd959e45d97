"""Maximum-likelihood fit of the diffusion model, with intervals and with what the data cannot tell."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
import scipy
from numpy.typing import ArrayLike

from analysis.stats.arrays import FloatArray, by_row
from analysis.times.first_passage import distribution
from analysis.times.likelihood import (
    DiffusionLikelihood,
    LapseRange,
    Trials,
    coordinates,
    log_likelihood,
    model_of,
    natural,
    trial_scores,
)
from analysis.times.trade import ez_from_summary

BEYOND_INTERVAL = 1.0 - 0.95
"""Of all intervals."""
EDGE = 1e-4
"""A share of lapses below this counts as none: its logit has no curvature left to take an interval from."""
BLIND = 1e-6
"""An eigenvalue of the information, scaled to a diagonal of ones, below this marks a direction the data do not see."""
_DIFFERENCE_STEP = 1e-4

_DRIFT_END, _LOG_BOUNDARY_END, _LOGIT_END = 100.0, 5.0, 12.0
"""As far as a fit climbs: boundaries of 0.007 to 150 sqrt(s), shares to 6e-6 of their ends."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A parameter in its own unit: drift 1/sqrt(s), boundary sqrt(s), start (z/a) and lapse 0..1, time s.

    NaN limits where the data do not tell it. `se` is of the estimate itself, by the delta method.
    """

    name: str
    value: float
    se: float
    ci_low: float
    ci_high: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DiffusionFit:
    """A fitted model. `unidentified` names parameters on which the data have no grip.

    Lapses whose best share is none are among them: at the end of its range it has no standard error, though a limit.
    With a `reason` the fit failed and has no intervals.
    """

    estimates: tuple[Estimate, ...]
    log_likelihood: float
    trials: int
    clusters: int | None  # people behind a sandwich covariance; None for the model's own
    unidentified: tuple[str, ...] = ()
    reason: str | None = None

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of a name. `KeyError`: there is none."""
        for estimate in self.estimates:
            if estimate.name == name:
                return estimate
        raise KeyError(name)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Peak:
    at: FloatArray
    value: float
    converged: bool


def fit(
    trials: Trials,
    *,
    bias: bool = True,
    lapses: bool | LapseRange = False,
    by_person: bool = False,
    near: DiffusionFit | None = None,
) -> DiffusionFit:
    """Fit a drift a condition, a boundary an instruction, t0, and if asked the start and the lapses, to all trials.

    `lapses`: True for lapses over the range of the data, or the range in s that they are known to have.
    A truncated Newton method on the exact gradient (Nash 1984, SIAM J. Numer. Anal. 21, 770) from three starts, EZ's
    and two multiples of it, the best of which is kept; L-BFGS-B climbs as high, but its threads wait for one another.
    Intervals are Wald's in coordinates without bounds (log, logit), from the observed information, so they stay within
    their range; with `by_person` from the sandwich of people's summed scores and t on people - 1 degrees of freedom.
    `near`: a fit of like data to climb from, which saves two of three climbs; if that ends nowhere, the three are made.
    When people differ the estimates are those of a compromise person all the same: t0 is pulled towards the fastest,
    drifts towards 0, boundaries up, and no interval cures that (`people.fit_people` averages over people instead).
    `profile` gives likelihood intervals. Without participants' own times none of this can be: accuracy alone fixes only
    the product of drift and boundary.
    Source: Ratcliff & Tuerlinckx 2002, Psychon. Bull. Rev. 9, 438.
    """
    model = model_of(trials, bias=bias, lapses=lapses)
    peak = highest_peak(model, starts(model) if near is None else [_beside(model, near)])
    if near is not None and not peak.converged:
        peak = highest_peak(model, starts(model))
    people = np.unique(trials.person).size if by_person else None
    covariance, unidentified = _covariance(model, peak.at, by_person=by_person)
    if not peak.converged:
        covariance = np.full_like(covariance, math.nan)
    critical = -float(
        scipy.special.stdtrit(people - 1, BEYOND_INTERVAL / 2.0)
        if people
        else NormalDist().inv_cdf(BEYOND_INTERVAL / 2.0)
    )
    return DiffusionFit(
        estimates=_estimates(model, peak.at, np.sqrt(np.diag(covariance)), critical),
        log_likelihood=peak.value,
        trials=trials.time_s.size,
        clusters=people,
        unidentified=unidentified,
        reason=None if peak.converged else "no start converged: the likelihood has no clear peak",
    )


def starts(model: DiffusionLikelihood) -> list[FloatArray]:
    """Coordinates to climb from: EZ's of all trials together, and with the boundary halved and doubled."""
    trials = model.trials
    right = trials.upper == (trials.sign > 0)
    times = trials.time_s[right] if right.sum() > 2 else trials.time_s
    found = ez_from_summary(float(right.mean()), float(times.mean()), float(times.var() + 1e-6), times.size)
    boundary = min(max(found.boundary, 0.3), 5.0)
    t0 = min(max(found.non_decision_s, 0.3 * model.cap_s), 0.9 * model.cap_s)
    places = []
    for factor in (1.0, 0.5, 2.0):
        values = [_first_drift(right[trials.condition == c], boundary) for c in range(model.drifts)]
        values += [boundary * factor] * model.boundaries + [0.5] * model.bias + [t0] + [0.02] * model.lapses
        places.append(coordinates(model, np.array(values)))
    return places


def _beside(model: DiffusionLikelihood, near: DiffusionFit) -> FloatArray:
    """Coordinates at the estimates of another fit; `KeyError` if it lacks a parameter."""
    values = np.array([near[name].value for name in model.names])
    first = model.drifts + model.boundaries
    values[model.drifts : first] = np.clip(values[model.drifts : first], 0.01, 100.0)
    values[first:] = np.clip(values[first:], 0.01, 0.99)
    values[first + model.bias] = min(near["non_decision_s"].value, 0.9 * model.cap_s)
    return coordinates(model, values)


def _first_drift(right: FloatArray, boundary: float) -> float:
    n = right.size
    rate = (right.sum() + 0.5) / (n + 1.0)
    return float(scipy.special.logit(rate)) / boundary


def highest_peak(model: DiffusionLikelihood, places: list[FloatArray], held: tuple[int, float] | None = None) -> _Peak:
    """The highest peak climbed to from the given places, one coordinate held if asked."""
    return max((_climb(model, place, held) for place in places), key=lambda peak: (peak.converged, peak.value))


def _climb(model: DiffusionLikelihood, place: FloatArray, held: tuple[int, float] | None) -> _Peak:
    n = model.trials.time_s.size
    at = np.array(place)
    free = np.ones(at.size, dtype=np.bool_)
    if held is not None:
        free[held[0]], at[held[0]] = False, held[1]

    def loss(part: FloatArray) -> tuple[float, FloatArray]:
        at[free] = part
        value, slope = log_likelihood(model, at)
        return -value / n, -slope[free] / n

    ends = [_DRIFT_END] * model.drifts + [_LOG_BOUNDARY_END] * model.boundaries
    ends += [_LOGIT_END] * (at.size - len(ends))
    bounds = [(-end, end) for end, open_ in zip(ends, free, strict=True) if open_]
    found = scipy.optimize.minimize(
        loss,
        at[free],
        jac=True,
        method="TNC",
        bounds=bounds,
        options={"maxfun": 2000, "ftol": 1e-13, "gtol": 1e-7},
    )
    at[free] = found.x
    return _Peak(at=at, value=-float(found.fun) * n, converged=bool(np.abs(found.jac).max() < 1e-4))


def information(model: DiffusionLikelihood, at: FloatArray) -> FloatArray:
    """The observed information in the coordinates: central differences of the exact gradient."""
    rows = []
    for i in range(at.size):
        step = np.zeros(at.size)
        step[i] = _DIFFERENCE_STEP
        ahead, behind = (log_likelihood(model, at + sign * step)[1] for sign in (1.0, -1.0))
        rows.append((behind - ahead) / (2.0 * _DIFFERENCE_STEP))
    matrix = np.array(rows)
    return (matrix + matrix.T) / 2.0


def _covariance(model: DiffusionLikelihood, at: FloatArray, *, by_person: bool) -> tuple[FloatArray, tuple[str, ...]]:
    """Covariance of the coordinates (NaN where there is none) and the names that have none."""
    matrix = information(model, at)
    seen = np.ones(at.size, dtype=np.bool_)
    if model.lapses and scipy.special.expit(at[-1]) < EDGE:
        seen[-1] = False
    seen &= np.diag(matrix) > 0.0
    seen[np.flatnonzero(seen)[_blind(matrix[np.ix_(seen, seen)])]] = False
    covariance = np.full_like(matrix, math.nan)
    inverse = np.linalg.inv(matrix[np.ix_(seen, seen)])
    if by_person:
        inverse = inverse @ _spread(model, at)[np.ix_(seen, seen)] @ inverse
    covariance[np.ix_(seen, seen)] = inverse
    return covariance, tuple(name for name, known in zip(model.names, seen, strict=True) if not known)


def _blind(matrix: FloatArray) -> FloatArray:
    """Which coordinates take part in a direction without information."""
    scale = np.sqrt(np.diag(matrix))
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    flat = vectors[:, values < BLIND]
    return np.asarray((np.abs(flat) > 0.1).any(axis=1))


def _spread(model: DiffusionLikelihood, at: FloatArray) -> FloatArray:
    """Sum over people of the outer products of their scores, n / (n - 1) times."""
    _, scores = trial_scores(model, at)
    person = model.trials.person
    summed = np.zeros((int(person.max()) + 1, at.size))
    np.add.at(summed, person, scores)
    n = len(summed)
    return summed.T @ summed * (n / (n - 1.0)) if n > 1 else np.full((at.size, at.size), math.nan)


def _estimates(model: DiffusionLikelihood, at: FloatArray, se: FloatArray, critical: float) -> tuple[Estimate, ...]:
    known = np.where(np.isfinite(se), se, 0.0)
    low, value, high = (natural(model, at + sign * critical * known) for sign in (-1.0, 0.0, 1.0))
    slope = (natural(model, at + _DIFFERENCE_STEP) - natural(model, at - _DIFFERENCE_STEP)) / (2.0 * _DIFFERENCE_STEP)
    blank = np.where(np.isfinite(se), 0.0, math.nan)
    rows = by_row(value=value, se=slope * se, ci_low=low + blank, ci_high=high + blank)
    return tuple(Estimate(name=name, **row) for name, row in zip(model.names, rows, strict=True))


_FARTHEST = 12.0
"""How far from the peak, in coordinates, a limit is looked for: a factor of 160,000 in odds or size."""


def profile(trials: Trials, name: str, *, bias: bool = True, lapses: bool | LapseRange = False) -> tuple[float, float]:
    """The limits where twice the fall of the profile likelihood equals the chi-squared quantile on 1 df.

    An end that is never reached is the edge of the parameter's range (0 or 1, infinite, or the cap of t0), as for a
    share of lapses that may as well be none. `KeyError`: no such parameter.
    Source: Venzon & Moolgavkar 1988, Appl. Stat. 37, 87.
    """
    fall = float(scipy.special.chdtri(1, BEYOND_INTERVAL)) / 2.0
    model = model_of(trials, bias=bias, lapses=lapses)
    if name not in model.names:
        raise KeyError(name)
    index = model.names.index(name)
    peak = highest_peak(model, starts(model))
    limits = [_limit(model, index, peak.at, peak.value - fall, sign) for sign in (-1.0, 1.0)]
    return limits[0], limits[1]


def _limit(model: DiffusionLikelihood, index: int, peak: FloatArray, wanted: float, sign: float) -> float:
    """Where the profile falls to `wanted` on one side, in the parameter's unit; doubled steps, then Brent's method."""
    last = [np.array(peak)]

    def excess(distance: float) -> float:
        found = highest_peak(model, [last[0]], held=(index, float(peak[index]) + sign * distance))
        last[0] = found.at
        return found.value - wanted

    inner, outer = 0.0, 0.05
    while excess(outer) > 0.0:
        if outer >= _FARTHEST:
            return _edge(model, index, sign)
        inner, outer = outer, min(2.0 * outer, _FARTHEST)
    distance = float(scipy.optimize.brentq(excess, inner, outer, xtol=1e-5))
    at = np.array(peak)
    at[index] += sign * distance
    return float(natural(model, at)[index])


def _edge(model: DiffusionLikelihood, index: int, sign: float) -> float:
    if index < model.drifts:
        return sign * math.inf
    at = np.full(len(model.names), 0.0)
    at[index] = sign * 700.0
    return float(natural(model, at)[index])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AnsweredBy:
    """Shares of all trials answered right and wrong by each time: cumulative, so that the ends add up to 1."""

    right: FloatArray
    wrong: FloatArray


def answered_by(
    fit: DiffusionFit,
    time_s: ArrayLike,
    *,
    condition: str,
    instruction: str,
    towards_upper: float = 0.5,
    lapse_range_s: LapseRange | None = None,
) -> AnsweredBy:
    """The fit's prediction for a condition and instruction, at times of one axis.

    `towards_upper` is the share of shots that drive to the upper answer; `lapse_range_s` that of the fit, if it has
    lapses. `KeyError`: the fit knows no such condition or instruction.
    """
    t = np.asarray(time_s, dtype=np.float64)
    v, a = fit[f"drift {condition}".strip()].value, fit[f"boundary {instruction}".strip()].value
    values = {estimate.name: estimate.value for estimate in fit.estimates}
    w, lapse = values.get("start", 0.5), values.get("lapse", 0.0)
    decided = t - values["non_decision_s"]
    right, wrong = (
        towards_upper * np.asarray(distribution(decided, answer, v, a, w))
        + (1.0 - towards_upper) * np.asarray(distribution(decided, not answer, -v, a, w))
        for answer in (True, False)
    )
    lapsed = np.zeros_like(t)
    if lapse_range_s is not None:
        earliest, latest = lapse_range_s
        lapsed = 0.5 * lapse * np.clip((t - earliest) / (latest - earliest), 0.0, 1.0)
    return AnsweredBy(right=(1.0 - lapse) * right + lapsed, wrong=(1.0 - lapse) * wrong + lapsed)
