"""From significant studies to shares with their Monte Carlo intervals, and from shares to the smallest design."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.paper.odds import wilson_interval
from analysis.predict.power.planned import Findings


@dataclass(frozen=True, slots=True, kw_only=True)
class Tally:
    """What is kept of a chunk of studies: in how many a claim held; sum and sum of squares of each half-width."""

    studies: int
    held: Mapping[str, int]
    sums: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """The share of studies in which a claim held, with its 95 % Wilson interval: the Monte Carlo error."""

    claim: str
    held: int
    share: float
    ci_low: float
    ci_high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Precision:
    """Half the length of a 95 % interval in the mean over studies; `mc_error` is that mean's own standard error."""

    measure: str
    half_width: float
    mc_error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """A design to choose from: what it costs, the lower end of the share that it reaches, and whether it may be run."""

    lab_hours: float
    participants: int
    ci_low: float
    allowed: bool


def tallied(findings: Findings) -> Tally:
    """The tally of studies (one leading axis)."""
    held = {claim: int(flags.sum()) for claim, flags in findings.claims.items()}
    sums = {name: (float(w.sum()), float(np.square(w).sum())) for name, w in findings.half_widths.items()}
    return Tally(studies=len(next(iter(findings.claims.values()))), held=held, sums=sums)


def merged(tallies: Sequence[Tally]) -> Tally:
    """One tally of many; the same in whatever order they come, to the last bit. `ValueError` if their claims differ."""
    first = tallies[0]
    if any(one.held.keys() != first.held.keys() or one.sums.keys() != first.sums.keys() for one in tallies):
        raise ValueError("tallies of different claims cannot be added")
    return Tally(
        studies=sum(one.studies for one in tallies),
        held={claim: sum(one.held[claim] for one in tallies) for claim in first.held},
        sums={
            name: (math.fsum(one.sums[name][0] for one in tallies), math.fsum(one.sums[name][1] for one in tallies))
            for name in first.sums
        },
    )


def shares(tally: Tally) -> tuple[Share, ...]:
    """The share of each claim."""
    rows = []
    for claim, held in tally.held.items():
        low, high = wilson_interval(held, tally.studies)
        rows.append(Share(claim=claim, held=held, share=held / tally.studies, ci_low=low, ci_high=high))
    return tuple(rows)


def precisions(tally: Tally) -> tuple[Precision, ...]:
    """The mean half-width of each interval.

    >>> precisions(Tally(studies=2, held={}, sums={"mean": (3.0, 5.0)}))
    (Precision(measure='mean', half_width=1.5, mc_error=0.5),)
    """
    rows, n = [], tally.studies
    for measure, (total, squares) in tally.sums.items():
        spread = max(squares - total * total / n, 0.0)
        error = math.sqrt(spread / (n * max(n - 1, 1)))
        rows.append(Precision(measure=measure, half_width=total / n, mc_error=error))
    return tuple(rows)


def smallest(options: Sequence[Option], target: float) -> int | None:
    """The place of the cheapest allowed option whose share is at least `target` even at its interval's lower end.

    Cheapest is fewest hours in the lab, then fewest participants; `None` if none reaches it.

    >>> few = Option(lab_hours=4, participants=8, ci_low=0.7, allowed=True)
    >>> many = Option(lab_hours=7, participants=14, ci_low=0.9, allowed=True)
    >>> smallest([many, few], 0.8), smallest([many, few], 0.95)
    (0, None)
    """
    reaching = [i for i, option in enumerate(options) if option.allowed and option.ci_low >= target]
    return min(reaching, key=lambda i: (options[i].lab_hours, options[i].participants, i), default=None)
