"""The likelihood of forward rates under the percept: its peak, and what the rates say of every number."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from device.methods import Method
from experiments.synthetic.diffusion import Floats, People
from experiments.synthetic.percept import Percept, PerceptParameters, evidence, forward_rates, percepts_of

FITTED = ("sensitivity", "confusion", "start")
ASSUMED = ("exponent", "leak_s", "boundary")
"""What the rates bear on as well; the boundary only through its product with the drift, the sensitivity."""
LOWEST, HIGHEST = np.array([-12.0, -9.0, -8.0]), np.array([6.0, 9.0, 8.0])
"""Ends of log sensitivity, log confusion and logit start: as good as 0 and infinite."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """Rates with their trials, what is felt of their methods, the people, and the numbers that are assumed."""

    methods: Mapping[str, Method]
    percepts: Mapping[str, Percept]
    rates: Mapping[str, float]
    trials: Mapping[str, int]
    people: People
    base: PerceptParameters

    def at(self, place: Floats) -> PerceptParameters:
        """The parameters of a place: log sensitivity, log confusion, logit start."""
        sensitivity, confusion = np.exp(place[:2])
        start = float(special.expit(place[2]))
        return replace(self.base, sensitivity=float(sensitivity), confusion=float(confusion), start=start)

    def predicted(self, parameters: PerceptParameters) -> Floats:
        """The mean forward rates."""
        return forward_rates(
            [evidence(self.percepts[name], parameters) for name in self.rates], parameters.start, self.people
        )

    def residuals(self, place: Floats) -> Floats:
        """Signed roots of the rates' binomial deviances, whose squares sum to the deviance."""
        p = np.clip(self.predicted(self.at(place)), 1e-15, 1.0 - 1e-15)
        r, n = np.array(list(self.rates.values())), np.array([self.trials[name] for name in self.rates])
        parts = 2.0 * n * (special.rel_entr(r, p) + special.rel_entr(1.0 - r, 1.0 - p))
        return np.asarray(np.sign(p - r) * np.sqrt(np.maximum(parts, 0.0)))


def task_of(
    rates: Mapping[str, float],
    methods: Mapping[str, Method],
    trials: Mapping[str, int] | int,
    people: People | None,
    base: PerceptParameters | None,
) -> Task:
    """The task of fitting these rates. `ValueError`: rates, methods or trials that cannot be used."""
    counts = dict.fromkeys(rates, trials) if isinstance(trials, int) else dict(trials)
    _check(rates, methods, counts)
    base = PerceptParameters() if base is None else base
    kept = {name: methods[name] for name in rates}
    return Task(
        methods=kept,
        percepts=percepts_of(kept, base.leak_s),
        rates=dict(rates),
        trials=counts,
        people=People() if people is None else people,
        base=base,
    )


def _check(rates: Mapping[str, float], methods: Mapping[str, Method], trials: Mapping[str, int]) -> None:
    if len(rates) < len(FITTED):
        raise ValueError(f"{len(rates)} rates; at least {len(FITTED)} are needed for {', '.join(FITTED)}")
    for name, rate in rates.items():
        if not 0.0 <= rate <= 1.0:
            raise ValueError(f"the rate of {name} is {rate}; it must be 0 to 1")
        if name not in methods:
            raise ValueError(f"there is a rate of {name}, but no such method; there are {', '.join(methods)}")
        if trials.get(name, 0) < 1:
            raise ValueError(f"the trials of {name} are {trials.get(name, 0)}; there must be at least 1")


_STARTS = np.array([[-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 3.0, 0.0]])


def lowest(task: Task, held: tuple[int, float] | None = None, near: Floats | None = None) -> tuple[Floats, float]:
    """The place of lowest deviance, one coordinate held if asked: least squares of the residuals.

    From several starts; `near` a place that is nearly it, from there and one other.
    """
    free = np.array([held is None or i != held[0] for i in range(len(FITTED))])
    starts = _STARTS if near is None else np.vstack([near, _STARTS[1:2]])
    return min((_descent(task, start, free, held) for start in starts), key=lambda found: found[1])


def _descent(
    task: Task, start: Floats, free: NDArray[np.bool_], held: tuple[int, float] | None
) -> tuple[Floats, float]:
    place = np.array(start)
    if held is not None:
        place[held[0]] = held[1]

    def residuals(part: Floats) -> Floats:
        place[free] = part
        return task.residuals(place)

    inside = np.clip(place[free], LOWEST[free] + 1e-6, HIGHEST[free] - 1e-6)
    found = optimize.least_squares(residuals, inside, bounds=(LOWEST[free], HIGHEST[free]), xtol=1e-12, ftol=1e-12)
    place[free] = found.x
    return place, 2.0 * float(found.cost)


def _slopes(task: Task, parameters: PerceptParameters) -> Floats:
    """Derivatives of the predicted rates by the logarithm of every parameter, (rates, parameters)."""
    columns = [slope(partial(_scaled, task, parameters, name)) for name in (*FITTED, *ASSUMED)]
    return np.column_stack(columns)


def slope(rates: Callable[[float], Floats], step: float = 1e-4) -> Floats:
    """The derivative by the logarithm of a factor."""
    return (rates(math.exp(step)) - rates(math.exp(-step))) / (2.0 * step)


def _scaled(task: Task, parameters: PerceptParameters, name: str, factor: float) -> Floats:
    """The predicted rates with one parameter times `factor`."""
    if name == "boundary":  # drift = evidence / boundary: the product, and with it every rate, stays
        return task.predicted(parameters)
    changed = replace(parameters, **{name: getattr(parameters, name) * factor})
    if name == "leak_s":
        task = replace(task, percepts=percepts_of(task.methods, changed.leak_s))
    return task.predicted(changed)


def information(task: Task, parameters: PerceptParameters) -> Floats:
    """Fisher information of the logarithms: sum over methods of n p' p'^T / (p (1 - p))."""
    p = np.clip(task.predicted(parameters), 1e-12, 1.0 - 1e-12)
    weights = np.array([task.trials[name] for name in task.rates]) / (p * (1.0 - p))
    slopes = _slopes(task, parameters)
    return np.asarray(slopes.T @ (weights[:, None] * slopes))
