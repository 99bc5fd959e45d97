"""The percept fitted to forward rates: three numbers by maximum likelihood, how sure they are, what is not told."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from statistics import NormalDist

import numpy as np
import scipy
from numpy.typing import NDArray

from device.methods import Method
from device.words import Direction
from experiments.synthetic.decision import Floats, forward_rates
from experiments.synthetic.diffusion import People
from experiments.synthetic.percept import Percept, PerceptParameters, evidence, percepts_of

FITTED = ("sensitivity", "confusion", "start")
ASSUMED = ("exponent", "leak_s", "boundary")
"""What the rates bear on as well; the boundary only through its product with the drift, the sensitivity."""
ALIKE, USUAL = People(), PerceptParameters()
CONFIDENCE = 0.95
_LOWEST, _HIGHEST = np.array([-12.0, -9.0, -8.0]), np.array([6.0, 9.0, 8.0])
"""Ends of log sensitivity, log confusion and logit start: as good as 0 and infinite."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Likelihood:
    """Rates with their trials, what is felt of their methods, the people, and the numbers that are assumed."""

    methods: Mapping[str, Method]
    percepts: Mapping[str, Percept]
    rates: Mapping[str, float]
    trials: int
    people: People
    base: PerceptParameters

    def at(self, place: Floats) -> PerceptParameters:
        """The parameters of a place: log sensitivity, log confusion, logit start."""
        sensitivity, confusion = np.exp(place[:2])
        start = float(scipy.special.expit(place[2]))
        return replace(self.base, sensitivity=float(sensitivity), confusion=float(confusion), start=start)

    def predicted(self, parameters: PerceptParameters) -> Floats:
        """The mean forward rates."""
        return forward_rates(
            [evidence(self.percepts[name], parameters) for name in self.rates], parameters.start, self.people
        )

    def residuals(self, place: Floats) -> Floats:
        """Signed roots of the rates' binomial deviances, whose squares sum to the deviance."""
        p = np.clip(self.predicted(self.at(place)), 1e-15, 1.0 - 1e-15)
        r = np.array(list(self.rates.values()))
        parts = 2.0 * self.trials * (scipy.special.rel_entr(r, p) + scipy.special.rel_entr(1.0 - r, 1.0 - p))
        return np.asarray(np.sign(p - r) * np.sqrt(np.maximum(parts, 0.0)))


def _likelihood_of(
    rates: Mapping[str, float],
    methods: Mapping[str, Method],
    trials: int,
    people: People,
    base: PerceptParameters,
) -> _Likelihood:
    """The likelihood of these rates. `ValueError`: rates, methods or trials that cannot be used."""
    if len(rates) < len(FITTED):
        raise ValueError(f"{len(rates)} rates; at least {len(FITTED)} are needed for {', '.join(FITTED)}")
    for name, rate in rates.items():
        if not 0.0 <= rate <= 1.0:
            raise ValueError(f"the rate of {name} is {rate}; it must be 0 to 1")
        if name not in methods:
            raise ValueError(f"there is a rate of {name}, but no such method; there are {', '.join(methods)}")
        if trials < 1:
            raise ValueError(f"the trials of {name} are {trials}; there must be at least 1")
    kept = {name: methods[name] for name in rates}
    percepts = percepts_of(kept, base.leak_s)
    return _Likelihood(methods=kept, percepts=percepts, rates=dict(rates), trials=trials, people=people, base=base)


_STARTS = np.array([[-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 3.0, 0.0]])


def _lowest(
    likelihood: _Likelihood, held: tuple[int, float] | None = None, near: Floats | None = None
) -> tuple[Floats, float]:
    """The place of lowest deviance, one coordinate held if asked: least squares of the residuals.

    From several starts; `near` a place that is nearly it, from there and one other.
    """
    free = np.array([held is None or i != held[0] for i in range(len(FITTED))])
    starts = _STARTS if near is None else np.vstack([near, _STARTS[1:2]])
    return min((_descent(likelihood, start, free, held) for start in starts), key=lambda found: found[1])


def _descent(
    likelihood: _Likelihood, start: Floats, free: NDArray[np.bool_], held: tuple[int, float] | None
) -> tuple[Floats, float]:
    place = np.array(start)
    if held is not None:
        place[held[0]] = held[1]

    def residuals(part: Floats) -> Floats:
        place[free] = part
        return likelihood.residuals(place)

    inside = np.clip(place[free], _LOWEST[free] + 1e-6, _HIGHEST[free] - 1e-6)
    found = scipy.optimize.least_squares(
        residuals, inside, bounds=(_LOWEST[free], _HIGHEST[free]), xtol=1e-12, ftol=1e-12
    )
    place[free] = found.x
    return place, 2.0 * float(found.cost)


def _slopes(likelihood: _Likelihood, parameters: PerceptParameters) -> Floats:
    """Derivatives of the predicted rates by the logarithm of every parameter, (rates, parameters)."""
    columns = [_slope(partial(_scaled, likelihood, parameters, name)) for name in (*FITTED, *ASSUMED)]
    return np.column_stack(columns)


