"""Predicted rates of designs, which of them are worth it, and from which voltage a direction is felt at all.

That voltage, at each friction, is the lowest of the sweep above which a direction is felt well enough; -inf if it is at
the lowest voltage of the sweep already, inf if it never is, NaN if no voltage brings the magnet home.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from statistics import NormalDist

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from analysis.predict.design_search.space import Layer, Space, one_more, shot_of
from analysis.predict.fit.percept_model import FITTED, PAPER_RATES, PerceptFit, best_percept
from analysis.stats.arrays import FloatArray
from device.limits import TRAIN_LIMITS, broken_limit
from device.methods import Method
from device.parameters import GunParameters
from device.physics.equations import HOME
from device.physics.shot import rates_of_periods_Hz
from experiments.design.streams import generator
from experiments.synthetic.decision import forward_rates
from experiments.synthetic.diffusion import People
from experiments.synthetic.percept import Percept, PerceptParameters, evidence


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


REACH = NormalDist().inv_cdf(0.975)
_STEP = 1e-4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Predicted:
    """Shares of right answers to a forward shot with their 95 % limits, and the evidence; NaN where nothing is felt."""

    evidence: FloatArray
    rate: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray


def evidences(felt: FloatArray, exponent: float, sensitivity: ArrayLike, confusion: ArrayLike) -> FloatArray:
    """`experiments.synthetic.percept.evidence` for arrays (..., 3) of first, reaction, second."""
    first, reaction, second = np.moveaxis(np.power(felt, exponent), -1, 0)
    strongest = np.maximum(first, reaction)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = strongest / (strongest + np.asarray(confusion) * second)
    return np.asarray(np.asarray(sensitivity) * (first - reaction) * np.where(strongest == 0.0, 0.0, share))


def logits(evidence: FloatArray, start: ArrayLike) -> FloatArray:
    """The log odds of "forward" from the evidence A and the start w.

    logit P = 2 A w + log((1 - exp(-2 A w)) / (1 - exp(-2 A (1 - w)))) for A > 0, its mirror for A < 0; it neither
    overflows nor loses what is close to 1.
    """
    w = np.asarray(start, dtype=np.float64)
    size = np.abs(evidence)
    near = np.where(np.asarray(evidence) < 0.0, 1.0 - w, w)
    with np.errstate(divide="ignore", invalid="ignore"):
        up = 2.0 * size * near + np.log(-np.expm1(-2.0 * size * near)) - np.log(-np.expm1(-2.0 * size * (1.0 - near)))
    found = np.where(np.asarray(evidence) < 0.0, -up, up)
    return np.where(size < 1e-12, scipy.special.logit(w), found)


def rates(felt: FloatArray, parameters: PerceptParameters) -> FloatArray:
    """The predicted share of right answers to a forward shot."""
    return np.asarray(scipy.special.expit(_logit_of(felt, parameters)))


def predict(felt: FloatArray, fit: PerceptFit) -> Predicted:
    """The rates with the fit's uncertainty: the delta method on the logit, as `predicted_rate`."""
    best = fit.parameters
    centre = _logit_of(felt, best)
    slopes = np.stack([_slope(felt, best, name) for name in FITTED], axis=-1)
    variance = np.einsum("...i,ij,...j->...", slopes, np.array(fit.covariance), slopes)
    half = REACH * np.sqrt(variance)
    low, rate, high = (np.asarray(scipy.special.expit(x)) for x in (centre - half, centre, centre + half))
    evidence = evidences(felt, best.exponent, best.sensitivity, best.confusion)
    return Predicted(evidence=evidence, rate=rate, ci_low=low, ci_high=high)


def _logit_of(felt: FloatArray, parameters: PerceptParameters, name: str = "", factor: float = 1.0) -> FloatArray:
    values = {one: getattr(parameters, one) * (factor if one == name else 1.0) for one in FITTED}
    found = evidences(felt, parameters.exponent, values["sensitivity"], values["confusion"])
    return logits(found, values["start"])


