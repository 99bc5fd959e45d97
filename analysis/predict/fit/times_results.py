"""What a fit of response times comes to: estimates together and person by person, EZ-diffusion, what was left out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import TypeVar

import numpy as np

from analysis.logs.files import names_below
from analysis.logs.reading import Logs
from analysis.stats.arrays import FloatArray
from analysis.times.fit import DiffusionFit, Estimate
from analysis.times.likelihood import LapseRange, Trials
from analysis.times.own_trials import REFUSALS, OwnTrials
from analysis.times.people import MeanEstimate, PeopleFit, mean_estimate
from analysis.times.trade import EZ, ez, ez_people
from experiments.record.provenance import provenance
from experiments.record.tables import DataKind


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FittedTimes:
    """The trials and their fits: of all together with `profiles` if asked for, and of each person of several."""

    own: OwnTrials
    trials: Trials
    lapse_range_s: LapseRange | None
    together: DiffusionFit
    profiles: dict[str, tuple[float, float]]
    each: PeopleFit | None


@dataclass(frozen=True, slots=True, kw_only=True)
class RefusedTrials:
    """How many answered trials have no time of the participant's own, and why."""

    trials: int
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TogetherFit(DiffusionFit):
    """The fit of all trials together; `profiles`: likelihood intervals where they were asked for."""

    profiles: dict[str, tuple[float, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class EZCell:
    """EZ-diffusion of a method under an instruction: means over people, and of everybody's trials together.

    Left out of the means are people with `few` right answers, `flat` times or an `impossible` non-decision time.
    """

    method: str
    instruction: str
    drift: MeanEstimate
    boundary: MeanEstimate
    non_decision_s: MeanEstimate
    few: int
    flat: int
    impossible: int
    corrected: int
    pooled: EZ


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimesFit:
    """The content of `fit.json`. The means over people are None, and `each` is empty, where there is one person."""

    files: tuple[str, ...]
    people: tuple[str, ...]
    methods: tuple[str, ...]
    instructions: tuple[str, ...]
    trials: int
    answered: int
    refused: dict[str, RefusedTrials]
    lapses: str
    bias: bool
    together: TogetherFit
    mean_of_people: tuple[MeanEstimate, ...] | None
    each: dict[str, DiffusionFit]
    left_out: tuple[str, ...]
    ez: tuple[EZCell, ...]
    provenance: dict[str, str]
    data_kind: DataKind

    @property
    def main_estimates(self) -> tuple[MeanEstimate | Estimate, ...]:
        """The estimates to report: means over people where there are several, else the one person's."""
        return self.mean_of_people or self.together.estimates


def times_fit(fitted: FittedTimes, logs: Logs, lapses: str, *, bias: bool) -> TimesFit:
    """The content of `fit.json`; `lapses` and `bias` as they were asked for."""
    own, each = fitted.own, fitted.each
    people = tuple(sorted({own.people[code] for code in own.person.tolist()}))
    whole = _in_order(fitted.together, own.methods)
    together = {field.name: getattr(whole, field.name) for field in fields(DiffusionFit)}
    return TimesFit(
        files=tuple(name.as_posix() for name in names_below(logs.files).values()),
        people=people,
        methods=tuple(own.methods[place] for place in np.unique(own.method)),
        instructions=tuple(fitted.trials.instructions),
        trials=own.time_s.size,
        answered=own.answered,
        refused={name: RefusedTrials(trials=count, reason=REFUSALS[name]) for name, count in own.refused.items()},
        lapses=lapses,
        bias=bias,
        together=TogetherFit(**together, profiles=fitted.profiles),
        mean_of_people=None if each is None else _drifts_in_order(each.means, own.methods),
        each={} if each is None else dict(zip(people, (_in_order(one, own.methods) for one in each.fits), strict=True)),
        left_out=() if each is None else tuple(people[place] for place in each.left_out),
        ez=tuple(_ez(own)),
        provenance=provenance(),
        data_kind=logs.kind,
    )


SomeEstimate = TypeVar("SomeEstimate", bound=Estimate)


def _in_order(found: DiffusionFit, methods: Sequence[str]) -> DiffusionFit:
    return replace(found, estimates=_drifts_in_order(found.estimates, methods))


def _drifts_in_order(estimates: Sequence[SomeEstimate], methods: Sequence[str]) -> tuple[SomeEstimate, ...]:
    """The drifts in the order of the methods, which the fit has in that of the alphabet; the others behind."""
    places = {f"drift {method}": place for place, method in enumerate(methods)}
    return tuple(sorted(estimates, key=lambda one: places.get(one.name, len(places))))


def _ez(own: OwnTrials) -> Iterator[EZCell]:
    """Each cell that has trials."""
    for instruction in own.instructions:
        for method in own.methods:
            cell = own.cell(method, instruction)
            if cell.time_s.size:
                yield _ez_cell(cell, method, instruction)


def _ez_cell(cell: OwnTrials, method: str, instruction: str) -> EZCell:
    found = ez_people(cell.correct, cell.time_s, cell.source, cell.person)
    return EZCell(
        method=method,
        instruction=instruction,
        drift=_mean("drift", found.drift),
        boundary=_mean("boundary", found.boundary),
        non_decision_s=_mean("non_decision_s", found.non_decision_s),
        few=int(found.few.sum()),
        flat=int(found.flat.sum()),
        impossible=int(found.impossible.sum()),
        corrected=int(found.corrected.sum()),
        pooled=ez(cell.correct, cell.time_s, cell.source),
    )


def _mean(name: str, values: FloatArray) -> MeanEstimate:
    """Over the people who have one."""
    return mean_estimate(name, values[np.isfinite(values)])
