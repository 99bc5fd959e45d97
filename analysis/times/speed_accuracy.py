"""The speed-accuracy trade-off of experiment 1, and of questions with a right answer, as in `statistics.json`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from analysis.stats.arrays import FloatArray, IndexArray
from analysis.times.cells import (
    InstructionEffect,
    Mean,
    PersonCells,
    defined,
    instruction_effects,
    over_people,
    person_cells,
    rate_over_people,
)
from analysis.times.own_trials import REFUSALS, OwnTrials, own_trials
from analysis.times.trade import (
    QUANTILES,
    ConditionalAccuracy,
    QuantileProbability,
    balanced_integration,
    conditional_accuracy,
    ez_people,
    inverse_efficiency,
    quantile_probability,
)

if TYPE_CHECKING:
    from analysis.times.fit import DiffusionFit
    from analysis.times.people import PeopleFit

BINS = 5
FEWEST_CORRECT = 5
"""Correct answers that a person needs for an EZ estimate of a cell: with 10 of 20 trials, as `ez` asks for, those near
chance who guessed luckily would be left, and the mean drift of no drift at all would be 0.2 (assumed)."""

CAVEATS = {
    "means": "Each person's own value first, then the mean over people, with Student's t for the 95 % interval, that "
    "of a rate cut at 0 and 1.",
    "conditional_accuracy": "A person's bin holds few trials; only the mean over people means much.",
    "quantile_probability": "Quantiles of errors rest on the people who made at least 5 of them.",
    "inverse_efficiency_s": "Mean time of the correct answers over the correct rate. Not to be trusted above about 10 "
    "% errors, which a method near chance breaks by design; it magnifies noise and does not cancel a trade-off: read "
    "it beside rate and time, never alone (Bruyer & Brysbaert 2011).",
    "balanced_integration": "z of the correct rate less z of the mean time of the correct answers, over this table's "
    "people and cells: it has mean 0, cannot be compared between studies, and weighs speed and accuracy alike by "
    "decree (Liesefeld & Janczyk 2019).",
    "ez": "EZ-diffusion, each person and cell alone: no bias (both answers together), no lapses, the correct "
    f"answers' times. Left out are people with fewer than {FEWEST_CORRECT} correct answers, with equal times, or with "
    "a non-decision time below 0. With 20 trials a cell the boundary comes out 1 to 6 % too small, the drift up to 10 "
    "% too large and the non-decision time 10 to 50 ms too long.",
    "diffusion": "A drift for each method or condition (its negative where the second answer is right, as of backward "
    "shots), a boundary for each instruction, one start (the share of the way towards the first answer, as forward) "
    "and one non-decision time; no lapses, no variability between trials. Each person's own fit, then the mean over "
    "people: the one to read. With 60 trials a person its non-decision time is about 10 ms too long and its drifts are "
    "some percent too large.",
    "together": "All trials in one fit, as if everybody were the same person, with intervals from the spread between "
    "people. Where people differ it is biased and its intervals are too short. In 200 simulated studies with people "
    "who differ by an SD of 20 % in drift and 10 % in boundary and non-decision time, it pulled a drift of 1.80 by "
    "−0.13, a boundary of 1.20 by +0.09 and the non-decision time by −35 ms, whose 95 % intervals then held the truth "
    "in 5 %.",
}
"""What each measure can and cannot tell."""

ALL_BY_HAND = (
    "No measure of the speed-accuracy trade-off is given: all times came from the experimenter's hand. Accuracy alone "
    "cannot tell a weak signal from little caution: drift and boundary stand in it as a product only."
)
NO_TIMES = "No measure of the speed-accuracy trade-off is given: no answered trial has a time of the answerer's own."


@dataclass(frozen=True, slots=True, kw_only=True)
class RefusedAnswers:
    """How many answered trials are refused, and why."""

    trials: int
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class EZLeftOut:
    """How many people have no EZ estimate, by the reason."""

    few_correct: int
    equal_times: int
    non_decision_below_0: int


@dataclass(frozen=True, slots=True, kw_only=True)
class EZMeans:
    """EZ-diffusion over people; `corrected` of them had no error or nothing but errors."""

    drift: Mean
    boundary: Mean
    non_decision_s: Mean
    corrected: int
    left_out: EZLeftOut


@dataclass(frozen=True, slots=True, kw_only=True)
class CellTrade:
    """The measures of a method, or of another condition, under an instruction."""

    n: int
    accuracy: Mean
    mean_s: Mean
    median_s: Mean
    inverse_efficiency_s: Mean
    balanced_integration: Mean
    conditional_accuracy: ConditionalAccuracy
    quantile_probability: QuantileProbability
    ez: EZMeans


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A parameter of the fit of all trials; `None` for what the data do not tell."""

    value: float | None
    se: float | None
    ci_low: float | None
    ci_high: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class EachFit:
    """Each parameter's mean over the people who have it; fits without a clear peak are left out."""

    estimates: Mapping[str, Mean]
    left_out: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PooledFit:
    """The fit of all trials as if they were of one person."""

    estimates: Mapping[str, Parameter]
    log_likelihood: float | None
    unidentified: tuple[str, ...]
    reason: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class DiffusionFits:
    """The diffusion fitted to `fitted` of the people: person by person, and together; without fits, the reason."""

    people: int
    fitted: int
    trials: int
    reason: str | None
    each: EachFit | None
    together: PooledFit | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _UsedTrials:
    """`n` of the `answered` trials are used, the others refused; `reason` says why none is."""

    n: int
    people: int
    answered: int
    refused: Mapping[str, RefusedAnswers]
    reason: str | None
    instructions: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class NoSpeedAccuracy(_UsedTrials):
    """A log without a trial of use; so `methods` is empty."""

    methods: Mapping[str, Mapping[str, CellTrade]]


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedAccuracy(_UsedTrials):
    """The measures by method and instruction, as far as there are such trials, over times of the answerer's own.

    Of a design's question conditions stand for methods, named by their factors: `method vibration, grip loose`.
    """

    quantiles: tuple[float, ...]
    methods: Mapping[str, Mapping[str, CellTrade]]
    instruction_effects: tuple[InstructionEffect, ...]
    diffusion: DiffusionFits
    caveats: Mapping[str, str]


