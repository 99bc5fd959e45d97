"""Each person's accuracy and times under each method and instruction, and what an instruction changes in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from analysis.stats.arrays import FloatArray
from analysis.times.by_person import ordered, quantiles
from analysis.times.own_trials import OwnTrials
from analysis.times.people import MeanEstimate, mean_estimate

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
class InstructionEffect:
    """What instruction `a` gives more than `b`, paired by person; `method` None for the mean over all methods."""

    a: str
    b: str
    method: str | None
    accuracy: MeanEstimate
    mean_s: MeanEstimate


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


def over_people(name: str, values: FloatArray) -> MeanEstimate:
    """The mean over the people who have a value."""
    return mean_estimate(name, values[np.isfinite(values)])


def instruction_effects(
    cells: PersonCells, methods: Sequence[str], instructions: Sequence[str]
) -> Iterator[InstructionEffect]:
    """Every pair of instructions, over all methods and for each; people who had both, under all methods alike.

    The mean over methods weighs them alike, whatever the number of trials. Student's t on people - 1 degrees of
    freedom; nothing is corrected for the number of pairs.
    """
    for a, b in combinations(range(len(instructions)), 2):
        rate, mean_s = (v[:, :, a] - v[:, :, b] for v in (cells.rate, cells.mean_s))
        columns: list[_Columns] = [(None, rate.mean(axis=1), mean_s.mean(axis=1))] if len(methods) > 1 else []
        columns += [(method, rate[:, i], mean_s[:, i]) for i, method in enumerate(methods)]
        for method, by_rate, by_time in columns:
            yield InstructionEffect(
                a=instructions[a],
                b=instructions[b],
                method=method,
                accuracy=over_people("accuracy", by_rate),
                mean_s=over_people("mean_s", by_time),
            )
