"""The speed-accuracy trade-off of experiment 1, as plain values for `direction.speed_accuracy` of `statistics.json`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.stats.arrays import FloatArray
from analysis.times.ez import ez_people
from analysis.times.fit import DiffusionFit, Estimate
from analysis.times.own_trials import REFUSALS, OwnTrials, own_trials
from analysis.times.people import (
    MeanEstimate,
    PeopleFit,
    PersonCells,
    SampledFit,
    instruction_effects,
    mean_estimate,
    over_people,
    person_cells,
    sampled_fit,
)
from analysis.times.trade import (
    QUANTILES,
    balanced_integration,
    conditional_accuracy,
    inverse_efficiency,
    quantile_probability,
)

Json = dict[str, Any]

BINS = 5
FEWEST_CORRECT = 5
"""Correct answers that a person needs for an EZ estimate of a cell: with 10 of 20 trials, as `ez` asks for, those near
chance who guessed luckily would be left, and the mean drift of no drift at all would be 0.2 (assumed)."""

CAVEATS = {
    "means": "Each person's own value first, then the mean over people, with Student's t for the 95 % interval, which "
    "is not cut at the ends of a scale.",
    "conditional_accuracy": "A person's bin holds few trials; only the mean over people means much.",
    "quantile_probability": "Quantiles of errors rest on the people who made at least 5 of them.",
    "inverse_efficiency_s": "Mean time of the correct answers over the correct rate. Not to be trusted above about 10 "
    "% errors, which a method near chance breaks by design; it magnifies noise and does not cancel a trade-off: read "
    "it beside rate and time, never alone (Bruyer & Brysbaert 2011).",
    "balanced_integration": "z of the correct rate less z of the mean time of the correct answers, over this table's "
    "people and cells: it has mean 0, cannot be compared between studies, and weighs speed and accuracy alike by "
    "decree (Liesefeld & Janczyk 2019).",
    "ez": "EZ-diffusion, each person and cell alone: no bias (both directions together), no lapses, the correct "
    f"answers' times. Left out are people with fewer than {FEWEST_CORRECT} correct answers, with equal times, or with "
    "a non-decision time below 0. With 20 trials a cell the boundary comes out 1 to 6 % too small, the drift up to 10 "
    "% too large and the non-decision time 10 to 50 ms too long.",
    "diffusion": "A drift for each method (backward shots with its negative), a boundary for each instruction, one "
    "start (the share of the way towards the answer forward) and one non-decision time; no lapses, no variability "
    "between trials. Each person's own fit, then the mean over people: the one to read. With 60 trials a person its "
    "non-decision time is about 10 ms too long and its drifts are some percent too large.",
    "together": "All trials in one fit, as if everybody were the same person, with intervals from the spread between "
    "people. Where people differ it is biased and its intervals are too short. In 200 simulated studies with people "
    "who differ by an SD of 20 % in drift and 10 % in boundary and non-decision time, it pulled a drift of 1.80 by "
    "−0.13, a boundary of 1.20 by +0.09 and the non-decision time by −35 ms, whose 95 % intervals then held the truth "
    "in 5 % (results/soak/decision.md).",
}
"""What each measure can and cannot tell."""

ALL_BY_HAND = (
    "No measure of the speed-accuracy trade-off is given: all times came from the experimenter's hand. Accuracy alone "
    "cannot tell a weak signal from little caution: drift and boundary stand in it as a product only."
)
NO_TIMES = "No measure of the speed-accuracy trade-off is given: no answered trial has a time of the answerer's own."


def speed_accuracy(trials: pd.DataFrame, methods: Sequence[str]) -> Json:
    """Measures of speed and accuracy by method and instruction, over times of the answerer's own hand alone.

    `n` of the `answered` trials are used, the others are `refused`, with the reason. Without any of use `methods` is
    empty and `reason` says why. What is undefined is None. `trials` is a coded table.
    """
    own = own_trials(trials, methods)
    found: Json = {
        "n": int(own.time_s.size),
        "people": int(np.unique(own.person).size),
        "answered": own.answered,
        "refused": {reason: {"trials": count, "why": REFUSALS[reason]} for reason, count in own.refused.items()},
        "reason": None,
        "instructions": list(own.instructions),
    }
    if not own.time_s.size:
        by_hand = set(own.refused) == {"experimenter"}
        return found | {"reason": ALL_BY_HAND if by_hand else NO_TIMES, "methods": {}}
    cells = person_cells(own)
    return found | {
        "quantiles": list(QUANTILES),
        "methods": _methods(own, cells),
        "instruction_effects": [
            {"a": one.a, "b": one.b, "method": one.method, "accuracy": _mean(one.accuracy), "mean_s": _mean(one.mean_s)}
            for one in instruction_effects(cells, own.methods, own.instructions)
        ],
        "diffusion": _diffusion(sampled_fit(own)),
        "caveats": CAVEATS,
    }


def _methods(own: OwnTrials, cells: PersonCells) -> Json:
    """What is told of each method and instruction that has trials."""
    efficiency, balanced = _inverse_efficiency(cells), _balanced_integration(cells)
    result: Json = {}
    for i, method in enumerate(own.methods):
        for k, instruction in enumerate(own.instructions):
            some = own.cell(method, instruction)
            if some.time_s.size:
                means = {name: _mean(over_people(name, values[:, i, k])) for name, values in _measures(cells).items()}
                result.setdefault(method, {})[instruction] = {
                    "n": int(some.time_s.size),
                    **means,
                    "inverse_efficiency_s": _mean(over_people("", efficiency[:, i, k])),
                    "balanced_integration": _mean(over_people("", balanced[:, i, k])),
                    **_curves(some),
                    "ez": _ez(some),
                }
    return result


def _measures(cells: PersonCells) -> dict[str, FloatArray]:
    return {"accuracy": cells.rate, "mean_s": cells.mean_s, "median_s": cells.median_s}


def _inverse_efficiency(cells: PersonCells) -> FloatArray:
    """The score of every person and cell, NaN without a correct answer."""
    some = np.isfinite(cells.mean_correct_s)
    found = np.full(cells.rate.shape, np.nan)
    found[some] = inverse_efficiency(cells.rate[some], cells.mean_correct_s[some])
    return found


def _balanced_integration(cells: PersonCells) -> FloatArray:
    """The score of the people who have a correct answer in every cell that anybody has; NaN for the others."""
    there = (cells.trials > 0.0).any(axis=0)
    rates, times = cells.rate[:, there], cells.mean_correct_s[:, there]
    whole = np.isfinite(times).all(axis=1)
    scores = np.full(rates.shape, np.nan)
    if whole.any():
        scores[whole] = balanced_integration(rates[whole], times[whole])
    found = np.full(cells.rate.shape, np.nan)
    found[:, there] = scores
    return found


def _curves(some: OwnTrials) -> Json:
    """Conditional accuracy function and quantile-probability points, errors before correct answers."""
    columns = some.correct, some.time_s, some.source, some.person
    curve, points = conditional_accuracy(*columns, bins=BINS), quantile_probability(*columns)
    return {
        "conditional_accuracy": {
            "mean_time_s": _list(curve.mean_time_s),
            "accuracy": _list(curve.accuracy),
            "people": curve.people,
            "left_out": curve.left_out,
        },
        "quantile_probability": {
            "probability": _list(points.probability),
            "quantiles_s": [_list(row) for row in points.quantiles_s],
            "people": points.people.tolist(),
        },
    }


def _ez(some: OwnTrials) -> Json:
    found = ez_people(some.correct, some.time_s, some.source, some.person, FEWEST_CORRECT)
    left_out: dict[str, NDArray[np.bool_]] = {
        "few_correct": found.few,
        "equal_times": found.flat,
        "non_decision_below_0": found.impossible,
    }
    return {
        **{name: _mean(over_people(name, getattr(found, name))) for name in ("drift", "boundary", "non_decision_s")},
        "corrected": int(found.corrected.sum()),
        "left_out": {why: int(flags.sum()) for why, flags in left_out.items()},
    }


def _diffusion(found: SampledFit) -> Json:
    return {
        "people": found.people,
        "fitted": found.fitted,
        "trials": found.trials,
        "reason": found.reason,
        "each": None if found.each is None else _each(found.each),
        "together": None if found.together is None else _together(found.together),
    }


def _each(found: PeopleFit) -> Json:
    """The mean of each parameter over the people who have it; fits without a clear peak are left out."""
    clear = [one for one in found.fits if one.reason is None]
    values: dict[str, list[float]] = {}
    for estimate in (estimate for one in clear for estimate in one.estimates):
        values.setdefault(estimate.name, []).append(estimate.value)
    means = {name: _mean(mean_estimate(name, own)) for name, own in values.items()}
    return {"estimates": means, "left_out": len(found.fits) - len(clear)}


def _together(found: DiffusionFit) -> Json:
    return {
        "estimates": {} if found.reason else {one.name: _estimate(one) for one in found.estimates},
        "log_likelihood": _some(found.log_likelihood),
        "unidentified": list(found.unidentified),
        "reason": found.reason,
    }


def _estimate(one: Estimate) -> Json:
    return {name: _some(getattr(one, name)) for name in ("value", "se", "ci_low", "ci_high")}


def _mean(one: MeanEstimate) -> Json:
    values: Mapping[str, float] = {"mean": one.value, "sd": one.sd, "ci_low": one.ci_low, "ci_high": one.ci_high}
    return {**{name: _some(value) for name, value in values.items()}, "people": one.people}


def _list(values: FloatArray) -> list[float | None]:
    return [_some(value) for value in values.tolist()]


def _some(value: float) -> float | None:
    """None for what is undefined: the counts beside it say why."""
    return float(value) if math.isfinite(value) else None
