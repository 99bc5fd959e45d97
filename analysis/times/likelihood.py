"""Log-likelihood of the diffusion model over trials, with its gradient.

One drift a condition (its sign that of the shot), one boundary an instruction, and for all trials together a starting
point, a non-decision time and, if asked for, a share of lapses with times uniform over the range of the data:

    p = (1 - lapse) p_diffusion(t - t0, answer | +-v_condition, a_instruction, w) + lapse / 2 / (latest - earliest)

The share of lapses rests on that range: one taken wider than the truth hides lapses among the decisions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from analysis.stats.arrays import FloatArray, IndexArray
from analysis.times.first_passage import with_slopes
from analysis.times.own_trials import answers, own_times

LapseRange = tuple[float, float]
"""Earliest and latest time of a lapse in s."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trials:
    """Trials as the fit takes them, one axis each; conditions and instructions as places in their labels."""

    upper: NDArray[np.bool_]
    time_s: FloatArray
    sign: FloatArray  # 1 if the stimulus drives to the upper answer, -1 if to the lower
    condition: IndexArray
    instruction: IndexArray
    person: IndexArray
    conditions: tuple[str, ...]
    instructions: tuple[str, ...]


def trials_of(
    *,
    upper: ArrayLike,
    time_s: ArrayLike,
    sources: Sequence[str] | ArrayLike,
    towards_upper: ArrayLike,
    condition: Sequence[str] | ArrayLike,
    instruction: Sequence[str] | ArrayLike | None = None,
    person: Sequence[str] | ArrayLike | None = None,
) -> Trials:
    """Columns of a log as `Trials`: for a judgement of direction "upper" is the answer "forward".

    `ValueError`: a time that is not the participant's own or not above 0, columns of unequal length, no trials.
    """
    times = own_times(time_s, sources)
    n = times.size
    if n == 0:
        raise ValueError("there must be at least 1 trial")
    conditions, place = _places(condition, n, "condition")
    instructions, other = _places(np.zeros(n, dtype=np.str_) if instruction is None else instruction, n, "instruction")
    return Trials(
        upper=answers(upper, "upper", n) == 1.0,
        time_s=times,
        sign=2.0 * answers(towards_upper, "towards_upper", n) - 1.0,
        condition=place,
        instruction=other,
        person=_places(np.zeros(n, dtype=np.str_) if person is None else person, n, "person")[1],
        conditions=conditions,
        instructions=instructions,
    )


