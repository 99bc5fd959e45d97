"""Scores from paired comparisons: Bradley and Terry, Thurstone's case V, ties, and how consistent the choices are."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Literal, get_args

import numpy as np
import scipy
from numpy.typing import ArrayLike

from analysis.stats.arrays import FloatArray, numbers, one_of, row_labels, share
from analysis.stats.frames import Result

PairModel = Literal["bradley-terry", "thurstone"]
_LEAST = -40.0
"""A log probability below which nothing more is told apart."""
_MOST = 40.0
"""A score, or an error of one, beyond which there is none."""
_STEP, _POLISHED = 1e-3, 20
"""Of derivatives by differences of the fourth order, whose error is that of rounding; Newton's steps at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemScore(Result):
    """An item's score, in logits (Bradley and Terry) or in units of sd √2 (Thurstone); the items' sum is 0.

    `se`: the larger standard error of two, of independent answers and of the sandwich over people. `low, high`: the
    wider of their two intervals, normal and Student's t, which need not be that of the larger error.
    """

    item: Hashable
    score: float
    se: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PairedScores(Result):
    """The scores of all items in their order; none for a `reason`. `tie`: the tie parameter, 0 without ties.

    `people`: the intervals allow for differences between so many people; 1: answers are taken as independent.
    """

    model: PairModel
    people: int = 1
    scores: tuple[ItemScore, ...] = ()
    tie: float = 0.0
    log_likelihood: float | None = None
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Consistency(Result):
    """Circular triads (A over B over C over A) among the `triads` whose three pairs were all decided.

    `zeta` is Kendall's coefficient of consistency, from 0 (as circular as it gets) to 1; only of complete designs.
    """

    triads: int
    circular: int
    zeta: float | None = None


def paired_scores(
    items: Sequence[Hashable],
    wins: ArrayLike,
    ties: ArrayLike | None = None,
    *,
    model: PairModel = "bradley-terry",
    confidence: float = 0.95,
) -> PairedScores:
    """Scores by maximum likelihood from `wins` (n, n): how often the row was chosen over the column.

    Bradley and Terry: P(i over j) = 1 / (1 + exp(s_j - s_i)), with `ties` (n, n; each pair's, on both sides) as
    Davidson (1970) has them: P(tie) is proportional to ν √(w_i w_j). Thurstone's case V: P(i over j) = Φ(s_i - s_j),
    with ties where the difference is within τ (Glenn and David 1960). Intervals are score ± z se; with `wins` (and
    `ties`) of the shape (people, n, n) the wider of these and score ± t se of a sandwich over people (Liang and Zeger
    1986, times people / (people - 1)), with people - 1 degrees of freedom.
    There are no scores, and a `reason`, where some items were never chosen over the others (Ford 1957): one could be as
    far above as one likes; nor where no circle of items, each chosen over or tied with the next, has more choices than
    ties: scores and ties could grow together. `ValueError`: counts that are none, or not of a square of the items.

    >>> found = paired_scores(["a", "b", "c"], [[0, 7, 9], [3, 0, 6], [1, 4, 0]])
    >>> [(one.item, round(one.score, 3)) for one in found.scores]
    [('a', 0.944), ('b', -0.16), ('c', -0.783)]
    """
    items = row_labels(items, "items")
    wins_of, ties_of = _counted(items, wins, ties)
    won, tied = wins_of.sum(axis=0), ties_of.sum(axis=0)
    one_of(model, "model", get_args(PairModel))
    level = share(confidence, "confidence")
    if reason := _not_connected(items, won + tied / 2):
        return PairedScores(model=model, reason=reason)
    found = _fitted(won, tied, model) if _bounded(won, tied) else None
    if found is None:
        reason = "with so many ties scores of any size fit alike; more choices without ties would tell"
        return PairedScores(model=model, reason=reason)
    fit, covariance = found
    basis = _basis(len(items))
    scores, ses = basis @ fit[: len(items) - 1], _errors(basis, covariance)
    reach = NormalDist().inv_cdf((1 + level) / 2) * ses
    if len(wins_of) > 1:
        robust, robust_reach = _over_people(basis, covariance, _slopes(fit, wins_of, ties_of, model), level)
        ses, reach = np.maximum(ses, robust), np.maximum(reach, robust_reach)
    return PairedScores(
        model=model,
        people=len(wins_of),
        scores=tuple(
            ItemScore(item=item, score=float(s), se=float(se), low=float(s - half), high=float(s + half))
            for item, s, se, half in zip(items, scores, ses, reach, strict=True)
        ),
        tie=float(np.exp(fit[-1])) if tied.any() else 0.0,
        log_likelihood=float(_log_likelihood(fit, won, tied, model)),
    )


