"""What a design search comes to: designs and methods with their predictions, a map, the critical conditions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from analysis.predict.design_search.choice import (
    THRESHOLD_SHARE,
    Alternative,
    Band,
    Contour,
    Designs,
    predict,
    reached,
    unbiased,
    under,
)
from analysis.predict.design_search.space import Layer, Space
from analysis.predict.fit.percept_model import PAPER_TRIALS, Fitted, PerceptFit, predicted_rate
from analysis.stats.arrays import FloatArray
from device.limits import MAX_COIL_C, MAX_DUTY, MAX_SHOTS_PER_MINUTE, TRAIN_LIMITS, broken_limit, load_of, steady_coil_C
from device.parameters import GunParameters
from device.physics import simulate
from device.physics.equations import STATUSES
from device.physics.shot import highest_rate_Hz, rates_of_periods_Hz
from device.words import MAX_PULSE_S, MAX_VOLTAGE_V, Pulse
from experiments.synthetic.percept import PerceptParameters, percept_of


@dataclass(frozen=True, slots=True, kw_only=True)
class SweptAxes:
    """The swept values."""

    friction_N: tuple[float, ...]
    voltage_V: tuple[float, ...]
    pulse_s: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignCounts:
    """How many designs there are of each kind."""

    total: int
    by_status: dict[str, int]
    beyond_limits: dict[str, int]
    proposable: int
    fast_enough: int


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivePrediction:
    """A gun's drive, how fast it may shoot, and its predicted share of right answers to a forward shot, if any."""

    friction_N: float
    voltage_V: float
    pulse_s: float
    status: str
    shooting_rate_Hz: float
    predicted: float | None
    ci_low: float | None
    ci_high: float | None
    limit: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class SweptDesign(DrivePrediction):
    """One design of the sweep."""

    evidence: float
    coil_C_at_bound: float


@dataclass(frozen=True, slots=True, kw_only=True)
class BestDesign(SweptDesign):
    """The best one; what is predicted of it under other assumptions, and at which ends of the sweep it lies."""

    under_other_assumptions: dict[str, float]
    at_an_end_of: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnMethod(DrivePrediction):
    """A method of the gun; `swept`: it differs from the swept gun in friction, voltage and pulse alone."""

    name: str
    swept: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plane:
    """The designs of one pulse, rows (frictions) of voltages."""

    pulse_s: float
    status: tuple[tuple[str, ...], ...]
    predicted: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    shooting_rate_Hz: FloatArray
    limit_of_voltage: tuple[str | None, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Critical:
    """The voltages over the frictions from which so many are right; one that is not finite is told by its `reached`."""

    level: float
    pulse_s: float
    friction_N: tuple[float, ...]
    voltage_V: FloatArray
    reached: tuple[str, ...]
    lasting: tuple[bool, ...]
    interpolation_error_V: float | None
    band: Band
    alternatives: tuple[Alternative, ...]
    both_directions_V: FloatArray
    status: tuple[tuple[str, ...], ...]
    predicted: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class PerceptBehind:
    """The percept behind the predictions, and what the shorter route to it would have cost."""

    parameters: PerceptParameters
    fitted: dict[str, Fitted]
    rates: dict[str, float]
    deviance: float
    covariance_of_logarithms: tuple[tuple[float, ...], ...]
    route: str
    summary_differs_in_predicted_rate: dict[str, float]
    unknown: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignSearch:
    """The content of `design.json`."""

    title: str
    gun: str
    parameters: GunParameters
    seed: int
    rate_above_Hz: float
    axes: SweptAxes
    designs: DesignCounts
    best: BestDesign | None
    own: tuple[OwnMethod, ...]
    front: tuple[SweptDesign, ...]
    map: Plane
    critical: Critical
    percept: PerceptBehind
    assumptions: tuple[str, ...]
    provenance: dict[str, str]


def counted(designs: Designs, rate_Hz: float) -> DesignCounts:
    """How many designs there are of each kind."""
    numbers = {status: int((designs.status == n).sum()) for n, status in enumerate(STATUSES)}
    return DesignCounts(
        total=len(designs),
        by_status={status: count for status, count in numbers.items() if count},
        beyond_limits={
            words: int((designs.limit == n).sum()) for n, words in enumerate(TRAIN_LIMITS) if (designs.limit == n).any()
        },
        proposable=int(designs.proposable.sum()),
        fast_enough=int((designs.proposable & (designs.shooting_rate_Hz >= rate_Hz)).sum()),
    )


def design_of(designs: Designs, place: int, gun: GunParameters, rate_Hz: float) -> SweptDesign:
    """One design of the sweep."""
    voltage_V, pulse_s = float(designs.voltage_V[place]), float(designs.pulse_s[place])
    load = load_of(Pulse(voltage_V=voltage_V, pulse_s=pulse_s), gun.resistance_ohm)
    return SweptDesign(
        friction_N=float(designs.friction_N[place]),
        voltage_V=voltage_V,
        pulse_s=pulse_s,
        status=STATUSES[int(designs.status[place])],
        shooting_rate_Hz=float(designs.shooting_rate_Hz[place]),
        predicted=_known(designs.predicted[place]),
        ci_low=_known(designs.ci_low[place]),
        ci_high=_known(designs.ci_high[place]),
        evidence=float(designs.evidence[place]),
        limit=None if designs.limit[place] < 0 else TRAIN_LIMITS[int(designs.limit[place])],
        coil_C_at_bound=steady_coil_C(load, rate_Hz),
    )


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def best_of(space: Space, designs: Designs, place: int, rate_Hz: float, others: Sequence[Alternative]) -> BestDesign:
    """The best design. An end of the sweep that is the device's own limit is none: nothing beyond may be proposed."""
    one = design_of(designs, place, space.gun, rate_Hz)
    axes = {"friction_N": space.friction_N, "voltage_V": space.voltage_V, "pulse_s": space.pulse_s}
    here = {key: getattr(one, key) for key in axes}
    limits = (MAX_VOLTAGE_V, MAX_PULSE_S)
    ends = [key for key, axis in axes.items() if len(axis) > 1 and here[key] in {axis[0], axis[-1]}.difference(limits)]
    return BestDesign(
        **{field.name: getattr(one, field.name) for field in fields(one)},
        under_other_assumptions=under(replace(space.gun, **here), others),
        at_an_end_of=tuple(ends),
    )


def own_of(space: Space, label: str, fit: PerceptFit, rate_Hz: float) -> OwnMethod:
    """A method of the gun, predicted as the fit predicts; without a prediction if its magnet does not come home."""
    gun = space.own[label]
    status = simulate(gun).status
    moved = replace(space.gun, friction_N=gun.friction_N, voltage_V=gun.voltage_V, pulse_s=gun.pulse_s)
    found = predicted_rate(fit, percept_of(gun, fit.parameters.leak_s)) if status == "home" else None
    return OwnMethod(
        name=label,
        swept=moved == gun,
        friction_N=gun.friction_N,
        voltage_V=gun.voltage_V,
        pulse_s=gun.pulse_s,
        status=status,
        shooting_rate_Hz=highest_rate_Hz(gun),
        limit=broken_limit(gun.voltage_V, gun.pulse_s, gun.resistance_ohm, rate_Hz),
        predicted=None if found is None else _known(found.value),
        ci_low=None if found is None else _known(found.ci_low),
        ci_high=None if found is None else _known(found.ci_high),
    )


def plane_of(space: Space, layer: Layer, fit: PerceptFit, rate_Hz: float) -> Plane:
    """The designs of one pulse."""
    found = predict(layer.felt[fit.parameters.leak_s], fit)
    return Plane(
        pulse_s=layer.pulse_s,
        status=_status_words(layer),
        predicted=found.rate,
        ci_low=found.ci_low,
        ci_high=found.ci_high,
        shooting_rate_Hz=rates_of_periods_Hz(layer.period_s),
        limit_of_voltage=tuple(
            broken_limit(v, layer.pulse_s, space.gun.resistance_ohm, rate_Hz) for v in space.voltage_V
        ),
    )


def _status_words(layer: Layer) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(STATUSES[n] for n in row) for row in layer.status.tolist())


