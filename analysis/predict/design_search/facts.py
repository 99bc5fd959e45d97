"""The findings of a design search as plain values, and what they rest on in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from analysis.predict.design_search.choice import LIMITS, Designs, broken_limit, shooting_rates, steady_coil_C
from analysis.predict.design_search.critical import DRAWS, INSIDE, LEVEL, Alternative, Contour, unbiased, under
from analysis.predict.design_search.rates import Floats, predict
from analysis.predict.design_search.shots import Layer
from analysis.predict.design_search.space import Space
from analysis.predict.fit.percept_model import PAPER_TRIALS, PerceptFit, predicted_rate
from device.limits import MAX_COIL_C, MAX_DUTY, MAX_SHOTS_PER_MINUTE, load_of
from device.parameters import GunParameters
from device.physics import simulate
from device.physics.kernel import STATUSES
from device.physics.trains import highest_rate_Hz
from device.words import MAX_PULSE_S, MAX_VOLTAGE_V, Pulse
from experiments.synthetic.percept import percept_of

Facts = dict[str, Any]

RATE = "predicted share of right answers to a forward shot"


def counted(designs: Designs, rate_Hz: float) -> Facts:
    """How many designs there are of each kind."""
    numbers = {status: int((designs.status == n).sum()) for n, status in enumerate(STATUSES)}
    return {
        "total": len(designs),
        "by_status": {status: count for status, count in numbers.items() if count},
        "beyond_limits": {
            words: int((designs.limit == n).sum()) for n, words in enumerate(LIMITS) if (designs.limit == n).any()
        },
        "proposable": int(designs.proposable.sum()),
        "fast_enough": int((designs.proposable & (designs.shooting_rate_Hz >= rate_Hz)).sum()),
    }


def design_facts(designs: Designs, place: int, gun: GunParameters, rate_Hz: float) -> Facts:
    """One design of the sweep."""
    voltage_V, pulse_s = float(designs.voltage_V[place]), float(designs.pulse_s[place])
    return {
        "friction_N": float(designs.friction_N[place]),
        "voltage_V": voltage_V,
        "pulse_s": pulse_s,
        "status": STATUSES[int(designs.status[place])],
        "shooting_rate_Hz": float(designs.shooting_rate_Hz[place]),
        "predicted": float(designs.predicted[place]),
        "ci_low": float(designs.ci_low[place]),
        "ci_high": float(designs.ci_high[place]),
        "evidence": float(designs.evidence[place]),
        "limit": None if designs.limit[place] < 0 else LIMITS[int(designs.limit[place])],
        "coil_C_at_bound": steady_coil_C(
            load_of(Pulse(voltage_V=voltage_V, pulse_s=pulse_s), gun.resistance_ohm), rate_Hz
        ),
    }


def best_facts(
    space: Space,
    designs: Designs,
    place: int,
    rate_Hz: float,
    others: Sequence[Alternative],
) -> Facts:
    """The best design; what is predicted of it under other assumptions, and at which ends of the sweep it lies.

    An end that is the device's own limit is none: nothing beyond it may be proposed.
    """
    facts = design_facts(designs, place, space.gun, rate_Hz)
    axes = {"friction_N": space.friction_N, "voltage_V": space.voltage_V, "pulse_s": space.pulse_s}
    gun = replace(space.gun, **{key: facts[key] for key in axes})
    limits = (MAX_VOLTAGE_V, MAX_PULSE_S)
    ends = [key for key, axis in axes.items() if len(axis) > 1 and facts[key] in {axis[0], axis[-1]}.difference(limits)]
    return facts | {"under_other_assumptions": under(gun, others), "at_an_end_of": ends}


def own_facts(space: Space, label: str, fit: PerceptFit, rate_Hz: float) -> Facts:
    """A method of the gun, predicted as the fit predicts; without a prediction if its magnet does not come home.

    `swept` says that it differs from the swept gun in friction, voltage and pulse alone.
    """
    gun = space.own[label]
    status = simulate(gun).status
    moved = replace(space.gun, friction_N=gun.friction_N, voltage_V=gun.voltage_V, pulse_s=gun.pulse_s)
    facts: Facts = {
        "name": label,
        "swept": moved == gun,
        "friction_N": gun.friction_N,
        "voltage_V": gun.voltage_V,
        "pulse_s": gun.pulse_s,
        "status": status,
        "shooting_rate_Hz": highest_rate_Hz(gun),
        "limit": broken_limit(gun.voltage_V, gun.pulse_s, gun.resistance_ohm, rate_Hz),
    }
    if status != "home":
        return facts | {"predicted": None, "ci_low": None, "ci_high": None}
    found = predicted_rate(fit, percept_of(gun, fit.parameters.leak_s))
    return facts | {"predicted": found.value, "ci_low": found.ci_low, "ci_high": found.ci_high}


def plane_facts(space: Space, layer: Layer, fit: PerceptFit, rate_Hz: float) -> Facts:
    """The designs of one pulse, rows (frictions) of voltages."""
    found = predict(layer.felt[fit.parameters.leak_s], fit)
    limits = [broken_limit(v, layer.pulse_s, space.gun.resistance_ohm, rate_Hz) for v in space.voltage_V]
    return {
        "pulse_s": layer.pulse_s,
        "status": [[STATUSES[n] for n in row] for row in layer.status.tolist()],
        "predicted": found.rate,
        "ci_low": found.ci_low,
        "ci_high": found.ci_high,
        "shooting_rate_Hz": shooting_rates(layer.period_s),
        "limit_of_voltage": limits,
    }


def critical_facts(
    space: Space, layer: Layer, fit: PerceptFit, contour: Contour, others: Sequence[Alternative]
) -> Facts:
    """The contour with band and alternatives; a voltage that is None is told by its `reached`."""
    band = contour.band
    return {
        "level": LEVEL,
        "pulse_s": layer.pulse_s,
        "friction_N": space.friction_N,
        "voltage_V": contour.voltage_V,
        "reached": [reached(v) for v in contour.voltage_V.tolist()],
        "lasting": contour.lasting,
        "interpolation_error_V": _apart(contour.voltage_V, contour.interpolated_V),
        "band": {
            "inside": INSIDE,
            "draws": DRAWS,
            "low_V": band.low_V,
            "high_V": band.high_V,
            "reached_low": [reached(v) for v in band.low_V.tolist()],
            "reached_high": [reached(v) for v in band.high_V.tolist()],
            "each_friction_low_V": band.alone_low_V,
            "each_friction_high_V": band.alone_high_V,
        },
        "alternatives": [
            {
                "name": other.name,
                "parameters": asdict(other.parameters),
                "deviance": other.deviance,
                "voltage_V": other.voltage_V,
                "reached": [reached(v) for v in other.voltage_V.tolist()],
            }
            for other in others
        ],
        "both_directions_V": unbiased(layer, space.voltage_V, fit),
        "status": [[STATUSES[n] for n in row] for row in layer.status.tolist()],
        "predicted": predict(layer.felt[fit.parameters.leak_s], fit).rate,
    }


def reached(voltage_V: float) -> str:
    """What stands behind a voltage of a contour."""
    if np.isnan(voltage_V):
        return "no voltage brings the magnet home"
    if np.isinf(voltage_V):
        return "not within the range" if voltage_V > 0 else "from the lowest voltage on"
    return "at this voltage"


def _apart(one: Floats, other: Floats) -> float | None:
    """The largest difference where both are finite."""
    known = np.isfinite(one) & np.isfinite(other)
    return float(np.abs(one[known] - other[known]).max()) if known.any() else None


def fit_facts(fit: PerceptFit, summary_error: Sequence[float]) -> Facts:
    """The percept behind the predictions, and what the shorter route to it would have cost."""
    error = dict(zip(("median", "of_95_percent", "largest"), summary_error, strict=False))
    return {
        "parameters": asdict(fit.parameters),
        "fitted": {name: asdict(one) for name, one in fit.fitted.items()},
        "rates": fit.rates,
        "deviance": fit.deviance,
        "covariance_of_logarithms": fit.covariance,
        "route": "full course of the force",
        "summary_differs_in_predicted_rate": error,
        "unknown": fit.unknown,
    }


def assumptions(space: Space, rate_Hz: float) -> list[str]:
    """What the predictions rest on."""
    gun = space.gun
    return [
        "Every share is a prediction of a model; no design but the paper's own was ever felt by anyone.",
        f"The percept is fitted to three rates of {PAPER_TRIALS} answers each (55.7, 79.3 and 92.9 %): three numbers "
        "for three rates, so that meeting them is no evidence for it. What lies beyond 92.9 % is extrapolated.",
        "Its exponent (1.7) is from a book and its leak (20 ms) is assumed; the intervals hold both fixed.",
        f"The gun: coil after the pulse {gun.drive_off}, back-EMF as {gun.emf}; {_braking(gun)}. The hand is rigid, as "
        "in equation (1).",
        "Right is right about a forward shot, as the paper counts; the fitted bias towards forward helps there.",
        "A shot whose magnet does not break away, sticks or does not come home has no prediction and is never "
        "counted as guessing.",
        "The shooting rate is the highest at which every shot starts from home. The device's limits "
        f"({MAX_VOLTAGE_V:g} V, {1e3 * MAX_PULSE_S:g} ms, {100 * MAX_DUTY:g} % of any second, "
        f"{MAX_SHOTS_PER_MINUTE} shots a minute, "
        f"{MAX_COIL_C:g} °C) are those of an endless train at {rate_Hz:g} Hz; faster trains are for bursts alone.",
    ]


def _braking(gun: GunParameters) -> str:
    if gun.return_friction_N is None:
        return "the damper brakes both ways alike"
    return f"the swept friction is that of the way out, on the way back it is {gun.return_friction_N:g} N"