_STEP = 1e-4
"""Of the logarithm of a factor, to either side."""


def _slope(rates: Callable[[float], Floats]) -> Floats:
    """The derivative by the logarithm of a factor."""
    return (rates(math.exp(_STEP)) - rates(math.exp(-_STEP))) / (2.0 * _STEP)


def _scaled(likelihood: _Likelihood, parameters: PerceptParameters, name: str, factor: float) -> Floats:
    """The predicted rates with one parameter times `factor`."""
    if name == "boundary":  # drift = evidence / boundary: the product, and with it every rate, stays
        return likelihood.predicted(parameters)
    changed = replace(parameters, **{name: getattr(parameters, name) * factor})
    if name == "leak_s":
        likelihood = replace(likelihood, percepts=percepts_of(likelihood.methods, changed.leak_s))
    return likelihood.predicted(changed)


def _information(likelihood: _Likelihood, parameters: PerceptParameters) -> Floats:
    """Fisher information of the logarithms: sum over methods of n p' p'^T / (p (1 - p))."""
    p = np.clip(likelihood.predicted(parameters), 1e-12, 1.0 - 1e-12)
    weights = likelihood.trials / (p * (1.0 - p))
    slopes = _slopes(likelihood, parameters)
    return np.asarray(slopes.T @ (weights[:, None] * slopes))