def circular_triads(items: Sequence[Hashable], wins: ArrayLike) -> Consistency:
    """How consistent one person's choices are; a pair is decided for the item that was chosen more often.

    ζ = 1 - 24 d / (n³ - n) for odd n, 1 - 24 d / (n³ - 4 n) for even n (Kendall and Babington Smith 1940).

    >>> circular_triads(["a", "b", "c"], [[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    Consistency(triads=1, circular=1, zeta=0.0)
    """
    items = row_labels(items, "items")
    won, n = _checked(items, wins, "wins"), len(items)
    above = (won > won.T).astype(float)
    decided = above + above.T
    triads, circular = round(np.trace(decided @ decided @ decided) / 6), round(np.trace(above @ above @ above) / 3)
    most = (n**3 - (n if n % 2 else 4 * n)) / 24
    complete = n > 2 and decided.sum() == n * (n - 1)
    return Consistency(triads=triads, circular=circular, zeta=1 - circular / most if complete else None)


def _fitted(won: FloatArray, tied: FloatArray, model: PairModel) -> tuple[FloatArray, FloatArray] | None:
    """The parameters at the maximum and their covariance; `None` where they are beyond what can be told apart."""

    def loss(at: FloatArray) -> float:
        return -_log_likelihood(at, won, tied, model)

    try:
        fit = _maximum(loss, np.zeros(len(won) - 1 + bool(tied.any())))
        covariance = np.asarray(np.linalg.inv(_curvature(loss, fit)), dtype=np.float64)
    except np.linalg.LinAlgError:
        return None
    held = np.abs(fit).max() < _MOST and np.all((np.diag(covariance) > 0) & (np.diag(covariance) < _MOST**2))
    return (fit, covariance) if held else None


def _over_people(
    basis: FloatArray, covariance: FloatArray, slopes: FloatArray, level: float
) -> tuple[FloatArray, FloatArray]:
    """Errors by a sandwich over people from each one's slope, and half the lengths of the intervals by Student's t."""
    people = len(slopes)
    errors = _errors(basis, np.asarray(covariance @ slopes.T @ slopes @ covariance * people / (people - 1)))
    return errors, np.asarray(scipy.special.stdtrit(people - 1, (1 + level) / 2) * errors)


def _errors(basis: FloatArray, covariance: FloatArray) -> FloatArray:
    free = basis.shape[1]
    return np.asarray(np.sqrt(np.diag(basis @ covariance[:free, :free] @ basis.T)))


def _slopes(at: FloatArray, wins: FloatArray, ties: FloatArray, model: PairModel) -> FloatArray:
    """Each person's slope of the log likelihood (people, parameters), which is linear in their counts."""
    with_ties = bool(ties.any())

    def terms(place: FloatArray) -> FloatArray:
        return np.stack(_terms(place, wins.shape[-1], model, with_ties=with_ties))

    steps = np.eye(at.size) * _STEP
    rises = [
        (8 * (terms(at + h) - terms(at - h)) - terms(at + 2 * h) + terms(at - 2 * h)) / (12 * _STEP) for h in steps
    ]
    return np.asarray(np.einsum("cpij,kcij->pk", np.stack([wins, ties / 2]), np.stack(rises)))


def _counted(items: Sequence[Hashable], wins: ArrayLike, ties: ArrayLike | None) -> tuple[FloatArray, FloatArray]:
    """Both counts (people, n, n), which agree."""
    won = _of_people(items, wins, "wins")
    tied = np.zeros_like(won) if ties is None else _of_people(items, ties, "ties")
    if not np.array_equal(tied, tied.swapaxes(1, 2)):
        raise ValueError("ties must be the same on both sides of each pair")
    if len(tied) != len(won):
        raise ValueError(f"ties must be of as many people as wins, {len(won)}, not {len(tied)}")
    return won, tied


def _of_people(items: Sequence[Hashable], counts: ArrayLike, name: str) -> FloatArray:
    """Counts (people, n, n), each person's checked; of one without the first axis."""
    found = numbers(counts, name)
    if found.ndim != 3:
        return _checked(items, found, name)[None]
    if not len(found):
        raise ValueError(f"{name} must be of at least one person")
    return np.stack([_checked(items, one, name) for one in found])


