"""Logistic regression of single answers with a random intercept a person, by maximum likelihood.

logit P(right) = x'b + s u, u ~ N(0, 1) of each person. The likelihood of a person is an integral over u, here by
adaptive Gauss-Hermite quadrature: the nodes lie around the peak of the integrand, as wide as that is. By Newton's
method, with gradient and Hessian as means under the same weights (Fisher's and Louis's identities).
Sources: Pinheiro & Bates 1995, J. Comput. Graph. Stat. 4, 12; Liu & Pierce 1994, Biometrika 81, 624; Louis 1982,
J. R. Stat. Soc. B 44, 226.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import scipy
from numpy.typing import ArrayLike, NDArray

from analysis.stats.arrays import FloatArray, numbers, share, whole
from analysis.stats.fixed_effects import Coefficient, PredictorColumns, coefficients, columns_of, people_codes
from analysis.stats.frames import Result
from analysis.stats.logit_model import ONE_PERSON, ONE_TRIAL

NODES = 25
"""As many as lme4 allows. Of people who differ by an SD above 3 (in log odds) they leave an error of 1 %; 99 do not."""
MOST_NODES = 100
"""What numpy has in full digits in less than a second."""
LARGEST_SD = 10.0
"""Log odds that differ so much between people leave hardly anybody with answers of both kinds."""
_STEPS, _CLOSE, _NEAR, _LONGEST = 100, 1e-8, 0.05, 2.0
_SINGULAR, _FLAT = 1e-4, 1e-10
"""A spread between people below the first is none; a peak as flat in one direction as the second is none."""

ALL_ALIKE = "All answers are alike: the log odds are infinite."
RUNS_AWAY = (
    "The likelihood grows as people are taken to differ without bound: hardly anybody has answers of both kinds that "
    "the predictors do not tell apart. There is no estimate."
)
NOT_FOUND = "The likelihood has no peak that could be found."


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomInterceptLogit(Result):
    """The fitted model: log odds of a right answer for the person of u = 0, and how people differ.

    `person_sd`: SD of the people's own log odds; 0 if they differ no more than chance has them. Empty where there is no
    estimate, and `reason` says why.
    """

    coefficients: tuple[Coefficient, ...] = ()
    person_sd: float | None = None
    log_likelihood: float | None = None
    people: int
    trials: int
    reason: str | None = None

    def rows(self) -> list[dict[str, object]]:
        """The coefficients, a row each."""
        return [row for coefficient in self.coefficients for row in coefficient.rows()]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Cells:
    """Trials that are alike in person and predictors together, sorted by person; `first` cell of each person."""

    matrix: FloatArray
    right: FloatArray
    trials: FloatArray
    person: NDArray[np.intp]
    first: NDArray[np.intp]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Peak:
    """Log-likelihood with its gradient and Hessian at coefficients and SD (the last)."""

    value: float
    gradient: FloatArray
    hessian: FloatArray


def random_intercept_logit(
    right: ArrayLike,
    people: Sequence[Hashable],
    predictors: Mapping[str, ArrayLike],
    confidence: float = 0.95,
    nodes: int = NODES,
) -> RandomInterceptLogit:
    """Logistic regression of answers on `predictors` and an intercept, with a random intercept a person.

    Estimates are of one person's odds, not of the population's (as `logit_model` has them): they are farther from 0 the
    more people differ. z and p are Wald's, from the curvature of the likelihood; with few people they are too small.

    `right`: (trials,) of 0 and 1; `people`: whose each is; `predictors`: by name (trials,), beside an intercept;
    `indicators` makes them of a factor. No estimate (`reason`): one person, one trial each, all answers alike,
    separation (predictors that tell right from wrong without exception), or people who differ without bound.
    `ValueError`: answers other than 0 and 1, lengths that differ, a trial of nobody, predictors that are constant or
    overlap, `nodes` outside 1 to 100. Equals lme4's `glmer(..., family = binomial, nAGQ = 25)`.
    Sources: see the module; Albert & Anderson 1984, Biometrika 71, 1, for separation.

    >>> right = [1, 1, 0, 1, 1, 0, 0, 1, 1, 1, 1, 0, 0, 0, 0, 1]
    >>> who = [person for person in "abcd" for _ in range(4)]
    >>> found = random_intercept_logit(right, who, {"forward": [1, 0] * 8})
    >>> [round(one.estimate, 3) for one in found.coefficients], found.trials
    ([0.511, -0.511], 16)
    """
    answers = numbers(right, "right")
    if answers.ndim != 1 or not np.isin(answers, (0.0, 1.0)).all():
        raise ValueError("right must be one number a trial, 1 for right and 0 for wrong")
    points = whole(nodes, "nodes", 1, MOST_NODES)
    columns = columns_of(predictors, answers.size)
    cells = _cells(columns.matrix, answers, people_codes(people, answers.size))
    reason = _unfit(cells, columns)
    empty = RandomInterceptLogit(people=cells.first.size, trials=answers.size, reason=reason)
    return empty if reason else _fitted(empty, cells, columns, (share(confidence, "confidence"), points))


def _cells(matrix: FloatArray, right: FloatArray, person: NDArray[np.intp]) -> _Cells:
    names = list(range(matrix.shape[1]))
    table = pd.DataFrame(matrix, columns=names).assign(person=person, right=right)
    found = table.groupby(["person", *names])["right"].agg(["sum", "size"]).reset_index()
    people = found["person"].to_numpy(dtype=np.intp)
    return _Cells(
        matrix=found[names].to_numpy(dtype=np.float64),
        right=found["sum"].to_numpy(dtype=np.float64),
        trials=found["size"].to_numpy(dtype=np.float64),
        person=people,
        first=np.flatnonzero(np.diff(people, prepend=-1)),
    )


def _unfit(cells: _Cells, columns: PredictorColumns) -> str | None:
    if cells.first.size < 2:
        return ONE_PERSON
    if cells.first.size == cells.trials.sum():
        return ONE_TRIAL
    if cells.right.sum() in (0.0, cells.trials.sum()):
        return ALL_ALIKE
    separating = _separating(cells)
    if not separating.any():
        return None
    names = [name for name, part in zip(columns.names[1:], separating[1:], strict=True) if part]
    return (
        f"The predictors ({', '.join(names)}) tell right from wrong without exception in some of the trials "
        "(separation), so the likelihood grows without bound and there is no estimate: all answers of a condition are "
        "right, or wrong, or all beyond a value."
    )


def _separating(cells: _Cells) -> NDArray[np.bool_]:
    """Which columns have a part in separation: max sum |x'b| with x'b >= 0 where all is right, <= 0 where all is wrong.

    Where a row of predictors has answers of both kinds x'b must be 0. Without separation b = 0 is all there is.
    """
    rows, where = np.unique(cells.matrix, axis=0, return_inverse=True)
    right = np.bincount(where.ravel(), weights=cells.right)
    trials = np.bincount(where.ravel(), weights=cells.trials)
    mixed = (right > 0.0) & (right < trials)
    signed = np.where(right[~mixed] > 0.0, 1.0, -1.0)[:, None] * rows[~mixed]
    found = scipy.optimize.linprog(
        -signed.sum(axis=0),
        A_ub=-signed if signed.size else None,
        b_ub=np.zeros(len(signed)) if signed.size else None,
        A_eq=rows[mixed] if mixed.any() else None,
        b_eq=np.zeros(int(mixed.sum())) if mixed.any() else None,
        bounds=(-1.0, 1.0),
    )
    separating: NDArray[np.bool_] = np.abs(np.asarray(found.x)) > 1e-7
    return separating


def _fitted(
    empty: RandomInterceptLogit, cells: _Cells, columns: PredictorColumns, confidence_and_nodes: tuple[float, int]
) -> RandomInterceptLogit:
    confidence, nodes = confidence_and_nodes
    start = np.zeros(cells.matrix.shape[1] + 1)
    start[0], start[-1] = scipy.special.logit(cells.right.sum() / cells.trials.sum()), 1.0
    theta, peak = _climbed(cells, start, np.polynomial.hermite.hermgauss(nodes))
    if abs(theta[-1]) > LARGEST_SD:
        return replace(empty, reason=RUNS_AWAY)
    covariance = None if peak is None else _covariance(theta, peak)
    if peak is None or covariance is None:
        return replace(empty, reason=NOT_FOUND)
    covariance = columns.back @ covariance @ columns.back.T
    sd = abs(float(theta[-1]))
    return replace(
        empty,
        coefficients=coefficients(columns.names, columns.back @ theta[:-1], np.sqrt(np.diag(covariance)), confidence),
        person_sd=sd if sd > _SINGULAR else 0.0,
        log_likelihood=peak.value,
    )


def _climbed(cells: _Cells, start: FloatArray, rule: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, _Peak | None]:
    """Where Newton's method ends, and the peak there; None if it is none."""
    theta, here = start, _likelihood(cells, start, rule)
    for _ in range(_STEPS):
        values, vectors = np.linalg.eigh(-here.hessian)
        steepness = np.maximum(np.abs(values), 1e-8 * np.abs(values).max())
        step = vectors @ ((vectors.T @ here.gradient) / steepness)
        step *= min(1.0, _LONGEST / float(np.abs(step).max() or 1.0))
        step, here = _upwards(cells, theta, here, step, rule)
        theta = theta + step
        if abs(theta[-1]) > LARGEST_SD:
            return theta, None
        if np.abs(step if abs(theta[-1]) > _SINGULAR else step[:-1]).max() < _CLOSE:
            return theta, here
    return theta, None