PAPER_RATES = {"vibration": 0.557, "asymmetric-1": 0.793, "asymmetric-2": 0.929}
"""Shares of right answers to forward shots (paper, section III.A)."""
PAPER_TRIALS = 140
"""Forward trials of each method: 14 people times 10 (paper)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fitted:
    """A fitted number: standard error from the Fisher information (delta method), limits from the profile likelihood.

    A limit is infinite or the end of the range where the profile never falls far enough.
    """

    value: float
    se: float
    ci_low: float
    ci_high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PerceptPeak:
    """The fit without its intervals; the covariance is NaN where there is none."""

    parameters: PerceptParameters
    deviance: float  # 0: the rates are met exactly
    covariance: tuple[tuple[float, ...], ...]  # of the logarithms of `FITTED`, the assumed numbers held


@dataclass(frozen=True, slots=True, kw_only=True)
class PerceptFit(PerceptPeak):
    """The fit. `rank` of the information on all `parameters`; `unknown` says in words what the rates do not tell."""

    fitted: dict[str, Fitted]
    rates: dict[str, float]  # observed
    predicted: dict[str, float]
    freedom: int  # rates less fitted numbers
    rank: int
    untold: dict[str, float]  # of each number, 0 if the rates fix it alone to 1 if they do not bear on it at all
    unknown: tuple[str, ...]


def fit_percept(
    rates: Mapping[str, float],
    methods: Mapping[str, Method],
    *,
    trials: int = PAPER_TRIALS,
    people: People = ALIKE,
) -> PerceptFit:
    """Sensitivity, confusion and start by maximum likelihood from the methods' mean forward rates.

    Binomial likelihood of `trials` answers a method; `people` are the assumed spreads, over which the rates are means.
    `ValueError`: fewer than three methods, a rate outside 0..1, no trials, or a rate of a method that is not given.

    >>> from device.methods import paper_methods
    >>> found = fit_percept(PAPER_RATES, paper_methods())
    >>> round(found.fitted["start"].value, 3), round(found.deviance, 6), found.freedom, found.rank
    (0.557, 0.0, 0, 3)
    """
    likelihood = _likelihood_of(rates, methods, trials, people, USUAL)
    place, deviance = _lowest(likelihood)
    parameters = likelihood.at(place)
    matrix = _information(likelihood, parameters)
    values, vectors = np.linalg.eigh(matrix)
    rank = int((values > 1e-8 * values[-1]).sum())
    covariance = _inverse(matrix[: len(FITTED), : len(FITTED)])
    fitted = _fitted(likelihood, place, deviance, np.sqrt(np.diag(covariance)))
    return PerceptFit(
        parameters=parameters,
        fitted=fitted,
        rates=dict(rates),
        predicted=dict(zip(rates, map(float, likelihood.predicted(parameters)), strict=True)),
        deviance=deviance,
        freedom=len(rates) - len(FITTED),
        rank=rank,
        untold=dict(zip((*FITTED, *ASSUMED), np.linalg.norm(vectors[:, :-rank], axis=1).tolist(), strict=True)),
        covariance=tuple(map(tuple, covariance.tolist())),
        unknown=_unknown(fitted, rank, len(rates), deviance),
    )


def best_percept(
    rates: Mapping[str, float],
    methods: Mapping[str, Method],
    *,
    trials: int = PAPER_TRIALS,
    people: People = ALIKE,
    base: PerceptParameters = USUAL,
) -> PerceptPeak:
    """The numbers of `fit_percept` alone, thirty times as fast: the profile takes the time.

    `base` holds the assumed numbers.
    """
    likelihood = _likelihood_of(rates, methods, trials, people, base)
    place, deviance = _lowest(likelihood)
    parameters = likelihood.at(place)
    covariance = _inverse(_information(likelihood, parameters)[: len(FITTED), : len(FITTED)])
    return PerceptPeak(parameters=parameters, deviance=deviance, covariance=tuple(map(tuple, covariance.tolist())))


def predicted_rate(
    fit: PerceptFit, percept: Percept, *, direction: Direction = "forward", people: People = ALIKE
) -> Fitted:
    """The correct rate that the fit predicts for a shot, with the fit's uncertainty (delta method, on the logit).

    Only of the fitted numbers: that of `exponent`, `leak_s` and of the model itself comes on top and is not known. NaN
    limits for a rate of 0 or 1, and where the fit has no covariance.
    """
    sign = 1.0 if direction == "forward" else -1.0

    def logit(name: str, factor: float) -> Floats:
        changed = replace(fit.parameters, **{name: getattr(fit.parameters, name) * factor})
        return sign * scipy.special.logit(forward_rates(sign * evidence(percept, changed), changed.start, people))

    with np.errstate(invalid="ignore"):
        slopes = np.array([_slope(partial(logit, name)) for name in FITTED])
    centre, se = float(logit("start", 1.0)), float(np.sqrt(slopes @ np.array(fit.covariance) @ slopes))
    reach = -NormalDist().inv_cdf((1.0 - CONFIDENCE) / 2.0) * se
    rate, low, high = (float(scipy.special.expit(x)) for x in (centre, centre - reach, centre + reach))
    return Fitted(value=rate, se=rate * (1.0 - rate) * se, ci_low=low, ci_high=high)


def _inverse(matrix: Floats) -> Floats:
    """The inverse, NaN where there is none."""
    told = int(np.linalg.matrix_rank(matrix, hermitian=True)) == len(matrix)
    return np.asarray(np.linalg.inv(matrix) if told else np.full_like(matrix, math.nan))


def _fitted(likelihood: _Likelihood, place: Floats, deviance: float, spread: Floats) -> dict[str, Fitted]:
    wanted = deviance + float(scipy.special.chdtri(1, 1.0 - CONFIDENCE))
    best, found = likelihood.at(place), {}
    for i, name in enumerate(FITTED):
        value = float(getattr(best, name))
        low, high = (_limit(likelihood, i, place, wanted, sign) for sign in (-1.0, 1.0))
        found[name] = Fitted(value=value, se=value * float(spread[i]), ci_low=low, ci_high=high)
    return found


def _limit(likelihood: _Likelihood, index: int, place: Floats, wanted: float, sign: float) -> float:
    """Where the lowest deviance with this number held reaches `wanted`, on one side."""
    farthest = abs(float((_HIGHEST if sign > 0 else _LOWEST)[index] - place[index]))
    forms = (math.exp, math.exp, lambda x: float(scipy.special.expit(x)))

    last = [place]

    def excess(distance: float) -> float:
        last[0], deviance = _lowest(likelihood, (index, float(place[index]) + sign * distance), last[0])
        return deviance - wanted

    inner, outer = 0.0, min(0.1, farthest)
    while excess(outer) < 0.0:
        if outer >= farthest:
            return 0.0 if sign < 0 else (math.inf, math.inf, 1.0)[index]
        inner, outer = outer, min(farthest, outer * 2.0)
    distance = float(scipy.optimize.brentq(excess, inner, outer, xtol=1e-6)) if farthest > 0.0 else 0.0
    return forms[index](float(place[index]) + sign * distance)


def _unknown(fitted: Mapping[str, Fitted], rank: int, rates: int, deviance: float) -> tuple[str, ...]:
    """In words: what these rates cannot tell."""
    count, level = len(FITTED) + len(ASSUMED), f"{100.0 * CONFIDENCE:g} %"
    said = [
        f"The rates bear on {count} numbers and fix {rank} combinations of them (rank of the information): exponent "
        "and leak_s are assumed, and others fit as well with another sensitivity and confusion.",
        "Drift and boundary cannot be told apart: without the participants' own response times the rates fix only "
        "their product, the log odds.",
        "Forward rates alone cannot tell a bias that differs between methods from a difference in what is felt; the "
        "bias is taken to be one for all.",
        "The answers are counted as independent; they come in people, whose spread is not published, so the intervals "
        "are too short if people differ.",
    ]
    if rates == len(FITTED):
        said.append("There are as many fitted numbers as rates: meeting them exactly is no evidence for the model.")
    if deviance > 1e-3:
        said.append(f"The model does not meet the rates: deviance {deviance:.3g}.")
    if fitted["start"].ci_low <= 0.5 <= fitted["start"].ci_high:
        said.append(f"No bias (start 0.5) lies within the {level} interval.")
    for name in ("sensitivity", "confusion"):
        if math.isinf(fitted[name].ci_high):
            said.append(f"The {name} has no upper limit at {level}.")
        if fitted[name].ci_low <= 0.0:
            said.append(f"The {name} may as well be 0 at {level}.")
    return tuple(said)