def critical_of(
    space: Space, layer: Layer, fit: PerceptFit, contour: Contour, others: Sequence[Alternative]
) -> Critical:
    """The contour with band and alternatives."""
    return Critical(
        level=THRESHOLD_SHARE,
        pulse_s=layer.pulse_s,
        friction_N=space.friction_N,
        voltage_V=contour.voltage_V,
        reached=reached(contour.voltage_V),
        lasting=contour.lasting,
        interpolation_error_V=_apart(contour.voltage_V, contour.interpolated_V),
        band=contour.band,
        alternatives=tuple(others),
        both_directions_V=unbiased(layer, space.voltage_V, fit),
        status=_status_words(layer),
        predicted=predict(layer.felt[fit.parameters.leak_s], fit).rate,
    )


def _apart(one: FloatArray, other: FloatArray) -> float | None:
    """The largest difference where both are finite."""
    known = np.isfinite(one) & np.isfinite(other)
    return float(np.abs(one[known] - other[known]).max()) if known.any() else None


def percept_behind(fit: PerceptFit, summary_error: Sequence[float]) -> PerceptBehind:
    """The fit, and in how far the shot's summary alone would have predicted otherwise; nothing where none is felt."""
    return PerceptBehind(
        parameters=fit.parameters,
        fitted=fit.fitted,
        rates=fit.rates,
        deviance=fit.deviance,
        covariance_of_logarithms=fit.covariance,
        route="full course of the force",
        summary_differs_in_predicted_rate=dict(
            zip(("median", "of_95_percent", "largest"), summary_error, strict=False)
        ),
        unknown=fit.unknown,
    )


def search_assumptions(space: Space, rate_Hz: float) -> tuple[str, ...]:
    """What the predictions rest on."""
    gun = space.gun
    return (
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
    )


def _braking(gun: GunParameters) -> str:
    if gun.return_friction_N is None:
        return "the damper brakes both ways alike"
    return f"the swept friction is that of the way out, on the way back it is {gun.return_friction_N:g} N"
