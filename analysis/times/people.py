"""The diffusion model person by person: each one's own fit, and the mean person of the population."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from analysis.times.cells import mean_over_people
from analysis.times.fit import BEYOND_INTERVAL, DiffusionFit, Estimate, fit
from analysis.times.likelihood import LapseRange, Trials, trials_of
from analysis.times.own_trials import OwnTrials
from device.messages import how_many


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanEstimate(Estimate):
    """A parameter's mean over people, its standard error and interval, and the SD of people's estimates.

    That SD holds the noise of each person's fit as well as the differences between people.
    """

    sd: float
    people: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PeopleFit:
    """Every person's own fit, in the order of their codes, and the means; `left_out` have no fit of their own."""

    means: tuple[MeanEstimate, ...]
    fits: tuple[DiffusionFit, ...]
    left_out: tuple[int, ...]


def fit_people(
    trials: Trials,
    *,
    bias: bool = True,
    lapses: bool | LapseRange = False,
    track: Callable[[Sequence[int]], Iterable[int]] = iter,
    together: DiffusionFit | None = None,
) -> PeopleFit:
    """Fit each person alone, then the mean over people with Student's t on people - 1 degrees of freedom.

    Two stages: right when people differ, which the fit of all trials together is not; but each person's fit has the
    bias of few trials (with 60: t0 about +10 ms, drifts some percent too large), which the mean keeps. Each climbs from
    the peak of all trials `together`, a fit of the same model, which is made if not given. A person who lacks a
    condition or instruction, or whose fit has no clear peak, is left out and named by place. `track` is given the
    places and gives them back one by one: for a progress bar.
    """
    places = track(range(int(trials.person.max()) + 1))
    near = together or fit(trials, bias=bias, lapses=lapses)
    fits = [fit(of_person(trials, place), bias=bias, lapses=lapses, near=near) for place in places]
    names = max((tuple(e.name for e in one.estimates) for one in fits), key=len)
    whole = [one.reason is None and tuple(e.name for e in one.estimates) == names for one in fits]
    kept = [one for one, good in zip(fits, whole, strict=True) if good]
    return PeopleFit(
        means=tuple(_mean(name, kept) for name in names),
        fits=tuple(fits),
        left_out=tuple(place for place, good in enumerate(whole) if not good),
    )


def _mean(name: str, fits: Sequence[DiffusionFit]) -> MeanEstimate:
    """The mean over people of a parameter; its interval is cut where the parameter's range ends.

    It has none where nobody's own data tell the parameter, as of lapses that may as well be none: equal ends are no
    precision.
    """
    found = mean_estimate(name, [one[name].value for one in fits], BEYOND_INTERVAL)
    if fits and all(name in one.unidentified for one in fits):
        return replace(found, se=math.nan, ci_low=math.nan, ci_high=math.nan)
    low, high = _range(name)
    return replace(found, ci_low=max(found.ci_low, low), ci_high=min(found.ci_high, high))


def _range(name: str) -> tuple[float, float]:
    """Between what a parameter is: a share is from 0 to 1, a boundary and a time from 0, a drift anything."""
    if name.startswith("drift"):
        return -math.inf, math.inf
    return 0.0, 1.0 if name in {"start", "lapse"} else math.inf


def of_person(trials: Trials, person: int) -> Trials:
    """The trials of one person; conditions and instructions that the person never had are dropped."""
    mine = trials.person == person
    conditions, condition = np.unique(trials.condition[mine], return_inverse=True)
    instructions, instruction = np.unique(trials.instruction[mine], return_inverse=True)
    return replace(
        trials,
        upper=trials.upper[mine],
        time_s=trials.time_s[mine],
        sign=trials.sign[mine],
        condition=condition,
        instruction=instruction,
        person=np.zeros(int(mine.sum()), dtype=np.intp),
        conditions=tuple(trials.conditions[place] for place in conditions),
        instructions=tuple(trials.instructions[place] for place in instructions),
    )


def mean_estimate(name: str, values: ArrayLike, alpha: float = 0.05) -> MeanEstimate:
    """The mean over people with Student's t on people - 1 degrees of freedom; NaN for the spread of fewer than two."""
    own = np.asarray(values, dtype=np.float64)
    value, sd, se, half = mean_over_people(own, alpha)
    return MeanEstimate(
        name=name, value=value, se=se, ci_low=value - half, ci_high=value + half, sd=sd, people=own.size
    )


MOST_PEOPLE = 40
MOST_TRIALS = 20_000
FEWEST_TRIALS = 10
"""Fewer trials than this are not fitted (assumed): there are about as many parameters."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledFit:
    """Person by person, and all trials together, of `fitted` of the `people`; no fits, but a reason, if too few."""

    people: int
    fitted: int
    trials: int
    each: PeopleFit | None
    together: DiffusionFit | None
    reason: str | None = None


def sampled_fit(own: OwnTrials) -> SampledFit:
    """Both fits: of everybody, or of people evenly spaced in the order of their codes, at most 40 and 20,000 trials.

    A person's fit takes about 10 ms and grows with their trials, so all takes half a second. "Upper" is
    the answer "forward".
    """
    codes = np.unique(own.person)
    share = MOST_TRIALS / max(own.time_s.size, 1)
    count = max(1, min(codes.size, MOST_PEOPLE, int(share * codes.size)))
    chosen = codes[np.round(np.linspace(0.0, codes.size - 1, count)).astype(np.intp)] if codes.size else codes
    some = own.of(np.isin(own.person, chosen)) if count < codes.size else own
    n = some.time_s.size
    if n < FEWEST_TRIALS:
        reason = f"{how_many(n, 'trial')} with a time of the answerer's own; the fit needs at least {FEWEST_TRIALS}"
        return SampledFit(people=codes.size, fitted=0, trials=n, each=None, together=None, reason=reason)
    trials = as_trials(some)
    together = fit(trials, by_person=count > 1)
    each = fit_people(trials, together=together)
    return SampledFit(people=codes.size, fitted=count, trials=n, each=each, together=together)


def as_trials(own: OwnTrials) -> Trials:
    """The trials as the fit takes them."""
    return trials_of(
        upper=own.forward == (own.correct == 1.0),
        time_s=own.time_s,
        sources=own.source,
        towards_upper=own.forward,
        condition=np.array(own.methods)[own.method],
        instruction=np.array(own.instructions)[own.instruction],
        person=np.array(own.people)[own.person],
    )