def _slope(felt: FloatArray, parameters: PerceptParameters, name: str) -> FloatArray:
    """The derivative of the logit by the logarithm of a fitted number."""
    up, down = (_logit_of(felt, parameters, name, math.exp(step)) for step in (_STEP, -_STEP))
    return (up - down) / (2.0 * _STEP)


THRESHOLD_SHARE = 0.75
"""Halfway between guessing and certainty: the usual threshold of a choice between two."""
DRAWS = 2000
INSIDE = 0.95
REACHED, ABOVE, BELOW = "at this voltage", "not within the range", "from the lowest voltage on"
NEVER = "no voltage brings the magnet home"
_CLOSE_V = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Band:
    """The contours that the fit allows: `inside` of so many draws lie wholly within; and each friction alone."""

    inside: float
    draws: int
    low_V: FloatArray
    high_V: FloatArray
    reached_low: tuple[str, ...]
    reached_high: tuple[str, ...]
    each_friction_low_V: FloatArray
    each_friction_high_V: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contour:
    """The contour, voltages over the frictions; `lasting`: every higher voltage of the sweep is felt as well."""

    voltage_V: FloatArray
    interpolated_V: FloatArray  # from the grid alone, as the band and the alternatives have it
    lasting: tuple[bool, ...]
    band: Band


def reached(voltages_V: FloatArray) -> tuple[str, ...]:
    """What stands behind each voltage of a contour."""
    return tuple(map(_reached, voltages_V.tolist()))


def _reached(voltage_V: float) -> str:
    if math.isnan(voltage_V):
        return NEVER
    if math.isinf(voltage_V):
        return ABOVE if voltage_V > 0 else BELOW
    return REACHED


def contour_of(space: Space, layer: Layer, fit: PerceptFit, seed: int) -> Contour:
    """The contour of a layer, solved with shots of its own, and its band by draws on the grid and these shots."""
    felt = layer.felt[fit.parameters.leak_s]
    volts, gun = np.array(space.voltage_V), replace(space.gun, pulse_s=layer.pulse_s)
    rough = crossings(rates(felt, fit.parameters), volts)
    exact = np.array(
        [
            _solved(replace(gun, friction_N=f), volts, float(v), fit.parameters)
            for f, v in zip(space.friction_N, rough, strict=True)
        ]
    )
    return Contour(
        voltage_V=exact,
        interpolated_V=rough,
        lasting=tuple(_lasts(row) for row in rates(felt, fit.parameters)),
        band=band_of(drawn_contours(*one_more(space, layer, fit.parameters.leak_s, exact), fit, seed)),
    )


def crossings(found: FloatArray, volts: FloatArray) -> FloatArray:
    """Where each row (frictions, voltages) of rates first reaches the level, linear between two voltages."""
    return np.array(list(map(_crossing, found, np.broadcast_to(volts, found.shape))))


def _crossing(row: FloatArray, volts: FloatArray) -> float:
    some = np.flatnonzero(np.isfinite(row))
    enough = np.flatnonzero(np.isfinite(row) & (row >= THRESHOLD_SHARE))
    if not some.size:
        return math.nan
    if not enough.size:
        return math.inf
    at = int(enough[0])
    if at == 0:
        return -math.inf
    if at == some[0]:  # what is weaker is not felt, so it lies at this voltage or below
        return float(volts[at])
    before = some[some < at][-1]
    share = (THRESHOLD_SHARE - row[before]) / (row[at] - row[before])
    return float(volts[before] + share * (volts[at] - volts[before]))


def _lasts(row: FloatArray) -> bool:
    enough = np.flatnonzero(row >= THRESHOLD_SHARE)
    return bool(enough.size) and bool(np.all(row[enough[0] :][np.isfinite(row[enough[0] :])] >= THRESHOLD_SHARE))