def speed_accuracy(
    trials: pd.DataFrame, methods: Sequence[str], *, groups: Sequence[Sequence[str]] = (), fits: bool = False
) -> SpeedAccuracy | NoSpeedAccuracy:
    """Measures of speed and accuracy over times of the answerer's own hand alone, if there are some.

    `trials` is a coded table; `groups`: of the methods, those that the same people meet, all unless given; `fits`:
    with the diffusion model fitted.
    """
    own = own_trials(trials, methods)
    n, people = int(own.time_s.size), int(np.unique(own.person).size)
    refused = {reason: RefusedAnswers(trials=count, why=REFUSALS[reason]) for reason, count in own.refused.items()}
    if not n:
        return NoSpeedAccuracy(
            n=n,
            people=people,
            answered=own.answered,
            refused=refused,
            reason=ALL_BY_HAND if set(refused) == {"experimenter"} else NO_TIMES,
            instructions=own.instructions,
            methods={},
        )
    cells = person_cells(own)
    places = [np.array([methods.index(one) for one in group]) for group in groups or [methods]]
    return SpeedAccuracy(
        n=n,
        people=people,
        answered=own.answered,
        refused=refused,
        reason=None,
        instructions=own.instructions,
        quantiles=QUANTILES,
        methods=_methods(own, cells, places),
        instruction_effects=tuple(instruction_effects(cells, own.methods, own.instructions, places)),
        diffusion=_diffusion(own) if fits else _not_fitted(n, people),
        caveats=CAVEATS,
    )