def _covariance(theta: FloatArray, peak: _Peak) -> FloatArray | None:
    """That of the coefficients; None where the likelihood is flat. With no spread its own direction does not count."""
    own = slice(None) if abs(theta[-1]) > _SINGULAR else slice(-1)
    bent = -peak.hessian[own, own]
    values = np.linalg.eigvalsh(bent)
    if values[0] <= _FLAT * values[-1]:
        return None
    covariance = np.linalg.inv(bent)[: theta.size - 1, : theta.size - 1]
    return np.asarray(covariance, dtype=np.float64)


def _upwards(
    cells: _Cells, theta: FloatArray, here: _Peak, step: FloatArray, rule: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, _Peak]:
    """The step, halved until it gains some of what its slope promises: s and -s are the same model, and no gain.

    Near the peak it is Newton's own: there the value, of so many nodes, tells less than the slope.
    """
    while True:
        there = _likelihood(cells, theta + step, rule)
        promised = 1e-4 * float(here.gradient @ step)
        if there.value >= here.value + promised or np.abs(step).max() < _NEAR:
            return step, there
        step = step / 2.0


def _likelihood(cells: _Cells, theta: FloatArray, rule: tuple[FloatArray, FloatArray]) -> _Peak:
    fixed, sd = cells.matrix @ theta[:-1], float(theta[-1])
    mode, curvature = _modes(cells, fixed, sd)
    z, weights = rule
    width = np.sqrt(2.0 / curvature)[:, None]
    u = mode[:, None] + width * z
    eta = fixed[:, None] + sd * u[cells.person]
    terms = cells.right[:, None] * eta - cells.trials[:, None] * np.logaddexp(0.0, eta)
    height = np.add.reduceat(terms, cells.first, axis=0) - np.square(u) / 2.0
    height += np.log(weights) + np.square(z) + np.log(width / np.sqrt(2.0 * np.pi))
    of_people = scipy.special.logsumexp(height, axis=1)
    return _with_slopes(cells, u, eta, np.exp(height - of_people[:, None]), float(of_people.sum()))