def rate_at(gun: GunParameters, parameters: PerceptParameters) -> float:
    """The predicted rate of one gun, simulated alone; NaN if its magnet does not come home."""
    shot = shot_of(gun, (parameters.leak_s,))
    numbers = [(one.first, one.reaction, one.second) for one in shot.felt]
    return float(rates(np.array(numbers), parameters)[0]) if numbers else math.nan


def _solved(gun: GunParameters, volts: FloatArray, rough_V: float, parameters: PerceptParameters) -> float:
    """The crossing to a millivolt by shots of its own, within the two voltages of the grid around it.

    Where the lower one is not felt at all it is the first that is, if that is enough.
    """
    if not math.isfinite(rough_V):
        return rough_V
    place = int(np.searchsorted(volts, rough_V))
    low, high = float(volts[max(place - 1, 0)]), float(volts[place])

    def above(voltage_V: float) -> float:
        return rate_at(replace(gun, voltage_V=voltage_V), parameters) - THRESHOLD_SHARE

    at_low, at_high = above(low), above(high)
    if math.isnan(at_low) and at_high >= 0.0:
        low = _first_felt(above, low, high)
        at_low = above(low)
    if at_low >= 0.0:
        return low
    if not at_low * at_high < 0.0:
        return rough_V
    return float(scipy.optimize.brentq(above, low, high, xtol=_CLOSE_V))


def _first_felt(above: Callable[[float], float], low: float, high: float) -> float:
    """The lowest voltage at which there is a percept, to a millivolt; at `high` there is one."""
    while high - low > _CLOSE_V:
        middle = (low + high) / 2
        low, high = (middle, high) if math.isnan(above(middle)) else (low, middle)
    return high


def drawn_contours(felt: FloatArray, volts: FloatArray, fit: PerceptFit, seed: int, draws: int = DRAWS) -> FloatArray:
    """Contours (draws, frictions) of numbers drawn from the fit: normal, on logarithms and for the start on its logit.

    Only the fitted numbers vary: the assumed ones and the model are held.
    """
    best = fit.parameters
    centre = [getattr(best, name) for name in FITTED]
    normal = generator(seed, "design", "contours").standard_normal((draws, len(FITTED)))
    moved = normal @ _root(np.array(fit.covariance)).T
    sensitivity, confusion = centre[0] * np.exp(moved[:, 0]), centre[1] * np.exp(moved[:, 1])
    start = scipy.special.expit(scipy.special.logit(centre[2]) + moved[:, 2] / (1.0 - centre[2]))
    found = np.empty((draws, len(felt)))
    for n in range(draws):
        evidence = evidences(felt, best.exponent, sensitivity[n], confusion[n])
        found[n] = crossings(np.asarray(scipy.special.expit(logits(evidence, start[n]))), volts)
    return found


def _root(covariance: FloatArray) -> FloatArray:
    """A square root of a covariance, which may be singular or 0; NaN if the fit has none."""
    if not np.isfinite(covariance).all():
        return np.full_like(covariance, math.nan)
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def band_of(contours: FloatArray) -> Band:
    """The global rank envelope of drawn contours (draws, frictions), and quantiles of each friction alone.

    A contour's depth is its most extreme rank over the frictions; the envelope is between the k-th lowest and k-th
    highest voltage of each friction, k the largest for which at least the share `INSIDE` is as deep (Myllymaki et al.
    2017, J R Stat Soc B 79, 381).
    """
    known = np.isfinite(contours).any(axis=0) | np.isinf(contours).all(axis=0)
    low, high, alone_low, alone_high = (np.full(contours.shape[1], math.nan) for _ in range(4))
    if known.any():
        ordered = np.sort(contours[:, known], axis=0)
        k = _depth(contours[:, known])
        tail = round((1.0 - INSIDE) / 2.0 * len(contours))
        low[known], high[known] = ordered[k - 1], ordered[-k]
        alone_low[known], alone_high[known] = ordered[tail], ordered[-1 - tail]
    return Band(
        inside=INSIDE,
        draws=len(contours),
        low_V=low,
        high_V=high,
        reached_low=reached(low),
        reached_high=reached(high),
        each_friction_low_V=alone_low,
        each_friction_high_V=alone_high,
    )