def _methods(own: OwnTrials, cells: PersonCells, groups: Sequence[IndexArray]) -> dict[str, dict[str, CellTrade]]:
    """The measures of each method and instruction that has trials."""
    efficiency, balanced = _inverse_efficiency(cells), _balanced_integration(cells, groups)
    found: dict[str, dict[str, CellTrade]] = {}
    for i, method in enumerate(own.methods):
        for k, instruction in enumerate(own.instructions):
            some = own.cell(method, instruction)
            columns = some.correct, some.time_s, some.source, some.person
            if some.time_s.size:
                found.setdefault(method, {})[instruction] = CellTrade(
                    n=int(some.time_s.size),
                    accuracy=rate_over_people(cells.rate[:, i, k]),
                    mean_s=over_people(cells.mean_s[:, i, k]),
                    median_s=over_people(cells.median_s[:, i, k]),
                    inverse_efficiency_s=over_people(efficiency[:, i, k]),
                    balanced_integration=over_people(balanced[:, i, k]),
                    conditional_accuracy=conditional_accuracy(*columns, bins=BINS),
                    quantile_probability=quantile_probability(*columns),
                    ez=_ez(some),
                )
    return found


def _inverse_efficiency(cells: PersonCells) -> FloatArray:
    """The score of every person and cell, NaN without a correct answer."""
    some = np.isfinite(cells.mean_correct_s)
    found = np.full(cells.rate.shape, np.nan)
    found[some] = inverse_efficiency(cells.rate[some], cells.mean_correct_s[some])
    return found


def _balanced_integration(cells: PersonCells, groups: Sequence[IndexArray]) -> FloatArray:
    """The score of the people who have a correct answer in every cell that anybody of their group has; else NaN."""
    whole = np.zeros(cells.rate.shape, dtype=np.bool_)
    for group in groups:
        there = (cells.trials[:, group] > 0.0).any(axis=0)
        scored = np.isfinite(cells.mean_correct_s[:, group]) & there
        people = np.flatnonzero((scored == there).all(axis=(1, 2)))
        whole[np.ix_(people, group)] = there
    found = np.full(cells.rate.shape, np.nan)
    if whole.any():
        found[whole] = balanced_integration(cells.rate[whole], cells.mean_correct_s[whole])
    return found


def _ez(some: OwnTrials) -> EZMeans:
    found = ez_people(some.correct, some.time_s, some.source, some.person, FEWEST_CORRECT)
    return EZMeans(
        drift=over_people(found.drift),
        boundary=over_people(found.boundary),
        non_decision_s=over_people(found.non_decision_s),
        corrected=int(found.corrected.sum()),
        left_out=EZLeftOut(
            few_correct=int(found.few.sum()),
            equal_times=int(found.flat.sum()),
            non_decision_below_0=int(found.impossible.sum()),
        ),
    )


NOT_ASKED = "it was not asked for (`recoil analyze --fits`)"


def _not_fitted(trials: int, people: int) -> DiffusionFits:
    return DiffusionFits(people=people, fitted=0, trials=trials, reason=NOT_ASKED, each=None, together=None)


def _diffusion(own: OwnTrials) -> DiffusionFits:
    from analysis.times.people import sampled_fit  # noqa: PLC0415 - of no use unless fits are asked for

    found = sampled_fit(own)
    return DiffusionFits(
        people=found.people,
        fitted=found.fitted,
        trials=found.trials,
        reason=found.reason,
        each=None if found.each is None else _each(found.each),
        together=None if found.together is None else _together(found.together),
    )


def _each(found: PeopleFit) -> EachFit:
    clear = [one for one in found.fits if one.reason is None]
    values: dict[str, list[float]] = {}
    for estimate in (estimate for one in clear for estimate in one.estimates):
        values.setdefault(estimate.name, []).append(estimate.value)
    means = {name: over_people(np.array(own)) for name, own in values.items()}
    return EachFit(estimates=means, left_out=len(found.fits) - len(clear))


def _together(found: DiffusionFit) -> PooledFit:
    known = () if found.reason else found.estimates
    return PooledFit(
        estimates={
            one.name: Parameter(**{key: defined(getattr(one, key)) for key in Parameter.__slots__}) for one in known
        },
        log_likelihood=defined(found.log_likelihood),
        unidentified=found.unidentified,
        reason=found.reason,
    )
