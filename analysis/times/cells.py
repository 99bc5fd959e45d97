"""Rates and times of each person and cell, and their means over people."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import scipy

from analysis.stats.arrays import FloatArray, IndexArray
from analysis.times.own_trials import OwnTrials, ordered, quantiles

_Columns = tuple[str | None, FloatArray, FloatArray]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PersonCells:
    """Arrays (people, methods, instructions); NaN where a person has no such trial, or no correct one."""

    trials: FloatArray
    rate: FloatArray
    mean_s: FloatArray
    median_s: FloatArray
    mean_correct_s: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Mean:
    """A mean over people with its 95 % interval, and the SD of their values; `None` for what so few leave undefined."""

    mean: float | None
    sd: float | None
    ci_low: float | None
    ci_high: float | None
    people: int


@dataclass(frozen=True, slots=True, kw_only=True)
class InstructionEffect:
    """What instruction `a` gives more than `b`, paired by person; `method` None for the mean over all methods."""

    a: str
    b: str
    method: str | None
    accuracy: Mean
    mean_s: Mean


def person_cells(own: OwnTrials) -> PersonCells:
    """Means over the trials of each cell."""
    shape = len(own.people), len(own.methods), len(own.instructions)
    cell, size = np.ravel_multi_index((own.person, own.method, own.instruction), shape), int(np.prod(shape))

    def summed(weights: FloatArray) -> FloatArray:
        return np.bincount(cell, weights=weights, minlength=size).astype(np.float64)

    trials, correct = summed(np.ones_like(own.time_s)), summed(own.correct)
    median_s = np.full(size, np.nan)
    median_s[trials > 0] = quantiles(own.time_s, ordered(cell, own.time_s), [0.5])[:, 0]
    return PersonCells(
        trials=trials.reshape(shape),
        rate=_shares(correct, trials).reshape(shape),
        mean_s=_shares(summed(own.time_s), trials).reshape(shape),
        median_s=median_s.reshape(shape),
        mean_correct_s=_shares(summed(own.time_s * own.correct), correct).reshape(shape),
    )


def _shares(sums: FloatArray, counts: FloatArray) -> FloatArray:
    return np.divide(sums, counts, out=np.full_like(sums, np.nan), where=counts > 0.0)


def mean_over_people(own: FloatArray, alpha: float = 0.05) -> tuple[float, float, float, float]:
    """The mean, its SD and SE, and half its interval (Student's t); NaN for the spread of fewer than two."""
    n = own.size
    mean = float(own.mean()) if n else math.nan
    sd = float(own.std(ddof=1)) if n > 1 else math.nan
    se = sd / math.sqrt(n) if n > 1 else math.nan
    half = -float(scipy.special.stdtrit(n - 1, alpha / 2.0)) * se if n > 1 else math.nan
    return mean, sd, se, half


def over_people(values: FloatArray) -> Mean:
    """The mean over the people who have a value, those whose is not NaN."""
    own = values[np.isfinite(values)]
    mean, sd, _, half = mean_over_people(own)
    low, high = defined(mean - half), defined(mean + half)
    return Mean(mean=defined(mean), sd=defined(sd), ci_low=low, ci_high=high, people=own.size)


def rate_over_people(rates: FloatArray) -> Mean:
    """The mean of rates over the people who have one; its interval is cut at 0 and 1, beyond which no mean lies.

    >>> rate_over_people(np.array([1.0, 0.9, 1.0])).ci_high
    1.0
    """
    found = over_people(rates)
    low, high = (None if end is None else min(max(end, 0.0), 1.0) for end in (found.ci_low, found.ci_high))
    return replace(found, ci_low=low, ci_high=high)


def defined(value: float) -> float | None:
    """`None` for what is undefined: the counts beside it say why."""
    return float(value) if math.isfinite(value) else None


def over_methods(values: FloatArray, groups: Sequence[IndexArray]) -> FloatArray:
    """Each person's mean over the methods of their group, NaN for who lacks one of these; values (people, methods).

    `groups`: the places of methods that the same people meet.
    """
    means = np.stack([values[:, group].mean(axis=1) for group in groups])
    own = np.isfinite(means)
    return np.where(own.any(axis=0), means[own.argmax(axis=0), np.arange(len(values))], np.nan)


def instruction_effects(
    cells: PersonCells, methods: Sequence[str], instructions: Sequence[str], groups: Sequence[IndexArray]
) -> Iterator[InstructionEffect]:
    """Every pair of instructions, over all methods and for each; people who had both, under all methods of their group.

    The mean over methods weighs them alike, whatever the number of trials. Student's t on people - 1 degrees of
    freedom; nothing is corrected for the number of pairs.
    """
    for a, b in combinations(range(len(instructions)), 2):
        rate, mean_s = (v[:, :, a] - v[:, :, b] for v in (cells.rate, cells.mean_s))
        together = over_methods(rate, groups), over_methods(mean_s, groups)
        columns: list[_Columns] = [(None, *together)] if len(methods) > 1 else []
        columns += [(method, rate[:, i], mean_s[:, i]) for i, method in enumerate(methods)]
        for method, by_rate, by_time in columns:
            yield InstructionEffect(
                a=instructions[a],
                b=instructions[b],
                method=method,
                accuracy=over_people(by_rate),
                mean_s=over_people(by_time),
            )