def _checked(items: Sequence[Hashable], counts: ArrayLike, name: str) -> FloatArray:
    found, n = numbers(counts, name), len(items)
    if n < 2 or len(set(items)) < n:
        raise ValueError(f"items must be at least two, each once, not {list(items)}")
    if found.shape != (n, n):
        raise ValueError(f"{name} must be of the shape ({n}, {n}), a row and a column an item, not {found.shape}")
    if (found < 0).any() or found.diagonal().any():
        raise ValueError(f"{name} must not be below 0, and 0 for an item and itself")
    return found


def _not_connected(items: Sequence[Hashable], won: FloatArray) -> str:
    """Why there are no scores; empty if each item can be reached from each other by choices."""
    parts, part = scipy.sparse.csgraph.connected_components(won > 0, directed=True, connection="strong")
    if parts == 1:
        return ""
    apart, group = scipy.sparse.csgraph.connected_components(won > 0, directed=False)
    if apart > 1:
        return f"never compared with each other: {_named(items, group)}"
    return f"never chosen over the others, or always: {_named(items, part)}; one more choice the other way would do"


def _bounded(won: FloatArray, tied: FloatArray) -> bool:
    """Whether ties leave a maximum, where the items are connected.

    If not, scores d and a reach of 1 can grow together: d_i - d_j ≥ 1 where i was chosen, |d_i - d_j| ≤ 1 where there
    were ties. Such d exist unless these bounds contradict each other around a circle.
    """
    if not tied.any():
        return True
    try:
        scipy.sparse.csgraph.bellman_ford(np.where(won > 0, -1.0, np.where(tied > 0, 1.0, 0.0)))
    except scipy.sparse.csgraph.NegativeCycleError:
        return True
    return False


def _named(items: Sequence[Hashable], groups: Iterable[int]) -> str:
    groups = list(groups)
    members = (
        [str(item) for item, of in zip(items, groups, strict=True) if of == group] for group in range(max(groups) + 1)
    )
    return " | ".join(", ".join(some) for some in members)


def _basis(n: int) -> FloatArray:
    """(n, n - 1): orthonormal columns that each sum to 0."""
    return np.asarray(np.linalg.qr(np.eye(n) - 1 / n)[0][:, : n - 1])


def _log_likelihood(at: FloatArray, won: FloatArray, tied: FloatArray, model: PairModel) -> float:
    chosen, drawn = _terms(at, len(won), model, with_ties=bool(tied.any()))
    return float((won * chosen).sum() + (tied * drawn).sum() / 2)


def _terms(at: FloatArray, n: int, model: PairModel, *, with_ties: bool) -> tuple[FloatArray, FloatArray]:
    """The log probabilities (n, n) that the row is chosen over the column, and of a tie."""
    scores = _basis(n) @ at[: n - 1]
    difference = scores[:, None] - scores
    if not with_ties:
        chosen = scipy.special.log_expit(difference) if model == "bradley-terry" else scipy.special.log_ndtr(difference)
        return chosen, np.zeros_like(chosen)
    if model == "bradley-terry":
        middle = at[-1] + np.zeros_like(difference)
        total = scipy.special.logsumexp([difference / 2, -difference / 2, middle], axis=0)
        chosen, drawn = difference / 2 - total, middle - total
    else:
        reach = np.exp(at[-1])
        chosen = scipy.special.log_ndtr(difference - reach)
        upper, lower = scipy.special.log_ndtr(reach - difference), scipy.special.log_ndtr(-reach - difference)
        drawn = upper + np.log(np.maximum(-np.expm1(lower - upper), np.exp(_LEAST)))
    return chosen, drawn


def _maximum(loss: Callable[[FloatArray], float], start: FloatArray) -> FloatArray:
    """The minimum of a convex loss, by quasi-Newton steps and then Newton's own until they are tiny."""
    at = np.asarray(scipy.optimize.minimize(loss, start, method="BFGS").x)
    for _ in range(_POLISHED):
        step = np.linalg.solve(_curvature(loss, at), _gradient(loss, at))
        at = at - step
        if np.abs(step).max() < 1e-10:
            break
    return np.asarray(at)


def _gradient(loss: Callable[[FloatArray], float], at: FloatArray) -> FloatArray:
    steps = np.eye(at.size) * _STEP
    return np.array(
        [(8 * (loss(at + h) - loss(at - h)) - loss(at + 2 * h) + loss(at - 2 * h)) / (12 * _STEP) for h in steps]
    )


def _curvature(loss: Callable[[FloatArray], float], at: FloatArray) -> FloatArray:
    steps = np.eye(at.size) * _STEP
    rows = np.array([(_gradient(loss, at + h) - _gradient(loss, at - h)) / (2 * _STEP) for h in steps])
    return np.asarray((rows + rows.T) / 2)
