"""What a fit of the percept comes to: fitted numbers, predictions, other assumptions, and the judgement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from analysis.predict.fit.percept_model import Fitted, PerceptFit, PerceptPeak, predicted_rate
from analysis.predict.fit.studies import Judgement, PerceptTask
from device.parameters import GunParameters
from experiments.record.provenance import provenance
from experiments.synthetic.decision import forward_rates
from experiments.synthetic.diffusion import People
from experiments.synthetic.percept import Percept, PerceptParameters, evidence, percept_of, percepts_of

FRICTIONS = 41
"""Points of a curve over the friction."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodRates:
    """Of a method the forward rate that was observed, that of the fit, and what the fit predicts with its intervals."""

    observed: float
    predicted: float
    forward: Fitted
    backward: Fitted


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodPercept(Percept):
    """What a method gives to feel, with the log odds of a right answer by somebody without bias."""

    log_odds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AssumedNumbers:
    """What is assumed of the percept, not fitted."""

    exponent: float
    leak_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class OtherFit(PerceptParameters):
    """The fit of the same rates under another assumption."""

    deviance: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RateBand:
    """A predicted rate along an axis, with its 95 % limits; NaN where there are none."""

    value: tuple[float, ...]
    ci_low: tuple[float, ...]
    ci_high: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionCurve:
    """The predicted forward rate over the damper's friction; `methods`: the friction of each method of this gun."""

    methods: dict[str, float]
    friction_N: tuple[float, ...]
    fit: RateBand
    other_assumptions: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedPercept:
    """The content of `fit.json`. `source` says where the rates come from; `judged` is None without published numbers.

    `people`: their assumed spread. `untold`: how far each number is left open, 0 to 1; `unknown` says it in words.
    """

    source: str
    trials: int
    rates: dict[str, MethodRates]
    people: People
    fitted: dict[str, Fitted]
    assumed: AssumedNumbers
    deviance: float
    freedom: int
    rank: int
    untold: dict[str, float]
    unknown: tuple[str, ...]
    percepts: dict[str, MethodPercept]
    other_assumptions: tuple[OtherFit, ...]
    friction: tuple[FrictionCurve, ...]
    provenance: dict[str, str]
    judged: Judgement | None
    assumptions: tuple[str, ...]


def fitted_percept(
    task: PerceptTask, fit: PerceptFit, others: Sequence[PerceptPeak], assumptions: Sequence[str]
) -> FittedPercept:
    """What the fit says of the task, not yet judged; `others` are the fits under other assumptions."""
    p = fit.parameters
    percepts = percepts_of(task.methods, p.leak_s)
    return FittedPercept(
        source=task.source,
        trials=task.trials,
        rates={name: _rates(task, fit, name, percepts[name]) for name in task.rates},
        people=task.people,
        fitted=fit.fitted,
        assumed=AssumedNumbers(exponent=p.exponent, leak_s=p.leak_s),
        deviance=fit.deviance,
        freedom=fit.freedom,
        rank=fit.rank,
        untold=fit.untold,
        unknown=fit.unknown,
        percepts={name: MethodPercept(**asdict(one), log_odds=evidence(one, p)) for name, one in percepts.items()},
        other_assumptions=tuple(OtherFit(**asdict(one.parameters), deviance=one.deviance) for one in others),
        friction=_friction(task, fit, others),
        provenance=provenance(),
        judged=None,
        assumptions=tuple(assumptions),
    )


def _rates(task: PerceptTask, fit: PerceptFit, method: str, percept: Percept) -> MethodRates:
    return MethodRates(
        observed=task.rates[method],
        predicted=fit.predicted[method],
        forward=predicted_rate(fit, percept, direction="forward", people=task.people),
        backward=predicted_rate(fit, percept, direction="backward", people=task.people),
    )


def _friction(task: PerceptTask, fit: PerceptFit, others: Sequence[PerceptPeak]) -> tuple[FrictionCurve, ...]:
    """A curve for each gun that differs in more than its friction."""
    guns: dict[GunParameters, dict[str, float]] = {}
    for name, method in task.methods.items():
        if isinstance(method, GunParameters):
            guns.setdefault(replace(method, friction_N=0.0), {})[name] = method.friction_N
    return tuple(_curve(task, gun, methods, fit, others) for gun, methods in guns.items())


def _curve(
    task: PerceptTask, gun: GunParameters, methods: dict[str, float], fit: PerceptFit, others: Sequence[PerceptPeak]
) -> FrictionCurve:
    """Up to the friction that holds the magnet against the spring's pre-load."""
    frictions = np.linspace(0.0, gun.stiffness_N_m * gun.preload_length_m, FRICTIONS).tolist()
    percepts = _percepts_along(gun, frictions, fit.parameters.leak_s)
    found = [predicted_rate(fit, one, people=task.people) for one in percepts]
    return FrictionCurve(
        methods=methods,
        friction_N=tuple(frictions),
        fit=RateBand(
            value=tuple(one.value for one in found),
            ci_low=tuple(one.ci_low for one in found),
            ci_high=tuple(one.ci_high for one in found),
        ),
        other_assumptions=tuple(_rates_along(task, gun, frictions, one.parameters) for one in others),
    )


def _percepts_along(gun: GunParameters, frictions: Sequence[float], leak_s: float) -> list[Percept]:
    return [percept_of(replace(gun, friction_N=friction), leak_s) for friction in frictions]


def _rates_along(
    task: PerceptTask, gun: GunParameters, frictions: Sequence[float], parameters: PerceptParameters
) -> tuple[float, ...]:
    log_odds = [evidence(one, parameters) for one in _percepts_along(gun, frictions, parameters.leak_s)]
    return tuple(forward_rates(log_odds, parameters.start, task.people).tolist())