def _depth(contours: FloatArray) -> int:
    """The largest depth that the share `INSIDE` of the contours has; equals count as the deepest of them."""
    ordered = np.sort(contours, axis=0)
    depths = np.full(len(contours), len(contours))
    for column, row in zip(ordered.T, contours.T, strict=True):
        below, not_above = np.searchsorted(column, row, side="right"), np.searchsorted(column, row, side="left")
        depths = np.minimum(depths, np.minimum(below, len(row) - not_above))
    return int(np.sort(depths)[math.floor((1.0 - INSIDE) * len(depths))])


DEFAULT = PerceptParameters()
EXPONENTS = (1.1, 2.3)
"""Stevens 1975, p. 15: static force on the palm's skin; and as far from 1.7 on the other side, assumed."""
LEAKS_S = (0.01, 0.04)
"""Half of the assumed leak and twice of it, assumed."""
LEAKS = (DEFAULT.leak_s, *LEAKS_S)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Alternative:
    """The contour under another assumption. `deviance` above 0: the refit does not meet the paper's rates."""

    name: str
    parameters: PerceptParameters
    deviance: float
    voltage_V: FloatArray
    reached: tuple[str, ...]


def base_parameters() -> list[tuple[str, PerceptParameters]]:
    """The other values of each assumed number, one changed at a time, by name."""
    exponents = [(f"exponent {value:g}", replace(DEFAULT, exponent=value)) for value in EXPONENTS]
    leaks = [(f"leak {1e3 * value:g} ms", replace(DEFAULT, leak_s=value)) for value in LEAKS_S]
    return exponents + leaks


def alternatives(methods: dict[str, Method], layer: Layer, voltage_V: tuple[float, ...]) -> Iterator[Alternative]:
    """The contour under each other assumption."""
    volts = np.array(voltage_V)
    for name, base in base_parameters():
        other = best_percept(PAPER_RATES, methods, base=base)
        found = crossings(rates(layer.felt[base.leak_s], other.parameters), volts)
        yield Alternative(
            name=name,
            parameters=other.parameters,
            deviance=other.deviance,
            voltage_V=found,
            reached=reached(found),
        )


def unbiased(layer: Layer, voltage_V: tuple[float, ...], fit: PerceptFit) -> FloatArray:
    """The contour of the mean over both directions, so that no bias helps."""
    best = fit.parameters
    return crossings(both_ways(layer.felt[best.leak_s], best), np.array(voltage_V))


def under(gun: GunParameters, others: Sequence[Alternative]) -> dict[str, float]:
    """The predicted share for one gun under each other assumption, by name; NaN if its magnet does not come home."""
    leaks_s = tuple(dict.fromkeys(other.parameters.leak_s for other in others))
    felt = dict(zip(leaks_s, shot_of(gun, leaks_s).felt, strict=False))
    return {other.name: _rate(felt.get(other.parameters.leak_s), other.parameters) for other in others}


def _rate(percept: Percept | None, parameters: PerceptParameters) -> float:
    if percept is None:
        return math.nan
    return float(forward_rates(evidence(percept, parameters), parameters.start, People()))


def both_ways(felt: FloatArray, parameters: PerceptParameters) -> FloatArray:
    """The mean share of right answers to a forward and to a backward shot."""
    evidence = evidences(felt, parameters.exponent, parameters.sensitivity, parameters.confusion)
    forward = scipy.special.expit(logits(evidence, parameters.start))
    backward = scipy.special.expit(logits(evidence, 1.0 - parameters.start))
    return np.asarray((forward + backward) / 2.0)
