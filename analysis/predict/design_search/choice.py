"""Which designs are worth it: allowed for ever, felt best above a bound of the rate, and the front of both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from analysis.predict.design_search.rates import predict, rates
from analysis.predict.design_search.shots import Layer
from analysis.predict.design_search.space import Space
from analysis.predict.fit.percept_model import PerceptFit
from analysis.stats.arrays import FloatArray
from device.limits import TRAIN_LIMITS, broken_limit
from device.physics.equations import HOME
from device.physics.shot import rates_of_periods_Hz


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Designs:
    """All designs, arrays of one length; predictions and rate are NaN where the magnet does not come home.

    `limit` is the place in `TRAIN_LIMITS` of what a steady train at the bound would break, -1 for nothing.
    """

    friction_N: FloatArray
    voltage_V: FloatArray
    pulse_s: FloatArray
    status: NDArray[np.int8]
    shooting_rate_Hz: FloatArray
    evidence: FloatArray
    predicted: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    by_summary: FloatArray  # the prediction from the summary alone, to be compared with
    limit: NDArray[np.int8]

    def __len__(self) -> int:
        return len(self.status)

    @property
    def proposable(self) -> NDArray[np.bool_]:
        """The magnet comes home, and the device allows a steady train at the bound."""
        return np.asarray((self.status == HOME) & (self.limit < 0))


def designs_of(space: Space, by_pulse: Mapping[float, Layer], fit: PerceptFit, rate_Hz: float) -> Designs:
    """Every combination of the three axes, in the order pulse, friction, voltage."""
    chosen = [by_pulse[pulse_s] for pulse_s in space.pulse_s]
    leak_s = fit.parameters.leak_s
    felt = np.concatenate([layer.felt[leak_s].reshape(-1, 3) for layer in chosen])
    pulse, friction, voltage = (
        np.ravel(part) for part in np.meshgrid(space.pulse_s, space.friction_N, space.voltage_V, indexing="ij")
    )
    found = predict(felt, fit)
    return Designs(
        friction_N=friction,
        voltage_V=voltage,
        pulse_s=pulse,
        status=np.concatenate([layer.status.ravel() for layer in chosen]),
        shooting_rate_Hz=rates_of_periods_Hz(np.concatenate([layer.period_s.ravel() for layer in chosen])),
        evidence=found.evidence,
        predicted=found.rate,
        ci_low=found.ci_low,
        ci_high=found.ci_high,
        by_summary=rates(np.concatenate([layer.by_summary.reshape(-1, 3) for layer in chosen]), fit.parameters),
        limit=_limits(space, rate_Hz),
    )


def joined_designs(one: Designs, other: Designs) -> Designs:
    """The designs of both, one after the other."""
    names = [field.name for field in fields(Designs)]
    return Designs(**{name: np.concatenate([getattr(one, name), getattr(other, name)]) for name in names})


def best_design(designs: Designs, rate_Hz: float) -> int | None:
    """The design felt best that shoots at `rate_Hz` or faster; of equals the one that heats the coil least."""
    allowed = np.flatnonzero(designs.proposable & (designs.shooting_rate_Hz >= rate_Hz))
    if not allowed.size:
        return None
    heat = designs.voltage_V[allowed] ** 2 * designs.pulse_s[allowed]
    order = np.lexsort((heat, -np.round(designs.evidence[allowed], 3)))
    return int(allowed[order[0]])


def front(designs: Designs) -> list[int]:
    """The designs that no other one beats in both rate and evidence, from the fastest on."""
    some = np.flatnonzero(designs.proposable)
    order = some[np.lexsort((-designs.evidence[some], -designs.shooting_rate_Hz[some]))]
    kept: list[int] = []
    for place in order.tolist():
        if not kept or designs.evidence[place] > designs.evidence[kept[-1]]:
            kept.append(place)
    return kept


def _limits(space: Space, rate_Hz: float) -> NDArray[np.int8]:
    """For each design the number of the limit that it breaks; the friction has no part in that."""
    numbers = {None: -1} | {words: number for number, words in enumerate(TRAIN_LIMITS)}
    grid = [
        [numbers[broken_limit(voltage_V, pulse_s, space.gun.resistance_ohm, rate_Hz)] for voltage_V in space.voltage_V]
        for pulse_s in space.pulse_s
    ]
    return np.repeat(np.array(grid, dtype=np.int8)[:, None, :], len(space.friction_N), axis=1).ravel()


def summary_error(designs: Designs) -> Sequence[float]:
    """Differences in the predicted rate between the summary's percept and the full course's: median, 95 %, largest."""
    some = np.isfinite(designs.predicted)
    apart = np.abs(designs.by_summary[some] - designs.predicted[some])
    return [float(x) for x in np.quantile(apart, [0.5, 0.95, 1.0])] if apart.size else []