def _places(labels: Sequence[str] | ArrayLike, count: int, name: str) -> tuple[tuple[str, ...], IndexArray]:
    found = np.asarray(labels, dtype=np.str_)
    if found.shape != (count,):
        raise ValueError(f"{name} must be {count} labels, one a trial, not {found.shape}")
    levels, place = np.unique(found, return_inverse=True)
    return tuple(map(str, levels)), place.astype(np.intp)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DiffusionLikelihood:
    """The likelihood in unbounded coordinates: drifts; log boundaries; logit w; logit(t0 / cap); logit lapse.

    `cap_s` is the largest t0: the shortest time that only a decision can have (no density before t0), at most the
    median.
    """

    trials: Trials
    bias: bool
    lapses: bool
    cap_s: float
    lapse_density: FloatArray  # 1/s, of each trial's answer and time

    @property
    def drifts(self) -> int:
        """How many drifts there are; they stand first, the boundaries after them."""
        return len(self.trials.conditions)

    @property
    def boundaries(self) -> int:
        """How many boundaries there are."""
        return len(self.trials.instructions)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters, in the order of the coordinates."""
        drifts = (f"drift {label}".strip() for label in self.trials.conditions)
        boundaries = (f"boundary {label}".strip() for label in self.trials.instructions)
        extra = ("start",) * self.bias + ("non_decision_s",) + ("lapse",) * self.lapses
        return (*drifts, *boundaries, *extra)


def model_of(trials: Trials, *, bias: bool = True, lapses: bool | LapseRange = False) -> DiffusionLikelihood:
    """The model to fit; lapses over the range of the data if True. `ValueError`: their range is empty."""
    t = trials.time_s
    if lapses is False:
        density = np.zeros_like(t)
    else:
        earliest, latest = (float(t.min()), float(t.max())) if lapses is True else lapses
        if not earliest < latest:
            raise ValueError(f"lapses need a range of times, not {earliest:g} to {latest:g} s")
        density = np.where((t >= earliest) & (t <= latest), 0.5 / (latest - earliest), 0.0)
    decided = t[density == 0.0]
    cap_s = min(float(np.median(t)), float(decided.min())) if decided.size else float(np.median(t))
    return DiffusionLikelihood(trials=trials, bias=bias, lapses=lapses is not False, cap_s=cap_s, lapse_density=density)


_TOP = 1.0 - 1e-12  # t0 stays below its cap


def natural(model: DiffusionLikelihood, at: FloatArray) -> FloatArray:
    """The parameters in their own units, from coordinates."""
    values, first, second = np.array(at), model.drifts, model.drifts + model.boundaries
    values[first:second] = np.exp(at[first:second])
    values[second:] = scipy.special.expit(at[second:])
    values[second + model.bias] = model.cap_s * min(values[second + model.bias], _TOP)
    return values


def coordinates(model: DiffusionLikelihood, values: FloatArray) -> FloatArray:
    """The coordinates of parameters in their own units."""
    at, first, second = np.array(values, dtype=np.float64), model.drifts, model.drifts + model.boundaries
    at[first:second] = np.log(at[first:second])
    at[second + model.bias] /= model.cap_s
    at[second:] = scipy.special.logit(at[second:])
    return at


def log_likelihood(model: DiffusionLikelihood, at: FloatArray) -> tuple[float, FloatArray]:
    """The log-likelihood and its gradient by the coordinates."""
    value, scores = trial_scores(model, at)
    return float(value.sum()), scores.sum(axis=0)


def trial_scores(model: DiffusionLikelihood, at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Each trial's log-likelihood (trials,) and gradient by the coordinates (trials, parameters)."""
    trials, values = model.trials, natural(model, at)
    place = model.drifts + model.boundaries
    w = float(values[place]) if model.bias else 0.5
    t0 = float(values[place + model.bias])
    value, by_drift, by_boundary, by_start, by_time = _diffusion(trials, values, w, t0)
    rows = np.arange(trials.time_s.size)
    scores = np.zeros((rows.size, at.size))
    scores[rows, trials.condition] = by_drift
    scores[rows, model.drifts + trials.instruction] = by_boundary
    if model.bias:
        scores[:, place] = by_start * w * (1.0 - w)
    scores[:, place + model.bias] = -by_time * t0 * (1.0 - t0 / model.cap_s)
    return _with_lapses(model, value, scores, float(values[-1])) if model.lapses else (value, scores)


def _diffusion(trials: Trials, values: FloatArray, w: float, t0: float) -> tuple[FloatArray, ...]:
    """Log density of each trial and its derivatives by v, log a, w and t; -inf and 0 where t <= t0."""
    first = len(trials.conditions)
    t, a = trials.time_s - t0, values[first : first + len(trials.instructions)][trials.instruction]
    answer = np.where(trials.upper, -1.0, 1.0)
    near = np.where(trials.upper, 1.0 - w, w)
    V = answer * trials.sign * values[:first][trials.condition]
    late = t > 0.0
    t = np.where(late, t, a**2)
    f = with_slopes(t / a**2, near)
    value = f.value - 2.0 * np.log(a) - V * a * near - V * V * t / 2.0
    slopes = (
        answer * trials.sign * (-a * near - V * t),
        -2.0 * t / a**2 * f.by_time - 2.0 - V * a * near,
        answer * (f.by_start - V * a),
        f.by_time / a**2 - V * V / 2.0,
    )
    return np.where(late, value, -np.inf), *(np.where(late, slope, 0.0) for slope in slopes)


def _with_lapses(
    model: DiffusionLikelihood, value: FloatArray, scores: FloatArray, rate: float
) -> tuple[FloatArray, FloatArray]:
    """The mixture in logarithms, so that a time far from any decision's underflows to no 0 / 0."""
    with np.errstate(divide="ignore"):
        decided, lapsed = np.log1p(-rate) + value, np.log(rate * model.lapse_density)
    both = np.logaddexp(decided, lapsed)
    share = np.exp(decided - both)
    scores *= share[:, None]
    scores[:, -1] = 1.0 - share - rate
    return both, scores