def _with_slopes(cells: _Cells, u: FloatArray, eta: FloatArray, share: FloatArray, value: float) -> _Peak:
    """Gradient: the mean score of (b, s). Hessian: its mean Hessian, and the variance of the score."""
    p, trials, at = scipy.special.expit(eta), cells.trials[:, None], u[cells.person]
    rest, weight = cells.right[:, None] - trials * p, share[cells.person] * trials * p * (1.0 - p)
    of_people = [np.add.reduceat(rest * column[:, None], cells.first, axis=0) for column in cells.matrix.T]
    score = np.stack([*of_people, u * np.add.reduceat(rest, cells.first, axis=0)], axis=-1)
    mean, squared = np.einsum("pq,pqk->pk", share, score), np.einsum("pq,pqk,pql->kl", share, score, score)
    both = cells.matrix.T @ (weight * at).sum(axis=1)
    curved = np.block(
        [
            [(cells.matrix.T * weight.sum(axis=1)) @ cells.matrix, both[:, None]],
            [both[None], np.array([[(weight * at * at).sum()]])],
        ]
    )
    return _Peak(value=value, gradient=mean.sum(axis=0), hessian=squared - mean.T @ mean - curved)


def _modes(cells: _Cells, fixed: FloatArray, sd: float) -> tuple[FloatArray, FloatArray]:
    """Where each person's integrand peaks, and its curvature: Newton's steps, halving where they leave the bracket."""
    people = cells.first.size
    total = np.add.reduceat(cells.trials, cells.first)
    high = abs(sd) * total + 1.0
    low, u = -high, np.zeros(people)
    for _ in range(_STEPS):
        p = scipy.special.expit(fixed + sd * u[cells.person])
        slope = sd * np.add.reduceat(cells.right - cells.trials * p, cells.first) - u
        curvature = sd**2 * np.add.reduceat(cells.trials * p * (1.0 - p), cells.first) + 1.0
        low, high = np.where(slope > 0.0, u, low), np.where(slope > 0.0, high, u)
        new = u + slope / curvature
        new = np.where((new > low) & (new < high), new, (low + high) / 2.0)
        done = np.abs(new - u).max() < 1e-10
        u = new
        if done:
            break
    return u, curvature
