"""The percept fitted to forward rates: three numbers from three rates, how sure they are, and what is not told."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import optimize, special

from analysis.predict.fit.percept_likelihood import (
    ASSUMED,
    FITTED,
    HIGHEST,
    LOWEST,
    Task,
    information,
    lowest,
    slope,
    task_of,
)
from device.methods import Method
from device.words import Direction
from experiments.synthetic.diffusion import Floats, People
from experiments.synthetic.percept import Percept, PerceptParameters, evidence, forward_rates

__all__ = [
    "ASSUMED",
    "FITTED",
    "PAPER_RATES",
    "PAPER_TRIALS",
    "Fitted",
    "PerceptFit",
    "PerceptPeak",
    "best_percept",
    "fit_percept",
    "predicted_rate",
]

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
class PerceptFit:
    """The fit. `rank` of the information on all `parameters`; `unknown` says in words what the rates do not tell."""

    parameters: PerceptParameters
    fitted: dict[str, Fitted]
    rates: dict[str, float]  # observed
    predicted: dict[str, float]
    deviance: float  # 0: the rates are met exactly
    freedom: int  # rates less fitted numbers
    rank: int
    untold: dict[str, float]  # of each number, 0 if the rates fix it alone to 1 if they do not bear on it at all
    covariance: tuple[tuple[float, ...], ...]  # of the logarithms of `FITTED`, the assumed numbers held
    unknown: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PerceptPeak:
    """The fit without its intervals; the covariance as in `PerceptFit`, NaN where there is none."""

    parameters: PerceptParameters
    deviance: float
    covariance: tuple[tuple[float, ...], ...]


def fit_percept(
    rates: Mapping[str, float],
    methods: Mapping[str, Method],
    *,
    trials: Mapping[str, int] | int = PAPER_TRIALS,
    people: People | None = None,
    base: PerceptParameters | None = None,
    confidence: float = 0.95,
) -> PerceptFit:
    """Sensitivity, confusion and start by maximum likelihood from the methods' mean forward rates.

    Binomial likelihood of `trials` answers a method; `people` are the assumed spreads, over which the rates are means;
    `base` holds the assumed numbers. `ValueError`: fewer than three methods, a rate outside 0..1, no trials, or a rate
    of a method that is not given.

    >>> from device.methods import paper_methods
    >>> found = fit_percept(PAPER_RATES, paper_methods())
    >>> round(found.fitted["start"].value, 3), round(found.deviance, 6), found.freedom, found.rank
    (0.557, 0.0, 0, 3)
    """
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence is {confidence}; it must lie between 0 and 1")
    task = task_of(rates, methods, trials, people, base)
    place, deviance = lowest(task)
    parameters = task.at(place)
    matrix = information(task, parameters)
    values, vectors = np.linalg.eigh(matrix)
    rank = int((values > 1e-8 * values[-1]).sum())
    covariance = _inverse(matrix[: len(FITTED), : len(FITTED)])
    fitted = _fitted(task, place, deviance, np.sqrt(np.diag(covariance)), confidence)
    return PerceptFit(
        parameters=parameters,
        fitted=fitted,
        rates=dict(rates),
        predicted=dict(zip(rates, map(float, task.predicted(parameters)), strict=True)),
        deviance=deviance,
        freedom=len(rates) - len(FITTED),
        rank=rank,
        untold=dict(zip((*FITTED, *ASSUMED), np.linalg.norm(vectors[:, :-rank], axis=1).tolist(), strict=True)),
        covariance=tuple(map(tuple, covariance.tolist())),
        unknown=_unknown(fitted, rank, len(rates), deviance, confidence),
    )


def best_percept(
    rates: Mapping[str, float],
    methods: Mapping[str, Method],
    *,
    trials: Mapping[str, int] | int = PAPER_TRIALS,
    people: People | None = None,
    base: PerceptParameters | None = None,
) -> PerceptPeak:
    """The numbers of `fit_percept` alone, thirty times as fast: the profile takes the time."""
    task = task_of(rates, methods, trials, people, base)
    place, deviance = lowest(task)
    parameters = task.at(place)
    covariance = _inverse(information(task, parameters)[: len(FITTED), : len(FITTED)])
    return PerceptPeak(parameters=parameters, deviance=deviance, covariance=tuple(map(tuple, covariance.tolist())))


def predicted_rate(
    fit: PerceptFit,
    percept: Percept,
    *,
    direction: Direction = "forward",
    people: People | None = None,
    confidence: float = 0.95,
) -> Fitted:
    """The correct rate that the fit predicts for a shot, with the fit's uncertainty (delta method, on the logit).

    Only of the fitted numbers: that of `exponent`, `leak_s` and of the model itself comes on top and is not known. NaN
    limits for a rate of 0 or 1, and where the fit has no covariance.
    """
    spread = People() if people is None else people
    sign = 1.0 if direction == "forward" else -1.0

    def logit(name: str, factor: float) -> Floats:
        changed = replace(fit.parameters, **{name: getattr(fit.parameters, name) * factor})
        return sign * special.logit(forward_rates(sign * evidence(percept, changed), changed.start, spread))

    with np.errstate(invalid="ignore"):
        slopes = np.array([slope(partial(logit, name)) for name in FITTED])
    centre, se = float(logit("start", 1.0)), float(np.sqrt(slopes @ np.array(fit.covariance) @ slopes))
    reach = -float(special.ndtri((1.0 - confidence) / 2.0)) * se
    rate, low, high = (float(special.expit(x)) for x in (centre, centre - reach, centre + reach))
    return Fitted(value=rate, se=rate * (1.0 - rate) * se, ci_low=low, ci_high=high)


def _inverse(matrix: Floats) -> Floats:
    """The inverse, NaN where there is none."""
    told = int(np.linalg.matrix_rank(matrix, hermitian=True)) == len(matrix)
    return np.asarray(np.linalg.inv(matrix) if told else np.full_like(matrix, math.nan))


def _fitted(task: Task, place: Floats, deviance: float, spread: Floats, confidence: float) -> dict[str, Fitted]:
    wanted = deviance + float(special.chdtri(1, 1.0 - confidence))
    best, found = task.at(place), {}
    for i, name in enumerate(FITTED):
        value = float(getattr(best, name))
        low, high = (_limit(task, i, place, wanted, sign) for sign in (-1.0, 1.0))
        found[name] = Fitted(value=value, se=value * float(spread[i]), ci_low=low, ci_high=high)
    return found


def _limit(task: Task, index: int, place: Floats, wanted: float, sign: float) -> float:
    """Where the lowest deviance with this number held reaches `wanted`, on one side."""
    farthest = abs(float((HIGHEST if sign > 0 else LOWEST)[index] - place[index]))
    forms = (math.exp, math.exp, lambda x: float(special.expit(x)))

    last = [place]

    def excess(distance: float) -> float:
        last[0], deviance = lowest(task, (index, float(place[index]) + sign * distance), last[0])
        return deviance - wanted

    inner, outer = 0.0, min(0.1, farthest)
    while excess(outer) < 0.0:
        if outer >= farthest:
            return 0.0 if sign < 0 else (math.inf, math.inf, 1.0)[index]
        inner, outer = outer, min(farthest, outer * 2.0)
    distance = float(optimize.brentq(excess, inner, outer, xtol=1e-6)) if farthest > 0.0 else 0.0
    return forms[index](float(place[index]) + sign * distance)


def _unknown(
    fitted: Mapping[str, Fitted], rank: int, rates: int, deviance: float, confidence: float
) -> tuple[str, ...]:
    """In words: what these rates cannot tell."""
    count, level = len(FITTED) + len(ASSUMED), f"{100.0 * confidence:g} %"
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
