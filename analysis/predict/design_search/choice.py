"""Which designs are worth it: allowed for ever, felt best above a bound of the rate, and the front of both."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from analysis.predict.design_search.rates import Floats, predict, rates
from analysis.predict.design_search.shots import HOME, Layer
from analysis.predict.design_search.space import Space
from analysis.predict.fit.percept_model import PerceptFit
from device.limits import AMBIENT_C, HEAT_CAPACITY_J_K, MAX_COIL_C, MAX_DUTY, THERMAL_RESISTANCE_K_W, Load, load_of
from device.physics.trains import TICKS
from device.words import MAX_PULSE_S, MAX_VOLTAGE_V, Pulse

_TICKS = 1_000_000  # a second, as the limits count it


VOLTAGE = f"voltage above {MAX_VOLTAGE_V:g} V"
PULSE = f"pulse above {1e3 * MAX_PULSE_S:g} ms"
DUTY = f"driven for more than {100 * MAX_DUTY:g} % of a second"
HEAT = f"coil above {MAX_COIL_C:g} °C in the end"
LIMITS = (VOLTAGE, PULSE, DUTY, HEAT)


def broken_limit(voltage_V: float, pulse_s: float, resistance_ohm: float, rate_Hz: float) -> str | None:
    """The first of `LIMITS` that a steady train of such pulses would break; None if it may go on for ever."""
    if voltage_V > MAX_VOLTAGE_V:
        return VOLTAGE
    if pulse_s > MAX_PULSE_S:
        return PULSE
    load = load_of(Pulse(voltage_V=voltage_V, pulse_s=pulse_s), resistance_ohm)
    if fullest_second_s(load, rate_Hz) > MAX_DUTY + 1e-9:
        return DUTY
    return HEAT if steady_coil_C(load, rate_Hz) > MAX_COIL_C else None


def fullest_second_s(load: Load, rate_Hz: float) -> float:
    """The time driven in the fullest second of a steady train: one that begins with a pulse."""
    on, period = math.ceil(load.on_s * _TICKS - 1e-6), round(_TICKS / rate_Hz)
    whole, rest = divmod(_TICKS, period)
    return (whole * on + min(on, rest)) / _TICKS


def steady_coil_C(load: Load, rate_Hz: float) -> float:  # noqa: N802 - the unit ends the name
    """The coil's temperature just after a shot of an endless train: T_room + (Q/C) / (1 - exp(-1/(f R C)))."""
    fall = -math.expm1(-1.0 / (rate_Hz * THERMAL_RESISTANCE_K_W * HEAT_CAPACITY_J_K))
    return AMBIENT_C + load.heat_J / HEAT_CAPACITY_J_K / fall


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Designs:
    """All designs, arrays of one length; predictions and rate are NaN where the magnet does not come home.

    `limit` is the place in `LIMITS` of what a steady train at the bound would break, -1 for nothing.
    """

    friction_N: Floats
    voltage_V: Floats
    pulse_s: Floats
    status: NDArray[np.int8]
    shooting_rate_Hz: Floats
    evidence: Floats
    predicted: Floats
    ci_low: Floats
    ci_high: Floats
    by_summary: Floats  # the prediction from the summary alone, to be compared with
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
        shooting_rate_Hz=shooting_rates(np.concatenate([layer.period_s.ravel() for layer in chosen])),
        evidence=found.evidence,
        predicted=found.rate,
        ci_low=found.ci_low,
        ci_high=found.ci_high,
        by_summary=rates(np.concatenate([layer.by_summary.reshape(-1, 3) for layer in chosen]), fit.parameters),
        limit=_limits(space, rate_Hz),
    )


def joined(one: Designs, other: Designs) -> Designs:
    """The designs of both, one after the other."""
    names = [field.name for field in fields(Designs)]
    return Designs(**{name: np.concatenate([getattr(one, name), getattr(other, name)]) for name in names})


def shooting_rates(period_s: Floats) -> Floats:
    """The highest rate at which every shot starts from home, as `device.physics.trains.highest_rate_Hz`."""
    return np.asarray(TICKS / np.ceil(period_s * TICKS))


def best(designs: Designs, rate_Hz: float) -> int | None:
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
    numbers = {None: -1} | {words: number for number, words in enumerate(LIMITS)}
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
